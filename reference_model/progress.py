"""What the integration carries from step to step, and how a contact's mode changes at an event."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.contact import without_memory
from reference_model.events import ROUNDING, next_regime, touching
from reference_model.forces import (
    CLIPPED,
    CONTACTS,
    GAP,
    INSIDE,
    MEMORY,
    MODES,
    RATE,
    REGIME,
    SLIP,
    Array,
    of_side,
    other_corner,
    side_motion,
)
from reference_model.formulations import crank_coordinate, free, right_hand_side, state_size
from reference_model.friction import friction_regime
from reference_model.observation import CHANNELS, note_forces, note_start
from reference_model.switching import PULL
from reference_model.watch import WATCHED, watch_start

STEPS, REJECTED, EVALUATIONS, SWITCHES, ENDED, BUFFERED, SAMPLES = range(7)
"""What `Progress.counters` counts; ENDED: contacts."""

EVENT_BUFFER = 4096
"""Rows; the kernel returns to have it emptied."""


class Progress(NamedTuple):
    """Everything the integration carries from one chunk to the next, arrays only."""

    clock: Array
    """(4,): time since the start of the cycle, next step, last step in free flight, s; number of previous
    cycles.

    Rounding of a time far from zero would move the mechanism by its speed times that, and a corner that has
    just left its wall back into it.
    """
    y: Array
    """(state_size,)."""
    modes: Array
    """(MODES, CONTACTS)."""
    open_contacts: Array
    """(CONTACTS, 5), of each contact: start, impact speed, impulse before, peak force, largest depth."""
    events: Array
    """(EVENT_BUFFER, 7): contact, start, end, impact speed, impulse, peak force, largest depth."""
    counters: NDArray[np.int64]
    """(7,)."""
    extrema: Array
    """(cycles, CHANNELS, 4), of each cycle: minimum, its time, maximum, its time."""
    noted: Array
    """(7,): the slider's coordinates and velocities in the state looked at last for extrema; its time, s."""
    start: Array
    """(5,): energies at t = 0 (`reference_model.energy`)."""
    watch: Array
    """(WATCHED, 3): the worst value of each invariant, its time and contact (`reference_model.watch`)."""


def begin(c: Constants, y0: Array, first_step: float, cycles: int = 1) -> Progress:
    """Return the progress at t = 0 from coordinates and velocities `y0`.

    Contacts that start inside their wall are closed from the start. `cycles`: how many the run begins; what
    is later counts as part of the last.
    """
    y = np.zeros(state_size(c))
    y[: y0.size] = y0
    progress = Progress(
        clock=np.array([0.0, first_step, first_step, 0.0]),
        y=y,
        modes=np.zeros((MODES, CONTACTS)),
        open_contacts=np.zeros((CONTACTS, 5)),
        events=np.empty((EVENT_BUFFER, 7)),
        counters=np.zeros(7, dtype=np.int64),
        extrema=no_extrema(cycles),
        noted=np.zeros(7),
        start=np.zeros(5),
        watch=np.zeros((WATCHED, 3)),
    )
    close_at_start(c, progress)
    return progress


def no_extrema(cycles: int) -> Array:
    """Return the extrema of so many cycles before the first value, shape (cycles, CHANNELS, 4)."""
    return np.tile([np.inf, 0.0, -np.inf, 0.0], (cycles, CHANNELS, 1))


@kernel
def cycle_time(c: Constants) -> float:
    """Return the period of a crank cycle, s."""
    return 2.0 * math.pi / abs(c.omega)


@kernel
def cycle_start(c: Constants, p: Progress) -> float:
    """Return the start time of the present crank cycle, s."""
    return float(p.clock[3]) * cycle_time(c)


@kernel
def begin_cycle(c: Constants, p: Progress) -> None:
    """Count time from the start of the present cycle, where the crank's angle is not a coordinate."""
    if not crank_coordinate(c):
        cycles = math.floor(p.clock[0] / cycle_time(c))
        p.clock[0] -= cycles * cycle_time(c)
        p.clock[3] += cycles


def reached(period: float, p: Progress, t: float) -> bool:
    """Return whether a run with cycles of `period` (s) has reached time `t` (s), up to round-off.

    Not compiled: asked from Python alone, where a call of compiled code takes longer than this.
    """
    return bool(t - p.clock[3] * period - p.clock[0] <= 1e-12 * t)


@kernel
def close_at_start(c: Constants, p: Progress) -> None:
    """Close the contacts that start inside their wall, and note the energies at t = 0."""
    dy, contacts = np.empty(state_size(c)), np.zeros((5, CONTACTS))
    contacts[GAP] = np.inf
    right_hand_side(c, 0.0, p.y, p.modes, dy, contacts)
    for k in range(CONTACTS):
        # What starts on its wall, but for rounding, is not inside it: it touches like any other.
        if contacts[GAP, k] < -ROUNDING:
            p.modes[INSIDE, k] = 1.0
            # Of a side that is inside with both corners the deeper one, or the lower, stands for the first.
            ahead = contacts[GAP, other_corner(k)] - contacts[GAP, k] if of_side(c, k) else 1.0
            if ahead > 0.0 or (ahead == 0.0 and k < 2):
                rate, slip = contacts[RATE, k], contacts[SLIP, k]
                if of_side(c, k):
                    _, rate, slip = side_motion(c, contacts, k)
                start_contact(c, k, 0.0, rate, slip, contacts, p)
    right_hand_side(c, 0.0, p.y, p.modes, dy, contacts)
    note_forces(c, p.modes, contacts, p.open_contacts)  # a contact may be at its deepest here
    note_start(c, p.y, p.modes, dy, contacts, p.start)


@kernel
def impulse(c: Constants, k: int, p: Progress) -> float:
    """Return the impulse of a contact, or of its side, since t = 0, N s."""
    total = p.y[free(c) + k]
    if of_side(c, k):
        total += p.y[free(c) + other_corner(k)]
    return float(total)


@kernel
def start_contact(
    c: Constants, k: int, t: float, rate: float, slip: float, contacts: Array, p: Progress
) -> None:
    """Freeze the impact speed of contact `k`, or of its side, and open its row of the event table."""
    watch_start(contacts[GAP, k], contacts[RATE, k], t, k, p.watch)
    speed = max(-rate, c.speed_floor)
    p.modes[INSIDE, k], p.modes[MEMORY, k] = 1.0, speed
    p.modes[REGIME, k] = friction_regime(c, slip)
    pulls = speed - c.C * rate < 0.0 and not without_memory(c)
    p.modes[CLIPPED, k] = 1.0 if pulls else 0.0
    row = p.open_contacts[k]
    row[0], row[1], row[2], row[3], row[4] = t, speed, impulse(c, k, p), 0.0, 0.0


@kernel
def end_contact(c: Constants, k: int, t: float, p: Progress) -> None:
    """Write the event row of contact `k` and free it."""
    contact, row = p.open_contacts[k], p.events[p.counters[BUFFERED]]
    row[0], row[1], row[2], row[3] = k, contact[0], t, contact[1]
    row[4], row[5], row[6] = impulse(c, k, p) - contact[2], contact[3], contact[4]
    p.counters[BUFFERED] += 1
    p.counters[ENDED] += 1
    p.modes[:, k] = 0.0


@kernel
def enter(c: Constants, k: int, t: float, contacts: Array, p: Progress) -> None:
    """Let contact `k` close; of a side that is in contact already only the other corner goes in."""
    p.modes[INSIDE, k] = 1.0
    rate, slip = contacts[RATE, k], contacts[SLIP, k]
    if of_side(c, k):
        other = other_corner(k)
        if max(p.modes[MEMORY, k], p.modes[MEMORY, other]) > 0.0:
            return
        # Of two that touch at once the faster one is ahead from there on; which is located first is rounding.
        if touching(contacts[GAP, other], contacts[RATE, other], contacts[GAP, k]):
            rate = min(rate, contacts[RATE, other])
    start_contact(c, k, t, rate, slip, contacts, p)


@kernel
def leave(c: Constants, k: int, t: float, contacts: Array, p: Progress) -> None:
    """Let contact `k` open; of a side that still has the other corner inside only this one goes out."""
    p.modes[INSIDE, k] = 0.0
    if not of_side(c, k):
        end_contact(c, k, t, p)
        return
    if contacts[GAP, other_corner(k)] < 0.0:
        p.modes[INSIDE, other_corner(k)] = 1.0
    if p.modes[INSIDE, other_corner(k)] == 0.0:
        end_contact(c, k if p.modes[MEMORY, k] > 0.0 else other_corner(k), t, p)


@kernel
def switch(c: Constants, t: float, kind: int, contact: int, contacts: Array, p: Progress) -> None:
    """Change the mode that ended at `t`; contacts that close at the same instant follow."""
    p.counters[SWITCHES] += 1
    if kind == GAP and p.modes[INSIDE, contact] > 0.0:
        leave(c, contact, t, contacts, p)
    elif kind == GAP:
        enter(c, contact, t, contacts, p)
        for k in range(CONTACTS):
            if p.modes[INSIDE, k] == 0.0 and touching(
                contacts[GAP, k], contacts[RATE, k], contacts[GAP, contact]
            ):
                enter(c, k, t, contacts, p)
    elif kind == PULL:
        p.modes[CLIPPED, contact] = 1.0 - p.modes[CLIPPED, contact]
    else:
        p.modes[REGIME, contact] = next_regime(c, int(p.modes[REGIME, contact]), contacts[SLIP, contact])


@kernel
def nothing_touches(modes: Array) -> bool:
    """Return whether no contact is closed."""
    closed = 0
    for k in range(CONTACTS):
        if modes[MEMORY, k] != 0.0:
            closed += 1
    return closed == 0
