"""What is recorded of each step: samples, extrema, peaks of the contacts.

Samples are kept only of the channels that were asked for, so that long runs fit into memory.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import kernel
from reference_model.dop853 import STAGES, dense, prepare_dense
from reference_model.events import contact_state, locate
from reference_model.forces import CONTACTS, MEMORY, NORMAL, RATE, Array, no_contacts
from reference_model.formulations import free, right_hand_side, state_size
from reference_model.observation import (
    CHANNELS,
    NAMES,
    WITH_ENERGY,
    force_lead,
    note_forces,
    observe,
    turns_inside,
    widen,
)
from reference_model.parameters import Constants
from reference_model.progress import EVALUATIONS, SAMPLES, Progress, end_contact, reached, turn_start


class Samples(NamedTuple):
    """Where the integration writes its samples, arrays only."""

    times: Array
    """(n,), s, ascending."""
    wanted: NDArray[np.int64]
    """(k,): the channels that are kept, as positions in `observation.NAMES`."""
    values: Array
    """(k, n)."""


def samples_of(names: Sequence[str], times: Array) -> Samples:
    """Return empty samples of some channels."""
    wanted = np.array([NAMES.index(name) for name in names], dtype=np.int64)
    return Samples(times, wanted, np.zeros((wanted.size, times.size)))


@kernel
def keep(samples: Samples, i: int, channels: Array) -> None:
    """Write the wanted ones of all `channels`, shape (CHANNELS,), as sample `i`."""
    for k in range(samples.wanted.size):
        samples.values[k, i] = channels[samples.wanted[k]]


@kernel
def strongest(
    c: Constants, p: Progress, contact: int, deepest: float, t: float, h: float, f: Array,
    state: Array, dy: Array, contacts: Array,
) -> float:  # fmt: skip
    """Return the share of the step at which a contact's force peaks, given the share at which it is deepest.

    The vertex of a parabola through three forces around the first-order estimate. It can lie shortly before
    the step: the dense output is a polynomial there as well.
    """
    dense(p.y, f, deepest, free(c), state)
    depth = -contact_state(c, contact, t + deepest * h, state)[0]
    lead = force_lead(c, depth, p.modes[MEMORY, contact]) / h
    share, width = deepest - lead, 0.5 * lead
    force = np.empty(3)
    for i in range(3):
        x = share + (i - 1) * width
        dense(p.y, f, x, free(c), state)
        right_hand_side(c, t + x * h, state, p.modes, dy, contacts)
        force[i] = contacts[NORMAL, contact]
    bend = force[0] - 2.0 * force[1] + force[2]
    if bend < 0.0:
        share += width * max(-2.0, min(2.0, 0.5 * (force[0] - force[2]) / bend))
    return max(-3.0, min(deepest, share))


@kernel
def note_step(
    c: Constants, p: Progress, t: float, h: float, y1: Array, k: Array, f: Array, before: Array, after: Array,
    samples: Samples, what: int, state: Array, dy: Array, contacts: Array, observed: Array,
) -> None:  # fmt: skip
    """Record samples, extrema and contact peaks of the step from `t` to t + h, just before it is accepted.

    `t` counts from the start of the turn.
    """
    turn = turn_start(c, p)
    # The integrals behind the coordinates are only read for the energies.
    size = p.y.size if what & WITH_ENERGY else free(c)
    count = p.counters[SAMPLES]
    times = samples.times
    turning = turns_inside(p.modes, before, after)
    if turning or (count < times.size and times[count] - turn < t + h):
        prepare_dense(c, t, h, p.y, y1, p.modes, k, size, state, contacts, f)
        p.counters[EVALUATIONS] += 3
    while count < times.size and times[count] - turn < t + h:
        # A sample on a step's end belongs to the next step: the right limit at a jump.
        at = times[count] - turn
        dense(p.y, f, (at - t) / h, size, state)
        right_hand_side(c, at, state, p.modes, dy, contacts)
        observe(c, at, state, p.modes, dy, contacts, what, p.start, observed)
        widen(p.extrema, times[count], observed)
        keep(samples, count, observed)
        count += 1
    p.counters[SAMPLES] = count
    if turning:
        for contact in range(CONTACTS):
            if p.modes[MEMORY, contact] > 0.0 and before[RATE, contact] < 0.0 < after[RATE, contact]:
                share = locate(c, RATE, contact, 0.0, 0.0, 1.0, t, h, p.y, f, p.modes, state)
                for peak in range(2):  # of the depth, then of the force
                    if peak == 1:
                        share = strongest(c, p, contact, share, t, h, f, state, dy, contacts)
                    dense(p.y, f, share, size, state)
                    right_hand_side(c, t + share * h, state, p.modes, dy, contacts)
                    observe(c, t + share * h, state, p.modes, dy, contacts, what, p.start, observed)
                    widen(p.extrema, turn + t + share * h, observed)
                    note_forces(p.modes, contacts, p.open_contacts)
    note_forces(p.modes, after, p.open_contacts)
    observe(c, t + h, y1, p.modes, k[STAGES], after, what, p.start, observed)
    widen(p.extrema, turn + t + h, observed)


def finish(c: Constants, p: Progress, samples: Samples, what: int) -> None:
    """Record the last sample and close the contacts that still touch."""
    t, dy, contacts = p.clock[0], np.empty(state_size(c)), no_contacts()
    last, observed = samples.times.size - 1, np.zeros(CHANNELS)
    if p.counters[SAMPLES] == last and reached(c, p, samples.times[last]):
        right_hand_side(c, t, p.y, p.modes, dy, contacts)
        observe(c, t, p.y, p.modes, dy, contacts, what, p.start, observed)
        keep(samples, last, observed)
        p.counters[SAMPLES] += 1
    for k in range(CONTACTS):
        if p.modes[MEMORY, k] > 0.0:
            end_contact(c, k, turn_start(c, p) + t, p)
