"""The corners' contact by Exudyn's own object instead of the user function: an independent form of the law.

``ObjectContactSphereTriangle`` at each corner: a small sphere inside the slider that touches the corner's
tip, against a triangle that covers the wall. No force of ``exudyn_model.contact`` acts. What is recorded
comes from Exudyn where it reports it: gap, impact speed, normal force, friction. Not reported are the
instants of touch and separation, which the table of contacts interpolates between steps as for the user
function, and the forces at t = 0: a corner that is closed there begins its contact with the first step.
Three things differ from Eqs. 9-14:

- The impact speed is that of the end of the step in which the contact begins, which leaves an error of first
  order in the step: 3.7e-8 m in the first cycle of the paper's case at 2e-6 s, 1.0e-8 m at 1e-6 s.
- Friction rises from no slip on, without the range below ``static_speed``; see ``proportional_zone``.
- A slider that is tilted has its corner 1e-4 m times the square of the angle over 2 farther inside.

And two things are not supported. A corner that begins inside a wall has no impact speed unless it moves
inwards: at rest 1e-6 m inside, it is wrong by the whole clearance after a cycle. Such a start is refused. And
a corner pressed in by more than its sphere's radius comes out behind the wall: there the run is stopped.
"""

from collections.abc import Callable, Mapping
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import MarkerBodyRigid, NodeGenericData, ObjectContactSphereTriangle
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, X, Y
from exudyn_model.compiled import kernel
from exudyn_model.contact.gaps import CornerMotion, corner_motion
from exudyn_model.contact.memory import accumulate, begin
from exudyn_model.contact.states import ACROSS, ALONG, CORNERS
from exudyn_model.parameters import Guide, Parameters

# m: a thousandth of the slider, and more than the corners of steel penetrate
RADIUS = 1e-4
# m: half the height of the walls
_REACH = 10.0
# Columns of what is read of each corner
_GAP, _IMPACT_SPEED, _NORMAL, _FRICTION = range(4)
# Data coordinates of Exudyn's object, and the places of two among them
_DATA, _DATA_GAP, _DATA_IMPACT_SPEED = 4, 0, 2
_CORNERS = len(CORNERS)


def restitution(contact: Guide) -> float:
    """Exudyn's coefficient for the damping of Eq. 11: its Hunt-Crossley factor is 3/2 (1 - coefficient)."""
    return 1.0 - contact.damping / 1.5


def proportional_zone(contact: Guide) -> float:
    """Slip (m/s) at which friction is full."""
    return contact.transition_speed


def sphere_friction(contact: Guide, extrema: Mapping[str, Mapping[str, float]], slip: float) -> float:
    """Bound the power (W) that the force along the wall can bring in for each newton of normal force.

    Exudyn's friction is against the slip of the sphere's surface. A slider tilted by an angle has its
    corner's tip in another place, by the radius times half the square of the angle. And the normal is the
    direction from the wall, a triangle of 10 m, to the sphere's centre: many roundings of 2e-15 m, over the
    radius; measured are 5e-14 m.

    Parameters
    ----------
    contact : Guide
    extrema : mapping
        Of the run: "slider_angle" (rad) and "slider_omega" (rad/s), each with "min" and "max".
    slip : float
        Largest one, m/s.
    """
    tilt, spin = (
        max(-extrema[name]["min"], extrema[name]["max"]) for name in ("slider_angle", "slider_omega")
    )
    wrong = RADIUS * tilt * tilt * spin
    return contact.friction * wrong * wrong / proportional_zone(contact) + 1e-12 / RADIUS * slip


def add_corner_contacts(
    mbs: Any,
    ground: Any,
    slider: Any,
    parameters: Parameters,
    motions: list[CornerMotion],
) -> Callable[[], NDArray[np.float64]]:
    """Add four contacts between the bodies ``ground`` and ``slider``.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    ground, slider : exudyn.ObjectIndex
    parameters : Parameters
    motions : list of CornerMotion
        Of the corners at t = 0.

    Raises
    ------
    ValueError
        If a corner starts inside a wall and does not move inwards.

    Returns
    -------
    callable
        Gap (m), impact speed (m/s; that of the contact that is going on), normal force and friction along
        +y (N) of each corner in the current state, shape (4, 4).
    """
    contact, shape = parameters.contact, parameters.mechanism.slider
    resting = [
        motion.gap for motion in motions if motion.gap < 0.0 and -motion.rate < contact.impact_speed_floor
    ]
    if resting:
        raise ValueError(
            f"initial: a corner starts {-min(resting):.3g} m inside a wall without moving inwards: with "
            "solver.exudyn.formulation = 'native' it has no impact speed then; use 'full'"
        )
    wall = shape.width / 2 + contact.clearance
    fixed = mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, 0.0, 0.0]))
    objects = []
    for side, end, motion in zip(ACROSS, ALONG, motions, strict=True):
        x = parameters.mechanism.guide_x + side * wall
        # Its normal, by the order of the points, is towards the slider
        triangle = exu.Vector3DList()
        for y, z in ((-_REACH, -side * _REACH), (-_REACH, side * _REACH), (2 * _REACH, 0.0)):
            triangle.Append([x, y, z])
        centre = [side * (shape.width / 2 - RADIUS), end * shape.length / 2, 0.0]
        # A contact begins at a change of sign: a corner on its wall must not count as closed before
        memory = mbs.AddNode(
            NodeGenericData(
                initialCoordinates=[max(motion.gap, 1e-15), 0.0, 0.0, 0.0],
                numberOfDataCoordinates=_DATA,
            )
        )
        objects.append(
            mbs.AddObject(
                ObjectContactSphereTriangle(
                    markerNumbers=[
                        mbs.AddMarker(MarkerBodyRigid(bodyNumber=slider, localPosition=centre)),
                        fixed,
                    ],
                    nodeNumber=memory,
                    sphereRadius=RADIUS,
                    trianglePoints=triangle,
                    includeEdges=0,
                    impactModel=1,
                    contactStiffness=contact.stiffness,
                    contactStiffnessExponent=contact.exponent,
                    restitutionCoefficient=restitution(contact),
                    minimumImpactVelocity=contact.impact_speed_floor,
                    dynamicFriction=contact.friction,
                    frictionProportionalZone=proportional_zone(contact),
                )
            )
        )
    force = exu.OutputVariableType.Force

    def read() -> NDArray[np.float64]:
        corners = np.zeros((_CORNERS, 4))
        data = mbs.systemData.GetDataCoordinates(copy=False).reshape(_CORNERS, _DATA)
        corners[:, _GAP], corners[:, _IMPACT_SPEED] = data[:, _DATA_GAP], data[:, _DATA_IMPACT_SPEED]
        for number in range(_CORNERS):
            if corners[number, _GAP] < 0.0:
                fx, fy, _ = mbs.GetObjectOutput(objects[number], force)
                # On the slider, away from the wall: a wall that pulled would show
                corners[number, _NORMAL], corners[number, _FRICTION] = -ACROSS[number] * fx, fy
        return corners

    return read


@kernel
def deepest(q: NDArray[np.float64], law: NDArray[np.void]) -> float:
    """Return how deep (m) the deepest corner is in a wall; negative if none is. ``q``: of the slider."""
    depth = -np.inf
    for number in range(_CORNERS):
        depth = max(depth, -corner_motion(number, q[X], q[ANGLE], 0.0, 0.0, 0.0, law[0]).gap)
    return depth


@kernel
def update_native_corners(
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    native: NDArray[np.float64],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    events: NDArray[np.void],
    event_count: int,
) -> tuple[int, float, float, float]:
    """Update the corners' memory as ``contact.memory.update_corners``, with what Exudyn tells of them.

    ``native`` is what the function of :func:`add_corner_contacts` returns, shape (4, 4).
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for number in range(_CORNERS):
        state, normal = corners[number], native[number, _NORMAL]
        _, rate, slip, arm_x, arm_y = corner_motion(number, q[X], q[ANGLE], v[X], v[Y], v[ANGLE], constants)
        motion = CornerMotion(native[number, _GAP], rate, slip, arm_x, arm_y)
        touched_at = begin(time, motion.gap, rate, state, constants)
        if motion.gap < 0.0 and time > 0.0:
            state.impact_speed = max(native[number, _IMPACT_SPEED], constants.impact_speed_floor)
        event_count = accumulate(
            time, motion, normal, touched_at, number, state, constants, events, event_count
        )
        state.friction = native[number, _FRICTION]
        inward = -ACROSS[number] * normal
        fx, fy = fx + inward, fy + state.friction
        moment = moment + arm_x * state.friction - arm_y * inward
    return event_count, fx, fy, moment
