"""Rows: what is recorded of a run at its samples, at marks, at the ends of steps, and where contacts peak.

A row holds a state with the balance of forces in it; named channels, extrema, energies and pulses are made of
rows, many at a time (`reference_model.channels`). Peaks of depth and force within a step are searched on the
dense output.
"""

import math

from reference_model.compiled import inner
from reference_model.contact import CONTACTS, GAP, INSIDE, MEMORY, RATE, STATES, normal_force
from reference_model.dop853 import STAGES, dense, prepare_dense
from reference_model.equations import Model, right_hand_side
from reference_model.events import EVALUATIONS, RECORDED, SAMPLES, Run, note_forces
from reference_model.linkage import Array
from reference_model.parameters import Law

MARKS = 1000
"""Instants of a cycle at which channels are looked at for their extrema, beside the steps' ends: steps in
flight are longer. What swings k times a cycle lies above the largest of these by 5e-6 k^2 of its size at most."""

SAMPLE, EXTREMUM, STEP, PART = 1, 2, 4, 8
"""What a row is for, added up: a sample; extrema; the end of a step; one of several within a step."""
TIME, CYCLE, PURPOSE = range(3)
"""Rows' first entries: s since the start of the cycle, start of the cycle (s), the sum above."""
SLIDER_FROM = 3
"""Then the slider's motion (9), ..."""
CONTACTS_FROM = SLIDER_FROM + 9
"""... the contacts' states (STATES, CONTACTS), ..."""
INSIDE_FROM = CONTACTS_FROM + STATES * CONTACTS
MEMORY_FROM = INSIDE_FROM + CONTACTS
STATE_FROM = MEMORY_FROM + CONTACTS
"""... what of their modes says whether they are closed, the state, and its derivative."""

_GOLDEN, _SECTIONS = 0.5 * (math.sqrt(5.0) - 1.0), 20
"""Of a step, which shrinks to 7e-5 of itself: a peak is short by the square of that."""


def row_size(size: int) -> int:
    """Return the length of a row for a state of so many numbers."""
    return STATE_FROM + 2 * size


@inner
def record(
    run: Run, t: float, purpose: int, y: Array, dy: Array, contacts: Array, slider: Array
) -> None:
    """Write a row at `t` (s, in the cycle)."""
    row = run.rows[run.counters[RECORDED]]
    row[TIME], row[CYCLE], row[PURPOSE] = t, run.clock[3], purpose
    for j in range(9):
        row[SLIDER_FROM + j] = slider[j]
    for k in range(CONTACTS):
        for j in range(STATES):
            row[CONTACTS_FROM + CONTACTS * j + k] = contacts[j, k]
        row[INSIDE_FROM + k], row[MEMORY_FROM + k] = run.modes[INSIDE, k], run.modes[MEMORY, k]
    for j in range(y.size):
        row[STATE_FROM + j], row[STATE_FROM + y.size + j] = y[j], dy[j]
    run.counters[RECORDED] += 1


@inner
def evaluate_inside(
    model: Model, law: Law, run: Run, share: float, t: float, h: float, f: Array, state: Array, dy: Array,
    contacts: Array, slider: Array,
) -> None:  # fmt: skip
    """Write state and forces at a share of a step, by its dense output."""
    dense(run.y, f, share, run.y.size, state)
    right_hand_side(model, law, t + share * h, state, run.modes, dy, contacts, slider)


@inner
def peaks_inside(law: Law, modes: Array, k: int, before: Array, stages: Array) -> tuple[bool, bool]:
    """Return whether depth and force of contact `k` peak within a step.

    The force as its stages say: one that peaks next to an end, before the first or after the last of them, has
    that end stand for it, up to 1e-4 of it short.
    """
    depth = modes[INSIDE, k] > 0.0 and before[RATE, k] < 0.0 < stages[STAGES, RATE, k]
    if modes[MEMORY, k] == 0.0:
        return depth, False
    largest = max(normal_force(law, before, k), normal_force(law, stages[STAGES], k))
    for i in range(1, STAGES - 1):
        if normal_force(law, stages[i], k) > largest:
            return depth, True
    return depth, False


@inner
def value_inside(
    model: Model, law: Law, run: Run, k: int, force: bool, share: float, t: float, h: float, f: Array,
    state: Array, dy: Array, contacts: Array, slider: Array,
) -> float:  # fmt: skip
    """Return force (N) or depth (m) of contact `k` at a share of a step."""
    evaluate_inside(model, law, run, share, t, h, f, state, dy, contacts, slider)
    return normal_force(law, contacts, k) if force else -contacts[GAP, k]


@inner
def peak_share(
    model: Model, law: Law, run: Run, k: int, force: bool, t: float, h: float, f: Array, state: Array, dy: Array,
    contacts: Array, slider: Array,
) -> float:  # fmt: skip
    """Return the share of a step at which force or depth of contact `k` is largest, by the golden section."""
    lo, hi, a, b = 0.0, 1.0, 1.0 - _GOLDEN, _GOLDEN
    at_a = value_inside(model, law, run, k, force, a, t, h, f, state, dy, contacts, slider)
    at_b = value_inside(model, law, run, k, force, b, t, h, f, state, dy, contacts, slider)
    for _ in range(_SECTIONS):
        left = at_a > at_b
        if left:
            hi, b, at_b = b, a, at_a
            a = x = hi - _GOLDEN * (hi - lo)
        else:
            lo, a, at_a = a, b, at_b
            b = x = lo + _GOLDEN * (hi - lo)
        value = value_inside(model, law, run, k, force, x, t, h, f, state, dy, contacts, slider)
        if left:
            at_a = value
        else:
            at_b = value
    return 0.5 * (lo + hi)


@inner
def record_step(
    model: Model, law: Law, run: Run, t: float, h: float, y1: Array, k: Array, f: Array, before: Array,
    stages: Array, interval: float, is_dense: bool, state: Array, dy: Array, contacts: Array, slider: Array,
    slider1: Array,
) -> None:  # fmt: skip
    """Record the step from `t` to t + h (s, in the cycle), just before it is accepted.

    Parameters
    ----------
    model, law, run
        Formulation, contacts, the run.
    t, h, y1, k, f
        The step, the state at its end, derivatives at its stages, coefficients of the dense output.
    before, stages
        States of the contacts at its start (STATES, CONTACTS), and at its stages.
    interval
        Between marks, s.
    is_dense
        Whether `f` is already that of this step.
    slider1
        Motion of the slider at its end, (9,).
    """
    times, count, cycle = run.times, run.counters[SAMPLES], run.clock[3]
    peak = False
    for i in range(CONTACTS):
        if run.modes[INSIDE, i] > 0.0 or run.modes[MEMORY, i] > 0.0:
            depth, force = peaks_inside(law, run.modes, i, before, stages)
            peak = peak or depth or force
    mark = math.ceil(t / interval - 1e-9)
    sample = times[count] - cycle if count < times.size else math.inf
    if not is_dense and (peak or min(sample, mark * interval) < t + h):
        prepare_dense(model, law, t, h, run.y, y1, run.modes, k, f, state, contacts, slider)
        run.counters[EVALUATIONS] += 3
    # A sample on a step's end belongs to the next step: the right limit at a jump.
    while min(sample, mark * interval) < t + h:
        both = abs(sample - mark * interval) <= 1e-9 * interval
        now = sample if both else min(sample, mark * interval)
        evaluate_inside(model, law, run, (now - t) / h, t, h, f, state, dy, contacts, slider)
        purpose = 0
        if now == sample:
            purpose += SAMPLE
            count += 1
            sample = times[count] - cycle if count < times.size else math.inf
        # Not at every sample: extrema must not depend on what is asked for.
        if now >= (mark - 1e-9) * interval:
            purpose += EXTREMUM
            mark += 1
        record(run, now, purpose, state, dy, contacts, slider)
    run.counters[SAMPLES] = count
    if peak:
        # Accelerations do not peak together with any one force: two corners push, and the slider turns. The
        # parabola through the largest and its neighbours says where.
        for i in range(9):
            share = i / 8
            evaluate_inside(model, law, run, share, t, h, f, state, dy, contacts, slider)
            record(run, t + share * h, EXTREMUM + PART, state, dy, contacts, slider)
        for i in range(CONTACTS):
            for force, found in enumerate(peaks_inside(law, run.modes, i, before, stages)):
                if found:
                    share = peak_share(
                        model, law, run, i, force == 1, t, h, f, state, dy, contacts, slider
                    )
                    evaluate_inside(model, law, run, share, t, h, f, state, dy, contacts, slider)
                    record(run, t + share * h, EXTREMUM, state, dy, contacts, slider)
                    note_forces(law, run.modes, contacts, run.open_contacts)
    note_forces(law, run.modes, stages[STAGES], run.open_contacts)
    record(run, t + h, EXTREMUM + STEP, y1, k[STAGES], stages[STAGES], slider1)
