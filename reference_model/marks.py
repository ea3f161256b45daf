"""What the kernels know of a contact law when they are compiled: the marks of the constants' type.

As for formulations (`reference_model.formulations`) numba compiles once for each that is used: other laws
do not pay for what one of them asks.
"""

from typing import Any

from reference_model.compiled import overload
from reference_model.constants import MEMORYLESS, SIDES, Constants, law_marks_of


def touches_with_sides(c: Constants) -> bool:
    """Return whether the slider's contacts are those of whole sides: the law foundation."""
    raise NotImplementedError


def without_memory(c: Constants) -> bool:
    """Return whether the damping refers to the present depth rate, not to the impact speed of the touch."""
    raise NotImplementedError


@overload(touches_with_sides, by_law=True)
def _touches_with_sides(c) -> Any:  # type: ignore[no-untyped-def]
    marked = SIDES in law_marks_of(c.fields)
    return lambda c: marked


@overload(without_memory, by_law=True)
def _without_memory(c) -> Any:  # type: ignore[no-untyped-def]
    marked = MEMORYLESS in law_marks_of(c.fields)
    return lambda c: marked
