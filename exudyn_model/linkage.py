"""The driven four-bar O-A-B-H in closed form: the rocker's tip C (Eq. 16, rows 1 to 8).

A function of time where the crank pin is ideal, else of the rocker's angle.
"""

from typing import Any, NamedTuple

import numpy as np

from exudyn_model.compiled import kernel

# Crank positions in a cycle
_POSITIONS = 3600


class TipMotion(NamedTuple):
    """Position (m), velocity (m/s) and acceleration (m/s^2) of joint C."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float


@kernel
def rocker_tip(time: float, linkage: Any) -> TipMotion:
    """Return the motion of joint C.

    The rocker's angle by the law of cosines in the triangle A, H, B; its angular velocity and acceleration
    from the constant length of rod 2, (B - A)^2, differentiated once and twice (Eq. 16, rows 1 to 8).

    Parameters
    ----------
    time : float
        s.
    linkage : record
        From ``constants.linkage_record``.
    """
    w1 = linkage.omega
    angle1 = linkage.crank_angle + w1 * time
    ax, ay = linkage.crank_length * np.cos(angle1), linkage.crank_length * np.sin(angle1)
    span_x, span_y = linkage.pivot_x - ax, linkage.pivot_y - ay
    squared = span_x * span_x + span_y * span_y
    arm = linkage.rocker_to_b
    cosine = (linkage.rod2_length**2 - squared - arm * arm) / (2.0 * arm * np.sqrt(squared))
    angle3 = np.arctan2(span_y, span_x) + linkage.rocker_branch * np.arccos(cosine)
    c3, s3 = np.cos(angle3), np.sin(angle3)
    # Rod 2 from A to B; B rotates about H with radius `arm`
    px, py = span_x + arm * c3, span_y + arm * s3
    across = arm * (-px * s3 + py * c3)
    # p . (vB - vA) = 0
    vax, vay = -w1 * ay, w1 * ax
    w3 = (px * vax + py * vay) / across
    rate_x, rate_y = -arm * w3 * s3 - vax, arm * w3 * c3 - vay
    # p . (aB - aA) + (vB - vA)^2 = 0; A and B are accelerated towards their pivots, B also along its path
    towards_x, towards_y = w1 * w1 * ax - arm * w3 * w3 * c3, w1 * w1 * ay - arm * w3 * w3 * s3
    alpha3 = -(px * towards_x + py * towards_y + rate_x * rate_x + rate_y * rate_y) / across
    length = linkage.rocker_length
    return TipMotion(
        linkage.pivot_x + length * c3,
        linkage.pivot_y + length * s3,
        -length * w3 * s3,
        length * w3 * c3,
        -length * (alpha3 * s3 + w3 * w3 * c3),
        length * (alpha3 * c3 - w3 * w3 * s3),
    )


@kernel
def tip_jerk(linkage: Any) -> float:
    """Bound the rate (m/s^3) at which joint C's acceleration along x changes, over a crank cycle.

    From accelerations 0.1 degrees apart, where the linkage hardly changes (``assembly``): the mean over an
    interval, and as much again as that changes from one interval to the next.
    """
    interval = 2.0 * np.pi / (_POSITIONS * abs(linkage.omega))
    mean, change, before, rise_before = 0.0, 0.0, 0.0, 0.0
    for position in range(_POSITIONS + 2):
        acceleration = rocker_tip(position * interval, linkage).ax
        rise = acceleration - before
        if position > 0:
            mean = max(mean, abs(rise))
        if position > 1:
            change = max(change, abs(rise - rise_before))
        before, rise_before = acceleration, rise
    jerk: float = (mean + change) / interval
    return jerk


@kernel
def carried_tip(theta3: float, w3: float, linkage: Any) -> tuple[float, float, float, float]:
    """Return position (m) and velocity (m/s) of joint C, each as x, y, from the rocker's motion (rad, s)."""
    x, y = linkage.rocker_length * np.cos(theta3), linkage.rocker_length * np.sin(theta3)
    return linkage.pivot_x + x, linkage.pivot_y + y, -w3 * y, w3 * x
