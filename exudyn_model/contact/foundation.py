"""A side of the slider on an elastic foundation: one contact for both of its corners (law "foundation").

A side is in contact while a corner of it is inside its wall. The corner that touches first names the contact:
the impact speed frozen in that corner's state is that of the side, and what the table of contacts is to show
is accumulated there, even when the other corner alone is left inside. Where both touch at once, within the
rounding of gaps, it is the lower one, with the speed of the faster. The damping's factor refers to the
depth's rate at the resultant, friction to the slip there: the point that divides the side as the forces in
its corners do.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact.friction import friction_force
from exudyn_model.contact.gaps import CornerMotion
from exudyn_model.contact.impact_speed import crossing, touch
from exudyn_model.contact.laws import FOUNDATION, foundation_normals
from exudyn_model.contact.point import damped
from exudyn_model.contact.states import CORNERS, PIN, UPPER

# A distance (m) that is none: some roundings of lengths near 0.6 m
_ROUNDED = 2e-15
_CORNERS = len(CORNERS)


class SideForces(NamedTuple):
    """Forces (N) in the corners of a side: normal, at least 0, and friction along +y; slip at the resultant.

    The slip (m/s) is 0 where there is no force.
    """

    lower: float
    upper: float
    lower_friction: float
    upper_friction: float
    slip: float


@kernel
def foundation_forces(lower: CornerMotion, upper: CornerMotion, impact_speed: float, law: Any) -> SideForces:
    """Return the forces of a side in contact; ``impact_speed`` (m/s) is the frozen one of the side."""
    first, second = foundation_normals(-lower.gap, -upper.gap, law.side_stiffness)
    total = first + second
    if not total > 0.0:
        return SideForces(0.0, 0.0, 0.0, 0.0, 0.0)
    depth_rate = -(first * lower.rate + second * upper.rate) / total
    slip = (first * lower.slip + second * upper.slip) / total
    factor = damped(1.0, depth_rate, impact_speed, law)
    friction = friction_force(factor, slip, law)
    return SideForces(factor * first, factor * second, friction * first, friction * second, slip)


@kernel
def other_end(number: int) -> int:
    """Return the other corner of a corner's side."""
    return (number + UPPER) % _CORNERS


@kernel
def shares_contact(number: int, law: Any) -> bool:
    """Return whether one of ``CONTACTS`` has its contact in common with the other corner of its side."""
    shared: bool = number != PIN and law.kind == FOUNDATION
    return shared


@kernel
def in_contact(number: int, contacts: NDArray[np.void], law: Any) -> bool:
    """Return whether a contact is in progress that one of ``CONTACTS`` takes part in, under either name."""
    if contacts[number].impact_speed > 0.0:
        return True
    return shares_contact(number, law) and contacts[other_end(number)].impact_speed > 0.0


@kernel
def first_touch(
    low: Any, up: Any, lower: CornerMotion, upper: CornerMotion, law: Any
) -> tuple[int, float, float]:
    """Return which end of an open side touches first in a step, at what fraction of it, and how fast (m/s).

    Parameters
    ----------
    low, up : record
        States of the side's corners at the step's start.
    lower, upper : CornerMotion
        Their motions at its end, where at least one is inside the wall.
    law : record

    Returns
    -------
    end : int
        0: the lower one; 1: the upper one.
    fraction, speed : float
    """
    lower_at, lower_speed = 0.0, 0.0
    if lower.gap < 0.0:
        lower_at, lower_speed = touch(low.gap, low.rate, lower.gap, lower.rate, law)
    if upper.gap < 0.0:
        upper_at, upper_speed = touch(up.gap, up.rate, upper.gap, upper.rate, law)
        lead = (lower_at - upper_at) * law.step
        if lower.gap >= 0.0 or lead * upper_speed > _ROUNDED:
            return 1, upper_at, upper_speed
        if -lead * lower_speed <= _ROUNDED:
            lower_speed = max(lower_speed, upper_speed)
    return 0, lower_at, lower_speed


@kernel
def side_speed_in_force(low: Any, up: Any, lower: CornerMotion, upper: CornerMotion, law: Any) -> float:
    """Return the impact speed (m/s) of a side in a trial state of a step; 0 where it is open.

    Arguments as for :func:`first_touch`; as ``impact_speed.impact_speed_in_force`` of a single corner.
    """
    frozen: float = max(low.impact_speed, up.impact_speed)
    if frozen > 0.0 or law.stays_open > 0.0:
        return frozen
    return first_touch(low, up, lower, upper, law)[2]


@kernel
def speed_at_start(
    lower_gap: float, lower_rate: float, upper_gap: float, upper_rate: float, law: Any
) -> float:
    """Return the impact speed (m/s) of a side inside its wall at t = 0: that of its resultant, floored.

    Of a side that is on its wall, where rounding would decide where that is, it is the faster corner's.
    """
    rate = min(lower_rate, upper_rate)
    if min(lower_gap, upper_gap) < -_ROUNDED:
        first, second = foundation_normals(-lower_gap, -upper_gap, law.side_stiffness)
        rate = (first * lower_rate + second * upper_rate) / (first + second)
    speed: float = max(-rate, law.impact_speed_floor)
    return speed


@kernel
def begin_side(
    time: float, side: int, lower: CornerMotion, upper: CornerMotion, contacts: NDArray[np.void], law: Any
) -> float:
    """Begin the contact of a side that was open in the last accepted state and is closed in that at ``time``.

    At t = 0 the deeper corner counts as the one that touched first; of a side on its wall the faster one.

    Returns
    -------
    float
        Fraction of the step from which its force acts.
    """
    low, up = contacts[side], contacts[side + UPPER]
    if max(low.impact_speed, up.impact_speed) > 0.0 or (lower.gap >= 0.0 and upper.gap >= 0.0):
        return 0.0
    if time == 0.0:
        inside = min(lower.gap, upper.gap) < -_ROUNDED
        upper_leads = upper.gap < lower.gap if inside else upper.rate < lower.rate
        end, touched_at = (1 if upper_leads else 0), 0.0
        speed = speed_at_start(lower.gap, lower.rate, upper.gap, upper.rate, law)
    else:
        end, touched_at, speed = first_touch(low, up, lower, upper, law)
    contact = contacts[side + UPPER * end]
    contact.impact_speed = speed
    contact.start = time - (1.0 - touched_at) * law.step if time > 0.0 else 0.0
    contact.impulse, contact.peak, contact.depth = 0.0, 0.0, 0.0
    return touched_at


@kernel
def follow_side(
    time: float, side: int, lower: CornerMotion, upper: CornerMotion, contacts: NDArray[np.void], law: Any
) -> tuple[int, float]:
    """Update the states of a side's corners with the accepted state at ``time`` (s).

    Parameters
    ----------
    time : float
    side : int
        Number of its lower corner.
    lower, upper : CornerMotion
        In this state.
    contacts : ndarray, shape (5,)
        Changed in place.
    law : record

    Returns
    -------
    ended : int
        Number of the corner whose contact ends in this step, -1: none.
    left_at : float
        Fraction of the step at which the last corner separates; 1 if none does.
    """
    low, up = contacts[side], contacts[side + UPPER]
    touched_at = begin_side(time, side, lower, upper, contacts, law)
    number = side if low.impact_speed > 0.0 else side + UPPER
    contact, ended, left_at = contacts[number], -1, 1.0
    forces = SideForces(0.0, 0.0, 0.0, 0.0, 0.0)
    if contact.impact_speed > 0.0:
        forces = foundation_forces(lower, upper, contact.impact_speed, law)
        if lower.gap >= 0.0 and upper.gap >= 0.0:
            ended, left_at = number, 0.0
            if low.closed > 0.0:
                left_at = crossing(low.gap, low.rate, lower.gap, lower.rate, law.step)
            if up.closed > 0.0:
                left_at = max(left_at, crossing(up.gap, up.rate, upper.gap, upper.rate, law.step))
        normal = forces.lower + forces.upper
        if time > 0.0:
            before = low.normal + up.normal
            contact.impulse += 0.5 * (before + normal) * (left_at - touched_at) * law.step
        contact.peak = max(contact.peak, normal)
        contact.depth = max(contact.depth, -min(lower.gap, upper.gap))
    low.normal, up.normal = forces.lower, forces.upper
    low.friction, up.friction = forces.lower_friction, forces.upper_friction
    low.slip, up.slip = lower.slip, upper.slip
    if forces.lower + forces.upper > 0.0:
        low.slip, up.slip = forces.slip, forces.slip  # of the point where friction acts
    low.gap, low.rate, up.gap, up.rate = lower.gap, lower.rate, upper.gap, upper.rate
    low.closed, up.closed = 1.0 if lower.gap < 0.0 else 0.0, 1.0 if upper.gap < 0.0 else 0.0
    return ended, left_at
