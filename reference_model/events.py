"""Where a mode ends: first touch, separation, a force that would turn to a pull, a kink of the friction.

Each is a zero of a switching function of one contact. A step is checked at its end, and for the gap also
at the extremum in between, so that a contact that dips into the wall and out again within one step is seen.
"""

import math

import numpy as np

from reference_model.compiled import bare, kernel
from reference_model.constants import Constants
from reference_model.contact import corner_arm, corner_gap, inward
from reference_model.dop853 import dense
from reference_model.forces import CLIPPED, CONTACTS, GAP, MEMORY, RATE, REGIME, SLIP, Array
from reference_model.formulations import bearing_motion, free, slider_motion
from reference_model.friction import regime_bounds
from reference_model.journal import JOURNAL

PULL = 5
"""Kind of switching function, beside GAP and SLIP; RATE only serves to find the extremum of the gap."""

ROUNDING = 1.0e-15
"""m or m/s; gaps are differences of coordinates near 0.55 m and round at 1e-16 m, slips of some m/s too."""
HALVINGS = 50
"""Down to the rounding of a step."""


@bare
def contact_state(c: Constants, k: int, t: float, y: Array) -> tuple[float, float, float]:
    """Return gap (m), its rate and the slip (m/s) of contact `k` in a state."""
    if k == JOURNAL:
        bearing = bearing_motion(c, t, y)
        return bearing.gap, bearing.rate, bearing.slip
    x5, _, angle, vx5, vy5, w5 = slider_motion(c, t, y)
    rx, ry = corner_arm(c, k, math.cos(angle), math.sin(angle))
    return corner_gap(c, k, x5 + rx), inward(k) * (vx5 - w5 * ry), vy5 + w5 * rx


@bare
def switching_value(
    c: Constants, kind: int, contact: int, bound: float, t: float, y: Array, modes: Array
) -> float:
    """Return one switching function in state `y`: m for GAP, m/s for the others."""
    gap, rate, slip = contact_state(c, contact, t, y)
    if kind == GAP:
        return gap
    if kind == RATE:
        return rate
    if kind == PULL:  # 1 + C depth_rate / impact_speed, times the impact speed
        return float(modes[MEMORY, contact]) - c.C * rate
    return slip - bound


@bare
def locate(
    c: Constants, kind: int, contact: int, bound: float, lo: float, hi: float,
    t: float, h: float, y: Array, f: Array, modes: Array, state: Array,
) -> float:  # fmt: skip
    """Return the share of the step, in (lo, hi], at which a switching function changes sign.

    The regula falsi in its Illinois form on the dense output; `hi` where the ends have the same sign.
    """
    dense(y, f, lo, free(c), state)
    f_lo = switching_value(c, kind, contact, bound, t + lo * h, state, modes)
    dense(y, f, hi, free(c), state)
    f_hi = switching_value(c, kind, contact, bound, t + hi * h, state, modes)
    if f_lo * f_hi > 0.0:
        return hi
    side = 0
    for _ in range(60):
        if f_hi == 0.0 or hi - lo <= 4.0e-16 * (1.0 + t / h):
            break
        x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
        dense(y, f, x, free(c), state)
        value = switching_value(c, kind, contact, bound, t + x * h, state, modes)
        if value * f_hi > 0.0:
            hi, f_hi = x, value
            if side == 1:
                f_lo *= 0.5
            side = 1
        else:
            lo, f_lo = x, value
            if value == 0.0:
                return x
            if side == -1:
                f_hi *= 0.5
            side = -1
    return hi


@bare
def step_may_switch(c: Constants, modes: Array, before: Array, after: Array) -> bool:
    """Return whether any mode can have ended in a step, from the contacts' states at its ends."""
    for k in range(CONTACTS):
        side = -1.0 if modes[MEMORY, k] > 0.0 else 1.0  # in contact the gap is negative
        if side * after[GAP, k] < 0.0 or (side * before[RATE, k] < 0.0 < side * after[RATE, k]):
            return True
        if modes[MEMORY, k] > 0.0:
            pulling = modes[MEMORY, k] - c.C * after[RATE, k] < 0.0
            if pulling != (modes[CLIPPED, k] > 0.0):
                return True
            lower, upper = regime_bounds(c, int(modes[REGIME, k]))
            if not lower <= after[SLIP, k] <= upper:
                return True
    return False


@bare
def departure(
    c: Constants, kind: int, contact: int, bound: float, side: float, reach: float,
    t: float, h: float, y: Array, f: Array, modes: Array, state: Array,
) -> float:  # fmt: skip
    """Return the share of the step, below `reach`, at which side * (switching function) turns negative.

    At `reach` it is. A mode that has just begun starts at zero but for rounding, and can turn right before it
    ends: then a right point is sought by halving. Where there is none the mode ends at once.
    """
    lo = 0.0
    dense(y, f, lo, free(c), state)
    if side * switching_value(c, kind, contact, bound, t, state, modes) <= ROUNDING:
        lo = reach
        for _ in range(HALVINGS):
            lo *= 0.5
            dense(y, f, lo, free(c), state)
            if side * switching_value(c, kind, contact, bound, t + lo * h, state, modes) > ROUNDING:
                return locate(c, kind, contact, bound, lo, 2.0 * lo, t, h, y, f, modes, state)
        return 0.0
    return locate(c, kind, contact, bound, lo, reach, t, h, y, f, modes, state)


@bare
def first_switch(
    c: Constants,
    t: float,
    h: float,
    y: Array,
    f: Array,
    modes: Array,
    before: Array,
    after: Array,
    state: Array,
) -> tuple[float, int, int]:
    """Return share of the step (2.0: none), kind and contact of the first end of a mode in a step."""
    best, best_kind, best_contact = 2.0, -1, -1
    # As numbers: for each constant numba would compile all that it is handed to once more.
    gap, rate, pull, slip = int(GAP), int(RATE), int(PULL), int(SLIP)
    for k in range(CONTACTS):
        active = modes[MEMORY, k] > 0.0
        side = -1.0 if active else 1.0
        x = 2.0
        if side * after[GAP, k] < 0.0:
            x = departure(c, gap, k, 0.0, side, 1.0, t, h, y, f, modes, state)
        elif side * before[RATE, k] < 0.0 < side * after[RATE, k]:
            turn = locate(c, rate, k, 0.0, 0.0, 1.0, t, h, y, f, modes, state)
            dense(y, f, turn, free(c), state)
            # What stays within rounding is no dip: there contact and flight would hand over for ever.
            if side * switching_value(c, gap, k, 0.0, t + turn * h, state, modes) < -ROUNDING:
                x = departure(c, gap, k, 0.0, side, turn, t, h, y, f, modes, state)
        if x < best:
            best, best_kind, best_contact = x, GAP, k
        if active:
            pulling = modes[MEMORY, k] - c.C * after[RATE, k] < 0.0
            if pulling != (modes[CLIPPED, k] > 0.0):
                x = departure(c, pull, k, 0.0, 1.0 if pulling else -1.0, 1.0, t, h, y, f, modes, state)
                if x < best:
                    best, best_kind, best_contact = x, PULL, k
            lower, upper = regime_bounds(c, int(modes[REGIME, k]))
            if not lower <= after[SLIP, k] <= upper:
                above = after[SLIP, k] > upper
                bound = upper if above else lower
                x = departure(c, slip, k, bound, -1.0 if above else 1.0, 1.0, t, h, y, f, modes, state)
                if x < best:
                    best, best_kind, best_contact = x, SLIP, k
    return best, best_kind, best_contact


@kernel
def touching(gap: float, rate: float, other_gap: float) -> bool:
    """Return whether a contact touches at the same instant as another one whose gap was just located."""
    return rate < 0.0 and gap <= abs(other_gap) + ROUNDING


@kernel
def next_regime(c: Constants, regime: int, slip: float) -> int:
    """Return the neighbouring friction regime towards which the located speed `slip` leaves `regime`."""
    lower, upper = regime_bounds(c, regime)
    if np.isinf(upper):
        return regime - 1
    if np.isinf(lower):
        return regime + 1
    return regime + 1 if upper - slip < slip - lower else regime - 1
