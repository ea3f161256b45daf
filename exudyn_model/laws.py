"""Contact laws: of a side of the slider, and modified Coulomb friction (Eqs. 12, 13) of any contact.

Of a side depths and rates of both corners go in, forces and energies come out.

Four laws, by their number in ``LAWS``; each is a branch of :func:`side_forces` or of :func:`damped`, and
``REMEMBERED_BY_SIDE`` names those where it is the side that remembers its touch:

- "hertz-corners": each corner follows Eqs. 9-11 independently.
- "paper-switching": the same until both corners are in contact. Then, literally Eqs. 7-8: the surface's force
  K_s (d1 + d2) / 2 without damping, in the centroid of the penetrated trapezoid, as the two forces in the
  corners that have this resultant. The force jumps at the switch, and with it what is stored: the audit of
  the energy shows what the jumps bring in.
- "foundation": Eqs. 7-8 also where a part of the side alone is inside, an elastic layer along it. It stores
  K_s (d1^2 + d1 d2 + d2^2) / 6, and K_s d1^3 / (6 (d1 - d2)) where d2 < 0 < d1, continuous there up to second
  derivatives. The forces in the corners are statically equivalent to the layer's pressure: the corner that is
  outside bears its part too. Damping and friction are those of the point which divides the side as the
  forces in its corners do.
- "adams-impact": each corner independently, with a damping that follows from its depth alone: the function
  IMPACT of ADAMS. Also that of the journal.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    DAMPING,
    DAMPING_DEPTH,
    EXPONENT,
    FRICTION_COEFFICIENT,
    LAW,
    SIDE_STIFFNESS,
    STATIC_SPEED,
    STIFFNESS,
    TRANSITION_SPEED,
)
from exudyn_model.kernels import kernel

LAWS = ("hertz-corners", "paper-switching", "foundation", "adams-impact")
_, SWITCHING, FOUNDATION, IMPACT = range(len(LAWS))
REMEMBERED_BY_SIDE = ("foundation",)


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
    """What a side does at a moment."""

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
    slip: float  # Where the friction of a side as a whole acts, m/s; else not a number


@kernel
def damped(
    elastic: float, depth: float, depth_rate: float, impact_speed: float, law: NDArray[np.float64]
) -> float:
    """Return an elastic force with its damping (N), at least 0: a surface cannot pull.

    Eq. 11: elastic (1 + C depth_rate / impact_speed), which does not depend on the depth (m) itself. The law
    "adams-impact" has no impact speed: elastic + c depth_rate, c from 0 to c_max at the depth d_max by a
    cubic step.
    """
    if law[LAW] == IMPACT:
        share = min(depth / law[DAMPING_DEPTH], 1.0)
        force: float = elastic + law[DAMPING] * share * share * (3.0 - 2.0 * share) * depth_rate
    else:
        force = elastic * (1.0 + law[DAMPING] * depth_rate / impact_speed)
    return max(force, 0.0)


@kernel
def friction_force(normal: float, slip: float, law: NDArray[np.float64]) -> float:
    """Eqs. 12, 13: friction (N) against the slip (m/s); zero below the static speed."""
    ramp = (abs(slip) - law[STATIC_SPEED]) / (law[TRANSITION_SPEED] - law[STATIC_SPEED])
    force: float = -law[FRICTION_COEFFICIENT] * min(max(ramp, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def slip_regime(slip: float, law: NDArray[np.float64]) -> float:
    """Return the straight piece of Eq. 13: 0 none, 1 rising, 2 full friction; with the slip's sign."""
    piece = 2.0 if abs(slip) >= law[TRANSITION_SPEED] else 1.0 if abs(slip) >= law[STATIC_SPEED] else 0.0
    return piece if slip >= 0.0 else -piece


@kernel
def friction_in_regime(normal: float, slip: float, regime: float, law: NDArray[np.float64]) -> float:
    """Extend one piece of :func:`friction_force` (N), named as by :func:`slip_regime`, to any slip."""
    if regime == 0.0:
        return 0.0
    sign, ramp = np.sign(regime), 1.0
    if abs(regime) == 1.0:
        ramp = (sign * slip - law[STATIC_SPEED]) / (law[TRANSITION_SPEED] - law[STATIC_SPEED])
    force: float = -law[FRICTION_COEFFICIENT] * ramp * normal * sign
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
    share = depth / (depth - other)  # of the side, that is inside
    inside, outside = sixth * depth * share * (3.0 - share), sixth * depth * share * share
    return (inside, outside) if lower > upper else (outside, inside)


@kernel
def side_forces(
    lower: CornerMotion,
    upper: CornerMotion,
    lower_speed: float,
    upper_speed: float,
    law: NDArray[np.float64],
) -> SideForces:
    """Return the forces of a side.

    An impact speed (m/s) of 0 means that the corner is not in contact, whatever its depth; where the side
    remembers, both are that of the side. Steps that end at each touch and leaving have trial states a little
    past it, where a corner in contact has a negative depth: a surface's force goes on smoothly.
    """
    d1, d2, r1, r2 = -lower.gap, -upper.gap, -lower.rate, -upper.rate
    if law[LAW] == FOUNDATION:
        f1, f2 = foundation_normals(d1, d2, law[SIDE_STIFFNESS])
        total = f1 + f2
        if lower_speed == 0.0 or not total > 0.0:
            return SideForces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.nan)
        rate, slip = (f1 * r1 + f2 * r2) / total, (f1 * lower.slip + f2 * upper.slip) / total
        factor = damped(1.0, max(d1, d2), rate, lower_speed, law)
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
    f1 = law[STIFFNESS] * d1 ** law[EXPONENT] if d1 > 0.0 and lower_speed > 0.0 else 0.0
    f2 = law[STIFFNESS] * d2 ** law[EXPONENT] if d2 > 0.0 and upper_speed > 0.0 else 0.0
    n1 = damped(f1, d1, r1, lower_speed, law) if f1 > 0.0 else 0.0
    n2 = damped(f2, d2, r2, upper_speed, law) if f2 > 0.0 else 0.0
    degree = law[EXPONENT] + 1.0
    if law[LAW] == SWITCHING and lower_speed > 0.0 and upper_speed > 0.0:
        sixth = law[SIDE_STIFFNESS] / 6.0
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
