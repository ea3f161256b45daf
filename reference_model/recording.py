"""What is recorded of each step: samples, extrema, peaks of the contacts.

Samples are kept only of the channels that were asked for, so that long runs fit into memory.
"""

import math
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
    widen_one,
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

MARKS = 1000
"""Instants of a cycle at which channels are looked at for their extrema, beside the steps' ends: steps in
flight are longer. What swings k times a cycle lies above the largest of these by 5e-6 k^2 of its size at
most."""


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
    interval = cycle_time(c) / MARKS
    mark = first_mark(t, interval)
    sampled = times[count] - t_cycle if count < times.size else np.inf
    now = earlier(sampled, mark, interval)
    if peak or now < t + h:
        prepare_dense(c, t, h, p.y, y1, p.modes, k, table, size, state, contacts, f)
        p.counters[EVALUATIONS] += 3
    while now < t + h:
        # A sample on a step's end belongs to the next step: the right limit at a jump.
        note_inside(c, p, (now - t) / h, t, h, f, samples, forces, size, state, dy, contacts, observed)
        if now == sampled:
            keep(samples, count, observed)
            if forces:
                # Not the forces: in stiff contacts those of the dense output are less accurate than the
                # steps'.
                watch_open(p.modes, contacts, times[count], p.watch)
            count += 1
            sampled = times[count] - t_cycle if count < times.size else np.inf
        # Not at every sample: extrema must not depend on what is asked for.
        if now >= (mark - 1e-9) * interval:
            note_extrema(c, p, samples, now, observed)
            mark += 1
        now = earlier(sampled, mark, interval)
    p.counters[SAMPLES] = count
    if peak:
        if forces:
            note_accelerations(c, p, t, h, f, samples, size, state, dy, contacts, observed)
        for i in range(CONTACTS):
            speed = p.modes[MEMORY, i]
            if p.modes[INSIDE, i] > 0.0 and before[RATE, i] < 0.0 < after[RATE, i]:
                share = deepest(c, i, t, h, p.y, f, before, after, state)
                note_inside(c, p, share, t, h, f, samples, peak, size, state, dy, contacts, observed)
                widen_cycle(c, p, samples, t + share * h, observed)
                note_forces(c, p.modes, contacts, p.open_contacts)
            share = force_peak(c, i, speed, h, before, after) if speed > 0.0 else -1.0
            if share > 0.0:
                share = strongest(c, p, i, share, t, h, f, state, dy, contacts)
                note_inside(c, p, share, t, h, f, samples, peak, size, state, dy, contacts, observed)
                widen_cycle(c, p, samples, t + share * h, observed)
                note_forces(c, p.modes, contacts, p.open_contacts)
    note_forces(c, p.modes, after, p.open_contacts)
    watch_contacts(p.modes, after, t_cycle + t + h, p.watch)
    at = driven_of(c, table, AT_END)
    observe_driven(c, t + h, at, y1, p.modes, k[STAGES], after, samples.what, p.start, observed)
    note_extrema(c, p, samples, t + h, observed)


@inlined
def first_mark(t: float, interval: float) -> int:
    """Return the number of the first of the `MARKS` from `t` (s) on, which are an interval (s) apart."""
    return math.ceil(t / interval - 1e-9)


@inlined
def earlier(sampled: float, mark: int, interval: float) -> float:
    """Return the time of a sample or that of a mark, the earlier one; where they coincide the sample's."""
    return min(sampled, mark * interval) if abs(sampled - mark * interval) > 1e-9 * interval else sampled


@bare
def note_extrema(c: Constants, p: Progress, samples: Samples, t: float, observed: Array) -> None:
    """Widen the extrema by a state at `t` (s, in the cycle), and by where the slider turned since the last.

    A coordinate turns where its velocity changes sign; there the motion is the cubic polynomial of both.
    """
    now, last = cycle_start(c, p) + t, p.noted
    then, h = last[6], now - last[6]
    for i in range(3):
        r0, r1 = last[i + 3], observed[i + 3]
        if h > 0.0 and r0 * r1 < 0.0:
            rise = (observed[i] - last[i]) / h
            curved, cubic = 3.0 * rise - 2.0 * r0 - r1, r0 + r1 - 2.0 * rise
            # The rate r0 + 2 curved s + 3 cubic s^2 is zero once; in this form also where cubic is 0.
            root = math.sqrt(curved**2 - 3.0 * cubic * r0)
            s = -r0 / (curved + (root if r1 > r0 else -root))
            value = last[i] + h * s * (r0 + s * (curved + s * cubic))
            widen_one(p.extrema[cycle_of(c, p, then + s * h)], i, then + s * h, value)
    widen_cycle(c, p, samples, t, observed)
    for i in range(6):
        last[i] = observed[i]
    last[6] = now


@bare
def note_accelerations(
    c: Constants, p: Progress, t: float, h: float, f: Array, samples: Samples, size: int, state: Array,
    dy: Array, contacts: Array, observed: Array,
) -> None:  # fmt: skip
    """Widen the extrema where an acceleration of the slider peaks in a step, as some contact's force does.

    They do not peak together: two corners push, and the slider turns. Where, says the parabola through both
    ends and the middle.
    """
    note_inside(c, p, 0.0, t, h, f, samples, True, size, state, dy, contacts, observed)
    start = observed[6], observed[7], observed[8]
    note_inside(c, p, 0.5, t, h, f, samples, True, size, state, dy, contacts, observed)
    middle = observed[6], observed[7], observed[8]
    note_inside(c, p, 1.0, t, h, f, samples, True, size, state, dy, contacts, observed)
    end = observed[6], observed[7], observed[8]
    for i in range(3):
        rise, bend = end[i] - start[i], end[i] - 2.0 * middle[i] + start[i]
        if abs(rise) < 2.0 * abs(bend):
            share = 0.5 - 0.25 * rise / bend
            note_inside(c, p, share, t, h, f, samples, True, size, state, dy, contacts, observed)
            now = cycle_start(c, p) + t + share * h
            widen_one(p.extrema[cycle_of(c, p, now)], 6 + i, now, observed[6 + i])


@inlined
def widen_cycle(c: Constants, p: Progress, samples: Samples, t: float, observed: Array) -> None:
    """Widen the extrema of the cycle of `t` (s, in the cycle); where one ends and another begins, of both."""
    now, slack = cycle_start(c, p) + t, 1e-9 * cycle_time(c)
    for cycle in range(cycle_of(c, p, now - slack), cycle_of(c, p, now + slack) + 1):
        widen(p.extrema[cycle], samples.wanted, now, observed)


@inlined
def cycle_of(c: Constants, p: Progress, now: float) -> int:
    """Return the number of the cycle of a time, s."""
    return int(max(0.0, min(now // cycle_time(c), p.extrema.shape[0] - 1.0)))


@bare
def note_inside(
    c: Constants, p: Progress, share: float, t: float, h: float, f: Array, samples: Samples, forces: bool,
    size: int, state: Array, dy: Array, contacts: Array, observed: Array,
) -> None:  # fmt: skip
    """Observe a state between the ends of a step, by its dense output.

    `forces`: whether `contacts` is needed.
    """
    now = t + share * h
    at = driven(c, now)
    dense(p.y, f, share, size, state)
    if forces:
        derivative(c, now, at, state, p.modes, dy, contacts)
    observe_driven(c, now, at, state, p.modes, dy, contacts, samples.what, p.start, observed)


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
