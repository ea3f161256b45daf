"""One interface to the equations of motion of all formulations.

Which of them stands for a function of this module follows, when a kernel is compiled, from the type of the
model: numba compiles the integrator once for each that is used, so a scene pays only for the coordinates that it
leaves free. The functions themselves are stubs, for names, arguments and types.
"""

from collections.abc import Callable
from typing import Any

import numba.extending

from reference_model import chain, minimal, multiplier
from reference_model.chain import Chain
from reference_model.compiled import inlined, inner, kernel
from reference_model.contact import CONTACTS, NORMAL
from reference_model.linkage import Array
from reference_model.minimal import Minimal
from reference_model.multiplier import Linkage
from reference_model.parameters import Law

Model = Minimal | Chain | Linkage
WORKS = 3
"""Integrals behind the impulses: work of the drive, loss by damping, loss by friction, J."""
TAIL = CONTACTS + WORKS
"""Of a state, behind its coordinates and rates: impulses of the contacts (N s), works (J)."""


def motion(model: Model, law: Law, t: float, y: Array, contacts: Array) -> None:
    """Write gaps, rates and slips of a state's contacts, shape (STATES, CONTACTS)."""
    raise NotImplementedError


def derivative_of_motion(
    model: Model, law: Law, t: float, y: Array, modes: Array, dy: Array, contacts: Array, slider: Array
) -> tuple[float, float, float]:
    """Write the derivatives of coordinates and rates; return the powers of drive, damping, friction, W."""
    raise NotImplementedError


_OPTIONS = {"error_model": "numpy", "forceinline": True, "_nrt": False}


@numba.extending.overload(motion, jit_options=_OPTIONS)
def _motion(model, law, t, y, contacts) -> Callable[..., Any]:  # type: ignore[no-untyped-def]
    return {
        Minimal: lambda model, law, t, y, contacts: minimal.motion(model, law, t, y, contacts),
        Chain: lambda model, law, t, y, contacts: chain.motion(model, law, t, y, contacts),
        Linkage: lambda model, law, t, y, contacts: multiplier.motion(model, law, t, y, contacts),
    }[model.instance_class]


@numba.extending.overload(derivative_of_motion, jit_options=_OPTIONS)
def _derivative(model, law, t, y, modes, dy, contacts, slider) -> Callable[..., Any]:  # type: ignore[no-untyped-def]
    return {
        Minimal: lambda model, law, t, y, modes, dy, contacts, slider: minimal.derivative(
            model, law, t, y, modes, dy, contacts, slider
        ),
        Chain: lambda model, law, t, y, modes, dy, contacts, slider: chain.derivative(
            model, law, t, y, modes, dy, contacts, slider
        ),
        Linkage: lambda model, law, t, y, modes, dy, contacts, slider: multiplier.derivative(
            model, law, t, y, modes, dy, contacts, slider
        ),
    }[model.instance_class]


@inlined
def derivative(
    model: Model, law: Law, t: float, y: Array, modes: Array, dy: Array, contacts: Array, slider: Array
) -> None:
    """Evaluate the equations of motion in frozen modes.

    Parameters
    ----------
    model, law, t
        Formulation, contacts, time (s).
    y
        State; only coordinates and rates matter.
    modes
        Shape (MODES, CONTACTS).
    dy
        Written: the derivative of the whole state.
    contacts
        Written: the states of the contacts that the formulation has, shape (STATES, CONTACTS).
    slider
        Written: x, y, angle of the slider, their rates and second derivatives, shape (9,).
    """
    power, damping, friction = derivative_of_motion(model, law, t, y, modes, dy, contacts, slider)
    tail = y.size - TAIL
    for k in range(CONTACTS):
        dy[tail + k] = contacts[NORMAL, k]
    dy[tail + CONTACTS], dy[tail + CONTACTS + 1], dy[tail + CONTACTS + 2] = power, damping, friction


@inner
def right_hand_side(
    model: Model, law: Law, t: float, y: Array, modes: Array, dy: Array, contacts: Array, slider: Array
) -> None:
    """Evaluate the equations of motion as `derivative` does, where its code need not be in the caller."""
    derivative(model, law, t, y, modes, dy, contacts, slider)


@kernel
def evaluate(
    model: Model, law: Law, t: float, y: Array, modes: Array, dy: Array, contacts: Array, slider: Array
) -> None:
    """Evaluate the equations of motion as `derivative` does, for Python."""
    right_hand_side(model, law, t, y, modes, dy, contacts, slider)
