"""Renew the contacts' memory from an accepted state, and keep a row of every contact that ends.

This is the only place where an impact speed is frozen or forgotten. It depends on accepted states alone
(the last one is what the memory still holds), never on trial states of the Newton iteration.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_motion
from exudyn_model.point_contact import crossing, friction_force, touch
from exudyn_model.side_law import side_normals

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
def begin(index: int, gap: float, rate: float, state: Any, law: Any) -> float:
    """Begin a contact that was open in accepted state ``index - 1`` and is closed in ``index``.

    Returns
    -------
    float
        Fraction of the step from which its force acts.
    """
    touched_at = 0.0
    if state.impact_speed == 0.0 and gap < 0.0:
        if index == 0:
            speed = max(-rate, law.impact_speed_floor)
            state.start = 0.0
        else:
            touched_at, speed = touch(state.gap, state.rate, gap, rate, law)
            state.start = (index - 1 + touched_at) * law.step
        state.impact_speed = speed
        state.normal, state.impulse, state.peak, state.depth = 0.0, 0.0, 0.0, 0.0
    return touched_at


@kernel
def carry_on(
    index: int,
    gap: float,
    rate: float,
    slip: float,
    normal: float,
    touched_at: float,
    number: int,
    state: Any,
    law: Any,
    events: NDArray[np.void],
    event_count: int,
) -> int:
    """Accumulate a contact up to accepted state ``index``; if it has ended, write it down. The event count.

    ``normal`` is the force (N) in this state, ``touched_at`` what :func:`begin` returned for it.
    """
    if state.impact_speed > 0.0:
        left_at = 1.0 if gap < 0.0 else crossing(state.gap, state.rate, gap, rate, law.step)
        if index > 0:
            state.impulse += 0.5 * (state.normal + normal) * (left_at - touched_at) * law.step
        state.peak = max(state.peak, normal)
        state.depth = max(state.depth, -gap)
        state.normal = normal
        state.friction = friction_force(normal, slip, law)
        if gap >= 0.0:
            write_event(events[event_count], number, state, (index - 1 + left_at) * law.step)
            event_count += 1
            state.impact_speed = 0.0
    state.gap, state.rate = gap, rate
    return event_count


@kernel
def renew_corners(
    index: int,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> tuple[int, float, float, float]:
    """Renew all corners with accepted state ``index``; ended contacts go to ``events``.

    Parameters
    ----------
    index : int
        Number of steps from t = 0.
    q, v : ndarray, shape (3,)
        The slider's coordinates (x from the guide's centre line) and their rates.
    law, corners : ndarray
        From ``contact`` and ``point_contact``; ``corners`` is changed in place.
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
        outward = -1.0 if side == 0 else 1.0
        low, up = corners[side], corners[side + 2]
        gap0, rate0, slip0, rx0, ry0 = corner_motion(side, q[0], q[2], v[0], v[1], v[2], constants)
        gap1, rate1, slip1, rx1, ry1 = corner_motion(side + 2, q[0], q[2], v[0], v[1], v[2], constants)
        touched0 = begin(index, gap0, rate0, low, constants)
        touched1 = begin(index, gap1, rate1, up, constants)
        # A corner that has left has no force, though its speed is still kept for the table
        normal0, normal1 = side_normals(
            -gap0,
            -rate0,
            low.impact_speed if gap0 < 0.0 else 0.0,
            -gap1,
            -rate1,
            up.impact_speed if gap1 < 0.0 else 0.0,
            constants,
        )
        event_count = carry_on(
            index, gap0, rate0, slip0, normal0, touched0, side, low, constants, events, event_count
        )
        event_count = carry_on(
            index, gap1, rate1, slip1, normal1, touched1, side + 2, up, constants, events, event_count
        )
        for corner, rx, ry in ((low, rx0, ry0), (up, rx1, ry1)):
            fx -= outward * corner.normal
            fy += corner.friction
            moment += rx * corner.friction + ry * outward * corner.normal
    return event_count, fx, fy, moment
