"""A planar linkage as lists, and what Exudyn makes of them: rigid bodies, joints, a drive, gravity, contacts."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectGenericODE2,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)
from numpy.typing import NDArray

from exudyn_model.columns import LAW_COLUMNS
from exudyn_model.corners import CORNER_COUNT, CORNERS
from exudyn_model.linkage import CRANK, ROCKER, ROD2, ROD4, SLIDER, InitialState
from exudyn_model.memory import law_array, new_contacts
from exudyn_model.parameters import Contact, Parameters
from exudyn_model.tables import PIN

FRAME = -1
# Among the coordinates of one body: of its centre (m), and its angle (rad)
X, Y, ANGLE = range(3)
PER_BODY = 3

Array = NDArray[np.float64]


class Body(NamedTuple):
    """A rigid body: mass (kg), inertia about its centre (kg m^2); x, y, angle at t = 0 (m, rad), and rates."""

    mass: float
    inertia: float
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]


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
    """An ideal guide of a body, which may not turn in it: its coordinate ``X`` or ``Y`` keeps a value, m."""

    body: int
    coordinate: int
    value: float


class SliderContact(NamedTuple):
    """A rectangular body with clearance in a straight guide.

    Attributes
    ----------
    body : int
    point : tuple of float
        Of the guide's centre line, m.
    direction : float
        Of the axis across the guide, rad; a body at this angle has its length along the guide.
    width, length : float
        Of the body, m.
    contact : Contact
    """

    body: int
    point: tuple[float, float]
    direction: float
    width: float
    length: float
    contact: Contact


class JournalContact(NamedTuple):
    """A journal on the first body in a bearing of the second one, with their centres in body coordinates, m."""

    name: str
    first: int
    first_point: tuple[float, float]
    second: int
    second_point: tuple[float, float]
    contact: Contact


class Drive(NamedTuple):
    """A motor that keeps the angular speed (rad/s) of a body."""

    body: int
    omega: float


@dataclass(frozen=True)
class System:
    """A linkage; ``observed`` is the body whose motion is recorded, ``gravity`` (m/s^2) acts along -y."""

    bodies: list[Body]
    pins: list[Pin]
    guides: list[Guide]
    contacts: list[SliderContact | JournalContact]
    drive: Drive
    observed: int
    gravity: float = 0.0

    @property
    def sliders(self) -> list[SliderContact]:
        """Contacts of sliders; their corners are the first rows of the contacts' memory."""
        return [contact for contact in self.contacts if isinstance(contact, SliderContact)]

    @property
    def journals(self) -> list[JournalContact]:
        """Contacts of journals, which follow there."""
        return [contact for contact in self.contacts if isinstance(contact, JournalContact)]

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts, by row: of further sliders and journals with a number."""
        numbers = ["", *(str(n) for n in range(2, 2 + len(self.contacts)))]
        corners = [f"{name}{n}" for _, n in zip(self.sliders, numbers, strict=False) for name in CORNERS]
        return (*corners, *(f"{PIN}{n}" for _, n in zip(self.journals, numbers, strict=False)))

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Channel of each Lagrange multiplier.

        Exudyn writes M a + (dc/dq)^T lambda = f, with c the second body's end less the first's: the channel,
        the constraint's force or moment on the second body, is -lambda.
        """
        pins = [f"reaction_{pin.name}_{axis}" for pin in self.pins for axis in "xy"]
        return (*pins, "crank_torque", *(name for _ in self.guides for name in ("guide_force", "guide_moment")))

    @property
    def reference(self) -> Array:
        """From where the coordinates count, shape (3 n,): a slider's from its guide, for all digits of gaps."""
        reference = np.zeros((len(self.bodies), PER_BODY))
        for slider in self.sliders:
            reference[slider.body, :ANGLE] = slider.point
        return reference.ravel()


def press(parameters: Parameters, state: InitialState) -> System:
    """Return the press of Fig. 4 as lists (Eq. 16): pins O, A, H, B, C, F; the crank pin A may have clearance."""
    mechanism = parameters.mechanism
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    slider = mechanism.slider
    contacts: list[SliderContact | JournalContact] = []
    guides = []
    if parameters.guide is None:
        guides.append(Guide(SLIDER, X, mechanism.guide_x + mechanism.reference_offset))
    else:
        middle = (mechanism.guide_x, 0.0)
        contacts.append(SliderContact(SLIDER, middle, 0.0, slider.width, slider.length, parameters.guide))
    pins = [
        Pin("O", FRAME, (0.0, 0.0), CRANK, (-crank.centroid, 0.0)),
        Pin("A", CRANK, (crank.to_tip, 0.0), ROD2, (-rod2.centroid, 0.0)),
        Pin("H", FRAME, mechanism.rocker_pivot, ROCKER, (-rocker.centroid, 0.0)),
        Pin("B", ROD2, (rod2.to_tip, 0.0), ROCKER, (0.0, 0.0)),
        Pin("C", ROCKER, (rocker.to_tip, 0.0), ROD4, (-rod4.centroid, 0.0)),
        Pin("F", ROD4, (rod4.to_tip, 0.0), SLIDER, (0.0, 0.0)),
    ]
    if parameters.journal is not None:
        contacts.append(JournalContact(*pins.pop(1), parameters.journal))
    bodies = [
        Body(body.mass, body.inertia, tuple(q.tolist()), tuple(v.tolist()))
        for body, q, v in zip((crank, rod2, rocker, rod4, slider), *state, strict=True)
    ]
    drive = Drive(CRANK, mechanism.omega)
    return System(bodies, pins, guides, contacts, drive, SLIDER, mechanism.gravity)


class Constants(NamedTuple):
    """The lists as arrays for the kernels.

    Attributes
    ----------
    masses, weights, reference : ndarray, shape (3 n,)
        Masses and inertias (kg, kg m^2) and weights (N) by coordinate; from where the coordinates count.
    pins : ndarray, shape (k, 6)
        First body, its point, second body, its point.
    fixed : ndarray, shape (l, 3)
        Of a coordinate that is prescribed: its number, value at t = 0, and rate. First that of the drive.
    bodies_of_rows : ndarray of int, shape (2 k + l, 2)
        Of each constraint; ``FRAME`` where there is none.
    sliders : ndarray, shape (s, 18)
        Law and geometry of each slider's contact: see ``columns``.
    slider_bodies : ndarray, shape (s,)
    journals : ndarray, shape (j, 18)
    journal_ends : ndarray, shape (j, 8)
        As ``pins``; then what the first body's coordinates count from, less what the second's do.
    """

    masses: Array
    weights: Array
    reference: Array
    pins: Array
    fixed: Array
    bodies_of_rows: NDArray[np.int64]
    sliders: Array
    slider_bodies: Array
    journals: Array
    journal_ends: Array


def constants(system: System) -> Constants:
    """Make the arrays of a system."""
    inertias = np.array([[body.mass, body.mass, body.inertia] for body in system.bodies])
    weights = np.zeros_like(inertias)
    weights[:, Y] = -system.gravity * inertias[:, Y]
    drive = system.drive
    fixed = [(PER_BODY * drive.body + ANGLE, system.bodies[drive.body].position[ANGLE], drive.omega)]
    for guide in system.guides:
        fixed.append((PER_BODY * guide.body + guide.coordinate, guide.value, 0.0))
        fixed.append((PER_BODY * guide.body + ANGLE, 0.0, 0.0))
    sliders = [
        law_array(one.contact, system.bodies[one.body].mass, one.width / 2, one.length / 2, one.direction)
        for one in system.sliders
    ]
    journals = [law_array(one.contact, system.bodies[one.second].mass) for one in system.journals]
    reference = system.reference.reshape(-1, PER_BODY)[:, :ANGLE]
    apart = [reference[one.first] - reference[one.second] for one in system.journals]
    rows = [(pin.first, pin.second) for pin in system.pins for _ in "xy"]
    rows += [(FRAME, int(coordinate) // PER_BODY) for coordinate, _, _ in fixed]
    return Constants(
        inertias.ravel(),
        weights.ravel(),
        system.reference,
        _ends(system.pins),
        np.array(fixed, dtype=np.float64),
        np.array(rows, dtype=np.int64),
        np.array(sliders).reshape(len(sliders), LAW_COLUMNS),
        np.array([one.body for one in system.sliders], dtype=np.float64),
        np.array(journals).reshape(len(journals), LAW_COLUMNS),
        np.hstack([_ends(system.journals), np.array(apart, dtype=np.float64).reshape(-1, 2)]),
    )


def _ends(joints: list[Any]) -> Array:
    rows = [(one.first, *one.first_point, one.second, *one.second_point) for one in joints]
    return np.array(rows, dtype=np.float64).reshape(len(rows), 6)


# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]


@dataclass(frozen=True)
class Model:
    """A system assembled in Exudyn, with what its contact forces read.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    container : exudyn.SystemContainer
        Owner of ``mbs``; held so that it outlives it.
    system : System
    constants : Constants
    contacts : ndarray, shape (n, columns)
        Memory of the contacts: see ``memory``.
    step : ndarray, shape (2,)
        Length of the step in progress (s); 1 where what is open at its start stays without force.
    after_newton : list of callable
        Of each journal: see ``contact_forces.settle_function``.
    """

    mbs: Any
    container: Any
    system: System
    constants: Constants
    contacts: Array
    step: Array
    after_newton: list[Callable[[], bool]] = field(default_factory=list)


def build(system: System, step: float) -> Model:
    """Build a system in Exudyn, for integration with ``step`` (s) in contacts.

    Its coordinates are x, y, angle of each body.
    """
    # Here, as a fault that a test puts into the forces has to take effect
    from exudyn_model.five_bodies import contact_forces

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(ObjectGround())
    ground_node = mbs.AddNode(NodePointGround())
    arrays = constants(system)
    rows = CORNER_COUNT * len(system.sliders) + len(system.journals)
    model = Model(mbs, container, system, arrays, new_contacts(rows), np.array([step, 0.0]))
    nodes, objects = [], []
    for body, reference in zip(system.bodies, arrays.reference.reshape(-1, PER_BODY), strict=True):
        node = mbs.AddNode(
            NodeRigidBody2D(
                referenceCoordinates=list(reference),
                initialCoordinates=list(body.position - reference),
                initialVelocities=list(body.velocity),
            )
        )
        nodes.append(node)
        objects.append(mbs.AddObject(ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node)))
        centre = mbs.AddMarker(MarkerBodyMass(bodyNumber=objects[-1]))
        mbs.AddLoad(LoadMassProportional(markerNumber=centre, loadVector=[0.0, -system.gravity, 0.0]))
    for pin in system.pins:
        ends = []
        for number, point in ((pin.first, pin.first_point), (pin.second, pin.second_point)):
            body_number = ground if number == FRAME else objects[number]
            ends.append(mbs.AddMarker(MarkerBodyPosition(bodyNumber=body_number, localPosition=[*point, 0.0])))
        mbs.AddObject(ObjectJointRevolute2D(name=pin.name, markerNumbers=ends))
    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground_node, coordinate=0))
    for number, (coordinate, value, rate) in enumerate(arrays.fixed):
        body_number, axis = divmod(int(coordinate), PER_BODY)
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[body_number], coordinate=axis))
        offset = rate if number == 0 else value - arrays.reference[int(coordinate)]
        mbs.AddObject(
            CoordinateConstraint(markerNumbers=[fixed, marker], offset=offset, velocityLevel=number == 0)
        )
    for number, slider in enumerate(system.sliders):
        _add_contact(mbs, [nodes[slider.body]], contact_forces.slider_function(model, number))
    for number, journal in enumerate(system.journals):
        both = [nodes[journal.first], nodes[journal.second]]
        _add_contact(mbs, both, contact_forces.journal_function(model, number))
        model.after_newton.append(contact_forces.settle_function(model, number))
    mbs.Assemble()
    return model


def _add_contact(mbs: Any, nodes: list[Any], force: ForceUserFunction) -> None:
    """Add an object without mass on the bodies' nodes, which only adds the contact force."""
    size = PER_BODY * len(nodes)
    mbs.AddObject(
        ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((size, size)), forceUserFunction=force)
    )
