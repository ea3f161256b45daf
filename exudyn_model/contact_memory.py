"""Renew the corners' memory from an accepted state, and keep a row of every contact that ends.

This is the only place where an impact speed is frozen or forgotten. It depends on accepted states alone
(the last one is what ``corners`` still holds), never on trial states of the Newton iteration.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_motion, crossing, friction_force, normal_force, touch

EVENT = np.dtype(
    [("corner", np.int64)]
    + [
        (name, np.float64)
        for name in ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")
    ]
)


@kernel
def write_event(row: Any, number: int, corner: Any, end: float) -> None:
    """Fill one row of the table of events from the accumulated contact of a corner."""
    row.corner = number
    row.start = corner.start
    row.end = end
    row.normal_speed = corner.impact_speed
    row.impulse = corner.impulse
    row.peak_force = corner.peak
    row.largest_depth = corner.depth


@kernel
def renew_corner(index: int, gap: float, rate: float, slip: float, corner: Any, law: Any) -> float:
    """Bring one corner from accepted state ``index - 1`` to ``index``.

    Returns
    -------
    float
        Time (s) at which its contact ended inside the step, or -1. Then the accumulated contact is
        complete, and the caller clears the impact speed.
    """
    step = law.step
    touched_at = 0.0  # fraction of the step from which the contact force acts
    if corner.impact_speed == 0.0 and gap < 0.0:
        if index == 0:
            speed = max(-rate, law.impact_speed_floor)
            corner.start = 0.0
        else:
            touched_at, speed = touch(corner.gap, corner.rate, gap, rate, law)
            corner.start = (index - 1 + touched_at) * step
        corner.impact_speed = speed
        corner.normal, corner.impulse, corner.peak, corner.depth = 0.0, 0.0, 0.0, 0.0
    ended = -1.0
    if corner.impact_speed > 0.0:
        normal, left_at = 0.0, 1.0
        if gap < 0.0:
            normal = normal_force(-gap, -rate, corner.impact_speed, law)
        else:
            left_at = crossing(corner.gap, corner.rate, gap, rate, step)
            ended = (index - 1 + left_at) * step
        if index > 0:
            corner.impulse += 0.5 * (corner.normal + normal) * (left_at - touched_at) * step
        corner.peak = max(corner.peak, normal)
        corner.depth = max(corner.depth, -gap)
        corner.normal = normal
        corner.friction = friction_force(normal, slip, law)
    corner.gap, corner.rate = gap, rate
    return ended


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
        From ``contact``; ``corners`` is changed in place.
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
    for number in range(4):
        gap, rate, slip, rx, ry = corner_motion(number, q[0], q[2], v[0], v[1], v[2], constants)
        corner = corners[number]
        ended = renew_corner(index, gap, rate, slip, corner, constants)
        if ended >= 0.0:
            write_event(events[event_count], number, corner, ended)
            event_count += 1
            corner.impact_speed = 0.0
        outward = -1.0 if number % 2 == 0 else 1.0
        fx -= outward * corner.normal
        fy += corner.friction
        moment += rx * corner.friction + ry * outward * corner.normal
    return event_count, fx, fy, moment
