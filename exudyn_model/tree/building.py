"""Build a kinematic tree of Exudyn whose joints all rotate about z."""

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
from numpy.typing import NDArray

from exudyn_model.compiled import ForceUserFunction
from exudyn_model.constants import Constants
from exudyn_model.model import Model


@dataclass(frozen=True)
class Link:
    """One link of a tree; its frame sits in the joint that carries it.

    Attributes
    ----------
    body : int
        Of ``bodies``.
    parent : int
        Place in the tree of the link that carries it; -1: the tree's base.
    joint : tuple of float
        Place of the joint in the parent's frame, or on the base, m.
    centre : float
        Centre of mass along the link, m.
    mass : float
        kg.
    inertia : float
        About the centre of mass, kg m^2.
    """

    body: int
    parent: int
    joint: tuple[float, float]
    centre: float
    mass: float
    inertia: float


def build_tree(
    links: list[Link],
    angles: NDArray[np.float64],
    rates: NDArray[np.float64],
    gravity: float,
    force: ForceUserFunction,
    constants: Constants,
    contacts: NDArray[np.void],
) -> Model:
    """Build a tree.

    Its coordinates are the angles of the links, each from that of its parent, rad.

    Parameters
    ----------
    links : list of Link
    angles, rates : ndarray, shape (5,)
        Of all bodies at t = 0, rad and rad/s.
    gravity : float
        Along -y, m/s^2.
    force : callable
        Moments on the tree's coordinates.
    constants : Constants
    contacts : ndarray, shape (5,)
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=len(links),
            referenceCoordinates=[0.0] * len(links),
            initialCoordinates=_from_parents(angles, links),
            initialCoordinates_t=_from_parents(rates, links),
        )
    )
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ] * len(links),
            linkParents=[link.parent for link in links],
            jointTransformations=_matrices([np.eye(3)] * len(links)),
            jointOffsets=_vectors([[*link.joint, 0.0] for link in links]),
            linkInertiasCOM=_matrices([np.diag([0.0, 0.0, link.inertia]) for link in links]),
            linkCOMs=_vectors([[link.centre, 0.0, 0.0] for link in links]),
            linkMasses=[link.mass for link in links],
            gravity=[0.0, -gravity, 0.0],
            forceUserFunction=force,
        )
    )
    mbs.Assemble()
    return Model(mbs, container, constants, contacts)


def _from_parents(values: NDArray[np.float64], links: list[Link]) -> list[float]:
    """Return the links' angles or rates, each less that of its parent."""
    return [
        float(values[link.body] - (0.0 if link.parent < 0 else values[links[link.parent].body]))
        for link in links
    ]


def _matrices(items: list[NDArray[np.float64]]) -> Any:
    """Make Exudyn's list of 3 x 3 matrices."""
    found = exu.Matrix3DList()
    for item in items:
        found.Append(item)
    return found


def _vectors(items: list[list[float]]) -> Any:
    """Make Exudyn's list of vectors in space."""
    found = exu.Vector3DList()
    for item in items:
        found.Append(item)
    return found
