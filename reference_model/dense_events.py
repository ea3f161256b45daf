"""The same ends of modes as `reference_model.events`, located on the dense output of any integrator."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from reference_model.constants import Constants
from reference_model.events import PULL, switching_value
from reference_model.forces import CLIPPED, CONTACTS, GAP, MEMORY, RATE, REGIME, SLIP, Array
from reference_model.friction import regime_bounds

Dense = Callable[[float], Array]
"""Time (s) -> state."""

_ROUND_OFF = 4.0 * np.finfo(np.float64).eps


def zero(
    c: Constants,
    modes: Array,
    dense: Dense,
    kind: int,
    contact: int,
    lo: float,
    hi: float,
    bound: float = 0.0,
) -> float:
    """Return the time (s) in [lo, hi] just after which a switching function has its sign at `hi`.

    `lo` where it has that sign from there on: the dense output of LSODA meets the last step's end only to
    within the tolerance, and a function that was just located is zero to round-off.
    """

    def value(t: float) -> float:
        return float(switching_value(c, kind, contact, bound, t, dense(t), modes))

    if value(lo) * value(hi) >= 0.0:
        return lo
    root = brentq(value, lo, hi, xtol=_ROUND_OFF * (hi - lo), rtol=_ROUND_OFF)
    # Brent's method ends on either side; a mode that has really ended does not end once more.
    return float(min(hi, root + _ROUND_OFF * hi))


def first_switch(
    c: Constants, modes: Array, before: Array, after: Array, t0: float, t1: float, dense: Dense
) -> tuple[float, int, int] | None:
    """Return time (s), kind and contact of the first end of a mode in the step from `t0` to `t1`, if any.

    `before`, `after`: the contacts at its ends, shape (5, CONTACTS).
    """
    found = []
    for k in range(CONTACTS):
        touch = _gap_closes_or_opens(c, modes, before, after, k, t0, t1, dense)
        if touch is not None:
            found.append((touch, GAP, k))
        if modes[MEMORY, k] == 0.0:
            continue
        pulling = modes[MEMORY, k] - c.C * after[RATE, k] < 0.0
        if pulling != (modes[CLIPPED, k] > 0.0):
            found.append((zero(c, modes, dense, PULL, k, t0, t1), PULL, k))
        lower, upper = regime_bounds(c, int(modes[REGIME, k]))
        if not lower <= after[SLIP, k] <= upper:
            bound = upper if after[SLIP, k] > upper else lower
            found.append((zero(c, modes, dense, SLIP, k, t0, t1, bound), SLIP, k))
    return min(found, default=None)


def _gap_closes_or_opens(
    c: Constants, modes: Array, before: Array, after: Array, k: int, t0: float, t1: float, dense: Dense
) -> float | None:
    """Return when contact `k` touches or separates, also by a dip that ends within the step."""
    side = -1.0 if modes[MEMORY, k] > 0.0 else 1.0  # in contact the gap is negative

    def turn() -> float:
        return zero(c, modes, dense, RATE, k, t0, t1)

    def margin(t: float) -> float:
        return side * float(switching_value(c, GAP, k, 0.0, t, dense(t), modes))

    on_its_side = side * before[GAP, k] > 0.0
    if side * after[GAP, k] < 0.0:
        if on_its_side:
            return zero(c, modes, dense, GAP, k, t0, t1)
        # Just switched, and rounded to the wrong side: it can switch back after the extremum.
        rises = side * before[RATE, k] > 0.0 > side * after[RATE, k]
        start = turn() if rises else t0
        return zero(c, modes, dense, GAP, k, start, t1) if margin(start) > 0.0 else start
    if side * before[RATE, k] < 0.0 < side * after[RATE, k]:
        lowest = turn()
        if margin(lowest) < 0.0:
            return zero(c, modes, dense, GAP, k, t0, lowest) if on_its_side else t0
    return None
