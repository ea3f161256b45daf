"""Linkage in closed form: the driven four-bar O-A-B-H for the kernels, and all bodies at t = 0."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.kernels import entry, kernel
from exudyn_model.parameters import Mechanism, Parameters

CRANK, ROD2, ROCKER, ROD4, SLIDER = range(5)

# Number of crank positions at which closure is checked: 0.1 degrees apart, where the linkage hardly changes
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
def driven_tip(time: float, mechanism: Mechanism) -> TipMotion:
    """Return the motion of joint C behind an ideal crank pin at a time in s.

    The rocker's angle follows from the law of cosines in the triangle A, H, B; its angular velocity and
    acceleration from (B - A)^2, which is constant, differentiated once and twice (Eq. 16, rows 1 to 8).
    """
    w1 = mechanism.omega
    angle1 = mechanism.crank_angle + w1 * time
    ax, ay = mechanism.crank.length * np.cos(angle1), mechanism.crank.length * np.sin(angle1)
    span_x, span_y = mechanism.pivot_x - ax, mechanism.pivot_y - ay
    squared, arm = span_x * span_x + span_y * span_y, mechanism.rocker.centroid
    cosine = (mechanism.rod2.length**2 - squared - arm * arm) / (2.0 * arm * np.sqrt(squared))
    angle3 = np.arctan2(span_y, span_x) + mechanism.rocker_branch * np.arccos(cosine)
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
    return carried_tip(angle3, w3, alpha3, mechanism)


@kernel
def carried_tip(theta3: float, w3: float, alpha3: float, mechanism: Mechanism) -> TipMotion:
    """Return the motion of joint C from that of the rocker, which carries it (rad, s)."""
    x, y = mechanism.rocker.length * np.cos(theta3), mechanism.rocker.length * np.sin(theta3)
    return TipMotion(
        mechanism.pivot_x + x,
        mechanism.pivot_y + y,
        -w3 * y,
        w3 * x,
        -alpha3 * y - w3 * w3 * x,
        alpha3 * x - w3 * w3 * y,
    )


@entry
def driven_rod4(time: float, mechanism: Mechanism) -> tuple[TipMotion, float, float, float]:
    """Return the motion of joint C behind an ideal crank pin, and that of rod 4 with an ideal slider.

    The latter is its angle, angular velocity and acceleration (rad, s), with the slider on the guide's centre
    line, at a ``time`` in s.
    """
    tip, length = driven_tip(time, mechanism), mechanism.rod4.length
    cosine = (mechanism.guide_x - tip.x) / length
    angle = mechanism.slider_branch * np.arccos(cosine)
    sine = np.sin(angle)
    rate = tip.vx / (length * sine)
    return tip, angle, rate, (tip.ax / length - cosine * rate * rate) / sine


class InitialState(NamedTuple):
    """Positions (x, y, angle; m, rad) and velocities of the five bodies, each of shape (5, 3)."""

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]


def assemble(parameters: Parameters) -> InitialState:
    """Return positions and velocities of all bodies at t = 0 that fit the joints and the drive.

    Raises
    ------
    ValueError
        If the linkage cannot be closed at the start or somewhere in a crank cycle.
    """
    mechanism, initial = parameters.mechanism, parameters.initial
    # An ideal slider's line; where the slider has clearance, also the centre line that the tree counts from
    lines, offset, angle, vx, omega = [mechanism.reference_offset], mechanism.reference_offset, 0.0, 0.0, 0.0
    if parameters.guide is not None:
        offset, angle, vx, omega = initial.offset, initial.angle, initial.vx, initial.omega
        lines.append(0.0)
    start = mechanism.crank_angle
    _require_a_turn(mechanism, np.array([mechanism.guide_x + line for line in lines]))
    x5 = mechanism.guide_x + offset
    try:
        rod_angles = _close(mechanism, np.array([start]), np.array([x5]))[:, 0, 0]
    except ValueError as error:
        raise ValueError(f"initial.slider_offset = {offset} m: {error}") from None
    angles = np.array([start, *rod_angles, angle])
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    n = np.stack([-u[:, 1], u[:, 0]], axis=1)
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    # Section 2 of docs/model.md: w2 and w3 from the loop O-A-B-H, w4 from the slider's vx
    across = n[ROCKER] @ u[ROD2]
    w1 = mechanism.omega
    w2 = w1 * crank.length * (n[CRANK] @ u[ROCKER]) / (rod2.length * across)
    w3 = w1 * crank.length * (n[CRANK] @ u[ROD2]) / (rocker.centroid * across)
    w4 = (w3 * rocker.length * n[ROCKER, 0] - vx) / (rod4.length * u[ROD4, 1])
    # Arms of joints and centroids along the chain: from O over A, from H over C
    pivot = np.array([mechanism.pivot_x, mechanism.pivot_y])
    places = [
        crank.centroid * u[CRANK],
        crank.length * u[CRANK] + rod2.centroid * u[ROD2],
        pivot + rocker.centroid * u[ROCKER],
        pivot + rocker.length * u[ROCKER] + rod4.centroid * u[ROD4],
        pivot + rocker.length * u[ROCKER] + rod4.length * u[ROD4],
    ]
    rates = [
        w1 * crank.centroid * n[CRANK],
        w1 * crank.length * n[CRANK] + w2 * rod2.centroid * n[ROD2],
        w3 * rocker.centroid * n[ROCKER],
        w3 * rocker.length * n[ROCKER] + w4 * rod4.centroid * n[ROD4],
        w3 * rocker.length * n[ROCKER] + w4 * rod4.length * n[ROD4],
    ]
    places[SLIDER][0], rates[SLIDER][0] = x5, vx  # not the round-off of cos(arccos)
    speeds = [w1, w2, w3, w4, omega]
    return InitialState(np.column_stack([places, angles]), np.column_stack([rates, speeds]))


def _require_a_turn(mechanism: Mechanism, lines: NDArray[np.float64]) -> None:
    """Raise a ValueError unless the linkage closes over a turn with the slider at each x of ``lines`` (m)."""
    positions = mechanism.crank_angle + np.linspace(0.0, 2.0 * math.pi, _POSITIONS, endpoint=False)
    # A nearest to H, and farthest
    extremes = math.atan2(mechanism.pivot_y, mechanism.pivot_x) + np.array([0.0, math.pi])
    angles = _close(mechanism, np.concatenate([positions, extremes]), lines)
    # Closer about the crank angles at which joint C is leftmost and rightmost
    c_x = np.cos(angles[1, 0, :_POSITIONS])
    offsets = np.linspace(-1.0, 1.0, 101) * (2.0 * math.pi / _POSITIONS)
    for outermost in (c_x.argmin(), c_x.argmax()):
        _close(mechanism, positions[outermost] + offsets, lines)


def _close(
    mechanism: Mechanism, crank_angles: NDArray[np.float64], lines: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the angles of rod 2, rocker and rod 4, shape (3, lines, n), from those of the crank (rad).

    ``lines``, shape (lines,), are the x of the slider, m.

    Raises
    ------
    ValueError
        If the linkage does not close at one of the angles.
    """
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    tip_x, tip_y = crank.length * np.cos(crank_angles), crank.length * np.sin(crank_angles)
    span_x, span_y = mechanism.pivot_x - tip_x, mechanism.pivot_y - tip_y
    squared, arm = span_x**2 + span_y**2, rocker.centroid
    with np.errstate(divide="ignore", invalid="ignore"):  # A in H: not closed either
        at_pivot = (rod2.length**2 - squared - arm**2) / (2 * arm * np.sqrt(squared))
        rocker_angle = np.arctan2(span_y, span_x) + mechanism.rocker_branch * np.arccos(at_pivot)
        c_x = mechanism.pivot_x + rocker.length * np.cos(rocker_angle)
        at_tip = (lines[:, None] - c_x) / rod4.length
        rod4_angle = mechanism.slider_branch * np.arccos(at_tip)
    # At exactly 1 the linkage is stretched: it closes, but its velocities are not determined
    open_loop, open_rod4 = ~(np.abs(at_pivot) < 1), ~(np.abs(at_tip) < 1).all(axis=0)
    failures = np.flatnonzero(open_loop | open_rod4)
    if failures.size:
        parts = "crank, rod 2 and rocker" if open_loop[failures[0]] else "rod 4 and slider"
        degrees = math.degrees(crank_angles[failures[0]]) % 360
        raise ValueError(f"mechanism: {parts} cannot be assembled at a crank angle of {degrees:.2f} degrees")
    rod2_angle = np.arctan2(span_y + arm * np.sin(rocker_angle), span_x + arm * np.cos(rocker_angle))
    shape = rod4_angle.shape
    return np.array([np.broadcast_to(rod2_angle, shape), np.broadcast_to(rocker_angle, shape), rod4_angle])
