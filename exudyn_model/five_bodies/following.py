"""What an accepted state of five bodies does to a contact: its memory, and the length of the next step.

Memory: this is the only place where an impact speed is frozen or cleared. It depends on accepted states alone
(the last one is what the memory still holds), never on trial states of the Newton iteration.

Foresight, which ``step_choice`` asks for: zeros of gaps and kinks of friction (Eq. 13) from the latest rates;
ticks that resolve the oscillation of a normal force; touches and separations in a step, by the gaps' cubic
Hermite interpolants.

Arguments are those of ``contact_forces``; ``last``, shape (4, 7) or (7,), is what foresight keeps of a state.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    ACROSS_X,
    ACROSS_Y,
    CLOSED,
    DAMPING_POWER,
    END,
    EXPONENT,
    FRICTION,
    FRICTION_POWER,
    GAP,
    IMPACT_SPEED,
    LAW,
    MASS,
    NAME,
    NORMAL,
    RATE,
    SHARED,
    SIDE_STIFFNESS,
    SLIP,
    START,
    STATIC_SPEED,
    STORED,
    TRANSITION_SPEED,
)
from exudyn_model.corners import CORNER_COUNT, UPPER, corner_motion, side_load
from exudyn_model.five_bodies.contact_forces import (
    ANGLE,
    LENGTH,
    TICK,
    X,
    Y,
    crossing,
    in_guide,
    journal_in_bearing,
    journal_loads,
    side_change,
    touch,
    triple,
)
from exudyn_model.journal import journal_forces
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import FOUNDATION, CornerMotion, side_forces

Array = NDArray[np.float64]

# Part of the time to a foreseen zero that a step may cover
PART = 0.5
# The oscillation of a normal force, relative to its mean, at which steps in a contact begin to grow
RIPPLE = 1.0
# Decay of the observed second derivative of a normal force, over the phase of its oscillation (rad): that
# passes through zero twice a period
_DECAY = 0.25
_NEVER = 2.0

# Of each contact in the last state: rate of its gap, slip, normal force and its rate, second derivative of
# the normal force, its largest one (decaying), and the length of the step that led there
(_RATE, _SLIP, _NORMAL, _NORMAL_RATE, _CHANGE, _LARGEST_CHANGE, _STEP) = range(7)
BEFORE_COLUMNS = 7


@kernel
def update_alone(
    time: float, step: float, row: int, gap: float, rate: float, contact: Array, law: Array
) -> None:
    """Begin the contact of a point that closes in the step to ``time`` (s), end one that opens."""
    if (contact[IMPACT_SPEED] > 0.0) == (gap < 0.0):
        return
    at, speed = touch(contact, gap, rate, step, law)
    now = time - (1.0 - at) * step
    if gap < 0.0:
        contact[IMPACT_SPEED], contact[START], contact[NAME] = speed, now, row
    else:
        contact[IMPACT_SPEED], contact[END] = 0.0, now


@kernel
def update_shared(
    time: float,
    step: float,
    row: int,
    lower: CornerMotion,
    upper: CornerMotion,
    low: Array,
    up: Array,
    law: Array,
) -> None:
    """Begin or end the contact of a side that remembers; ``row`` is that of its lower corner."""
    is_open = lower.gap >= 0.0 and upper.gap >= 0.0
    if (low[IMPACT_SPEED] > 0.0) != is_open:
        return
    end, at, speed = side_change(low, up, lower, upper, step, law)
    now = time - (1.0 - at) * step
    if is_open:
        low[IMPACT_SPEED], low[END] = 0.0, now
    else:
        low[IMPACT_SPEED], low[START], low[NAME] = speed, now, row + UPPER * end


@kernel
def remember(contact: Array, gap: float, rate: float, slip: float, normal: float, friction: float) -> None:
    """Keep the state of a contact for the next step."""
    contact[GAP], contact[RATE], contact[SLIP] = gap, rate, slip
    contact[NORMAL], contact[FRICTION] = normal, friction
    contact[CLOSED] = 1.0 if gap < 0.0 else 0.0


@kernel
def update_side(
    time: float,
    step: float,
    first: int,
    side: int,
    lower: CornerMotion,
    upper: CornerMotion,
    law: Array,
    contacts: Array,
    load: Array,
) -> None:
    """Update the memory of a side with the accepted state at ``time`` (s), and add its ``load``.

    ``first`` is the row of the slider's first corner among all contacts, ``side`` that of the side's lower
    corner among its four.
    """
    low, up, row = contacts[side], contacts[side + UPPER], first + side
    # Before the forces: what has left has none
    if time > 0.0 and law[SHARED] > 0.0:
        update_shared(time, step, row, lower, upper, low, up, law)
    elif time > 0.0:
        update_alone(time, step, row, lower.gap, lower.rate, low, law)
        update_alone(time, step, row + UPPER, upper.gap, upper.rate, up, law)
    forces = side_forces(lower, upper, low[IMPACT_SPEED], up[IMPACT_SPEED], law)
    whole = not np.isnan(forces.slip)
    lower_slip, upper_slip = (forces.slip, forces.slip) if whole else (lower.slip, upper.slip)
    remember(low, lower.gap, lower.rate, lower_slip, forces.lower, forces.lower_friction)
    remember(up, upper.gap, upper.rate, upper_slip, forces.upper, forces.upper_friction)
    low[STORED], low[DAMPING_POWER], low[FRICTION_POWER] = forces.stored, forces.damping, forces.friction
    fx, fy, moment = side_load(side, forces, lower, upper)
    load[X] += fx
    load[Y] += fy
    load[ANGLE] += moment


@entry
def follow_slider(
    time: float,
    step: Array,
    q: Array,
    v: Array,
    longest: float,
    first: int,
    law: Array,
    contacts: Array,
    last: Array,
    load: Array,
) -> float:
    """Take an accepted state of a slider in its guide; return how many ticks the next step may take.

    At most ``longest`` ticks. The memory of its corners, of which ``first`` is the row of the first one among
    all contacts, and ``last`` are moved on; ``load`` is filled with fx, fy (N) and moment (N m).
    """
    cx, cy, motion = law[ACROSS_X], law[ACROSS_Y], in_guide(q, v, law)
    load[X], load[Y], load[ANGLE] = 0.0, 0.0, 0.0
    for side in range(2):
        lower, upper = corner_motion(side, *motion, law), corner_motion(side + UPPER, *motion, law)
        update_side(time, step[LENGTH], first, side, lower, upper, law, contacts, load)
    load[X], load[Y] = cx * load[X] - cy * load[Y], cy * load[X] + cx * load[Y]
    for number in range(CORNER_COUNT):
        longest = min(longest, allowed_ticks(time, step, contacts[number], last[number], law))
    return longest


@kernel
def allowed_ticks(time: float, step_taken: Array, contact: Array, last: Array, law: Array) -> float:
    """Return how many ticks a contact lets the next step take after one that ends at ``time`` (s).

    A part of the time to a zero of its gap, foreseen from gap, rate and acceleration, and to a kink of its
    friction (Eq. 13). Inside a contact also what resolves the oscillation of the normal force: one by
    ``RIPPLE`` times N has N'' = ripple omega^2 N, with the frequency omega of the mass on the contact; the
    error of a step is that of N'' times the square of its length.
    """
    acceleration, slip_rate, closed = 0.0, 0.0, contact[CLOSED] > 0.0
    step: float = step_taken[LENGTH]
    tick: float = step_taken[TICK]
    if time > 0.0:
        acceleration, slip_rate = (contact[RATE] - last[_RATE]) / step, (contact[SLIP] - last[_SLIP]) / step
        normal_rate = (contact[NORMAL] - last[_NORMAL]) / step
        if last[_STEP] > 0.0:
            last[_CHANGE] = 2.0 * abs(normal_rate - last[_NORMAL_RATE]) / (step + last[_STEP])
        last[_NORMAL_RATE], last[_STEP] = normal_rate, step
    last[_RATE], last[_SLIP], last[_NORMAL] = contact[RATE], contact[SLIP], contact[NORMAL]
    sign = -1.0 if closed else 1.0
    distance, rate, towards = abs(contact[GAP]), sign * contact[RATE], min(sign * acceleration, 0.0)
    root, span, ticks = np.sqrt(rate * rate - 2.0 * towards * distance), np.inf, np.inf
    if rate < 0.0:
        span = 2.0 * distance / (root - rate)
    elif towards < 0.0:
        span = -(root + rate) / towards
    if not closed:
        last[_LARGEST_CHANGE] = 0.0
        return PART * span / tick
    speed, change = abs(contact[SLIP]), slip_rate if contact[SLIP] >= 0.0 else -slip_rate
    for kink in (0.0, law[STATIC_SPEED], law[TRANSITION_SPEED]):
        if (kink - speed) * change > 0.0:
            span = min(span, (kink - speed) / change)
    normal = contact[NORMAL]
    if normal <= 0.0:
        return 1.0
    squared_frequency = law[EXPONENT] * normal / (distance * law[MASS])
    if law[LAW] == FOUNDATION:  # that of a whole side inside: the stiffest
        squared_frequency = law[SIDE_STIFFNESS] / law[MASS]
    decay = np.exp(-_DECAY * np.sqrt(squared_frequency) * last[_STEP])
    last[_LARGEST_CHANGE] = max(last[_CHANGE], decay * last[_LARGEST_CHANGE])
    if last[_LARGEST_CHANGE] > 0.0:
        ticks = np.sqrt(RIPPLE * squared_frequency * normal / last[_LARGEST_CHANGE])
    return min(ticks, PART * span / tick)


@kernel
def zero_within(contact: Array, gap: float, rate: float, step: float) -> float:
    """Return the fraction of a step at which a contact's gap first changes its sign, or more than 1.

    By the cubic Hermite interpolant between its memory, at the start, and gap (m) and rate at the end.
    """
    sign = -1.0 if contact[CLOSED] > 0.0 else 1.0
    distance0, distance1 = sign * contact[GAP], sign * gap
    rate0, rate1 = sign * contact[RATE], sign * rate
    if distance1 <= 0.0:
        return crossing(distance0, rate0, distance1, rate1, step) if distance0 > 0.0 else 0.0
    if rate0 >= 0.0 or rate1 <= 0.0:
        return _NEVER
    # Its least value, where the slope, slope0 + 2 b f + a f^2, vanishes
    slope0, slope1, rise = step * rate0, step * rate1, distance1 - distance0
    a, b = 3.0 * (slope0 + slope1 - 2.0 * rise), 3.0 * rise - 2.0 * slope0 - slope1
    fraction = -slope0 / (b + np.sqrt(b * b - a * slope0))
    least = distance0 + fraction * (slope0 + fraction * (b + fraction * a / 3.0))
    return fraction if least <= 0.0 else _NEVER


@entry
def slider_change(q: Array, v: Array, step: Array, law: Array, contacts: Array) -> float:
    """Return the fraction of a step after which a corner's contact begins or ends; more than 1: none does.

    ``q`` and ``v`` are those at the step's end, ``contacts`` is the memory at its start.
    """
    motion, earliest = in_guide(q, v, law), _NEVER
    for number in range(CORNER_COUNT):
        corner = corner_motion(number, *motion, law)
        earliest = min(earliest, zero_within(contacts[number], corner.gap, corner.rate, step[LENGTH]))
    return earliest


@entry
def follow_journal(
    time: float,
    step: Array,
    q: Array,
    v: Array,
    longest: float,
    row: int,
    ends: Array,
    law: Array,
    contact: Array,
    last: Array,
    load: Array,
) -> float:
    """Take an accepted state of a journal in its bearing: as :func:`follow_slider`.

    ``load`` is on the journal's body, then on the bearing's.
    """
    q1, q2, v1, v2 = triple(q, ends[0]), triple(q, ends[3]), triple(v, ends[0]), triple(v, ends[3])
    motion = journal_in_bearing(q1, v1, q2, v2, ends, law)
    if time > 0.0:
        update_alone(time, step[LENGTH], row, motion.gap, motion.rate, contact, law)
    normal, elastic, friction = journal_forces(motion, contact[IMPACT_SPEED], law)
    remember(contact, motion.gap, motion.rate, motion.slip, normal, friction)
    contact[STORED] = elastic * max(-motion.gap, 0.0) / (law[EXPONENT] + 1.0)
    contact[DAMPING_POWER] = -(normal - elastic) * motion.rate
    contact[FRICTION_POWER] = -friction * motion.slip
    gx, gy, moment1, moment2 = journal_loads(normal, friction, motion, q1, q2, ends, law)
    load[0], load[1], load[2] = -gx, -gy, moment1
    load[3], load[4], load[5] = gx, gy, moment2
    ticks = allowed_ticks(time, step, contact, last, law)
    # Its friction reverses within a step: see `contact_forces`
    return 1.0 if contact[CLOSED] > 0.0 else min(longest, ticks)


@entry
def journal_change(q: Array, v: Array, step: Array, ends: Array, law: Array, contact: Array) -> float:
    """Return the fraction of a step after which the contact begins or ends: as :func:`slider_change`."""
    q1, q2, v1, v2 = triple(q, ends[0]), triple(q, ends[3]), triple(v, ends[0]), triple(v, ends[3])
    motion = journal_in_bearing(q1, v1, q2, v2, ends, law)
    return zero_within(contact, motion.gap, motion.rate, step[LENGTH])
