"""Contact forces of five bodies as user functions of Exudyn, in trial states of a step's end.

Exudyn advances the bodies in implicit steps and calls a force at trial states of the step's end. In the
shortest step (``step_choice``), inside of which alone a contact may begin or end:

- What was in contact at the step's start keeps its frozen speed.
- What was open and is closed in the trial state gets the speed at the instant of touch between the two, by
  :func:`touch`. The memory's next update (``following``) applies the same function to the accepted
  state, so the speed that is frozen is the one that the step itself was solved with: no jump, and second
  order is kept.

In a longer step what was open at its start stays without force.

Arguments of the kernels have the same names throughout: ``step``, shape (2,), the step in progress; ``law``;
``contacts``, shape (4, columns), or ``contact``, the memory at the step's start (``low`` and ``up``: of the
corners of a side); ``q``, ``v``: coordinates and rates (m, rad, s) of all bodies, or of a slider; ``ends``:
see ``parts.JournalPart``.

The journal's forces are of some kN and rod 2 is light: across the contact, friction changes its speed in a
step of 1e-6 s by several times the speed over which Eq. 13 rises. Newton's method then goes from full
friction of one direction to that of the other and back indefinitely. So the iteration keeps to one straight
piece of Eq. 13; where it converges outside of it, :func:`settle` goes to the next piece, and the iteration is
taken up again. A step is accepted where piece and slip fit: the force is that of Eqs. 12-13.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    ACROSS_X,
    ACROSS_Y,
    BEARING_RADIUS,
    CLOSED,
    DIRECTION,
    GAP,
    IMPACT_SPEED,
    RATE,
    REGIME,
    SHARED,
    SPEED_FLOOR,
)
from exudyn_model.corners import UPPER, corner_motion, side_load
from exudyn_model.journal import JournalMotion, bearing_load, journal_forces, journal_motion
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import CornerMotion, friction_in_regime, side_forces, slip_regime
from exudyn_model.memory import ROUNDED

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

# Among the coordinates of one body: of its centre (m), and its angle (rad)
X, Y, ANGLE = range(3)
PER_BODY = 3
FRAME = -1
# Of the step in progress: its length and that of a tick, s. In a longer step than that what is open at its
# start stays without force
LENGTH, TICK = range(2)


@kernel
def crossing(gap0: float, rate0: float, gap1: float, rate1: float, step: float) -> float:
    """Return the fraction of a step at which the gap changes its sign: root of its cubic Hermite interpolant.

    Newton's method, safeguarded by bisection; gap0 and gap1 must differ in sign.
    """
    slope0, slope1 = step * rate0, step * rate1
    quadratic = 3.0 * (gap1 - gap0) - 2.0 * slope0 - slope1
    cubic = 2.0 * (gap0 - gap1) + slope0 + slope1
    low, high = 0.0, 1.0
    fraction = gap0 / (gap0 - gap1)
    for _ in range(60):
        value = gap0 + fraction * (slope0 + fraction * (quadratic + fraction * cubic))
        if (value > 0.0) == (gap0 > 0.0):
            low = fraction
        else:
            high = fraction
        slope = slope0 + fraction * (2.0 * quadratic + 3.0 * fraction * cubic)
        change = -value / slope if slope != 0.0 else 2.0
        if not low <= fraction + change <= high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14:
            break
    return fraction


@kernel
def touch(contact: Array, gap: float, rate: float, step: float, law: Array) -> tuple[float, float]:
    """Return the fraction of a step at which an open contact closes, and its impact speed (m/s, floored).

    The speed is interpolated linearly between the ends of the step. The derivative of the Hermite
    interpolant would be of a higher order, but magnifies the Newton iteration's error in the positions by
    1/step. ``contact`` is its memory at the start, ``gap`` and ``rate`` are those at the end.
    """
    fraction = crossing(contact[GAP], contact[RATE], gap, rate, step)
    speed = -(contact[RATE] + fraction * (rate - contact[RATE]))
    return fraction, max(speed, law[SPEED_FLOOR])


@kernel
def side_change(
    low: Array, up: Array, lower: CornerMotion, upper: CornerMotion, step: float, law: Array
) -> tuple[int, float, float]:
    """Return which end of a side touches first in a step or, of one in contact, leaves last; when; how fast.

    Of an open side at least one corner is inside the wall at the step's end, of one in contact none. Of two
    that touch at once, within the rounding of gaps, it is the lower one with the faster's speed.

    Returns
    -------
    end : int
        0: the lower one; 1: the upper one.
    fraction, speed : float
        Of the step; impact speed, m/s.
    """
    first, first_at, first_speed, leaves = 0, 0.0, 0.0, low[IMPACT_SPEED] > 0.0
    for end in range(2):
        corner, contact = (lower, low) if end == 0 else (upper, up)
        if (corner.gap < 0.0) == (contact[CLOSED] > 0.0):
            continue
        at, speed = touch(contact, corner.gap, corner.rate, step, law)
        lead = (first_at - at) * step
        if first_speed == 0.0 or (at > first_at if leaves else lead * speed > ROUNDED):
            first, first_at, first_speed = end, at, speed
        elif -lead * first_speed <= ROUNDED:
            first_speed = max(first_speed, speed)
    return first, first_at, first_speed


@kernel
def speed_in_step(contact: Array, gap: float, rate: float, step: Array, law: Array) -> float:
    """Return the impact speed (m/s) of a contact in a trial state of a step; 0 where it is open."""
    if gap >= 0.0:
        return 0.0
    frozen: float = contact[IMPACT_SPEED]
    if frozen > 0.0 or step[LENGTH] > step[TICK]:
        return frozen
    return touch(contact, gap, rate, step[LENGTH], law)[1]


@kernel
def in_guide(q: Array | Triple, v: Array | Triple, law: Array) -> tuple[float, float, float, float, float]:
    """Return x, angle, vx, vy, omega in the guide's frame from a slider's coordinates and their rates."""
    cx, cy = law[ACROSS_X], law[ACROSS_Y]
    across, v_across, v_along = cx * q[X] + cy * q[Y], cx * v[X] + cy * v[Y], cx * v[Y] - cy * v[X]
    return across, q[ANGLE] - law[DIRECTION], v_across, v_along, v[ANGLE]


@entry
def slider_force(
    x: float,
    y: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    step: Array,
    law: Array,
    contacts: Array,
) -> tuple[float, float, float]:
    """Return the force of all corners on a slider: fx, fy (N) and the moment about its centre (N m).

    Its motion is counted from the guide's point, along the fixed axes: m, rad, s.
    """
    motion = in_guide((x, y, angle), (vx, vy, omega), law)
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower, upper = corner_motion(side, *motion, law), corner_motion(side + UPPER, *motion, law)
        if lower.gap < 0.0 or upper.gap < 0.0:
            low, up = contacts[side], contacts[side + UPPER]
            if law[SHARED] > 0.0:
                lower_speed = low[IMPACT_SPEED]
                if lower_speed == 0.0 and step[LENGTH] <= step[TICK]:
                    lower_speed = side_change(low, up, lower, upper, step[LENGTH], law)[2]
                upper_speed = lower_speed
            else:
                lower_speed = speed_in_step(low, lower.gap, lower.rate, step, law)
                upper_speed = speed_in_step(up, upper.gap, upper.rate, step, law)
            forces = side_forces(lower, upper, lower_speed, upper_speed, law)
            load = side_load(side, forces, lower, upper)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
    return law[ACROSS_X] * fx - law[ACROSS_Y] * fy, law[ACROSS_Y] * fx + law[ACROSS_X] * fy, moment


@kernel
def journal_in_bearing(
    q1: Triple, v1: Triple, q2: Triple, v2: Triple, ends: Array, law: Array
) -> JournalMotion:
    """Return the motion of a journal from those of its bodies, each as x, y, angle (m, rad) and rates."""
    jx, jy = _arm(q1[ANGLE], ends[1], ends[2])
    bx, by = _arm(q2[ANGLE], ends[4], ends[5])
    w1, w2 = v1[ANGLE], v2[ANGLE]
    return journal_motion(
        q1[X] + jx - q2[X] - bx + ends[6],
        q1[Y] + jy - q2[Y] - by + ends[7],
        v1[X] - w1 * jy - v2[X] + w2 * by,
        v1[Y] + w1 * jx - v2[Y] - w2 * bx,
        w1,
        w2,
        law,
    )


@kernel
def _arm(angle: float, along: float, across: float) -> tuple[float, float]:
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * along - sine * across, sine * along + cosine * across


@kernel
def journal_loads(
    normal: float, friction: float, motion: JournalMotion, q1: Triple, q2: Triple, ends: Array, law: Array
) -> tuple[float, float, float, float]:
    """Return the force on the bearing's body (N), and the moments on the journal's and on it (N m)."""
    bx, by = _arm(q2[ANGLE], ends[4], ends[5])
    gx, gy, moment2 = bearing_load(normal, friction, motion, bx, by, law)
    jx, jy = _arm(q1[ANGLE], ends[1], ends[2])
    radius = law[BEARING_RADIUS] - motion.distance  # from the journal's centre to the bearing's surface
    px, py = jx + radius * motion.nx, jy + radius * motion.ny
    return gx, gy, py * gx - px * gy, moment2


@kernel
def triple(values: Array, body: float) -> Triple:
    """Take x, y, angle of a body, or their rates, from those of all."""
    first = PER_BODY * int(body)
    return values[first], values[first + 1], values[first + 2]


@entry
def journal_force(
    q1: Triple, q2: Triple, v1: Triple, v2: Triple, step: Array, ends: Array, law: Array, contact: Array
) -> tuple[float, float, float, float, float, float]:
    """Return force and moment on the journal's body, then on the bearing's (N, N m)."""
    motion = journal_in_bearing(q1, v1, q2, v2, ends, law)
    speed = speed_in_step(contact, motion.gap, motion.rate, step, law)
    if speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    normal, _, _ = journal_forces(motion, speed, law)
    friction = friction_in_regime(normal, motion.slip, contact[REGIME], law)
    gx, gy, moment1, moment2 = journal_loads(normal, friction, motion, q1, q2, ends, law)
    return -gx, -gy, moment1, gx, gy, moment2


@entry
def settle(q: Array, v: Array, ends: Array, law: Array, contact: Array) -> bool:
    """Return whether the friction's piece fits the slip that Newton's method has come to; else take the next.

    One piece at a time: the force falls with the slip, so that the way from piece to piece has one direction.
    """
    q1, q2, v1, v2 = triple(q, ends[0]), triple(q, ends[3]), triple(v, ends[0]), triple(v, ends[3])
    motion = journal_in_bearing(q1, v1, q2, v2, ends, law)
    wanted = slip_regime(motion.slip, law)
    if motion.gap >= 0.0:  # no friction in any piece
        contact[REGIME] = wanted
    fits: bool = contact[REGIME] == wanted
    contact[REGIME] += np.sign(wanted - contact[REGIME])
    return fits
