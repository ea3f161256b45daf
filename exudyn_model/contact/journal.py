"""Clearance of the crank pin A: the crank's journal in the bearing of rod 2 (Figs. 7, 8).

The journal, of radius R_j, sits on the crank's tip; the bearing, of radius R_b = R_j + clearance, at the
start of rod 2. With e from the bearing's centre to the journal's, the contact is closed where |e| exceeds
the clearance; n = e / |e|. Force and friction act in the point of the bearing's surface, its centre + R_b n,
on both bodies. The law is that of one point (``point_contact``) for two conforming cylinders.

The forces are of some kN and rod 2 is light: across the contact, friction changes its speed in a step of
1e-6 s by several times the speed over which Eq. 14 rises. Newton's method then goes from full friction of
one direction to that of the other and back for ever. So the iteration keeps to one straight piece of
Eq. 14; where it converges outside of it, :func:`settle_regime` goes to the next piece, and the iteration is
taken up again. A step is accepted where piece and slip fit: the force is that of Eqs. 13-14.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import direct, kernel
from exudyn_model.contact import ForceUserFunction
from exudyn_model.contact_memory import begin, carry_on
from exudyn_model.parameters import Parameters
from exudyn_model.point_contact import (
    PIN,
    damped,
    friction_in_regime,
    impact_speed_in_force,
    law_type,
    slip_regime,
    surface_law,
)

_LAW = law_type("clearance", "bearing_radius", "crank_to_tip", "rod2_centroid")


def journal_law(parameters: Parameters, step: float) -> NDArray[np.void]:
    """Collect the constants of the kernels in one record, shape (1,); lengths in m, the step in s.

    All zero where the pin is ideal.
    """
    journal, mechanism = parameters.journal, parameters.mechanism
    if journal is None:
        return np.zeros(1, _LAW)
    law = surface_law(_LAW, journal, step)
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
def crank_and_rod2(q: NDArray[np.float64], v: NDArray[np.float64]) -> CrankAndRod2:
    """Take both from the first six coordinates and their rates."""
    return CrankAndRod2(q[0], q[1], q[2], q[3], q[4], q[5], v[0], v[1], v[2], v[3], v[4], v[5])


@kernel
def pin_motion(bodies: CrankAndRod2, law: Any) -> tuple[float, float, float, float, float]:
    """Gap (m, positive open), its rate, slip (m/s) and the unit vector n.

    The slip is the velocity of the bearing's material relative to the journal's, along n turned by +90
    degrees.
    """
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
    return gap, rate, slip, nx, ny


@kernel
def pin_load(
    normal: float, friction: float, nx: float, ny: float, gap: float, bodies: CrankAndRod2, law: Any
) -> tuple[float, float, float, float]:
    """Force on rod 2 (N), moments about the centres of crank and rod 2 (N m); the crank's force opposes."""
    fx, fy = normal * nx - friction * ny, normal * ny + friction * nx
    # From the bearing's surface back to the journal's centre: R_b - |e|
    radius1 = law.bearing_radius - law.clearance + gap
    x1, y1 = (
        law.crank_to_tip * np.cos(bodies.angle1) + radius1 * nx,
        law.crank_to_tip * np.sin(bodies.angle1) + radius1 * ny,
    )
    x2 = -law.rod2_centroid * np.cos(bodies.angle2) + law.bearing_radius * nx
    y2 = -law.rod2_centroid * np.sin(bodies.angle2) + law.bearing_radius * ny
    return fx, fy, y1 * fx - x1 * fy, x2 * fy - y2 * fx


@kernel
def journal_force(
    x1: float,
    y1: float,
    angle1: float,
    x2: float,
    y2: float,
    angle2: float,
    vx1: float,
    vy1: float,
    w1: float,
    vx2: float,
    vy2: float,
    w2: float,
    law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> tuple[float, float, float, float, float, float]:
    """Force and moment on the crank, then on rod 2 (N, N m), in a trial state of a step's end.

    Plain numbers come in, since Python calls this in every iteration: a tuple takes longer to unpack.

    Parameters
    ----------
    x1, y1, angle1, x2, y2, angle2 : float
        Centres and angles of crank and rod 2 (m, rad); then their rates.
    law : ndarray, shape (1,)
        From :func:`journal_law`.
    contacts : ndarray, shape (5,)
        State of the contacts at the start of the step.
    """
    constants = law[0]
    bodies = CrankAndRod2(x1, y1, angle1, x2, y2, angle2, vx1, vy1, w1, vx2, vy2, w2)
    gap, rate, slip, nx, ny = pin_motion(bodies, constants)
    if gap >= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    speed = impact_speed_in_force(contacts[PIN], gap, rate, constants)
    normal = damped(constants.stiffness * (-gap) ** constants.exponent, -rate, speed, constants)
    friction = friction_in_regime(normal, slip, contacts[PIN].regime, constants)
    fx, fy, moment1, moment2 = pin_load(normal, friction, nx, ny, gap, bodies, constants)
    return -fx, -fy, moment1, fx, fy, moment2


@kernel
def settle_regime(
    q: NDArray[np.float64], v: NDArray[np.float64], law: NDArray[np.void], contacts: NDArray[np.void]
) -> bool:
    """Whether the friction's piece fits the slip that Newton's method has come to; else take the next one.

    Arguments as for :func:`renew_pin`. One piece at a time: the force falls with the slip, so that the way
    from piece to piece has one direction.
    """
    gap, _, slip, _, _ = pin_motion(crank_and_rod2(q, v), law[0])
    state, wanted = contacts[PIN], slip_regime(slip, law[0])
    if gap >= 0.0:  # no friction in any piece
        state.regime = wanted
    fits: bool = state.regime == wanted
    state.regime += np.sign(wanted - state.regime)
    return fits


@kernel
def renew_pin(
    index: int,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    law: NDArray[np.void],
    contacts: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> tuple[int, float, float, float]:
    """Renew the pin's memory with accepted state ``index``; an ended contact goes to ``events``.

    Parameters
    ----------
    index : int
        Number of steps from t = 0.
    q, v : ndarray, shape (6,)
        Coordinates of crank and rod 2, and their rates.
    law, contacts : ndarray
        As for :func:`journal_force`; ``contacts`` is changed in place.
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
    gap, rate, slip, nx, ny = pin_motion(bodies, constants)
    if index == 0:
        state.regime = slip_regime(slip, constants)
    touched_at, normal = begin(index, gap, rate, state, constants), 0.0
    if gap < 0.0:
        elastic = constants.stiffness * (-gap) ** constants.exponent
        normal = damped(elastic, -rate, state.impact_speed, constants)
    event_count = carry_on(
        index, gap, rate, slip, normal, touched_at, PIN, state, constants, events, event_count
    )
    fx, fy, _, moment = pin_load(state.normal, state.friction, nx, ny, gap, bodies, constants)
    return event_count, fx, fy, moment


def force_user_function(law: NDArray[np.void], contacts: NDArray[np.void]) -> ForceUserFunction:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the nodes of crank and rod 2."""
    found = direct(journal_force, *[0.0] * 12, law, contacts)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        return found(q[0], q[1], q[2], q[3], q[4], q[5], v[0], v[1], v[2], v[3], v[4], v[5], law, contacts)

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
