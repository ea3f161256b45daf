"""Margins: functions that stay positive while the mode of a contact lasts, and a cheap proof that they do.

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
Hermite polynomial of both ends, a rate or slip with the straight line. The deviation of the interior stages
from it, over the shape 16 x^2 (1 - x)^2 or 4 x (1 - x) of such an interpolant's error, estimates that error;
twice the largest is subtracted, and the Bernstein coefficients of the rest must be positive. Where the stages
are less accurate than the step's end, more steps than necessary are looked at closely.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import inlined, inner
from reference_model.contact import side_motion
from reference_model.dop853 import END, SHARES
from reference_model.laws import SHALLOWEST, push, regime_bounds
from reference_model.linkage import Array
from reference_model.parameters import ADAMS_IMPACT, Contact
from reference_model.state import Mode, Records, Touch

GATE, PULL, LOWER, UPPER = range(4)
MARGINS = 4
"""Number of margins of a contact."""
NONE = -1
"""No margin, instead of the place MARGINS contact + number of one."""

LOCATED = 2.0e-12
"""Largest depth at which a touch is located, m: a fifth of the bound of the invariant open-depth."""
LOCATED_SPEED = 1.0e-10
"""Accuracy of located friction regimes and pulls, m/s. There the force has kinks but no jumps."""
SECOND_CORNER = 1.0e-12
"""Gap beyond zero at which the second corner of a side goes in or out, m: less than LOCATED."""

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
def smooth_gap(contact: Contact, mode: Mode, touch: Touch) -> float:
    """Return the gap (m) as a smooth function of the state, with the sign that it keeps in its mode."""
    gap = touch.gap * (1.0 - 0.5 * touch.gap / contact.clearance)
    return -gap if mode.inside else gap


@inner
def margin(contacts: Records, modes: Records, touches: Records, k: int, number: int, scale: float) -> float:
    """Return a margin of contact `k`, m or m/s, the pull times `scale` (`pull_scale`).

    It is infinite if the contact does not have that margin in its mode.
    """
    contact, mode, touch = contacts[k], modes[k], touches[k]
    if number == GATE:
        gap = smooth_gap(contact, mode, touch)
        # The second corner of a side changes no force at its zero. In a side that comes to rest both depths
        # are rounding: without some room the corner would go in and out for ever.
        return gap + SECOND_CORNER if contact.one_side and modes[contact.other].inside else gap
    if mode.speed == 0.0:
        return math.inf
    rate: float = touch.rate
    slip: float = touch.slip
    if contact.one_side:
        _, rate, slip = side_motion(contact, touch, touches[contact.other])
    if number == PULL:
        if contact.lossless:
            return math.inf
        pull = push(contact, -touch.gap, -rate, mode.speed) * scale
        return -pull if mode.clipped else pull
    lower, upper = regime_bounds(contact, mode.regime)
    return slip - lower if number == LOWER else upper - slip


@inner
def pull_scale(contacts: Records, touches: Records, k: int) -> float:
    """Return a factor by which the pull in a step has no more rounding than other margins.

    A change of depth moves the resultant's point by up to a third of that over |d1| + |d2|, as a share of the
    side; so the rounding of depths, 1e-16 m, moves the pull's margin by more than what counts as zero where
    the side is hardly inside. The push of adams-impact follows the depth itself, at a rate that grows with
    that of the depth. `touches` are the contacts' states at the nodes of the step.
    """
    contact, touch = contacts[k], touches[0, k]
    if contact.law == ADAMS_IMPACT:
        if contact.lossless:
            return 1.0
        rate, depth = max(abs(touch.rate), abs(touches[END, k].rate)), max(-touch.gap, SHALLOWEST)
        step = 1e-3 * depth
        change = abs(push(contact, depth + step, rate, 0.0) - push(contact, depth, rate, 0.0))
        return float(step / (step + change))
    if not contact.one_side:
        return 1.0
    other = touches[0, contact.other]
    extent = abs(touch.gap) + abs(other.gap) + SECOND_CORNER
    return float(extent / (extent + contact.C * abs(touch.rate - other.rate)))


@inlined
def located_to(contact: Contact, number: int) -> float:
    """Return the accuracy of a located margin, m/s or m; adams-impact's scaled push has that of a gap."""
    like_a_gap = number == GATE or (number == PULL and contact.law == ADAMS_IMPACT)
    return LOCATED if like_a_gap else LOCATED_SPEED


@inlined
def gap_is_settled(contact: Contact, mode: Mode, k: int, h: float, touches: Records) -> bool:
    """Return whether the gap of contact `k` certainly keeps its sign within a step of `h` (s)."""
    first, last = touches[0, k], touches[END, k]
    p0, p1 = smooth_gap(contact, mode, first), smooth_gap(contact, mode, last)
    signed_h = -h if mode.inside else h
    d0 = signed_h * (first.rate * (1.0 - first.gap / contact.clearance))
    d1 = signed_h * (last.rate * (1.0 - last.gap / contact.clearance))
    # Bernstein coefficients of the quartic except the middle one, which the error lowers.
    if p0 < -LOCATED or p1 < -LOCATED or p0 + 0.25 * d0 <= 0.0 or p1 - 0.25 * d1 <= 0.0:
        return False
    error = 0.0
    for i in range(_X.size):
        cubic = _HERMITE[0, i] * p0 + _HERMITE[1, i] * d0 + _HERMITE[2, i] * p1 + _HERMITE[3, i] * d1
        deviation = abs(smooth_gap(contact, mode, touches[_FIRST + i, k]) - cubic) * _CUBIC_WEIGHT[i]
        error = max(error, deviation)
    return bool(0.5 * (p0 + p1) + (d0 - d1) / 6.0 > _SAFETY * error * 16.0 / 6.0)


@inlined
def speed_is_settled(
    contacts: Records, modes: Records, touches: Records, k: int, number: int, scale: float
) -> bool:
    """Return whether one of the other margins certainly stays positive within a step."""
    p0 = margin(contacts, modes, touches[0], k, number, scale)
    if p0 == math.inf:
        return True
    p1 = margin(contacts, modes, touches[END], k, number, scale)
    accuracy = located_to(contacts[k], number)
    if p0 < -accuracy or p1 < -accuracy:
        return False
    error = 0.0
    for i in range(_X.size):
        p = margin(contacts, modes, touches[_FIRST + i], k, number, scale)
        error = max(error, abs(p - (1.0 - _X[i]) * p0 - _X[i] * p1) * _LINEAR_WEIGHT[i])
    return 0.5 * (p0 + p1) > _SAFETY * error * 2.0


@inlined
def unsettled(
    contacts: Records, modes: Records, touches: Records, h: float, scales: Array, flags: NDArray[np.bool_]
) -> bool:
    """Return whether a mode may end within a step of `h` (s).

    `touches` are the states of the contacts at its nodes. Write `scales`, the `pull_scale` of each contact,
    and `flags`, shape (contacts MARGINS,): true for each margin that is not settled.
    """
    any_unsettled = False
    for k in range(contacts.size):
        contact, mode = contacts[k], modes[k]
        flags[MARGINS * k] = not gap_is_settled(contact, mode, k, h, touches)
        any_unsettled = any_unsettled or flags[MARGINS * k]
        touching = mode.speed > 0.0
        if touching:
            scales[k] = pull_scale(contacts, touches, k)
        for number in range(PULL, MARGINS):
            flags[MARGINS * k + number] = touching and not speed_is_settled(
                contacts, modes, touches, k, number, scales[k]
            )
            any_unsettled = any_unsettled or flags[MARGINS * k + number]
    return any_unsettled


@inner
def has_ended(contacts: Records, modes: Records, touches: Records, place: int, scales: Array) -> bool:
    """Return whether the margin at a `place` has fallen to the accuracy of its location."""
    k, number = place // MARGINS, place % MARGINS
    return margin(contacts, modes, touches, k, number, scales[k]) <= located_to(contacts[k], number)
