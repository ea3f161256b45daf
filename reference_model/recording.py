"""What is recorded of each step: samples, extrema, peaks of the contacts.

Samples are kept only of the channels that were asked for, so that long runs fit into memory.
"""

from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import Kernel, bare, inlined, kernel
from reference_model.constants import Constants
from reference_model.dop853 import AT_END, STAGES, dense, prepare_dense
from reference_model.energy import ENERGIES
from reference_model.forces import (
    CONTACTS,
    INSIDE,
    MEMORY,
    RATE,
    Array,
    no_contacts,
)
from reference_model.formulations import derivative, driven, driven_of, free, right_hand_side, state_size
from reference_model.observation import (
    ACCELERATIONS,
    CHANNELS,
    CORNER_CHANNELS,
    MOTION_ONLY,
    NAMES,
    WITH_ENERGY,
    WITH_FORCES,
    WITH_JOINTS,
    note_forces,
    observe,
    observe_driven,
    widen,
)
from reference_model.peaks import deepest, force_peak, has_peak, strongest
from reference_model.progress import (
    EVALUATIONS,
    SAMPLES,
    Progress,
    cycle_start,
    cycle_time,
    end_contact,
    reached,
)
from reference_model.reactions import REACTIONS
from reference_model.watch import watch_contacts, watch_open


class Samples(NamedTuple):
    """Where the integration writes its samples, and what they need."""

    times: Array
    """(n,), s, ascending."""
    wanted: NDArray[np.int64]
    """(k,): the channels that are kept, as positions in `observation.NAMES`."""
    values: Array
    """(k, n)."""
    what: int
    """What has to be observed for them (`reference_model.observation`)."""


def samples_of(names: Sequence[str], times: Array) -> Samples:
    """Return empty samples of some channels."""
    wanted = np.array([NAMES.index(name) for name in names], dtype=np.int64)
    groups = {
        WITH_JOINTS: REACTIONS, WITH_ENERGY: ENERGIES, WITH_FORCES: (*ACCELERATIONS, *CORNER_CHANNELS)
    }  # fmt: skip
    what = sum(
        (group for group, members in groups.items() if not set(names).isdisjoint(members)), MOTION_ONLY
    )
    return Samples(times, wanted, np.zeros((wanted.size, times.size)), what)


@bare
def keep(samples: Samples, i: int, channels: Array) -> None:
    """Write the wanted ones of all `channels`, shape (CHANNELS,), as sample `i`."""
    for k in range(samples.wanted.size):
        samples.values[k, i] = channels[samples.wanted[k]]


@inlined
def note_step(
    c: Constants, p: Progress, t: float, h: float, y1: Array, k: Array, table: Array, f: Array, before: Array,
    after: Array, samples: Samples, state: Array, dy: Array, contacts: Array, observed: Array,
) -> None:  # fmt: skip
    """Record samples, extrema and contact peaks of the step from `t` to t + h, just before it is accepted.

    `t` counts from the start of the cycle.
    """
    t_cycle = cycle_start(c, p)
    # The integrals behind the coordinates are only read for the energies.
    size = p.y.size if samples.what & WITH_ENERGY else free(c)
    count = p.counters[SAMPLES]
    times, forces = samples.times, samples.what != MOTION_ONLY
    peak = has_peak(c, p.modes, h, before, after)
    if peak or (count < times.size and times[count] - t_cycle < t + h):
        prepare_dense(c, t, h, p.y, y1, p.modes, k, table, size, state, contacts, f)
        p.counters[EVALUATIONS] += 3
    while count < times.size and times[count] - t_cycle < t + h:
        # A sample on a step's end belongs to the next step: the right limit at a jump.
        share = (times[count] - t_cycle - t) / h
        note_inside(c, p, share, t, h, f, samples, forces, size, state, dy, contacts, observed)
        keep(samples, count, observed)
        if forces:
            # Not the forces: in stiff contacts those of the dense output are less accurate than the steps'.
            watch_open(p.modes, contacts, times[count], p.watch)
        count += 1
    p.counters[SAMPLES] = count
    if peak:
        for i in range(CONTACTS):
            speed = p.modes[MEMORY, i]
            if p.modes[INSIDE, i] > 0.0 and before[RATE, i] < 0.0 < after[RATE, i]:
                share = deepest(c, i, t, h, p.y, f, before, after, state)
                note_inside(c, p, share, t, h, f, samples, peak, size, state, dy, contacts, observed)
                note_forces(c, p.modes, contacts, p.open_contacts)
            share = force_peak(c, i, speed, h, before, after) if speed > 0.0 else -1.0
            if share > 0.0:
                share = strongest(c, p, i, share, t, h, f, state, dy, contacts)
                note_inside(c, p, share, t, h, f, samples, peak, size, state, dy, contacts, observed)
                note_forces(c, p.modes, contacts, p.open_contacts)
    note_forces(c, p.modes, after, p.open_contacts)
    watch_contacts(p.modes, after, t_cycle + t + h, p.watch)
    at = driven_of(c, table, AT_END)
    observe_driven(c, t + h, at, y1, p.modes, k[STAGES], after, samples.what, p.start, observed)
    widen(p.extrema, samples.wanted, t_cycle + t + h, observed)


@bare
def note_inside(
    c: Constants, p: Progress, share: float, t: float, h: float, f: Array, samples: Samples, forces: bool,
    size: int, state: Array, dy: Array, contacts: Array, observed: Array,
) -> None:  # fmt: skip
    """Observe a state between the ends of a step, by its dense output, and widen the extrema.

    `forces`: whether `contacts` is needed.
    """
    now = t + share * h
    at = driven(c, now)
    dense(p.y, f, share, size, state)
    if forces:
        derivative(c, now, at, state, p.modes, dy, contacts)
    observe_driven(c, now, at, state, p.modes, dy, contacts, samples.what, p.start, observed)
    widen(p.extrema, samples.wanted, cycle_start(c, p) + now, observed)


def prepare_finish(c: Constants, p: Progress, samples: Samples) -> None:
    """Compile what `finish` calls."""
    cast(Kernel, _finish).prepare(c, p, samples, True)


def finish(c: Constants, p: Progress, samples: Samples) -> None:
    """Record the last sample and close the contacts that still touch."""
    last = samples.times.size - 1
    is_due = p.counters[SAMPLES] == last and reached(cycle_time(c), p, samples.times[last])
    _finish(c, p, samples, bool(is_due))


@kernel
def _finish(c: Constants, p: Progress, samples: Samples, is_due: bool) -> None:
    """Close them, record it if due. One kernel: those that it calls are not compiled for Python."""
    t = p.clock[0]
    if is_due:
        dy, contacts, observed = np.empty(state_size(c)), no_contacts(), np.zeros(CHANNELS)
        right_hand_side(c, t, p.y, p.modes, dy, contacts)
        observe(c, t, p.y, p.modes, dy, contacts, samples.what, p.start, observed)
        keep(samples, p.counters[SAMPLES], observed)
        p.counters[SAMPLES] += 1
    for k in range(CONTACTS):
        if p.modes[MEMORY, k] > 0.0:
            end_contact(c, k, cycle_start(c, p) + t, p)
