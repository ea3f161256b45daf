"""One interface to the equations of motion of all formulations.

Which of them stands for a function of this module follows, when a kernel is compiled, from the type of the
model: numba compiles the integrator once for each that is used, so a scene pays only for the coordinates that
it leaves free. The functions themselves are stubs, for names, arguments and types.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba.extending

from reference_model import chain, minimal, multiplier
from reference_model.chain import Chain
from reference_model.compiled import ONLY_FROM_KERNELS
from reference_model.linkage import Array
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage
from reference_model.parameters import Law

F = TypeVar("F", bound=Callable[..., object])
Model = Minimal | Chain | Linkage
_MODULES: dict[type, Any] = {Minimal: minimal, Chain: chain, Linkage: multiplier}


def _overload(stub: Callable[..., Any]) -> Callable[[F], F]:
    # Into the code of their callers, to which all constants are at hand.
    options = {**ONLY_FROM_KERNELS, "forceinline": True}
    return cast(Callable[[F], F], numba.extending.overload(stub, jit_options=options, strict=False))


def tabulate(model: Model, t: float, h: float, shares: Array) -> None:
    """Prepare what of the motion is a function of time alone, for all times t + shares h (s)."""
    raise NotImplementedError


def motion(model: Model, law: Law, t: float, node: int, y: Array, contacts: Array) -> None:
    """Write gaps, rates and slips of a state's contacts, shape (STATES,)."""
    raise NotImplementedError


def derivative(
    model: Model, law: Law, t: float, node: int, y: Array, modes: Array, dy: Array, contacts: Array,
    slider: Array,
) -> None:  # fmt: skip
    """Evaluate the equations of motion in frozen modes.

    Parameters
    ----------
    model, law, t
        Formulation, contacts, time (s).
    node
        Which of the times last given to `tabulate` that is.
    y
        State; only coordinates and rates matter.
    modes
        Shape (MODES,).
    dy
        Written: the derivative of the whole state.
    contacts
        Written: the states of the contacts that the formulation has, shape (STATES,).
    slider
        Written: x, y, angle of the slider, their rates and second derivatives, shape (9,).
    """
    raise NotImplementedError


@_overload(tabulate)
def _tabulate(model, t, h, shares) -> Any:  # type: ignore[no-untyped-def]
    return _MODULES[model.instance_class].tabulate


@_overload(motion)
def _motion(model, law, t, node, y, contacts) -> Any:  # type: ignore[no-untyped-def]
    return _MODULES[model.instance_class].motion


@_overload(derivative)
def _derivative(*arguments: Any) -> Any:
    return _MODULES[arguments[0].instance_class].derivative
