"""Switching functions: what must not change its sign while a mode lasts.

A mode of a contact (`reference_model.forces`) ends where one of its *margins* turns negative:

=======  ==========================  ==========================================  =======
kind     margin                      lasts while                                 unit
=======  ==========================  ==========================================  =======
GAP      +gap (open), -gap (closed)  open, or in contact                         m
PULL     +-(v - C gap')              the damped force pushes, or is clipped      m/s
SLIP     slip - lower, upper - slip  the friction stays in its regime            m/s
=======  ==========================  ==========================================  =======

Under the law foundation every corner has a gap to go in or out by; the corner that keeps the contact of its
side has the other margins, with gap' and slip of the resultant's point. A law without memory never pulls.

The journal's gap c - |e| has a kink where the pin is centred; in its place stands (c^2 - e^2) / 2 c, which
has the same zero, slope and sign and is smooth.
"""

import math

from reference_model.compiled import bare, inlined
from reference_model.constants import Constants
from reference_model.contact import corner_arm, corner_gap, inward, without_memory
from reference_model.forces import (
    CLIPPED,
    GAP,
    INSIDE,
    MEMORY,
    RATE,
    REGIME,
    SLIP,
    Array,
    of_side,
    other_corner,
    side_motion,
)
from reference_model.formulations import bearing_motion, slider_motion
from reference_model.foundation import resultant
from reference_model.friction import regime_bounds
from reference_model.journal import JOURNAL
from reference_model.trigonometry import cos_sin

PULL = 5
"""Kind of switching function, beside GAP and SLIP; RATE serves to find the extremum of a gap."""
MARGINS = 4
"""Of a contact: its gap, the pull, the lower and the upper bound of its friction regime."""
SECOND_CORNER = 1.0e-12
"""m, by which the second corner of a side is past zero where it goes in or out: less than LOCATED."""
NONE = -1
"""Kind of a margin that a contact does not have in its mode."""


@bare
def contact_state(c: Constants, k: int, t: float, y: Array) -> tuple[float, float, float]:
    """Return gap (m), its rate and the slip (m/s) of contact `k` in a state."""
    if k == JOURNAL:
        bearing = bearing_motion(c, t, y)
        return bearing.gap, bearing.rate, bearing.slip
    x5, _, angle, vx5, vy5, w5 = slider_motion(c, t, y)
    c5, s5 = cos_sin(angle)
    rx, ry = corner_arm(c, k, c5, s5)
    return corner_gap(c, k, x5 + rx), inward(k) * (vx5 - w5 * ry), vy5 + w5 * rx


@bare
def margin_state(c: Constants, k: int, kind: int, t: float, y: Array) -> tuple[float, float, float]:
    """Return gap, rate and slip that a margin of contact `k` is about: its own, or the resultant's point's.

    Under the law foundation the latter for PULL and SLIP.
    """
    gap, rate, slip = contact_state(c, k, t, y)
    if of_side(c, k) and kind in (PULL, SLIP):
        other_gap, other_rate, other_slip = contact_state(c, other_corner(k), t, y)
        _, share = resultant(c, -gap, -other_gap)
        rest = 1.0 - share
        return gap, share * rate + rest * other_rate, share * slip + rest * other_slip
    return gap, rate, slip


@inlined
def smooth_gap(c: Constants, k: int, gap: float) -> float:
    """Return the gap (m) as a smooth function of the state."""
    return gap * (1.0 - 0.5 * gap / c.pin_clearance) if k == JOURNAL else gap


@inlined
def smooth_rate(c: Constants, k: int, gap: float, rate: float) -> float:
    """Return the rate (m/s) of the smooth gap."""
    return rate * (1.0 - gap / c.pin_clearance) if k == JOURNAL else rate


@inlined
def margin_of(c: Constants, modes: Array, k: int, number: int) -> tuple[int, float, float]:
    """Return kind, sign and bound of a margin (`margin_value`); kind NONE: there is none.

    Parameters
    ----------
    c, modes
        Constants; modes, shape (MODES, CONTACTS).
    k, number
        Contact, and which of its MARGINS.
    """
    if number == 0:
        # The second corner of a side changes no force at its zero, and of a side that fades away at rest both
        # depths are rounding: without some room it would go in and out for ever.
        second = of_side(c, k) and modes[INSIDE, other_corner(k)] > 0.0
        return GAP, -1.0 if modes[INSIDE, k] > 0.0 else 1.0, -SECOND_CORNER if second else 0.0
    if modes[MEMORY, k] == 0.0 or (number == 1 and (c.C == 0.0 or without_memory(c))):
        return NONE, 0.0, 0.0
    if number == 1:
        return PULL, -1.0 if modes[CLIPPED, k] > 0.0 else 1.0, 0.0
    lower, upper = regime_bounds(c, int(modes[REGIME, k]))
    sign, bound = (1.0, lower) if number == 2 else (-1.0, upper)
    return NONE if math.isinf(bound) else SLIP, sign, bound


@inlined
def margin_value(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float,
    gap: float, rate: float, slip: float,
) -> float:  # fmt: skip
    """Return a margin (m or m/s) from what `margin_state` returns of it."""
    if kind == GAP:
        return sign * smooth_gap(c, k, gap) - bound
    if kind == PULL:  # 1 + C depth_rate / impact_speed, times the impact speed
        return sign * (float(modes[MEMORY, k]) - c.C * rate)
    if kind == RATE:
        return sign * rate
    return sign * (slip - bound)


@inlined
def margin_at(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float, contacts: Array
) -> float:
    """Return a margin (m or m/s) from the states of the contacts, shape (5, CONTACTS)."""
    rate = contacts[RATE, k]
    if kind == PULL and of_side(c, k):
        _, rate, _ = side_motion(c, contacts, k)
    return margin_value(c, modes, k, kind, sign, bound, contacts[GAP, k], rate, contacts[SLIP, k])
