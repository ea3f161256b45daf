"""How reliably the slider follows the ideal mechanism: the paper's reliability, and what qualifies it.

From a result and the ideal mechanism's (`ideal`) to errors by crank angle (`errors`, `bins`), to the paper's
stress-strength reliability (`interference`) and what a finite run leaves open (`sampling`): that is one
model's `assessment`. Two models' `difference` has an interval, and `words` say what a scene's numbers mean.
"""
