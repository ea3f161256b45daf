"""Trees of the press in Exudyn: the bodies that the drive leaves free, with their moments as user function.

No joint is left as a constraint, which Exudyn's explicit integrators would ignore.

- Crank pin ideal: rod 4, which carries the slider's mass, and the slider are the only free bodies; they
  rotate in the accelerating frame of the rocker's tip C. The drive makes C move as it does whatever the
  slider meets (``linkage``); the moving frame adds inertial forces. Rod 4's coordinate is its lead over one
  with an ideal slider, some 1e-3 rad. A slider that rests at its wall hardly changes it; the angle itself
  rotates by a radian, and a stiff contact makes a force of its error in each stage of a step. Measured at a
  tolerance of 1e-11, two cycles at 150 rpm: 38,600 steps instead of 55,600, error of x 2e-9 m, not 8e-8 m.
- Crank pin with clearance: nothing but the contact holds rod 2 to the driven crank, so that the linkage is
  open: rod 2 and rod 4 hang from the rocker, a slider with clearance on rod 4. An ideal slider closes a loop,
  though: it does not rotate, which makes it a point mass at the end of rod 4, and the guide's force keeps
  its x without acceleration. Its drift from its line is the integration's error: measured 2e-10 m in two
  cycles at a tolerance of 1e-7, 5e-14 m at 1e-10.

In the second case the coordinates are the angles (rad) of rocker, rod 2, rod 4 and, where it has clearance,
the slider, each from that of its parent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    Node1D,
    NodeGenericODE2,
    ObjectGenericODE2,
    ObjectKinematicTree,
    ObjectRotationalMass1D,
)
from numpy.typing import NDArray

from exudyn_model.clearances import new_contacts
from exudyn_model.kernels import entry, machine_code, record
from exudyn_model.laws import Law
from exudyn_model.linkage import ROCKER, ROD2, ROD4, SLIDER, InitialState, carried_tip, driven_rod4
from exudyn_model.parameters import Parameters
from exudyn_model.tree.motion import CONTACTS, Press, State, chain_accelerations, contact_loads, rod4_moment
from exudyn_model.workpiece import workpiece_array

Array = NDArray[np.float64]
# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]
# Exudyn's stub does not declare that its lists can be made from Python's
_LISTS = cast(Any, exu)


@dataclass(frozen=True)
class Tree:
    """A tree assembled in Exudyn, with the arrays that its forces read."""

    mbs: Any
    container: Any  # Owner of ``mbs``, which must not outlive it
    press: Press
    # For the kernels: ``press``, a workpiece's rows, memory of the corners and, always, of the journal
    press_record: NDArray[Any]
    workpiece: NDArray[Any]
    contacts: NDArray[Any]

    @property
    def kernel_arrays(self) -> tuple[NDArray[Any], ...]:
        """Arguments that every kernel takes after its own."""
        return self.press_record, self.workpiece, self.contacts


@entry
def slider_tree_moments(
    time: float,
    q: tuple[float, float],
    v: tuple[float, float],
    press_record: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
) -> tuple[float, float]:
    """Return the moments (N m) of inertia, contact and load on rod 4's coordinate and on the slider's.

    Arguments: time (s), both coordinates (rad), their rates (rad/s).
    """
    press: Press = press_record[0]
    tip, angle, rate, acceleration = driven_rod4(time, press.mechanism)
    state = State(0.0, 0.0, angle + q[0], q[1], 0.0, 0.0, rate + v[0], v[1])
    loads = contact_loads(time, state, tip, press, workpiece, contacts, None)
    inertial = press.carried_inertia * acceleration
    return rod4_moment(state.theta4, tip, loads, press) - inertial, loads.moment


@entry
def rocker_tree_moments(
    time: float,
    q: tuple[float, float, float, float],
    v: tuple[float, float, float, float],
    press_record: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
) -> tuple[float, float, float, float]:
    """Return the moments (N m) of contact, load and guide on the coordinates of the tree that hangs from H.

    Arguments as for :func:`slider_tree_moments`; the coordinate of an ideal slider, not in the tree, is 0.
    """
    press: Press = press_record[0]
    rod2, rocker = press.mechanism.rod2, press.mechanism.rocker
    theta3, theta4, w3, w4 = q[0], q[0] + q[2], v[0], v[0] + v[2]
    state = State(theta3 + q[1], theta3, theta4, theta4 + q[3], w3 + v[1], w3, w4, w4 + v[3])
    tip = carried_tip(theta3, w3, 0.0, press.mechanism)
    loads = contact_loads(time, state, tip, press, workpiece, contacts, None)
    fx = loads.fx
    if not press.has_guide:
        fx = chain_accelerations(state, loads, press)[3]
    c2, s2, c3, s3 = np.cos(state.theta2), np.sin(state.theta2), np.cos(theta3), np.sin(theta3)
    # Moments about the joints that carry: of rod 2 about B, of rod 4 about C
    arm2 = rod2.length - rod2.centroid
    on_rod2 = loads.pin_moment - arm2 * (c2 * loads.pin_y - s2 * loads.pin_x)
    on_rod4 = loads.moment + loads.along_x * loads.fy - loads.along_y * fx
    on_rocker = rocker.centroid * (c3 * loads.pin_y - s3 * loads.pin_x)
    on_rocker += rocker.length * (c3 * loads.fy - s3 * fx)
    # The rocker's coordinate rotates all bodies, rod 4's the slider too
    return on_rocker + on_rod2 + on_rod4, on_rod2, on_rod4, loads.moment


def build_tree(parameters: Parameters, state: InitialState) -> Tree:
    """Build the tree of a scene at ``state``."""
    mechanism, guide, journal = parameters.mechanism, parameters.guide, parameters.journal
    rod4, slider = mechanism.rod4, mechanism.slider
    no_law = Law(*(0.0,) * len(Law._fields))
    press = Press(
        mechanism,
        rod4.mass * rod4.centroid + slider.mass * rod4.length,
        rod4.inertia + rod4.mass * rod4.centroid**2 + slider.mass * rod4.length**2,
        guide is not None,
        journal is not None,
        guide or no_law,
        journal or no_law,
    )
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    tree = Tree(
        mbs, container, press, record(press), workpiece_array(parameters.load), new_contacts(CONTACTS)
    )
    if journal is None:
        _add_rotors(tree, state)
    else:
        _add_chain(tree, state)
    mbs.Assemble()
    return tree


def _add_rotors(tree: Tree, state: InitialState) -> None:
    """Add rod 4, which carries the slider's mass about C, and the slider, which rotates about its centre."""
    mbs, mechanism = tree.mbs, tree.press_record[0]["mechanism"]
    _, angle, rate, _ = driven_rod4(0.0, mechanism)
    nodes = []
    for body, inertia, start, speed in (
        (ROD4, tree.press.carried_inertia, angle, rate),
        (SLIDER, tree.press.mechanism.slider.inertia, 0.0, 0.0),
    ):
        nodes.append(
            mbs.AddNode(
                Node1D(
                    referenceCoordinates=[0.0],
                    initialCoordinates=[state.positions[body, 2] - start],
                    initialVelocities=[state.velocities[body, 2] - speed],
                )
            )
        )
        mbs.AddObject(ObjectRotationalMass1D(inertia=inertia, nodeNumber=nodes[-1]))
    force = _user_function(tree)
    mbs.AddObject(ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((2, 2)), forceUserFunction=force))


def _add_chain(tree: Tree, state: InitialState) -> None:
    """Add rocker, rod 2, rod 4 and, where it has clearance, the slider as links of a tree.

    The origin of a link's frame is the joint that carries it.
    """
    mbs, mechanism = tree.mbs, tree.press.mechanism
    rod2, rocker, rod4, slider = mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider
    mass4, centre4, inertia4 = rod4.mass, rod4.centroid, rod4.inertia
    if not tree.press.has_guide:
        mass4 = rod4.mass + slider.mass
        centre4 = (rod4.mass * rod4.centroid + slider.mass * rod4.length) / mass4
        inertia4 += rod4.mass * (centre4 - rod4.centroid) ** 2 + slider.mass * (centre4 - rod4.length) ** 2
    # Body, link that carries it (-1: the base), joint in that one's frame; centre along it, mass, inertia
    links = [
        (ROCKER, -1, (mechanism.pivot_x, mechanism.pivot_y), rocker.centroid, rocker.mass, rocker.inertia),
        # Rod 2's frame sits at its end B and looks along it, away from A
        (ROD2, 0, (rocker.centroid, 0.0), -rod2.to_tip, rod2.mass, rod2.inertia),
        (ROD4, 0, (rocker.length, 0.0), centre4, mass4, inertia4),
        (SLIDER, 2, (rod4.length, 0.0), 0.0, slider.mass, slider.inertia),
    ][: 4 if tree.press.has_guide else 3]
    bodies, parents, joints, centres, masses, inertias = (list(column) for column in zip(*links, strict=True))

    def from_parents(values: Array) -> list[float]:
        """Return the links' angles or rates, each less that of its parent."""
        motions = values[bodies]
        return [float(one - (motions[a] if a >= 0 else 0.0)) for one, a in zip(motions, parents, strict=True)]

    node = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=len(links),
            referenceCoordinates=[0.0] * len(links),
            initialCoordinates=from_parents(state.positions[:, 2]),
            initialCoordinates_t=from_parents(state.velocities[:, 2]),
        )
    )
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ] * len(links),
            linkParents=parents,
            jointTransformations=_LISTS.Matrix3DList([np.eye(3)] * len(links)),
            jointOffsets=_LISTS.Vector3DList([[*joint, 0.0] for joint in joints]),
            linkInertiasCOM=_LISTS.Matrix3DList([np.diag([0.0, 0.0, inertia]) for inertia in inertias]),
            linkCOMs=_LISTS.Vector3DList([[centre, 0.0, 0.0] for centre in centres]),
            linkMasses=masses,
            gravity=[0.0, -mechanism.gravity, 0.0],
            forceUserFunction=_user_function(tree),
        )
    )


def _user_function(tree: Tree) -> ForceUserFunction:
    """Return the ``forceUserFunction`` of a tree; the time that Exudyn passes is that of the stage."""
    arrays = tree.kernel_arrays
    if not tree.press.has_journal:
        moments = machine_code(slider_tree_moments, 0.0, (0.0,) * 2, (0.0,) * 2, *arrays)

        def on_rotors(_mbs: Any, t: float, _number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
            return moments(t, tuple(q), tuple(v), *arrays)

        return on_rotors
    chain_moments = machine_code(rocker_tree_moments, 0.0, (0.0,) * 4, (0.0,) * 4, *arrays)

    def on_chain(_mbs: Any, t: float, _number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        if not tree.press.has_guide:
            return chain_moments(t, (*q, 0.0), (*v, 0.0), *arrays)[:3]
        return chain_moments(t, tuple(q), tuple(v), *arrays)

    return on_chain
