"""The same ends of modes as `reference_model.events`, on the dense output of any integrator.

Such a step has no stages to settle it by: its dense output is evaluated at the nine points of
`reference_model.isolation` at once, and what they leave open is followed as there. The dense output of
LSODA or BDF is no more accurate than the tolerance: dips within it are none, and a margin that is negative
at the step's end has ended in it however little.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.events import DEEPEST, MOST_INTERVALS, ROUNDING
from reference_model.forces import CONTACTS, GAP, MEMORY, RATE, Array
from reference_model.integrate import VELOCITY_TIME
from reference_model.isolation import (
    BELOW,
    CROSSES,
    NARROWEST,
    NODES,
    POINTS,
    RESOLUTION,
    SETTLED,
    UNCLEAR,
    classify,
    dips,
    last_positive,
)
from reference_model.switching import MARGINS, NONE, margin_at, margin_of, margin_state, margin_value

Dense = Callable[[Array | float], Array]
"""Times (s), shape () or (n,) -> states, shape (size,) or (size, n)."""
Margin = Callable[[float], float]
"""Time (s) -> what is positive before an end or a turning point, and negative after it: m or m/s."""

HALVINGS = 50
"""Down to the rounding of a step."""

_ROUND_OFF = 4.0 * np.finfo(np.float64).eps


@kernel
def _margin_in(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float, t: float, y: Array
) -> float:
    gap, rate, slip = margin_state(c, k, kind, t, y)
    return margin_value(c, modes, k, kind, sign, bound, gap, rate, slip)


@kernel
def _deepest(kind: int, sign: float, tolerance: float) -> float:
    """Return how far below zero a margin may start, m or m/s: an open contact's gap as far as it is known."""
    return max(DEEPEST, tolerance) if kind == GAP and sign > 0.0 else np.inf


@kernel
def _unsettled(
    c: Constants, modes: Array, after: Array, times: Array, states: Array, tolerance: float
) -> Array:
    """Return contact and number of each margin that does not certainly last; shape (n, 2)."""
    found, count = np.empty((CONTACTS * MARGINS, 2)), 0
    values = np.empty(POINTS)
    for k in range(CONTACTS):
        if after[GAP, k] == np.inf:
            continue
        for number in range(MARGINS if modes[MEMORY, k] > 0.0 else 1):
            kind, sign, bound = margin_of(c, modes, k, number)
            if kind == NONE:
                continue
            for j in range(POINTS):
                values[j] = _margin_in(c, modes, k, kind, sign, bound, times[j], states[j])
            end = margin_at(c, modes, k, kind, sign, bound, after)
            resolution = tolerance if kind == GAP else tolerance / VELOCITY_TIME
            starting = values[0] <= ROUNDING and not dips(values, _deepest(kind, sign, tolerance))
            if end < 0.0 or classify(values, starting, resolution) != SETTLED:
                found[count, 0], found[count, 1] = k, number
                count += 1
    return found[:count]


def margin(
    c: Constants, modes: Array, dense: Dense, kind: int, contact: int, sign: float, bound: float = 0.0
) -> Margin:
    """Return sign * (switching function - bound) of one contact along the dense output."""
    return lambda t: float(_margin_in(c, modes, contact, kind, sign, bound, t, dense(t)))


def zero(value: Margin, lo: float, hi: float) -> float:
    """Return the time (s) in [lo, hi] just after which `value` is negative.

    An end where the zero seems to lie beyond it: the dense output of LSODA meets the ends of its steps only
    to within the tolerance.
    """
    if value(lo) <= 0.0:
        return lo
    if value(hi) >= 0.0:
        return hi
    root = brentq(value, lo, hi, xtol=_ROUND_OFF * hi, rtol=_ROUND_OFF)
    # Brent's method ends on either side; a mode that has really ended does not end once more.
    return float(min(hi, root + 2.0 * _ROUND_OFF * hi))


def departure(value: Margin, start: float, reach: float) -> float:
    """Return the time (s) from `start` at which `value` turns negative; at `reach` it is.

    What starts within rounding must first turn right before it ends: then a right point is sought by halving.
    """
    if value(start) > ROUNDING:
        return zero(value, start, reach)
    length = reach - start
    for _ in range(HALVINGS):
        length *= 0.5
        if value(start + length) > ROUNDING:
            return zero(value, start + length, start + 2.0 * length)
    return start


def end_of_mode(
    value: Margin, start: float, end: float, resolution: float, deepest: float = np.inf
) -> float | None:
    """Return the time (s) at which `value` first turns negative, by the rule of `events.end_of_mode`.

    `deepest`: how far below zero it may start, m or m/s.
    """
    lo, width = 0.0, 1.0
    length = end - start
    for _ in range(MOST_INTERVALS):
        hi = min(1.0, lo + width)
        times = start + (lo + (hi - lo) * NODES) * length
        values = np.array([value(t) for t in times])
        starting = lo == 0.0 and values[0] <= ROUNDING and not dips(values, deepest)
        found = classify(values, starting, resolution)
        if found == CROSSES:
            return zero(value, times[last_positive(values, resolution)], times[-1])
        if found == BELOW:
            return float(times[0])
        if found == UNCLEAR and width > NARROWEST:
            width *= 0.5
        elif hi >= 1.0:
            return None
        else:
            lo, width = hi, 2.0 * width
    return start + lo * length


def first_switch(
    c: Constants, modes: Array, after: Array, t0: float, t1: float, dense: Dense, tolerance: float
) -> tuple[float, int, int] | None:
    """Return time (s), kind and contact of the first end of a mode in the step from `t0` to `t1`, if any.

    Parameters
    ----------
    c, modes
        Constants; modes, shape (MODES, CONTACTS).
    after
        The contacts at the step's end, shape (5, CONTACTS).
    t0, t1, dense
        s; the step's dense output.
    tolerance
        Of the coordinates, m and rad.
    """
    times = t0 + (t1 - t0) * NODES
    states = np.ascontiguousarray(dense(times).T)
    tolerance = max(tolerance, RESOLUTION)
    found = []
    for contact, number in _unsettled(c, modes, after, times, states, tolerance).astype(int):
        kind, sign, bound = margin_of(c, modes, contact, number)
        value = margin(c, modes, dense, kind, contact, sign, bound)
        resolution = tolerance if kind == GAP else tolerance / VELOCITY_TIME
        at = end_of_mode(value, t0, t1, resolution, _deepest(kind, sign, tolerance))
        if at is None and margin_at(c, modes, contact, kind, sign, bound, after) < 0.0:
            at = departure(value, t0, t1)
        if at is not None:
            found.append((at, int(kind), int(contact)))
    return min(found, default=None)


def turning_time(c: Constants, modes: Array, contact: int, t0: float, t1: float, dense: Dense) -> float:
    """Return when (s) within a step the depth of a closed contact is largest: its gap turns from closing."""
    return zero(margin(c, modes, dense, RATE, contact, -1.0), t0, t1)
