"""A planar linkage as lists, and as Exudyn's bodies, joints, drive, gravity and contacts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    LoadMassProportional,
    LoadTorqueVector,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectConnectorSpringDamper,
    ObjectGenericODE2,
    ObjectGround,
    ObjectJointPrismatic2D,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)
from numpy.typing import NDArray

from exudyn_model.clearances import CORNERS, new_contacts
from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY, STEP, ForceUserFunction, Partners, X, Y
from exudyn_model.five_bodies.journal_contact import JournalElement
from exudyn_model.five_bodies.slider_contact import SliderElement
from exudyn_model.kernels import entry, machine_code
from exudyn_model.laws import Law
from exudyn_model.linkage import CRANK, ROCKER, ROD2, ROD4, SLIDER, InitialState
from exudyn_model.parameters import Load, Parameters
from exudyn_model.tables import PIN
from exudyn_model.workpiece import workpiece_array, workpiece_force

Array = NDArray[np.float64]
Element = SliderElement | JournalElement


class Body(NamedTuple):
    """A rigid body: kg, kg m^2 about its centre; x, y, angle at t = 0 (m, rad) and their rates."""

    mass: float
    inertia: float
    position: Sequence[float]
    velocity: Sequence[float]


class Pin(NamedTuple):
    """A revolute joint between a point of one body and a point of another, in body coordinates, m.

    ``first`` may be ``FRAME``; then ``first_point`` is fixed in space.
    """

    name: str
    first: int
    first_point: tuple[float, float]
    second: int
    second_point: tuple[float, float]


class Guide(NamedTuple):
    """An ideal guide: a body keeps its angle at 0, and its coordinate ``X`` or ``Y`` at a value, m."""

    body: int
    coordinate: int
    value: float


class TurnedGuide(NamedTuple):
    """A line of the body ``on`` or of the ``FRAME``, on which another body keeps its centre and its angle."""

    name: str
    body: int
    on: int
    point: tuple[float, float]  # Of the line, in body coordinates, m
    direction: float  # Of the line, and angle of the body, in the frame of ``on``, rad
    angle: float


class Spring(NamedTuple):
    """A spring with a damper between two points, as those of a `Pin`: N/m, free length in m, N s/m."""

    name: str
    first: int
    first_point: tuple[float, float]
    second: int
    second_point: tuple[float, float]
    stiffness: float
    length: float
    damping: float


def ends(joint: Pin | Spring) -> tuple[tuple[int, tuple[float, float]], ...]:
    """Return number and point of either body that a pin or a spring joins."""
    return (joint.first, joint.first_point), (joint.second, joint.second_point)


class SliderContact(NamedTuple):
    """A rectangular body with clearance in a straight guide of the body ``on`` or of the ``FRAME``."""

    body: int
    point: tuple[float, float]  # Of the guide's centre line, in body coordinates, m
    direction: float  # Of the axis across the guide, rad
    law: Law  # With the body's dimensions
    on: int = FRAME
    turn: float = 0.0  # Angle of the body less ``direction`` that has its length along the guide, rad
    rows: tuple[str, ...] = CORNERS  # Names of its rows in the memory


class JournalContact(NamedTuple):
    """A journal on the first body in a bearing of the second one; their centres in body coordinates, m."""

    name: str
    first: int
    first_point: tuple[float, float]
    second: int
    second_point: tuple[float, float]
    law: Law
    rows: tuple[str, ...] = (PIN,)  # Name of its row in the memory


class Drive(NamedTuple):
    """A motor that keeps the angular speed (rad/s) of a body."""

    body: int
    omega: float


class Torque(NamedTuple):
    """A torque of the frame on a body, linear over its angle and periodic: rows of rad in a turn and N m."""

    body: int
    table: Array  # Shape (n, 2)


@dataclass(frozen=True)
class System:
    """A linkage; ``gravity`` (m/s^2) acts along -y.

    ``observed`` is the body whose motion is recorded, and on which the workpiece acts, if there is one.
    """

    bodies: list[Body]
    pins: list[Pin]
    guides: list[Guide]
    contacts: list[SliderContact | JournalContact]
    drive: Drive | Torque | None
    observed: int
    gravity: float = 0.0
    load: Load | None = None
    turned_guides: list[TurnedGuide] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)

    @property
    def journals(self) -> list[JournalContact]:
        """Contacts of journals."""
        return [contact for contact in self.contacts if isinstance(contact, JournalContact)]

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the rows of the contacts' memory."""
        return tuple(name for contact in self.contacts for name in contact.rows)

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Channel of each Lagrange multiplier.

        Exudyn writes M a + (dc/dq)^T lambda = f, with c the second body's end less the first's: the channel,
        the constraint's force or moment on the second body, is -lambda; the force of a turned guide, whose
        first body is guided, is +lambda.
        """
        pins = [f"reaction_{pin.name}_{axis}" for pin in self.pins for axis in "xy"]
        guides = (*self.guides, *self.turned_guides)
        return (
            *pins,
            *(["crank_torque"] if isinstance(self.drive, Drive) else []),
            *(name for _ in guides for name in ("guide_force", "guide_moment")),
        )

    @cached_property
    def masses(self) -> Array:
        """Masses and inertias by coordinate, shape (3 n,); kg, kg m^2."""
        return np.array([[body.mass, body.mass, body.inertia] for body in self.bodies]).ravel()

    @cached_property
    def prescribed(self) -> list[tuple[int, float, float]]:
        """Prescribed coordinates, first that of a drive: number, value at t = 0, rate (m, rad, s)."""
        prescribed, drive = [], self.drive
        if isinstance(drive, Drive):
            angle = self.bodies[drive.body].position[ANGLE]
            prescribed.append((PER_BODY * drive.body + ANGLE, angle, drive.omega))
        for guide in self.guides:
            prescribed.append((PER_BODY * guide.body + guide.coordinate, guide.value, 0.0))
            prescribed.append((PER_BODY * guide.body + ANGLE, 0.0, 0.0))
        return prescribed

    @cached_property
    def reference(self) -> Array:
        """Origins of the coordinates, shape (3 n,); a slider's is in its guide: gaps keep all digits."""
        reference = np.zeros((len(self.bodies), PER_BODY))
        for contact in self.contacts:
            if isinstance(contact, SliderContact) and contact.on == FRAME:
                reference[contact.body, :ANGLE] = contact.point
        return reference.ravel()


def press_system(parameters: Parameters, state: InitialState) -> System:
    """Return the press of Fig. 4 as lists (Eq. 16): pins O, A, H, B, C, F; A may have clearance."""
    mechanism = parameters.mechanism
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    slider = mechanism.slider
    contacts: list[SliderContact | JournalContact] = []
    guides = []
    if parameters.guide is None:
        guides.append(Guide(SLIDER, X, mechanism.guide_x + mechanism.reference_offset))
    else:
        middle = (mechanism.guide_x, 0.0)
        contacts.append(SliderContact(SLIDER, middle, 0.0, parameters.guide))
    pins = [
        Pin("O", FRAME, (0.0, 0.0), CRANK, (-crank.centroid, 0.0)),
        Pin("A", CRANK, (crank.to_tip, 0.0), ROD2, (-rod2.centroid, 0.0)),
        Pin("H", FRAME, (mechanism.pivot_x, mechanism.pivot_y), ROCKER, (-rocker.centroid, 0.0)),
        Pin("B", ROD2, (rod2.to_tip, 0.0), ROCKER, (0.0, 0.0)),
        Pin("C", ROCKER, (rocker.to_tip, 0.0), ROD4, (-rod4.centroid, 0.0)),
        Pin("F", ROD4, (rod4.to_tip, 0.0), SLIDER, (0.0, 0.0)),
    ]
    if parameters.journal is not None:
        contacts.append(JournalContact(*pins.pop(1), parameters.journal))
    inertias = [(body.mass, body.inertia) for body in (crank, rod2, rocker, rod4)]
    inertias.append((slider.mass, slider.inertia))
    bodies = [
        Body(mass, inertia, tuple(q.tolist()), tuple(v.tolist()))
        for (mass, inertia), q, v in zip(inertias, *state, strict=True)
    ]
    drive = Drive(CRANK, mechanism.omega)
    return System(bodies, pins, guides, contacts, drive, SLIDER, mechanism.gravity, parameters.load)


@dataclass(frozen=True)
class Model:
    """A system assembled in Exudyn, with the arrays that its contact forces read."""

    mbs: Any
    container: Any  # Owner of ``mbs``, which must not outlive it
    system: System
    elements: list[Element]
    contacts: NDArray[Any]  # Memory of the contacts: see ``clearances``
    step: NDArray[Any]  # Step in progress, of ``contact.STEP``, shape (1,)
    workpiece: NDArray[Any]


def build(system: System, step: float) -> Model:
    """Build a system in Exudyn, for steps of ``step`` (s) in contacts."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(ObjectGround())
    ground_node = mbs.AddNode(NodePointGround())
    nodes, objects = [], []
    for body, reference in zip(system.bodies, system.reference.reshape(-1, PER_BODY), strict=True):
        node = mbs.AddNode(
            NodeRigidBody2D(
                referenceCoordinates=list(reference),
                initialCoordinates=list(body.position - reference),
                initialVelocities=list(body.velocity),
            )
        )
        nodes.append(node)
        objects.append(
            mbs.AddObject(ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node))
        )
        centre = mbs.AddMarker(MarkerBodyMass(bodyNumber=objects[-1]))
        mbs.AddLoad(LoadMassProportional(markerNumber=centre, loadVector=[0.0, -system.gravity, 0.0]))

    def add_marker(kind: Any, body_number: int, point: tuple[float, float]) -> Any:
        carrier = ground if body_number == FRAME else objects[body_number]
        return mbs.AddMarker(kind(bodyNumber=carrier, localPosition=[*point, 0.0]))

    for pin in system.pins:
        markers = [add_marker(MarkerBodyPosition, *end) for end in ends(pin)]
        mbs.AddObject(ObjectJointRevolute2D(name=pin.name, markerNumbers=markers))
    ground_marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground_node, coordinate=0))
    for number, (coordinate, value, rate) in enumerate(system.prescribed):
        body_number, axis = divmod(coordinate, PER_BODY)
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[body_number], coordinate=axis))
        is_drive = number == 0 and isinstance(system.drive, Drive)
        offset = rate if is_drive else value - system.reference[coordinate]
        mbs.AddObject(
            CoordinateConstraint(markerNumbers=[ground_marker, marker], offset=offset, velocityLevel=is_drive)
        )
    for guide in system.turned_guides:
        line, body_line = guide.direction, guide.direction - guide.angle
        sides = (guide.body, (0.0, 0.0)), (guide.on, guide.point)
        mbs.AddObject(
            ObjectJointPrismatic2D(
                markerNumbers=[add_marker(MarkerBodyRigid, *side) for side in sides],
                axisMarker0=[math.cos(body_line), math.sin(body_line), 0.0],
                normalMarker1=[-math.sin(line), math.cos(line), 0.0],
            )
        )
    for spring in system.springs:
        mbs.AddObject(
            ObjectConnectorSpringDamper(
                markerNumbers=[add_marker(MarkerBodyPosition, *end) for end in ends(spring)],
                referenceLength=spring.length,
                stiffness=spring.stiffness,
                damping=spring.damping,
            )
        )
    if isinstance(system.drive, Torque) and len(system.drive.table) == 1:
        marker = add_marker(MarkerBodyRigid, system.drive.body, (0.0, 0.0))
        torque = [0.0, 0.0, float(system.drive.table[0, 1])]
        mbs.AddLoad(LoadTorqueVector(markerNumber=marker, loadVector=torque))
    contacts, step_array = new_contacts(len(system.contact_names)), np.array([(step, step)], STEP)
    elements = _elements(system, contacts, step_array)
    workpiece = workpiece_array(system.load)
    forces: list[tuple[tuple[int, ...], ForceUserFunction]] = [(one.bodies, one.force) for one in elements]
    if system.load is not None:
        origin = system.reference[PER_BODY * system.observed + Y]
        forces.append(((system.observed,), _load_force(workpiece, float(origin))))
    for numbers, force in (*forces, *_table_force(system.drive)):
        # An object without mass on the bodies' nodes, which only adds the force
        carriers = [nodes[number] for number in numbers if number != FRAME]
        size = PER_BODY * len(carriers)
        mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=carriers, massMatrix=np.zeros((size, size)), forceUserFunction=force
            )
        )
    mbs.Assemble()
    return Model(mbs, container, system, elements, contacts, step_array, workpiece)


@entry
def table_torque(angle: float, table: Array) -> float:
    """Interpolate a torque (N m) linearly at an angle (rad) in a table of `Torque` over a turn."""
    return float(np.interp(angle % (2.0 * np.pi), table[:, 0], table[:, 1]))


def _table_force(drive: Drive | Torque | None) -> list[tuple[tuple[int, ...], ForceUserFunction]]:
    """Return the body and the ``forceUserFunction`` of a torque that changes over the angle, if any."""
    if not isinstance(drive, Torque) or len(drive.table) == 1:
        return []
    torque = machine_code(table_torque, 0.0, drive.table)

    def user_function(_mbs: Any, _t: float, _number: int, q: list[float], _v: Any) -> tuple[float, ...]:
        return 0.0, 0.0, torque(q[ANGLE], drive.table)

    return [((drive.body,), user_function)]


def _load_force(workpiece: NDArray[Any], origin: float) -> ForceUserFunction:
    """Make the ``forceUserFunction`` of a workpiece on a body whose y counts from ``origin`` (m)."""
    force = machine_code(workpiece_force, 0.0, workpiece)

    def user_function(_mbs: Any, _t: float, _number: int, q: list[float], _v: Any) -> tuple[float, ...]:
        return 0.0, force(origin + q[Y], workpiece)[0], 0.0

    return user_function


def _elements(system: System, contacts: NDArray[Any], step: NDArray[Any]) -> list[Element]:
    # The frame's follow those of the last body
    reference = np.vstack([system.reference.reshape(-1, PER_BODY), np.zeros(PER_BODY)])
    elements: list[Element] = []
    row = 0
    for contact in system.contacts:
        law, (second_x, second_y) = contact.law, (0.0, 0.0)
        if isinstance(contact, SliderContact):
            first, first_point, second, (second_x, second_y) = (
                contact.body,
                (0.0, 0.0),
                contact.on,
                contact.point,
            )
            across = {"across_x": math.cos(contact.direction), "across_y": math.sin(contact.direction)}
            law = law._replace(direction=contact.direction + contact.turn, **across)
        else:
            _, first, first_point, second, (second_x, second_y), *_ = contact
        apart_x, apart_y, _ = (reference[first] - reference[second]).tolist()
        if second == FRAME:  # a difference of coordinates that count from the guide would lose digits
            second_x, second_y, apart_x, apart_y = second_x - apart_x, second_y - apart_y, 0.0, 0.0
        law = law._replace(mass=min(system.bodies[body].mass for body in (first, second) if body != FRAME))
        partners = Partners(first, *first_point, second, second_x, second_y, apart_x, apart_y, law)
        kind = SliderElement if isinstance(contact, SliderContact) else JournalElement
        elements.append(kind(partners, row, contacts, step))
        row += len(contact.rows)
    return elements
