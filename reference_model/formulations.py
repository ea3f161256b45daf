"""One interface to the equations of all formulations, resolved when the kernels are compiled.

The type of the constants names the formulation (`reference_model.constants.as_record`); numba compiles
the integrator once for each that is used, so a scene pays only for the coordinates that it leaves free. What
calls none of the functions below is compiled once for all.

A body that raises `NotImplementedError` is a stub: it gives a function its name, arguments and types. Where a
kernel calls it numba compiles what `overload` chose in its place, and so the stub itself never runs compiled;
it raises only where plain Python calls it.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from reference_model import chain, minimal, multiplier
from reference_model.compiled import inlined, kernel, overload
from reference_model.constants import Constants, Formulation, formulation_of
from reference_model.forces import CONTACTS, NORMAL, Array
from reference_model.journal import Bearing
from reference_model.linkage import TIP_ROWS, rocker_tip, rocker_tips

WORKS = 3
"""Integrals behind the impulses: work of the drive, loss by damping, loss by friction, J."""

DRIVEN = TIP_ROWS
"""Rows of a table of what is driven."""
Driven = tuple[float, ...]
"""The rocker's tip behind the driven four-bar; nothing where that is in the equations."""
_Slider = tuple[float, float, float, float, float, float]
Kernel = Callable[..., Any]


def coordinates(c: Constants) -> int:
    """Return the number of coordinates of a formulation."""
    raise NotImplementedError


def driven(c: Constants, t: float) -> Driven:
    """Return what of the motion is a function of time alone."""
    raise NotImplementedError


def tabulate_driven(c: Constants, t: float, h: float, shares: Array, table: Array) -> None:
    """Write what `driven` returns at all times t + shares h (s) into `table`, shape (DRIVEN, n)."""
    raise NotImplementedError


def driven_of(c: Constants, table: Array, i: int) -> Driven:
    """Return what `tabulate_driven` wrote of one of the times."""
    raise NotImplementedError


def _equations(
    c: Constants, t: float, at: Driven, y: Array, modes: Array, dy: Array, contacts: Array
) -> tuple[float, float, float]:
    raise NotImplementedError


def slider_at(c: Constants, at: Driven, y: Array) -> _Slider:
    """Return x, y, angle of the slider and their rates; `at` is what `driven` says of the time."""
    raise NotImplementedError


def bearing_motion(c: Constants, t: float, y: Array) -> Bearing:
    """Return the contact at the crank pin A; open for ever where that is an ideal revolute."""
    raise NotImplementedError


_COORDINATES: dict[Formulation, int] = {
    Formulation.SLIDER: 2,
    Formulation.PIN: 2,
    Formulation.BOTH: 4,
    Formulation.MULTIPLIER: 15,
    Formulation.MULTIPLIER_IDEAL: 15,
}


_no_bearing: Kernel = lambda c, t, y: Bearing(np.inf, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # noqa: E731


@overload(coordinates)
def _coordinates(c) -> Kernel:  # type: ignore[no-untyped-def]
    count = _COORDINATES[formulation_of(c.fields)]
    return lambda c: count


@overload(driven)
def _select_driven(c, t) -> Kernel:  # type: ignore[no-untyped-def]
    if formulation_of(c.fields) is Formulation.SLIDER:
        return lambda c, t: rocker_tip(c, t)
    return lambda c, t: ()


@overload(tabulate_driven)
def _select_tabulate(c, t, h, shares, table) -> Kernel:  # type: ignore[no-untyped-def]
    if formulation_of(c.fields) is Formulation.SLIDER:
        return lambda c, t, h, shares, table: rocker_tips(c, t, h, shares, table)
    return lambda c, t, h, shares, table: None


@overload(driven_of)
def _select_driven_of(c, table, i) -> Kernel:  # type: ignore[no-untyped-def]
    if formulation_of(c.fields) is Formulation.SLIDER:
        return lambda c, table, i: (
            table[0, i], table[1, i], table[2, i], table[3, i], table[4, i], table[5, i]
        )  # fmt: skip
    return lambda c, table, i: ()


@overload(_equations)
def _select_equations(c, t, at, y, modes, dy, contacts) -> Kernel:  # type: ignore[no-untyped-def]
    table: dict[Formulation, Kernel] = {
        Formulation.SLIDER: lambda c, t, at, y, modes, dy, contacts: minimal.equations(
            c, at, y, modes, dy, contacts
        ),
        Formulation.PIN: lambda c, t, at, y, modes, dy, contacts: chain.equations_pin(
            c, t, y, modes, dy, contacts
        ),
        Formulation.BOTH: lambda c, t, at, y, modes, dy, contacts: chain.equations_both(
            c, t, y, modes, dy, contacts
        ),
        Formulation.MULTIPLIER: lambda c, t, at, y, modes, dy, contacts: multiplier.equations(
            c, t, y, modes, dy, contacts, multiplier.ROWS_CLEARANCE
        ),
        Formulation.MULTIPLIER_IDEAL: lambda c, t, at, y, modes, dy, contacts: multiplier.equations(
            c, t, y, modes, dy, contacts, multiplier.ROWS_IDEAL
        ),
    }
    return table[formulation_of(c.fields)]


@overload(slider_at)
def _select_slider(c, at, y) -> Kernel:  # type: ignore[no-untyped-def]
    table: dict[Formulation, Kernel] = {
        Formulation.SLIDER: lambda c, at, y: minimal.slider_motion(c, at, y),
        Formulation.PIN: lambda c, at, y: chain.ideal_slider_motion(c, y[1], y[3]),
        Formulation.BOTH: lambda c, at, y: chain.slider_motion(c, y[1], y[2], y[3], y[5], y[6], y[7]),
        Formulation.MULTIPLIER: lambda c, at, y: (y[12], y[13], y[14], y[27], y[28], y[29]),
        Formulation.MULTIPLIER_IDEAL: lambda c, at, y: (y[12], y[13], y[14], y[27], y[28], y[29]),
    }
    return table[formulation_of(c.fields)]


@overload(bearing_motion)
def _select_bearing(c, t, y) -> Kernel:  # type: ignore[no-untyped-def]
    table: dict[Formulation, Kernel] = {
        Formulation.PIN: lambda c, t, y: chain.bearing_motion(c, t, y[0], y[1], y[2], y[3]),
        Formulation.BOTH: lambda c, t, y: chain.bearing_motion(c, t, y[0], y[1], y[4], y[5]),
    }
    return table.get(formulation_of(c.fields), _no_bearing)


@inlined
def slider_motion(c: Constants, t: float, y: Array) -> _Slider:
    """Return x, y, angle of the slider and their rates."""
    return slider_at(c, driven(c, t), y)


@inlined
def crank_coordinate(c: Constants) -> bool:
    """Return whether the crank's angle is a coordinate, which grows from cycle to cycle."""
    return coordinates(c) == multiplier.COORDINATES


@inlined
def free(c: Constants) -> int:
    """Return the number of coordinates and velocities, at the head of every state."""
    return 2 * coordinates(c)


@inlined
def state_size(c: Constants) -> int:
    """Return the length of a state: coordinates, velocities, impulses of the contacts (N s), works (J)."""
    return 2 * coordinates(c) + CONTACTS + WORKS


@inlined
def derivative(
    c: Constants, t: float, at: Driven, y: Array, modes: Array, dy: Array, contacts: Array
) -> None:
    """Evaluate the equations of motion in frozen modes.

    Parameters
    ----------
    c, t, at
        Constants, time (s), and what `driven` says of it.
    y
        State; only coordinates and velocities matter.
    modes
        Shape (MODES, CONTACTS).
    dy
        Written: the derivative of the whole state, shape (state_size,).
    contacts
        Written: gap, rate, slip, normal and friction force of each contact that the formulation has, shape
        (5, CONTACTS).
    """
    n = 2 * coordinates(c)
    power, damping, friction = _equations(c, t, at, y, modes, dy, contacts)
    for k in range(CONTACTS):
        dy[n + k] = contacts[NORMAL, k]
    dy[n + CONTACTS], dy[n + CONTACTS + 1], dy[n + CONTACTS + 2] = power, damping, friction


@kernel
def right_hand_side(c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array) -> None:
    """Evaluate the equations of motion as `derivative` does, where its code need not be in the caller."""
    derivative(c, t, driven(c, t), y, modes, dy, contacts)
