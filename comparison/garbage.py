"""How often Python looks for cyclic garbage in a process that is this program's own."""

import gc

_OBJECTS = 100_000
"""That have to be made, and be alive, before Python looks through them: some 50 MB."""


def collect_rarely() -> None:
    """Look for cyclic garbage after many objects, not after 700.

    Importing and compiling make objects that live on. Python looked through all of them again and again: a
    sixth of a short run, and an eighth of a compilation.
    """
    gc.set_threshold(_OBJECTS)
