"""How often Python looks for cyclic garbage in a process that is this program's own."""

import gc

_OBJECTS = 100_000
"""More that are made than freed, after which Python looks through them; its own number is 700."""


def collect_rarely() -> None:
    """Look for cyclic garbage only after many new objects.

    Importing and compiling make objects that live on, and Python looked through them again and again: a sixth
    of the processor time of 100 cycles, and some tenth of a compilation.
    """
    gc.set_threshold(_OBJECTS)
