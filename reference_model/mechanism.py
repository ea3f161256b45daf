"""What is observed of the whole mechanism, in every formulation: bodies, drift, what moves as prescribed.

Chosen when the kernels are compiled, by stubs and overloads as in `reference_model.formulations`.
"""

import numpy as np

from reference_model import bodies, minimal, multiplier
from reference_model.compiled import kernel, overload
from reference_model.constants import Constants, Formulation, formulation_of
from reference_model.forces import Array
from reference_model.formulations import Driven, Kernel


def _bodies(c: Constants, t: float, y: Array, dy: Array, out: Array) -> None:
    raise NotImplementedError


def slider_row(c: Constants, t: float, at: Driven, y: Array, dy: Array, out: Array) -> None:
    """Write x, y, angle of the slider, their rates and their second derivatives into out[:9].

    `at` is what `driven` says of the time `t`.
    """
    raise NotImplementedError


def constraint_drift(c: Constants, t: float, y: Array) -> tuple[float, float]:
    """Return the largest |Phi| (m, rad) and |Phi'| (m/s, rad/s); zero where no constraint can drift."""
    raise NotImplementedError


def driven_bodies(c: Constants) -> int:
    """Return how many bodies, from the crank, move as prescribed and are not in the equations."""
    raise NotImplementedError


def ideal_slider(c: Constants) -> bool:
    """Return whether the slider is fixed to its line."""
    raise NotImplementedError


def ideal_pin(c: Constants) -> bool:
    """Return whether the crank pin A is an ideal revolute."""
    raise NotImplementedError


@overload(_bodies)
def _select_bodies(c, t, y, dy, out) -> Kernel:  # type: ignore[no-untyped-def]
    table: dict[Formulation, Kernel] = {
        Formulation.SLIDER: lambda c, t, y, dy, out: bodies.motion_slider_clearance(c, t, y, dy, out),
        Formulation.PIN: lambda c, t, y, dy, out: bodies.motion_pin_clearance(c, t, y, dy, out),
        Formulation.BOTH: lambda c, t, y, dy, out: bodies.motion_both_clearances(c, t, y, dy, out),
        Formulation.MULTIPLIER: lambda c, t, y, dy, out: bodies.motion_multipliers(y, dy, out),
        Formulation.MULTIPLIER_IDEAL: lambda c, t, y, dy, out: bodies.motion_multipliers(y, dy, out),
    }
    return table[formulation_of(c.fields)]


@kernel
def _from_bodies(c: Constants, t: float, y: Array, dy: Array, out: Array) -> None:
    bodies = np.empty((5, 9))
    _bodies(c, t, y, dy, bodies)
    for i in range(9):
        out[i] = bodies[4, i]


@overload(slider_row)
def _select_slider_row(c, t, at, y, dy, out) -> Kernel:  # type: ignore[no-untyped-def]
    if formulation_of(c.fields) is Formulation.SLIDER:
        return lambda c, t, at, y, dy, out: minimal.slider_row(c, at, y, dy, out)
    return lambda c, t, at, y, dy, out: _from_bodies(c, t, y, dy, out)


@overload(constraint_drift)
def _select_drift(c, t, y) -> Kernel:  # type: ignore[no-untyped-def]
    table: dict[Formulation, Kernel] = {
        Formulation.MULTIPLIER: lambda c, t, y: multiplier.drift(c, t, y, multiplier.ROWS_CLEARANCE),
        Formulation.MULTIPLIER_IDEAL: lambda c, t, y: multiplier.drift(c, t, y, multiplier.ROWS_IDEAL),
    }
    return table.get(formulation_of(c.fields), lambda c, t, y: (0.0, 0.0))


@overload(driven_bodies)
def _select_driven(c) -> Kernel:  # type: ignore[no-untyped-def]
    count = 3 if formulation_of(c.fields) is Formulation.SLIDER else 0
    return lambda c: count


@overload(ideal_slider)
def _select_ideal_slider(c) -> Kernel:  # type: ignore[no-untyped-def]
    ideal = formulation_of(c.fields) in (Formulation.PIN, Formulation.MULTIPLIER_IDEAL)
    return lambda c: ideal


@overload(ideal_pin)
def _select_ideal_pin(c) -> Kernel:  # type: ignore[no-untyped-def]
    ideal = formulation_of(c.fields) not in (Formulation.PIN, Formulation.BOTH)
    return lambda c: ideal


@kernel
def fill_bodies(c: Constants, t: float, y: Array, dy: Array, out: Array) -> None:
    """Write the motion of all five bodies, shape (5, 9), from a state and its derivative."""
    _bodies(c, t, y, dy, out)
