"""Whether a model has changed since its baseline was made; never whether the two models differ.

`baseline` is the file and `checkpoints` what of a run goes into it, `renewal` makes it, `regression` holds
one run against its record and `examination` all of them.
"""
