"""Contact laws of a side of the slider, and modified Coulomb friction (Eqs. 12, 13) of any contact.

Four laws give forces and energies from depths and rates of both corners of a side. The number of a law
is its place in ``LAWS``; each is a branch of :func:`side_forces` or of :func:`surface_force`:

- "hertz-corners": each corner follows Eqs. 9-11 independently.
- "paper-switching": the same until both corners are in contact. Then, literally Eqs. 7-8: the surface's force
  K_s (d1 + d2) / 2 without damping, in the centroid of the penetrated trapezoid, as the two forces in the
  corners that have this resultant. The force jumps at the switch, and so does the stored energy: the audit
  of the energy shows what the jumps add.
- "foundation": Eqs. 7-8 also where a part of the side alone is inside, an elastic layer along it. It stores
  K_s (d1^2 + d1 d2 + d2^2) / 6, and K_s d1^3 / (6 (d1 - d2)) where d2 < 0 < d1, continuous there up to second
  derivatives. The forces in the corners are statically equivalent to the layer's pressure: the corner that is
  outside bears its share too. Damping and friction are those of the point which divides the side as the
  forces in its corners do.
- "adams-impact": each corner independently, with a damping that follows from its depth alone: the function
  IMPACT of ADAMS. Also that of the journal.
"""

from typing import NamedTuple

import numpy as np

from exudyn_model.kernels import kernel

LAWS = ("hertz-corners", "paper-switching", "foundation", "adams-impact")
HERTZ, SWITCHING, FOUNDATION, IMPACT = range(len(LAWS))


class Law(NamedTuple):
    """Constants of the contacts of a slider or of a journal."""

    number: float  # In ``LAWS``; a journal has "hertz-corners" where a side has a law of two corners
    clearance: float  # m
    stiffness: float  # K of Eq. 10, N/m^1.5 (used as it is with any exponent)
    exponent: float  # n of Eq. 9
    damping: float  # C of Eq. 11; of "adams-impact" c_max, N s/m
    speed_floor: float  # Lower bound of the impact speed, m/s
    friction: float  # c_f of Eq. 12
    # v0 and v1 of Eq. 13, m/s
    static_speed: float
    transition_speed: float
    damping_depth: float = 0.0  # d_max of "adams-impact", m
    shared: float = 0.0  # 1: a side has one contact of both corners, not each corner its own
    side_stiffness: float = 0.0  # K_s of Eq. 8, N/m; of a side of the slider
    # Of a slider, m
    half_width: float = 0.0
    half_length: float = 0.0
    bearing_radius: float = 0.0  # Of the crank pin's bearing, m
    # Used by five bodies only: mass of the body on the contact, kg; angle of the axis across the guide, rad,
    # and the unit vector along that axis
    mass: float = 0.0
    direction: float = 0.0
    across_x: float = 1.0
    across_y: float = 0.0


class CornerMotion(NamedTuple):
    """Motion of one corner against its wall."""

    # Gap (m), positive where it is open, and its rate (m/s)
    gap: float
    rate: float
    slip: float  # Speed of the corner along the guide, m/s
    # From the slider's centre to the corner, m
    arm_x: float
    arm_y: float


class SideForces(NamedTuple):
    """Forces of a side in a state, its energy and powers."""

    # Normal forces in the corners, at least 0, N
    lower: float
    upper: float
    # Along the guide, N
    lower_friction: float
    upper_friction: float
    stored: float  # Energy, J
    # Dissipated powers, W
    damping: float
    friction: float
    slip: float  # At the point where a "foundation" has its one friction, m/s; nan under other laws


@kernel
def surface_force(elastic: float, depth: float, depth_rate: float, impact_speed: float, law: Law) -> float:
    """Return the sum of an elastic force and its damping (N), at least 0: a surface cannot pull.

    Eq. 11 gives elastic (1 + C depth_rate / impact_speed), whatever the depth (m); rates in m/s. The law
    "adams-impact" has no impact speed: elastic + c depth_rate, c from 0 to c_max at the depth d_max by a
    cubic step.
    """
    if law.number == IMPACT:
        share = min(depth / law.damping_depth, 1.0)
        force: float = elastic + law.damping * share * share * (3.0 - 2.0 * share) * depth_rate
    else:
        force = elastic * (1.0 + law.damping * depth_rate / impact_speed)
    return max(force, 0.0)


@kernel
def friction_force(normal: float, slip: float, law: Law) -> float:
    """Return the friction (N) of Eqs. 12, 13 against the slip (m/s); zero below the static speed."""
    ramp = (abs(slip) - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * min(max(ramp, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def slip_regime(slip: float, law: Law) -> float:
    """Return the straight piece of Eq. 13 with the slip's sign: 0 no, 1 rising, 2 full friction."""
    piece = 2.0 if abs(slip) >= law.transition_speed else 1.0 if abs(slip) >= law.static_speed else 0.0
    return piece if slip >= 0.0 else -piece


@kernel
def friction_in_regime(normal: float, slip: float, regime: float, law: Law) -> float:
    """Return the friction (N) of the piece ``regime`` (see :func:`slip_regime`), extended to any slip."""
    if regime == 0.0:
        return 0.0
    sign, ramp = np.sign(regime), 1.0
    if abs(regime) == 1.0:
        ramp = (sign * slip - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * ramp * normal * sign
    return force


@kernel
def foundation_normals(lower: float, upper: float, stiffness: float) -> tuple[float, float]:
    """Return the elastic normal forces (N) of both corners of a side on an elastic foundation.

    ``lower`` and ``upper`` are depths (m), ``stiffness`` is K_s (N/m).
    """
    sixth = stiffness / 6.0
    if lower > 0.0 and upper > 0.0:
        return sixth * (2.0 * lower + upper), sixth * (lower + 2.0 * upper)
    depth, other = max(lower, upper), min(lower, upper)
    if not depth > 0.0:
        return 0.0, 0.0
    share = depth / (depth - other)  # of the side inside its wall
    inside, outside = sixth * depth * share * (3.0 - share), sixth * depth * share * share
    return (inside, outside) if lower > upper else (outside, inside)


@kernel
def side_forces(
    lower: CornerMotion,
    upper: CornerMotion,
    lower_speed: float,
    upper_speed: float,
    law: Law,
) -> SideForces:
    """Return the forces of a side.

    An impact speed (m/s) of 0 means that the corner is not in contact, whatever its depth; under a shared
    contact (``Law.shared``) both are that of the side. Steps that end at each touch and leaving have trial
    states a little past it, where a corner in contact has a negative depth: a side's force goes on smoothly.
    """
    d1, d2, r1, r2 = -lower.gap, -upper.gap, -lower.rate, -upper.rate
    if law.number == FOUNDATION:
        f1, f2 = foundation_normals(d1, d2, law.side_stiffness)
        total = f1 + f2
        if lower_speed == 0.0 or not total > 0.0:
            return SideForces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.nan)
        rate, slip = (f1 * r1 + f2 * r2) / total, (f1 * lower.slip + f2 * upper.slip) / total
        factor = surface_force(1.0, max(d1, d2), rate, lower_speed, law)
        friction = friction_force(factor, slip, law)
        return SideForces(
            factor * f1,
            factor * f2,
            friction * f1,
            friction * f2,
            0.5 * (f1 * d1 + f2 * d2),
            (factor - 1.0) * total * rate,
            -friction * total * slip,
            slip,
        )
    f1 = law.stiffness * d1**law.exponent if d1 > 0.0 and lower_speed > 0.0 else 0.0
    f2 = law.stiffness * d2**law.exponent if d2 > 0.0 and upper_speed > 0.0 else 0.0
    n1 = surface_force(f1, d1, r1, lower_speed, law) if f1 > 0.0 else 0.0
    n2 = surface_force(f2, d2, r2, upper_speed, law) if f2 > 0.0 else 0.0
    degree = law.exponent + 1.0
    if law.number == SWITCHING and lower_speed > 0.0 and upper_speed > 0.0:
        sixth = law.side_stiffness / 6.0
        n1 = f1 = max(sixth * (2.0 * d1 + d2), 0.0)
        n2 = f2 = max(sixth * (d1 + 2.0 * d2), 0.0)
        degree = 2.0
    t1, t2 = friction_force(n1, lower.slip, law), friction_force(n2, upper.slip, law)
    # Forces are homogeneous functions of the depths, of a degree one less than their potential's (Euler)
    return SideForces(
        n1,
        n2,
        t1,
        t2,
        (f1 * d1 + f2 * d2) / degree,
        (n1 - f1) * r1 + (n2 - f2) * r2,
        -t1 * lower.slip - t2 * upper.slip,
        np.nan,
    )
