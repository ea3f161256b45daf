"""How reliably the slider follows the ideal mechanism: the paper's reliability, and what to hold beside it.

From a result and the ideal mechanism's (`errors`) to errors by crank angle (`bins`), to the paper's
stress-strength reliability (`interference`), to uncertainty of either (`sampling`), for one model
(`assessment`).
"""
