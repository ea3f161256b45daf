"""The same ends of modes as `reference_model.events`, located on the dense output of any integrator."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from reference_model.constants import Constants
from reference_model.events import HALVINGS, PULL, ROUNDING, switching_value
from reference_model.forces import CLIPPED, CONTACTS, GAP, MEMORY, RATE, REGIME, SLIP, Array
from reference_model.friction import regime_bounds

Dense = Callable[[float], Array]
"""Time (s) -> state."""
Margin = Callable[[float], float]
"""Time (s) -> what is positive before an end or a turn, and negative after it: m or m/s."""

_ROUND_OFF = 4.0 * np.finfo(np.float64).eps


def margin(
    c: Constants, modes: Array, dense: Dense, kind: int, contact: int, side: float, bound: float = 0.0
) -> Margin:
    """Return side * (switching function) of one contact along the dense output."""
    return lambda t: side * float(switching_value(c, kind, contact, bound, t, dense(t), modes))


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

    By the rule of `events.departure`: what starts within rounding must first turn right before it ends.
    """
    if value(start) > ROUNDING:
        return zero(value, start, reach)
    length = reach - start
    for _ in range(HALVINGS):
        length *= 0.5
        if value(start + length) > ROUNDING:
            return zero(value, start + length, start + 2.0 * length)
    return start


def first_switch(
    c: Constants, modes: Array, before: Array, after: Array, t0: float, t1: float, dense: Dense
) -> tuple[float, int, int] | None:
    """Return time (s), kind and contact of the first end of a mode in the step from `t0` to `t1`, if any.

    `before`, `after`: the contacts at its ends, shape (5, CONTACTS).
    """
    found = []
    for k in range(CONTACTS):
        active = modes[MEMORY, k] > 0.0
        side = -1.0 if active else 1.0  # in contact the gap is negative
        gap = margin(c, modes, dense, GAP, k, side)
        if side * after[GAP, k] < 0.0:
            found.append((departure(gap, t0, t1), GAP, k))
        elif side * before[RATE, k] < 0.0 < side * after[RATE, k]:
            turn = zero(margin(c, modes, dense, RATE, k, -side), t0, t1)
            # What stays within rounding is no dip.
            if gap(turn) < -ROUNDING:
                found.append((departure(gap, t0, turn), GAP, k))
        if not active:
            continue
        pulling = modes[MEMORY, k] - c.C * after[RATE, k] < 0.0
        if pulling != (modes[CLIPPED, k] > 0.0):
            pull = margin(c, modes, dense, PULL, k, 1.0 if pulling else -1.0)
            found.append((departure(pull, t0, t1), PULL, k))
        lower, upper = regime_bounds(c, int(modes[REGIME, k]))
        if not lower <= after[SLIP, k] <= upper:
            above = after[SLIP, k] > upper
            slip = margin(c, modes, dense, SLIP, k, -1.0 if above else 1.0, upper if above else lower)
            found.append((departure(slip, t0, t1), SLIP, k))
    return min(found, default=None)
