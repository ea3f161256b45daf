"""Margins: what stays positive while the mode of a contact lasts, and a cheap proof that it does.

======  ==========================  ==========================================  =======
number  margin                      lasts while                                 unit
======  ==========================  ==========================================  =======
GATE    +gap (open), -gap (closed)  open, or in contact                         m
PULL    +-`laws.push`               the damped force pushes, or is clipped      m/s
LOWER   slip - lower                the friction stays in its regime            m/s
UPPER   upper - slip                the friction stays in its regime            m/s
======  ==========================  ==========================================  =======

Where a side is one contact every corner has a gap to go in or out by; the corner that keeps the contact has
the other margins, with gap' and slip of the resultant's point. The journal's gap c - |e| has a kink where the
pin is centred; in its place stands (c^2 - e^2) / 2 c, which has the same zero, slope and sign and is smooth.

Most steps are settled by their stages, without dense output (`unsettled`). A gap is compared with the cubic
Hermite polynomial of both ends, a rate or slip with the straight line. What the interior stages deviate from
it, over the shape 16 x^2 (1 - x)^2 or 4 x (1 - x) of such an interpolant's error, estimates that error; twice
the largest is taken off, and the Bernstein coefficients of what is left must be positive. Where the stages
are less accurate than the step's end, more steps than necessary are looked at closely.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import inlined, inner
from reference_model.contact import (
    CLIPPED,
    CONTACTS,
    GAP,
    INSIDE,
    JOURNAL,
    MEMORY,
    RATE,
    REGIME,
    SLIP,
    is_of_side,
    other_corner,
    side_motion,
    stiffness,
)
from reference_model.dop853 import END
from reference_model.friction import regime_bounds
from reference_model.laws import SHALLOWEST, is_lossless, push
from reference_model.linkage import Array
from reference_model.parameters import ADAMS_IMPACT, Law
from reference_model.tableau import SHARES

GATE, PULL, LOWER, UPPER = range(4)
MARGINS = 4
"""Of a contact."""
NONE = -1
"""In place of a margin's place, MARGINS contact + number."""

LOCATED = 2.0e-12
"""m; a touch is located where the gap is no more negative: a fifth of what no corner may be in its wall."""
LOCATED_SPEED = 1.0e-10
"""m/s; what friction regimes and pulls are located to. There the force has kinks but no jumps."""
SECOND_CORNER = 1.0e-12
"""m, by which the second corner of a side is past zero where it goes in or out: less than LOCATED."""

_FIRST, _LAST = 4, 10
"""The interior stages whose states are accurate to the fourth order or better."""
_SAFETY = 2.0
_X = SHARES[_FIRST : _LAST + 1]
_HERMITE = np.stack(
    [(1.0 + 2.0 * _X) * (1.0 - _X) ** 2, _X * (1.0 - _X) ** 2, _X**2 * (3.0 - 2.0 * _X), _X**2 * (_X - 1.0)]
)
_CUBIC_WEIGHT = 1.0 / (16.0 * (_X * (1.0 - _X)) ** 2)
_LINEAR_WEIGHT = 1.0 / (4.0 * _X * (1.0 - _X))


@inlined
def smooth_gap(law: Law, k: int, gap: float) -> float:
    """Return the gap (m) as a smooth function of the state."""
    return gap * (1.0 - 0.5 * gap / law.pin_clearance) if k == JOURNAL else gap


@inlined
def smooth_rate(law: Law, k: int, gap: float, rate: float) -> float:
    """Return the rate (m/s) of the smooth gap."""
    return rate * (1.0 - gap / law.pin_clearance) if k == JOURNAL else rate


@inner
def margin(law: Law, modes: Array, k: int, number: int, contacts: Array, scale: float) -> float:
    """Return a margin of contact `k`, m or m/s; infinite where the contact does not have it in its mode.

    Parameters
    ----------
    law, modes
        The contacts and their modes, shape (MODES,).
    k, number
        Contact, and which of its MARGINS.
    contacts
        States of the contacts, shape (STATES,).
    scale
        Of `pull_scale`: by which the pull is multiplied.
    """
    if number == GATE:
        gap: float = smooth_gap(law, k, contacts[GAP + k])
        if modes[INSIDE + k] > 0.0:
            gap = -gap
        # The second corner of a side changes no force at its zero, and of a side that fades away at rest both
        # depths are rounding: without some room it would go in and out for ever.
        return gap + SECOND_CORNER if is_of_side(law, k) and modes[INSIDE + other_corner(k)] > 0.0 else gap
    if modes[MEMORY + k] == 0.0:
        return math.inf
    rate: float = contacts[RATE + k]
    slip: float = contacts[SLIP + k]
    if is_of_side(law, k):
        _, rate, slip = side_motion(law, contacts, k)
    if number == PULL:
        if is_lossless(law):
            return math.inf
        pull: float = push(law, stiffness(law, k), -contacts[GAP + k], -rate, modes[MEMORY + k]) * scale
        return -pull if modes[CLIPPED + k] > 0.0 else pull
    lower, upper = regime_bounds(law, modes[REGIME + k])
    return slip - lower if number == LOWER else upper - slip


@inner
def pull_scale(law: Law, contacts: Array, k: int) -> float:
    """Return a factor that makes the pull in a step round no more than other margins.

    A change of depth moves the resultant's point by up to a third of that over |d1| + |d2|, as a share of the
    side; so the rounding of depths, 1e-16 m, moves the pull's margin by more than what counts as zero where
    the side is hardly inside. The push of adams-impact follows the depth itself, at a rate that grows with
    that of the depth.

    Parameters
    ----------
    law, k
        The contacts, and which of them.
    contacts
        Their states at the nodes of the step.
    """
    start = contacts[0]
    if law.law == ADAMS_IMPACT:
        if is_lossless(law):
            return 1.0
        K, rate = stiffness(law, k), max(abs(start[RATE + k]), abs(contacts[END, RATE + k]))
        depth = max(-start[GAP + k], SHALLOWEST)
        step = 1e-3 * depth
        change = abs(push(law, K, depth + step, rate, 0.0) - push(law, K, depth, rate, 0.0))
        factor: float = step / (step + change)
        return factor
    if not is_of_side(law, k):
        return 1.0
    m = other_corner(k)
    extent: float = abs(start[GAP + k]) + abs(start[GAP + m]) + SECOND_CORNER
    turning: float = abs(start[RATE + k] - start[RATE + m])
    return extent / (extent + law.C * turning)


@inlined
def located_to(law: Law, number: int) -> float:
    """Return what a margin is located to, m/s or m; the push of adams-impact, as scaled, like a gap."""
    return LOCATED if number == GATE or (number == PULL and law.law == ADAMS_IMPACT) else LOCATED_SPEED


@inlined
def gap_is_settled(law: Law, modes: Array, k: int, h: float, contacts: Array) -> bool:
    """Return whether the gap of contact `k` certainly keeps its sign within a step of `h` (s)."""
    sign = -1.0 if modes[INSIDE + k] > 0.0 else 1.0
    gap0, gap1 = contacts[0, GAP + k], contacts[END, GAP + k]
    p0, p1 = sign * smooth_gap(law, k, gap0), sign * smooth_gap(law, k, gap1)
    d0 = sign * h * smooth_rate(law, k, gap0, contacts[0, RATE + k])
    d1 = sign * h * smooth_rate(law, k, gap1, contacts[END, RATE + k])
    # The quartic's Bernstein coefficients but for the middle one, which the error lowers.
    if p0 < -LOCATED or p1 < -LOCATED or p0 + 0.25 * d0 <= 0.0 or p1 - 0.25 * d1 <= 0.0:
        return False
    error = 0.0
    for i in range(_X.size):
        cubic = _HERMITE[0, i] * p0 + _HERMITE[1, i] * d0 + _HERMITE[2, i] * p1 + _HERMITE[3, i] * d1
        away = abs(sign * smooth_gap(law, k, contacts[_FIRST + i, GAP + k]) - cubic) * _CUBIC_WEIGHT[i]
        error = max(error, away)
    return 0.5 * (p0 + p1) + (d0 - d1) / 6.0 > _SAFETY * error * 16.0 / 6.0


@inlined
def speed_is_settled(law: Law, modes: Array, k: int, number: int, scale: float, contacts: Array) -> bool:
    """Return whether one of the other margins certainly stays positive within a step."""
    p0 = margin(law, modes, k, number, contacts[0], scale)
    if p0 == math.inf:
        return True
    p1 = margin(law, modes, k, number, contacts[END], scale)
    located = located_to(law, number)
    if p0 < -located or p1 < -located:
        return False
    error = 0.0
    for i in range(_X.size):
        p = margin(law, modes, k, number, contacts[_FIRST + i], scale)
        error = max(error, abs(p - (1.0 - _X[i]) * p0 - _X[i] * p1) * _LINEAR_WEIGHT[i])
    return 0.5 * (p0 + p1) > _SAFETY * error * 2.0


@inlined
def unsettled(
    law: Law, modes: Array, h: float, contacts: Array, scales: Array, open_: NDArray[np.bool_]
) -> bool:
    """Return whether it is not certain that all modes last throughout a step of `h` (s).

    Parameters
    ----------
    law, modes, h, contacts
        Contacts, their modes, step, the contacts' states at its nodes.
    scales
        Written, shape (CONTACTS,): `pull_scale` of each contact.
    open_
        Written, shape (CONTACTS MARGINS,): which margins are not settled.
    """
    any_open = False
    for k in range(CONTACTS):
        for number in range(MARGINS):
            open_[MARGINS * k + number] = False
        if contacts[0, GAP + k] == np.inf:  # a contact that the formulation does not have
            continue
        if not gap_is_settled(law, modes, k, h, contacts):
            open_[MARGINS * k] = any_open = True
        if modes[MEMORY + k] > 0.0:
            scales[k] = pull_scale(law, contacts, k)
            for number in range(PULL, MARGINS):
                if not speed_is_settled(law, modes, k, number, scales[k], contacts):
                    open_[MARGINS * k + number] = any_open = True
    return any_open


@inner
def has_ended(law: Law, modes: Array, place: int, scales: Array, contacts: Array) -> bool:
    """Return whether the margin at a `place` is down to what it is located to."""
    k, number = place // MARGINS, place % MARGINS
    left = margin(law, modes, k, number, contacts, scales[k])
    return left <= located_to(law, number)
