"""Regression gate: detects changes of a model since its baseline; does not compare the two models.

`baseline` is the file, `checkpoints` selects its contents, `update` creates it, `deviation` compares one run
with its record and `check` all of them.
"""
