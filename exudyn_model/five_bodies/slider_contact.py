"""Contact of a slider with the walls of its guide: its force in trial states, its update in accepted ones."""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import (
    CORNER_COUNT,
    ROUNDED,
    UPPER,
    Memory,
    corner_load,
    corner_motion,
    side_load,
    start_side,
)
from exudyn_model.five_bodies.contact import (
    ANGLE,
    AT_REST,
    NEVER,
    ContactArrays,
    ContactElement,
    Pair,
    Partners,
    Six,
    Triple,
    X,
    Y,
    allowed_ticks,
    of_bodies,
    relative,
    remember,
    speed_in_step,
    touch,
    update_alone,
    zero_within,
)
from exudyn_model.invariants import Watch
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import CornerMotion, Law, SideForces, side_forces

Array = NDArray[np.float64]
Four = tuple[float, float, float, float]
GuideMotion = tuple[float, float, float, float, float]
Turn = tuple[float, float]


@kernel
def side_change(
    low: Memory, up: Memory, lower: CornerMotion, upper: CornerMotion, step: float, law: Law
) -> tuple[int, float, float]:
    """Return the corner of an open side that touches first in a step, or of a closed side that leaves last.

    At the step's end at least one corner of an open side is inside the wall, and none of a closed side. Two
    corners that touch at once, within the rounding of gaps, count as the lower one at the faster's speed.

    Returns
    -------
    end : int
        0: lower corner; 1: upper corner.
    fraction, speed : float
        Fraction of the step at which it does so; impact speed, m/s.
    """
    first, first_fraction, first_speed, leaves = 0, 0.0, 0.0, low.impact_speed > 0.0
    for end in range(2):
        corner, contact = (lower, low) if end == 0 else (upper, up)
        if (corner.gap < 0.0) == (contact.closed > 0.0):
            continue
        fraction, speed = touch(contact, corner.gap, corner.rate, step, law)
        lead = (first_fraction - fraction) * step
        if first_speed == 0.0 or (fraction > first_fraction if leaves else lead * speed > ROUNDED):
            first, first_fraction, first_speed = end, fraction, speed
        elif -lead * first_speed <= ROUNDED:
            first_speed = max(first_speed, speed)
    return first, first_fraction, first_speed


@kernel
def in_guide(offset: Four, turn: Turn, guide_turn: Turn, law: Law) -> tuple[GuideMotion, tuple[float, float]]:
    """Return the slider's motion in its guide's frame, and the unit vector across the guide.

    Parameters
    ----------
    apart : tuple
        Result of ``contact.relative``.
    turned, on : tuple
        Angle (rad) and angular speed (rad/s) of the slider and of the guide's body.
    law : Law

    Returns
    -------
    motion : tuple
        x (across the guide, m), angle, vx, vy, omega.
    across : tuple
    """
    (x, y, vx, vy), (angle, omega), (on_angle, on_omega) = offset, turn, guide_turn
    cosine, sine = np.cos(on_angle), np.sin(on_angle)
    cx = cosine * law.across_x - sine * law.across_y
    cy = sine * law.across_x + cosine * law.across_y
    # Against the guide's material where the slider's centre is
    vx, vy = vx + on_omega * y, vy - on_omega * x
    motion = cx * x + cy * y, angle - on_angle - law.direction, cx * vx + cy * vy, cx * vy - cy * vx
    return (*motion, omega - on_omega), (cx, cy)


@kernel
def guide_motion(q: Pair, v: Pair, guide: Partners) -> tuple[GuideMotion, tuple[float, float]]:
    """Return the results of :func:`in_guide` from the motions of slider and guide."""
    (q1, q2), (v1, v2) = q, v
    return in_guide(relative(q, v, guide), (q1[ANGLE], v1[ANGLE]), (q2[ANGLE], v2[ANGLE]), guide.law)


@kernel
def guide_loads(load: Triple, across: tuple[float, float], q: Pair, guide: Partners) -> Six:
    """Return the loads on slider and guide (N, N m) of one on the slider in the guide's frame."""
    (fx, fy, moment), (cx, cy), (q1, q2) = load, across, q
    x, y = cx * fx - cy * fy, cy * fx + cx * fy
    arm_x, arm_y = q1[X] - q2[X] + guide.apart_x, q1[Y] - q2[Y] + guide.apart_y
    return x, y, moment, -x, -y, -moment - arm_x * y + arm_y * x


@entry
def slider_force(q: Any, v: Any, arrays: ContactArrays) -> Six:
    """Return force of all corners and moment about the centre on a slider, then on its guide (N, N m).

    ``q`` and ``v`` are of the slider, then of the guide's body; of the slider alone if that is the frame.
    """
    step, guide, contacts = arrays.step[0], arrays.partners[0], arrays.contacts
    pair = q[:3], (q + AT_REST)[3:6]
    motion, across = guide_motion(pair, (v[:3], (v + AT_REST)[3:6]), guide)
    law = guide.law
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower, upper = corner_motion(side, *motion, law), corner_motion(side + UPPER, *motion, law)
        if lower.gap < 0.0 or upper.gap < 0.0:
            low, up = contacts[side], contacts[side + UPPER]
            if law.shared > 0.0:
                lower_speed = low.impact_speed
                if lower_speed == 0.0 and step.length <= step.tick:
                    lower_speed = side_change(low, up, lower, upper, step.length, law)[2]
                upper_speed = lower_speed
            else:
                lower_speed = speed_in_step(low, lower.gap, lower.rate, step, law)
                upper_speed = speed_in_step(up, upper.gap, upper.rate, step, law)
            forces = side_forces(lower, upper, lower_speed, upper_speed, law)
            load = side_load(side, forces, lower, upper)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
    return guide_loads((fx, fy, moment), across, pair, guide)


@kernel
def update_side(
    time: float,
    step: float,
    row: int,
    lower: CornerMotion,
    upper: CornerMotion,
    low: Memory,
    up: Memory,
    law: Law,
) -> SideForces:
    """Update the memory of a side with the accepted state at ``time`` (s); return its forces.

    ``row`` is that of its lower corner among all contacts.
    """
    # Before the forces: a contact that has ended has none
    if time > 0.0 and law.shared > 0.0:
        is_open = lower.gap >= 0.0 and upper.gap >= 0.0
        if (low.impact_speed > 0.0) == is_open:
            end, fraction, speed = side_change(low, up, lower, upper, step, law)
            now = time - (1.0 - fraction) * step
            if is_open:
                low.impact_speed, low.end = 0.0, now
            else:
                low.impact_speed, low.start, low.name = speed, now, row + UPPER * end
    elif time > 0.0:
        update_alone(time, step, row, lower.gap, lower.rate, low, law)
        update_alone(time, step, row + UPPER, upper.gap, upper.rate, up, law)
    forces = side_forces(lower, upper, low.impact_speed, up.impact_speed, law)
    one_slip = not np.isnan(forces.slip)
    lower_slip, upper_slip = (forces.slip, forces.slip) if one_slip else (lower.slip, upper.slip)
    remember(low, lower.gap, lower.rate, lower_slip, forces.lower, forces.lower_friction)
    remember(up, upper.gap, upper.rate, upper_slip, forces.upper, forces.upper_friction)
    low.stored, low.damping_power, low.friction_power = forces.stored, forces.damping, forces.friction
    return forces


@entry
def follow_slider(
    time: float, q: Array, v: Array, longest: float, first: int, arrays: ContactArrays
) -> float:
    """Take the accepted state at ``time`` (s); return the largest number of ticks of the next step.

    It is at most ``longest``. ``first`` is the row of the first corner among all contacts; memory, ``last``
    and ``load`` of the arrays are updated.
    """
    step, guide, contacts, load = arrays.step[0], arrays.partners[0], arrays.contacts, arrays.load
    pair = of_bodies(q, guide)
    motion, across = guide_motion(pair, of_bodies(v, guide), guide)
    law = guide.law
    x, y, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower, upper = corner_motion(side, *motion, law), corner_motion(side + UPPER, *motion, law)
        low, up = contacts[side], contacts[side + UPPER]
        forces = update_side(time, step.length, first + side, lower, upper, low, up, law)
        part = side_load(side, forces, lower, upper)
        x, y, moment = x + part[0], y + part[1], moment + part[2]
    load[:] = guide_loads((x, y, moment), across, pair, guide)
    for number in range(CORNER_COUNT):
        longest = min(longest, allowed_ticks(time, step, contacts[number], arrays.last[number], law))
    return longest


@entry
def slider_change(q: Array, v: Array, arrays: ContactArrays) -> float:
    """Return the fraction of a step after which a corner's contact begins or ends; more than 1: none does.

    ``q`` and ``v`` are the state at the step's end; the memory is that at its start.
    """
    step, guide = arrays.step[0], arrays.partners[0]
    motion, _ = guide_motion(of_bodies(q, guide), of_bodies(v, guide), guide)
    earliest = NEVER
    for number in range(CORNER_COUNT):
        corner = corner_motion(number, *motion, guide.law)
        earliest = min(earliest, zero_within(arrays.contacts[number], corner.gap, corner.rate, step.length))
    return earliest


class SliderElement(ContactElement):
    """A slider in its guide; ``first`` is the row of its first corner in the memory of all ``contacts``."""

    def __init__(self, guide: Partners, first: int, contacts: NDArray[Any], step: NDArray[Any]) -> None:
        kernels = (slider_force, follow_slider, slider_change)
        super().__init__(guide, slice(first, first + CORNER_COUNT), contacts, step, kernels)

    def start(self) -> None:
        """Begin the contacts that are closed at t = 0."""
        x, angle, vx, vy, omega = self._in_guide(self._q, self._v)
        motion = cast(Any, corner_motion).py_func  # not compiled for four calls
        corners = [motion(k, x, angle, vx, vy, omega, self.law) for k in range(CORNER_COUNT)]
        for side in range(UPPER):
            start_side(side, corners[side], corners[side + UPPER], self._arrays.contacts, self.law)
        self._arrays.contacts["name"] += self.rows.start

    def watch(self, watch: Watch, times: Array, q: Array, v: Array, forces: Array, memory: Array) -> None:
        """Watch states of all bodies, shape (3 n, states), with forces and memory of its rows."""
        motion = np.array(self._in_guide(q, v))
        watch.take_slider(self.rows.start, times, motion, forces, memory, self.law)

    def gaps_and_moment(self, q: Array, normals: Array, frictions: Array) -> tuple[Array, Array]:
        """Return the corners' gaps (m), shape (4, states), and the moment (N m) of their forces (N)."""
        gaps, moment, motion = [], np.zeros(q.shape[1]), cast(Any, corner_motion).py_func
        x, angle, *_ = self._in_guide(q, np.zeros_like(q))
        for k in range(CORNER_COUNT):
            corner = motion(k, x, angle, 0.0, 0.0, 0.0, self.law)
            gaps.append(corner.gap)
            moment += cast(Any, corner_load).py_func(k, normals[k], frictions[k], corner)[2]
        return np.array(gaps), moment

    def _in_guide(self, q: Array, v: Array) -> tuple[Any, ...]:
        """Return x, angle, vx, vy, omega in the guide's frame from the coordinates of all bodies."""
        motion = self.motion(q, v)
        (in_frame, _) = cast(Any, in_guide).py_func(motion[:4], motion[4::2], motion[5::2], self.law)
        coordinates: tuple[Any, ...] = in_frame
        return coordinates
