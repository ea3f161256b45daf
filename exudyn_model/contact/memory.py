"""Update the contacts' memory from an accepted state, and keep a row of every contact that ends.

For five bodies this is the only place where an impact speed is frozen or cleared. It depends on accepted
states alone (the last one is what the memory still holds), never on trial states of the Newton iteration.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, X, Y
from exudyn_model.compiled import kernel
from exudyn_model.contact.foundation import follow_side
from exudyn_model.contact.friction import friction_force, slip_regime
from exudyn_model.contact.gaps import CornerMotion, corner_motion
from exudyn_model.contact.impact_speed import crossing, touch
from exudyn_model.contact.journal import PinMotion, crank_and_rod2, pin_load, pin_motion
from exudyn_model.contact.laws import FOUNDATION, side_normals
from exudyn_model.contact.point import damped, elastic_force
from exudyn_model.contact.states import ACROSS, PIN, UPPER

EVENT = np.dtype(
    [("corner", np.int64)]
    + [
        (name, np.float64)
        for name in ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")
    ]
)


@kernel
def write_event(row: Any, number: int, state: Any, end: float) -> None:
    """Fill one row of the table of events from the accumulated contact ``number`` of ``CONTACTS``."""
    row.corner = number
    row.start = state.start
    row.end = end
    row.normal_speed = state.impact_speed
    row.impulse = state.impulse
    row.peak_force = state.peak
    row.largest_depth = state.depth


@kernel
def begin(time: float, gap: float, rate: float, state: Any, law: Any) -> float:
    """Begin a contact that was open in the last accepted state and is closed in that at ``time`` (s).

    Returns
    -------
    float
        Fraction of the step from which its force acts.
    """
    touched_at = 0.0
    if state.impact_speed == 0.0 and gap < 0.0:
        if time == 0.0:
            speed = max(-rate, law.impact_speed_floor)
            state.start = 0.0
        else:
            touched_at, speed = touch(state.gap, state.rate, gap, rate, law)
            state.start = time - (1.0 - touched_at) * law.step
        state.impact_speed = speed
        state.closed = 1.0
        state.normal, state.impulse, state.peak, state.depth = 0.0, 0.0, 0.0, 0.0
    return touched_at


@kernel
def accumulate(
    time: float,
    motion: CornerMotion | PinMotion,
    normal: float,
    touched_at: float,
    number: int,
    state: Any,
    law: Any,
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Accumulate a contact up to the accepted state at ``time``; if it has ended, write it down.

    Parameters
    ----------
    time : float
        s.
    motion : CornerMotion or PinMotion
        In this state.
    normal : float
        Normal force in this state, N.
    touched_at : float
        What :func:`begin` returned for it.
    number : int
        One of ``CONTACTS``.
    state, law : record
    events : ndarray, shape (n,)
        With room for a row at ``event_count``.

    Returns
    -------
    event_count : int
    """
    gap, rate = motion.gap, motion.rate
    if state.impact_speed > 0.0:
        left_at = 1.0 if gap < 0.0 else crossing(state.gap, state.rate, gap, rate, law.step)
        if time > 0.0:
            state.impulse += 0.5 * (state.normal + normal) * (left_at - touched_at) * law.step
        state.peak = max(state.peak, normal)
        state.depth = max(state.depth, -gap)
        state.normal = normal
        state.friction = friction_force(normal, motion.slip, law)
        if gap >= 0.0:
            write_event(events[event_count], number, state, time - (1.0 - left_at) * law.step)
            event_count += 1
            state.impact_speed, state.closed = 0.0, 0.0
    state.gap, state.rate, state.slip = gap, rate, motion.slip
    return event_count


@kernel
def update_side(
    time: float,
    side: int,
    lower: CornerMotion,
    upper: CornerMotion,
    law: Any,
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Update the corners of one side, moving as ``lower`` and ``upper``; return the count of events."""
    low, up = corners[side], corners[side + UPPER]
    if law.kind == FOUNDATION:
        ended, left_at = follow_side(time, side, lower, upper, corners, law)
        if ended >= 0:
            write_event(events[event_count], ended, corners[ended], time - (1.0 - left_at) * law.step)
            event_count += 1
            corners[ended].impact_speed = 0.0
        return event_count
    lower_touched = begin(time, lower.gap, lower.rate, low, law)
    upper_touched = begin(time, upper.gap, upper.rate, up, law)
    # A corner that has left has no force, though its speed is still kept for the table
    normals = side_normals(
        -lower.gap,
        -lower.rate,
        low.impact_speed if lower.gap < 0.0 else 0.0,
        -upper.gap,
        -upper.rate,
        up.impact_speed if upper.gap < 0.0 else 0.0,
        law,
    )
    event_count = accumulate(time, lower, normals[0], lower_touched, side, low, law, events, event_count)
    return accumulate(time, upper, normals[1], upper_touched, side + UPPER, up, law, events, event_count)


@kernel
def update_corners(
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> tuple[int, float, float, float]:
    """Update all corners with the accepted state at ``time``; ended contacts go to ``events``.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray, shape (3,)
        The slider's coordinates (x from the guide's centre line) and their rates.
    law, corners : ndarray
        From ``gaps`` and ``states``; ``corners`` is changed in place.
    events : ndarray, shape (n,)
        With room for at least four rows from ``event_count`` on.

    Returns
    -------
    event_count : int
    fx, fy, moment : float
        Contact force (N) and moment (N m) on the slider in this state.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        outward = ACROSS[side]
        low, up = corners[side], corners[side + UPPER]
        lower = corner_motion(side, q[X], q[ANGLE], v[X], v[Y], v[ANGLE], constants)
        upper = corner_motion(side + UPPER, q[X], q[ANGLE], v[X], v[Y], v[ANGLE], constants)
        event_count = update_side(time, side, lower, upper, constants, corners, events, event_count)
        for corner, motion in ((low, lower), (up, upper)):
            fx -= outward * corner.normal
            fy += corner.friction
            moment += motion.arm_x * corner.friction + motion.arm_y * outward * corner.normal
    return event_count, fx, fy, moment


@kernel
def update_pin(
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    law: NDArray[np.void],
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> tuple[int, float, float, float]:
    """Update the pin's memory with the accepted state at ``time``; an ended contact goes to ``events``.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray
        Coordinates of the five bodies, or of crank and rod 2 alone, and their rates.
    law, contacts : ndarray
        From ``journal`` and ``states``; ``contacts`` is changed in place.
    events : ndarray, shape (n,)
        With room for a row at ``event_count``.

    Returns
    -------
    event_count : int
    fx, fy, moment : float
        Contact force (N) on rod 2 and its moment about rod 2's centre (N m) in this state.
    """
    constants, state = law[0], contacts[PIN]
    bodies = crank_and_rod2(q, v)
    motion = pin_motion(bodies, constants)
    if time == 0.0:
        state.regime = slip_regime(motion.slip, constants)
    touched_at, normal = begin(time, motion.gap, motion.rate, state, constants), 0.0
    if motion.gap < 0.0:
        normal = damped(elastic_force(motion.gap, constants), -motion.rate, state.impact_speed, constants)
    event_count = accumulate(time, motion, normal, touched_at, PIN, state, constants, events, event_count)
    fx, fy, _, moment = pin_load(state.normal, state.friction, motion, bodies, constants)
    return event_count, fx, fy, moment
