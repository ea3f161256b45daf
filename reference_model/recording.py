"""Rows: what is recorded of a run at its samples, at marks, at the ends of steps, and where contacts peak.

A row holds a state with the balance of forces in it; named channels, extrema, energies and pulses are made of
rows, many at a time (`reference_model.channels`). Peaks of depth and force within a step are searched on the
dense output.
"""

import math

from reference_model.compiled import inner
from reference_model.contact import CONTACTS, GAP, INSIDE, MEMORY, RATE, STATES, normal_force
from reference_model.dop853 import STAGES, Work, dense, prepare_dense
from reference_model.equations import Model, right_hand_side
from reference_model.events import EVALUATIONS, PARTED, RECORDED, SAMPLES, Run, note_forces
from reference_model.linkage import Array
from reference_model.parameters import Law

MARKS = 1000
"""Instants of a cycle at which channels are looked at for their extrema, beside the steps' ends: steps in
flight are longer. What swings k times a cycle lies above the largest of these by 5e-6 k^2 of its size at
most."""

SAMPLE, EXTREMUM, STEP = 1, 2, 4
"""What a row is for, added up: a sample; extrema; the end of a step."""
TIME, CYCLE, PURPOSE = range(3)
"""Rows' first entries: s since the start of the cycle, start of the cycle (s), the sum above."""
SLIDER_FROM = 3
"""Then the slider's motion (9), ..."""
CONTACTS_FROM = SLIDER_FROM + 9
"""... the contacts' states (STATES,), ..."""
INSIDE_FROM = CONTACTS_FROM + STATES * CONTACTS
MEMORY_FROM = INSIDE_FROM + CONTACTS
STATE_FROM = MEMORY_FROM + CONTACTS
"""... what of their modes says whether they are closed, the state, and its derivative."""

_NEAR = 1.0e-3
"""Of a step, from whose ends it is looked how a force begins and ends in it."""
PARTS = 5
"""Points of a step with a peak, evenly spaced, both ends included, that it is interpolated from."""
_ROUNDS = 9
"""Of such points, the next between the neighbours of the largest, for a law without memory: there the damping
factor falls from 1 + C to 1 - C while the depth's rate changes its sign, and the peak is narrow."""


def row_size(size: int) -> int:
    """Return the length of a row for a state of so many numbers."""
    return STATE_FROM + 2 * size


@inner
def evaluate_inside(model: Model, law: Law, run: Run, work: Work, share: float, t: float, h: float) -> None:
    """Write state and forces at a share of a step, by its dense output, into the next row."""
    row, size = run.rows[run.counters[RECORDED]], run.y.size
    contacts, state = row[CONTACTS_FROM:INSIDE_FROM], row[STATE_FROM : STATE_FROM + size]
    for j in range(STATES):
        contacts[j] = run.contacts[j]
    row[TIME], row[CYCLE] = t + share * h, run.clock[3]
    dense(run.y, work.f, share, size, state)
    right_hand_side(
        model,
        law,
        row[TIME],
        -1,
        state,
        run.modes,
        row[STATE_FROM + size :],
        contacts,
        row[SLIDER_FROM:CONTACTS_FROM],
    )


@inner
def keep(run: Run, purpose: int) -> None:
    """Keep the next row."""
    row = run.rows[run.counters[RECORDED]]
    row[PURPOSE] = purpose
    for k in range(CONTACTS):
        row[INSIDE_FROM + k], row[MEMORY_FROM + k] = run.modes[INSIDE + k], run.modes[MEMORY + k]
    run.counters[RECORDED] += 1


@inner
def record(run: Run, t: float, purpose: int, y: Array, dy: Array, contacts: Array, slider: Array) -> None:
    """Keep a state at `t` (s, in the cycle)."""
    row, size = run.rows[run.counters[RECORDED]], y.size
    row[TIME], row[CYCLE] = t, run.clock[3]
    for j in range(9):
        row[SLIDER_FROM + j] = slider[j]
    for j in range(STATES):
        row[CONTACTS_FROM + j] = contacts[j]
    for j in range(size):
        row[STATE_FROM + j], row[STATE_FROM + size + j] = y[j], dy[j]
    keep(run, purpose)


@inner
def force_near(model: Model, law: Law, run: Run, work: Work, t: float, h: float, at_end: bool) -> None:
    """Write the contacts a `_NEAR` of a step inside one of its ends, from the derivative there."""
    y, row, ahead = (work.y1, STAGES, -_NEAR * h) if at_end else (run.y, 0, _NEAR * h)
    contacts = work.stages[0] if at_end else work.contacts
    for m in range(y.size):
        work.state[m] = y[m] + ahead * work.k[row, m]
    now = t + ahead + (h if at_end else 0.0)
    right_hand_side(model, law, now, -1, work.state, run.modes, work.rate, contacts, work.aside)


@inner
def peaks_inside(law: Law, modes: Array, k: int, before: Array, work: Work) -> tuple[bool, bool]:
    """Return whether depth and force of contact `k` rise at a step's start, and fall at its end.

    The contacts near the ends are those of `force_near`.
    """
    after = work.stages[STAGES]
    depth = modes[INSIDE + k] > 0.0 and before[RATE + k] < 0.0 < after[RATE + k]
    if modes[MEMORY + k] == 0.0:
        return depth, False
    rises = normal_force(law, work.contacts, k) > normal_force(law, before, k)
    return depth, rises and normal_force(law, work.stages[0], k) > normal_force(law, after, k)


@inner
def largest(values: Array) -> int:
    """Return the place of the largest of the values."""
    best = 0
    for j in range(1, values.size):
        if values[j] > values[best]:
            best = j
    return best


@inner
def top(values: Array) -> float:
    """Return where the polynomial through the values at j / 4 is largest, next to the largest of them."""
    v0, v1, v2, v3, v4 = values[0], values[1], values[2], values[3], values[4]
    # Newton's divided differences, at s = 0 .. 4.
    a1, a2 = v1 - v0, (v2 - 2.0 * v1 + v0) / 2.0
    a3, a4 = (v3 - 3.0 * (v2 - v1) - v0) / 6.0, (v4 - 4.0 * (v3 + v1) + 6.0 * v2 + v0) / 24.0
    s = float(largest(values))
    lo, hi = max(0.0, s - 1.0), min(4.0, s + 1.0)
    for _ in range(30):  # the zero of its derivative, by halving
        s = 0.5 * (lo + hi)
        slope = a1 + a2 * (2.0 * s - 1.0) + a3 * (3.0 * s * s - 6.0 * s + 2.0)
        slope += a4 * (4.0 * s * s * s - 18.0 * s * s + 22.0 * s - 6.0)
        if slope > 0.0:
            lo = s
        else:
            hi = s
    return 0.25 * s


@inner
def peak_share(model: Model, law: Law, run: Run, work: Work, k: int, force: int, t: float, h: float) -> float:
    """Return the share of a step at which force or depth of contact `k` is largest, from its parts."""
    values, lo, width = work.parts[2 * k + force], 0.0, 1.0
    for _ in range(_ROUNDS if force == 1 and law.memoryless > 0.0 else 0):
        lo += 0.25 * width * max(0, min(largest(values) - 1, PARTS - 3))
        width *= 0.5
        for j in range(PARTS):
            evaluate_inside(model, law, run, work, lo + 0.25 * j * width, t, h)
            values[j] = normal_force(law, run.rows[run.counters[RECORDED], CONTACTS_FROM:INSIDE_FROM], k)
    return lo + width * top(values)


@inner
def record_step(model: Model, law: Law, run: Run, work: Work, t: float, h: float, is_dense: bool) -> None:
    """Record the step from `t` to t + h (s, in the cycle), just before it is accepted.

    `is_dense`: whether the dense output in `work` is already that of this step.
    """
    times, count, interval = run.times, run.counters[SAMPLES], work.interval
    closed, peak = 0.0, False
    for k in range(CONTACTS):
        closed += run.modes[INSIDE + k] + run.modes[MEMORY + k]
    if closed > 0.0:
        force_near(model, law, run, work, t, h, False)
        force_near(model, law, run, work, t, h, True)
        for k in range(CONTACTS):
            depth, force = peaks_inside(law, run.modes, k, run.contacts, work)
            work.peaks[2 * k], work.peaks[2 * k + 1] = depth, force
            peak = peak or depth or force
    mark = math.ceil(t / interval)
    if mark * interval < t:  # by rounding
        mark += 1
    sample = times[count] - run.clock[3] if count < times.size else math.inf
    if not is_dense and (peak or min(sample, mark * interval) < t + h):
        prepare_dense(model, law, t, h, run.y, run.modes, work)
        run.counters[EVALUATIONS] += 3
    # A sample on a step's end belongs to the next step: the right limit at a jump.
    while True:
        marked = mark * interval
        both = abs(sample - marked) <= 1e-9 * min(interval, h)
        is_sample = both or sample < marked
        now = sample if is_sample else marked
        if now >= t + h:
            break
        evaluate_inside(model, law, run, work, (now - t) / h, t, h)
        if is_sample:
            count += 1
            sample = times[count] - run.clock[3] if count < times.size else math.inf
        # Not at every sample: extrema must not depend on what is asked for.
        if both or not is_sample:
            mark += 1
        keep(run, (SAMPLE if is_sample else 0) + (EXTREMUM if both or not is_sample else 0))
    run.counters[SAMPLES] = count
    # Accelerations do not peak together with any one force: two corners push, and the slider turns.
    for j in range(PARTS if peak else 0):
        evaluate_inside(model, law, run, work, j / (PARTS - 1), t, h)
        contacts = run.rows[run.counters[RECORDED], CONTACTS_FROM:INSIDE_FROM]
        for k in range(CONTACTS):
            work.parts[2 * k, j], work.parts[2 * k + 1, j] = (
                -contacts[GAP + k],
                normal_force(law, contacts, k),
            )
        row, part = run.rows[run.counters[RECORDED]], run.accelerations[run.counters[PARTED]]
        part[0] = row[TIME] + row[CYCLE]
        part[1], part[2], part[3] = row[SLIDER_FROM + 6], row[SLIDER_FROM + 7], row[SLIDER_FROM + 8]
        run.counters[PARTED] += 1
    for k in range(CONTACTS if peak else 0):
        for what in range(2):
            if work.peaks[2 * k + what]:
                evaluate_inside(model, law, run, work, peak_share(model, law, run, work, k, what, t, h), t, h)
                contacts = run.rows[run.counters[RECORDED], CONTACTS_FROM:INSIDE_FROM]
                note_forces(law, run.modes, contacts, run.open_contacts)
                keep(run, EXTREMUM)
    note_forces(law, run.modes, work.stages[STAGES], run.open_contacts)
    record(run, t + h, EXTREMUM + STEP, work.y1, work.k[STAGES], work.stages[STAGES], work.slider)
