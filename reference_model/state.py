"""The data of a run: arrays of records with named fields, which compiled functions take directly.

A record is passed as one address; a NamedTuple would be passed field by field, an array as seven numbers.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from reference_model.linkage import Array
from reference_model.parameters import Contact

Records = Any
"""Array of records; their fields are those of the class that the docstring names."""

WORKS = 3
"""Integrals after the impulses in a state, J: work of the drive, loss by damping, loss by friction."""
NODES = 17
"""Nodes of a step: its start, the stages up to its end, the stages of its dense output, any other point."""
EVENT_BUFFER = 4096


def record(fields: type) -> np.dtype[np.void]:
    """Return the type of a record with the annotated fields of a class."""
    return np.dtype(list(get_type_hints(fields).items()), align=True)


def records(fields: type, *shape: int) -> Records:
    """Return an array of zero records with the annotated fields of a class."""
    return np.zeros(shape, record(fields))


@dataclass
class Mode:
    """State of a contact that is constant between two events, so that its force is smooth there."""

    speed: float
    """Impact speed, frozen at the touch, m/s; 0: the contact is open."""
    regime: int
    """Regime of the friction (`laws.friction_regime`)."""
    clipped: bool
    """True if the force is zero because the contact law would make the wall pull."""
    inside: bool
    """True if the gap is closed: the same as `speed` > 0, except if a side is one contact, whose speed only
    the corner that touched first holds."""


@dataclass
class Touch:
    """Motion and force of a contact in one state."""

    gap: float
    """m; positive when open."""
    rate: float
    """Rate of the gap, m/s."""
    slip: float
    """Tangential velocity, m/s."""
    normal: float
    """Normal force, N."""
    friction: float
    """Friction force along the slip's positive direction, N."""
    stored: float
    """Stored energy, J; that of both corners of a side is with the lower one."""


@dataclass
class Motion:
    """Motion of the slider: m, rad, and their derivatives by time in s."""

    x: float
    y: float
    angle: float
    vx: float
    vy: float
    omega: float
    ax: float
    ay: float
    alpha: float


@dataclass
class Clock:
    """Time and steps of a run.

    The compiled solver counts time from the start of a cycle: far from zero its rounding, times the
    speed of the mechanism, would move a corner that has just left its wall back into it.
    """

    time: float
    """s since the start of the present cycle."""
    step: float
    """Next step, s."""
    flight_step: float
    """Last step in free flight, s."""
    cycle: float
    """Start of the present cycle, s."""


@dataclass
class Counters:
    """Counts since t = 0, and numbers of rows in the buffers."""

    steps: int
    rejected: int
    evaluations: int
    switches: int
    contacts: int
    """Contacts that have ended."""
    events: int
    """Rows of `Run.events` that are filled."""
    recorded: int
    """Rows of `Run.rows` that are filled."""
    instant: int
    """Index of the next of `Run.instants`."""
    started: bool


@dataclass
class Event:
    """One contact from its touch to its separation: a row of the event table."""

    contact: int
    start: float
    """s."""
    end: float
    """s."""
    normal_speed: float
    """m/s."""
    impulse: float
    """N s; until the contact ends, the integral before its touch."""
    peak_force: float
    """N."""
    largest_depth: float
    """m."""
    gap: float
    """Gap at the start, m."""
    rate: float
    """Rate of the gap at the start, m/s."""


@dataclass
class Worst:
    """The largest value of a quantity, its time (s), and its contact; -1: none."""

    value: float
    time: float
    contact: int


WORST = ("open-depth", "force", "pull", "driving-friction")
"""Violations that no correct run shows (`reference_model.invariants`), and the largest force; m, N, N, W."""


class Nodes(NamedTuple):
    """States at the nodes of a step, and the balance of forces in each of them."""

    y: Array
    """State: coordinates, rates, impulses of the contacts (N s), works (J); shape (NODES, size)."""
    dy: Array
    """Derivative of `y`."""
    touches: Records
    """`Touch`, shape (NODES, contacts)."""
    slider: Records
    """`Motion`, shape (NODES,)."""


class Rows(NamedTuple):
    """Recorded rows (`reference_model.recording`)."""

    times: Array
    """s since the start of the cycle."""
    cycles: Array
    """Start of the cycle, s."""
    purposes: NDArray[np.int64]
    """Sum of the purposes of each row: SAMPLE, EXTREMUM, ... of `recording`."""
    touches: Records
    """`Touch`, shape (n, contacts)."""
    slider: Records
    """`Motion`."""
    y: Array
    """States, shape (n, size)."""
    dy: Array
    """Derivatives of `y`."""


class Run(NamedTuple):
    """Everything that the integration carries from one call to the next, arrays only."""

    clock: Records
    """`Clock`, shape (1,)."""
    counters: Records
    """`Counters`, shape (1,)."""
    nodes: Nodes
    """Nodes of the present step; the first is the present state."""
    modes: Records
    """`Mode` of each contact."""
    current_events: Records
    """`Event` of each contact that is closed now."""
    events: Records
    """`Event` of the contacts that have ended, shape (EVENT_BUFFER,); emptied by the caller."""
    rows: Rows
    """Emptied by the caller."""
    instants: Array
    """Times at which to record a row, s since the start of the present cycle, ascending up to infinity, and
    the purposes of these rows; shape (2, n)."""
    worst: Records
    """`Worst` of each of WORST."""
    f: Array
    """Work array: coefficients of the dense output, shape (7, size)."""
    values: Array
    """Work array: margins along the step, shape (margins, events.POINTS)."""
    scales: Array
    """Work array: `margins.pull_scale` of each contact."""
    unsettled: NDArray[np.bool_]
    """Work array: true for each margin that the stages leave undecided, shape (margins,)."""
    parts: Array
    """Work array: a depth or a force at the `recording.PARTS` of the step."""
    peaks: NDArray[np.bool_]
    """Work array: true for each depth and force of a contact that peaks in the step, shape (contacts, 2)."""


def contact_list(contacts: tuple[Contact, ...]) -> Records:
    """Return contacts as the records that kernels take."""
    return np.array([tuple(contact) for contact in contacts], dtype=record(Contact))


def new_nodes(y0: Array, contacts: int) -> Nodes:
    """Return the nodes of a run that starts with coordinates and rates `y0`."""
    size = y0.size + contacts + WORKS
    nodes = Nodes(
        np.zeros((NODES, size)),
        np.zeros((NODES, size)),
        records(Touch, NODES, contacts),
        records(Motion, NODES),
    )
    nodes.y[0, : y0.size] = y0
    return nodes
