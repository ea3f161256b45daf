"""Contact of a slider with the walls of its guide: its force in trial states, its update in accepted ones."""

from typing import Any, NamedTuple, cast

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
    BEFORE,
    NEVER,
    PER_BODY,
    ContactElement,
    Triple,
    X,
    Y,
    allowed_ticks,
    remember,
    speed_in_step,
    touch,
    update_alone,
    zero_within,
)
from exudyn_model.invariants import Watch
from exudyn_model.kernels import entry, kernel, record
from exudyn_model.laws import CornerMotion, Law, SideForces, side_forces

Array = NDArray[np.float64]


class SliderArrays(NamedTuple):
    """Arrays of a slider that its kernels read and fill; ``step`` and ``law`` have shape (1,)."""

    step: NDArray[Any]  # Of ``contact.STEP``
    law: NDArray[Any]
    contacts: NDArray[Any]  # Memory of the corners
    last: NDArray[Any]  # Of the corners, of ``contact.BEFORE``
    load: Array  # fx, fy (N) and moment (N m) in the last accepted state


@kernel
def side_change(
    low: Memory, up: Memory, lower: CornerMotion, upper: CornerMotion, step: float, law: Law
) -> tuple[int, float, float]:
    """Return which corner of an open side touches first in a step, or which of a closed side leaves last.

    At the step's end at least one corner of an open side is inside the wall, and none of a closed side. Two
    corners that touch at once, within the rounding of gaps, count as the lower one at the faster's speed.

    Returns
    -------
    end : int
        0: lower corner; 1: upper corner.
    fraction, speed : float
        Fraction of the step at which it does so; impact speed, m/s.
    """
    first, first_at, first_speed, leaves = 0, 0.0, 0.0, low.impact_speed > 0.0
    for end in range(2):
        corner, contact = (lower, low) if end == 0 else (upper, up)
        if (corner.gap < 0.0) == (contact.closed > 0.0):
            continue
        at, speed = touch(contact, corner.gap, corner.rate, step, law)
        lead = (first_at - at) * step
        if first_speed == 0.0 or (at > first_at if leaves else lead * speed > ROUNDED):
            first, first_at, first_speed = end, at, speed
        elif -lead * first_speed <= ROUNDED:
            first_speed = max(first_speed, speed)
    return first, first_at, first_speed


@kernel
def in_guide(q: Array | Triple, v: Array | Triple, law: Law) -> tuple[float, float, float, float, float]:
    """Return x, angle, vx, vy, omega in the guide's frame from a slider's coordinates and their rates."""
    cx, cy = law.across_x, law.across_y
    across, v_across, v_along = cx * q[X] + cy * q[Y], cx * v[X] + cy * v[Y], cx * v[Y] - cy * v[X]
    return across, q[ANGLE] - law.direction, v_across, v_along, v[ANGLE]


@entry
def slider_force(q: Triple, v: Triple, arrays: SliderArrays) -> tuple[float, float, float]:
    """Return the force of all corners on a slider: fx, fy (N) and the moment about its centre (N m).

    ``q`` counts from the guide's point, along the fixed axes.
    """
    step, law, contacts = arrays.step[0], arrays.law[0], arrays.contacts
    motion = in_guide(q, v, law)
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
    return law.across_x * fx - law.across_y * fy, law.across_y * fx + law.across_x * fy, moment


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
            end, at, speed = side_change(low, up, lower, upper, step, law)
            now = time - (1.0 - at) * step
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
def follow_slider(time: float, q: Array, v: Array, longest: float, first: int, arrays: SliderArrays) -> float:
    """Take the accepted state at ``time`` (s); return the largest number of ticks of the next step.

    It is at most ``longest``. ``first`` is the row of the first corner among all contacts; memory, ``last``
    and ``load`` of the arrays are updated.
    """
    step, law, contacts, load = arrays.step[0], arrays.law[0], arrays.contacts, arrays.load
    cx, cy, motion = law.across_x, law.across_y, in_guide(q, v, law)
    x, y, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower, upper = corner_motion(side, *motion, law), corner_motion(side + UPPER, *motion, law)
        low, up = contacts[side], contacts[side + UPPER]
        forces = update_side(time, step.length, first + side, lower, upper, low, up, law)
        of_side = side_load(side, forces, lower, upper)
        x, y, moment = x + of_side[0], y + of_side[1], moment + of_side[2]
    load[X], load[Y], load[ANGLE] = cx * x - cy * y, cy * x + cx * y, moment
    for number in range(CORNER_COUNT):
        longest = min(longest, allowed_ticks(time, step, contacts[number], arrays.last[number], law))
    return longest


@entry
def slider_change(q: Array, v: Array, arrays: SliderArrays) -> float:
    """Return the fraction of a step after which a corner's contact begins or ends; more than 1: none does.

    ``q`` and ``v`` are the state at the step's end; the memory is that at its start.
    """
    step, law = arrays.step[0], arrays.law[0]
    motion, earliest = in_guide(q, v, law), NEVER
    for number in range(CORNER_COUNT):
        corner = corner_motion(number, *motion, law)
        earliest = min(earliest, zero_within(arrays.contacts[number], corner.gap, corner.rate, step.length))
    return earliest


class SliderElement(ContactElement):
    """A slider in its guide; ``first`` is the row of its first corner in the memory of all ``contacts``."""

    def __init__(self, body: int, first: int, law: Law, contacts: NDArray[Any], step: NDArray[Any]) -> None:
        rows, last = slice(first, first + CORNER_COUNT), np.zeros(CORNER_COUNT, BEFORE)
        arrays = SliderArrays(step, record(law), contacts[rows], last, np.zeros(PER_BODY))
        self._own = slice(PER_BODY * body, PER_BODY * body + PER_BODY)
        super().__init__((body,), rows, law, arrays, (slider_force, follow_slider, slider_change))

    def attach(self, q: Array, v: Array) -> None:
        """Read all further states from these vectors of all bodies, shape (3 n,)."""
        super().attach(q[self._own], v[self._own])

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
        motion = np.array(self._in_guide(q[self._own], v[self._own]))
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
        """Return x, angle, vx, vy, omega in the guide's frame from the slider's coordinates."""
        motion: tuple[Any, ...] = cast(Any, in_guide).py_func(q, v, self.law)
        return motion
