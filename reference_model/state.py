"""The data of a run: arrays of records with named fields, which kernels take as they are.

A function that gets a record gets one address; a NamedTuple would be passed field by field, an array as seven
numbers.
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
"""Integrals of a state behind the impulses: work of the drive, loss by damping, loss by friction, J."""
NODES = 17
"""Of a step: its start, the stages up to its end, those that only its dense output needs, any other point."""
EVENT_BUFFER = 4096


def record(fields: type) -> np.dtype[np.void]:
    """Return the type of records with the annotated fields of a class."""
    return np.dtype(list(get_type_hints(fields).items()), align=True)


def records(fields: type, *shape: int) -> Records:
    """Return an array of such records, all zero."""
    return np.zeros(shape, record(fields))


@dataclass
class Mode:
    """What a contact does between two events; its force is smooth as long as this lasts."""

    speed: float
    """Impact speed, frozen at the touch, m/s; 0: no contact."""
    regime: int
    """Of the friction (`laws.friction_regime`)."""
    clipped: bool
    """Whether the wall would have to pull."""
    inside: bool
    """Whether the gap is closed. That is `speed` > 0 except where a side is one contact: the corner that
    touched first keeps it."""


@dataclass
class Touch:
    """State of a contact."""

    gap: float
    """m; positive when open."""
    rate: float
    """Of the gap, m/s."""
    slip: float
    """m/s."""
    normal: float
    """N."""
    friction: float
    """N."""
    stored: float
    """J; of a side, with its lower corner."""


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
    """Where a run is.

    Rounding of a time far from zero would move the mechanism by its speed times that, and a corner that has
    just left its wall back into it.
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
    """What is counted since t = 0, and rows in the buffers."""

    steps: int
    rejected: int
    evaluations: int
    switches: int
    contacts: int
    """That have ended."""
    events: int
    """Rows in the buffer."""
    recorded: int
    """Rows in the buffer."""
    instant: int
    """Which of `Run.instants` is next."""
    started: bool


@dataclass
class Event:
    """A contact, open or ended."""

    contact: int
    start: float
    """s."""
    end: float
    """s."""
    normal_speed: float
    """m/s."""
    impulse: float
    """N s; of an open contact that before the touch."""
    peak_force: float
    """N."""
    largest_depth: float
    """m."""
    gap: float
    """At the start, m."""
    rate: float
    """Of the gap at the start, m/s."""


@dataclass
class Worst:
    """A largest value, when it was, and of which contact; -1: there is none."""

    value: float
    time: float
    contact: int


WORST = ("open-depth", "force", "pull", "driving-friction")
"""What no correct run shows (`reference_model.invariants`), and the largest force; m, N, N, W."""


class Nodes(NamedTuple):
    """States at the nodes of a step, and the balance of forces in each of them."""

    y: Array
    """State: coordinates, rates, impulses of the contacts (N s), works (J); shape (NODES, size)."""
    dy: Array
    """Its derivative."""
    touches: Records
    """`Touch`, shape (NODES, contacts)."""
    slider: Records
    """`Motion`, shape (NODES,)."""


class Rows(NamedTuple):
    """What is recorded (`reference_model.recording`), one entry a row."""

    times: Array
    """s since the start of the cycle."""
    cycles: Array
    """Start of the cycle, s."""
    purposes: NDArray[np.int64]
    """Sum of `recording`'s purposes."""
    touches: Records
    """`Touch`, shape (n, contacts)."""
    slider: Records
    """`Motion`."""
    y: Array
    """The state, shape (n, size), or (n, 0) where no channel needs it."""
    dy: Array
    """Its derivative."""


class Run(NamedTuple):
    """Everything that the integration carries from one call to the next, arrays only."""

    clock: Records
    """`Clock`, shape (1,)."""
    counters: Records
    """`Counters`, shape (1,)."""
    nodes: Nodes
    """The state now is the first of them."""
    modes: Records
    """`Mode` of each contact."""
    current_events: Records
    """`Event` of each contact, as long as it has not ended."""
    events: Records
    """`Event` of those that have, shape (EVENT_BUFFER,); emptied by the caller."""
    rows: Rows
    """Emptied by the caller."""
    instants: Array
    """(2, n): when to record a row, s since the start of the present cycle, ascending up to infinity; and
    what for."""
    worst: Records
    """`Worst` of each of WORST."""
    f: Array
    """What a step is computed in: coefficients of its dense output, shape (7, size), ..."""
    values: Array
    """... margins along the step, shape (margins, points), ..."""
    scales: Array
    """... `margins.pull_scale` of each contact, ..."""
    unsettled: NDArray[np.bool_]
    """... which margins the stages leave open, ..."""
    parts: Array
    """... a depth or a force at parts of the step, ..."""
    peaks: NDArray[np.bool_]
    """... and whether depth and force of each contact peak within it, (contacts, 2)."""


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
