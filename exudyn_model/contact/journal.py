"""Clearance of the crank pin A: the crank's journal in the bearing of rod 2 (Figs. 7, 8).

The journal, of radius R_j, sits on the crank's tip; the bearing, of radius R_b = R_j + clearance, at the
start of rod 2. With e from the bearing's centre to the journal's, the contact is closed where |e| exceeds
the clearance; n = e / |e|. Force and friction act in the point of the bearing's surface, its centre + R_b n,
on both bodies. The law is that of one point (``point``) for two conforming cylinders.

The forces are of some kN and rod 2 is light: across the contact, friction changes its speed in a step of
1e-6 s by several times the speed over which Eq. 13 rises. Newton's method then goes from full friction of
one direction to that of the other and back indefinitely. So the iteration keeps to one straight piece of
Eq. 13; where it converges outside of it, :func:`settle_regime` goes to the next piece, and the iteration is
taken up again. A step is accepted where piece and slip fit: the force is that of Eqs. 12-13.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import (
    CRANK_ANGLE,
    CRANK_X,
    CRANK_Y,
    ROD2_ANGLE,
    ROD2_X,
    ROD2_Y,
)
from exudyn_model.compiled import ForceUserFunction, direct, kernel
from exudyn_model.contact.friction import friction_in_regime, slip_regime
from exudyn_model.contact.impact_speed import impact_speed_in_force
from exudyn_model.contact.point import damped, elastic_force, law_type, surface_law
from exudyn_model.contact.states import PIN
from exudyn_model.parameters import Parameters

# Coordinates of crank and rod 2 (m, rad), or their rates
PairOfBodies = tuple[float, float, float, float, float, float]

_LAW = law_type("clearance", "bearing_radius", "crank_to_tip", "rod2_centroid")


def journal_law(parameters: Parameters, step: float) -> NDArray[np.void]:
    """Collect the constants of the kernels in one record, shape (1,); lengths in m, the step in s.

    All zero where the pin is ideal.
    """
    journal, mechanism = parameters.journal, parameters.mechanism
    if journal is None:
        return np.zeros(1, _LAW)
    law = surface_law(_LAW, journal, step, mechanism.rod2.mass)
    law["clearance"] = journal.clearance
    law["bearing_radius"] = journal.radius + journal.clearance
    law["crank_to_tip"] = mechanism.crank.to_tip
    law["rod2_centroid"] = mechanism.rod2.centroid
    return law


class CrankAndRod2(NamedTuple):
    """Centres (m) and angles (rad) of crank, 1, and rod 2, and their rates."""

    x1: float
    y1: float
    angle1: float
    x2: float
    y2: float
    angle2: float
    vx1: float
    vy1: float
    w1: float
    vx2: float
    vy2: float
    w2: float


@kernel
def crank_and_rod2(
    q: NDArray[np.float64] | PairOfBodies, v: NDArray[np.float64] | PairOfBodies
) -> CrankAndRod2:
    """Take both from the first six coordinates of the five bodies and their rates."""
    return CrankAndRod2(
        q[CRANK_X],
        q[CRANK_Y],
        q[CRANK_ANGLE],
        q[ROD2_X],
        q[ROD2_Y],
        q[ROD2_ANGLE],
        v[CRANK_X],
        v[CRANK_Y],
        v[CRANK_ANGLE],
        v[ROD2_X],
        v[ROD2_Y],
        v[ROD2_ANGLE],
    )


class PinMotion(NamedTuple):
    """Motion of the journal in its bearing.

    Attributes
    ----------
    gap, rate : float
        Gap (m), positive where it is open, and its rate (m/s).
    slip : float
        Velocity (m/s) of the bearing's material relative to the journal's, along n rotated by +90 degrees.
    nx, ny : float
        The unit vector n.
    """

    gap: float
    rate: float
    slip: float
    nx: float
    ny: float


@kernel
def pin_motion(bodies: CrankAndRod2, law: Any) -> PinMotion:
    """Return the motion of the journal in its bearing."""
    jx, jy = law.crank_to_tip * np.cos(bodies.angle1), law.crank_to_tip * np.sin(bodies.angle1)
    bx, by = -law.rod2_centroid * np.cos(bodies.angle2), -law.rod2_centroid * np.sin(bodies.angle2)
    ex, ey = bodies.x1 + jx - bodies.x2 - bx, bodies.y1 + jy - bodies.y2 - by
    distance = np.hypot(ex, ey)
    # Centred to the last digit there is no direction, and no contact that would need it
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    w1, w2 = bodies.w1, bodies.w2
    vx = bodies.vx1 - w1 * jy - bodies.vx2 + w2 * by
    vy = bodies.vy1 + w1 * jx - bodies.vy2 - w2 * bx
    gap, rate = law.clearance - distance, -(nx * vx + ny * vy)
    slip = ny * vx - nx * vy + w2 * law.bearing_radius - w1 * (law.bearing_radius - distance)
    return PinMotion(gap, rate, slip, nx, ny)


@kernel
def pin_load(
    normal: float, friction: float, motion: PinMotion, bodies: CrankAndRod2, law: Any
) -> tuple[float, float, float, float]:
    """Return the force on rod 2 (N) and the moments about the centres of crank and rod 2 (N m).

    The force on the crank is opposite.
    """
    nx, ny = motion.nx, motion.ny
    fx, fy = normal * nx - friction * ny, normal * ny + friction * nx
    # From the bearing's surface back to the journal's centre: R_b - |e|
    radius1 = law.bearing_radius - law.clearance + motion.gap
    x1, y1 = (
        law.crank_to_tip * np.cos(bodies.angle1) + radius1 * nx,
        law.crank_to_tip * np.sin(bodies.angle1) + radius1 * ny,
    )
    x2 = -law.rod2_centroid * np.cos(bodies.angle2) + law.bearing_radius * nx
    y2 = -law.rod2_centroid * np.sin(bodies.angle2) + law.bearing_radius * ny
    return fx, fy, y1 * fx - x1 * fy, x2 * fy - y2 * fx


@kernel
def journal_force(
    q: PairOfBodies, v: PairOfBodies, law: NDArray[np.void], contacts: NDArray[np.void]
) -> tuple[float, float, float, float, float, float]:
    """Return force and moment on the crank, then on rod 2 (N, N m), in a trial state of a step's end.

    Parameters
    ----------
    q, v : tuple of float, length 6
        Centres and angles of crank and rod 2 (m, rad), and their rates.
    law : ndarray, shape (1,)
        From :func:`journal_law`.
    contacts : ndarray, shape (5,)
        States of the contacts at the start of the step.
    """
    constants = law[0]
    bodies = crank_and_rod2(q, v)
    motion = pin_motion(bodies, constants)
    if motion.gap >= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    speed = impact_speed_in_force(contacts[PIN], motion.gap, motion.rate, constants)
    if speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    normal = damped(elastic_force(motion.gap, constants), -motion.rate, speed, constants)
    friction = friction_in_regime(normal, motion.slip, contacts[PIN].regime, constants)
    fx, fy, moment1, moment2 = pin_load(normal, friction, motion, bodies, constants)
    return -fx, -fy, moment1, fx, fy, moment2


@kernel
def settle_regime(
    q: NDArray[np.float64], v: NDArray[np.float64], law: NDArray[np.void], contacts: NDArray[np.void]
) -> bool:
    """Return whether the friction's piece fits the slip that Newton's method has come to; else take the next.

    Arguments as for :func:`journal_force`, as vectors of Exudyn's. One piece at a time: the force falls with
    the slip, so that the way from piece to piece has one direction.
    """
    motion = pin_motion(crank_and_rod2(q, v), law[0])
    state, wanted = contacts[PIN], slip_regime(motion.slip, law[0])
    if motion.gap >= 0.0:  # no friction in any piece
        state.regime = wanted
    fits: bool = state.regime == wanted
    state.regime += np.sign(wanted - state.regime)
    return fits


def force_user_function(law: NDArray[np.void], contacts: NDArray[np.void]) -> ForceUserFunction:
    """Make the ``forceUserFunction`` of an ``ObjectGenericODE2`` on the nodes of crank and rod 2."""
    pair = (0.0,) * 6
    found = direct(journal_force, pair, pair, law, contacts)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        # Tuples cost as much as twelve numbers; lists would be copied element by element
        return found(tuple(q), tuple(v), law, contacts)

    return force


def post_newton_user_function(
    law: NDArray[np.void], contacts: NDArray[np.void]
) -> Callable[[Any, float], list[float]]:
    """Make Exudyn's post-Newton function: an error above 1 takes the iteration up again.

    Crank and rod 2 must be the first bodies of the system.
    """

    def settle(mbs: Any, t: float) -> list[float]:
        del t
        q, v = mbs.systemData.GetODE2Coordinates(copy=False), mbs.systemData.GetODE2Coordinates_t(copy=False)
        return [0.0 if settle_regime(q, v, law, contacts) else 2.0, -1.0]

    return settle
