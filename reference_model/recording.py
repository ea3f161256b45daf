"""Rows: what is recorded of a run at its samples, at marks, at the ends of steps, and where contacts peak.

A row holds a state with the balance of forces in it; named channels, extrema, energies and pulses are made of
rows, many at a time (`reference_model.observation`). Peaks of depth and force within a step are searched on
the dense output.
"""

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import constant, inlined, inner
from reference_model.contact import (
    CONTACTS,
    FRICTION,
    GAP,
    INSIDE,
    MEMORY,
    NORMAL,
    RATE,
    SLIP,
    STATES,
    is_of_side,
    normal_force,
    other_corner,
)
from reference_model.dop853 import END, POINT, Work, dense, evaluate_nodes
from reference_model.equations import Model
from reference_model.events import DEPTH, PARTED, PEAK, RECORDED, Run
from reference_model.linkage import Array
from reference_model.parameters import Law
from reference_model.tableau import SHARES

MARKS = 1000
"""Instants of a cycle at which channels are looked at for their extrema, beside the steps' ends: steps in
flight are longer. What swings k times a cycle lies above the largest of these by 5e-6 k^2 of its size at
most."""

SAMPLE, EXTREMUM, STEP = map(constant, (1, 2, 4))
"""What a row is for, added up: a sample; extrema; the end of a step."""
CLOSED = 8
"""CLOSED 2^k is added where contact k has a force."""
TIME, CYCLE, PURPOSE = range(3)
"""Rows' first entries: s since the start of the cycle, start of the cycle (s), the sum above."""
SLIDER_FROM = 3
"""Then the slider's motion (9), ..."""
CONTACTS_FROM = SLIDER_FROM + 9 - GAP
"""... the contacts' states from GAP on, ..."""
STATE_FROM = CONTACTS_FROM + STATES
"""... and, where a channel needs them, the state and its derivative."""

OPEN_DEPTH, FORCE, PULL, DRIVING = range(4)
"""What no correct run shows (`reference_model.invariants`), and the largest force; m, N, N, W."""
WORST = 4

_EARLY, _LATER, _LATE, _SOONER = 6, 5, 10, 9
"""Stages from which it is looked how a force begins and ends in a step, the nearer first, ..."""
_SQUARES = np.append(SHARES[[_EARLY, _LATER]], 1.0 - SHARES[[_LATE, _SOONER]]) ** 2
"""... and the squares of their shares of it, from its start or its end."""
_FLAT = 2.0e-3
"""Of what a force changes in the step, by which it may seem to fall at the start or rise at the end, times
such a square: a share of 0.1 to 0.3 in the parabola's slope. What is missed all the same is 3e-5 of it."""
PARTS = 5
"""Points of a step with a peak, evenly spaced, both ends included, that it is interpolated from."""


def instants(samples: int, cycles: float, period: float) -> Array:
    """Return samples and marks of three cycles, as `Run.instants` holds them, from the samples in a cycle.

    Three: where a run goes on to its next cycle, its last step may have ended well inside that. Of a shorter
    run so many `cycles`.
    """
    ticks = np.union1d(
        *(each * np.arange(min(3.0, cycles) * n) for n, each in ((samples, MARKS), (MARKS, samples)))
    )
    purposes = np.where(ticks % MARKS == 0, SAMPLE, 0) + np.where(ticks % samples == 0, EXTREMUM, 0)
    return np.stack([np.append(ticks * (period / (MARKS * samples)), np.inf), np.append(purposes, 0)])


@inlined
def note_worst(law: Law, run: Run, i: int, now: float, at_end: bool) -> None:
    """Note what no correct run shows at node `i`; within a step of the depths of open contacts alone."""
    contacts, worst = run.nodes.contacts[i], run.worst
    for k in range(CONTACTS):
        normal = contacts[NORMAL + k]
        if contacts[GAP + k] >= 0.0 and normal == 0.0:
            continue
        power = contacts[FRICTION + k] * contacts[SLIP + k]
        if is_of_side(law, k):
            m = other_corner(k)
            power += contacts[FRICTION + m] * contacts[SLIP + m]
        # Where the wall pulls its friction drives, too: that is the same violation.
        driving = power if normal >= 0.0 else 0.0
        depth = -contacts[GAP + k] if run.modes[INSIDE + k] == 0.0 else 0.0
        values = (depth, normal, -normal, driving)
        for what in range(WORST if at_end else 1):
            if not values[what] <= worst[what, 0]:
                worst[what, 0], worst[what, 1], worst[what, 2] = values[what], now, k


@inlined
def note_forces(law: Law, run: Run, i: int) -> None:
    """Update peak force and largest depth of the closed contacts at node `i`."""
    contacts = run.nodes.contacts[i]
    for k in range(CONTACTS):
        if run.modes[MEMORY + k] > 0.0:
            row = run.open_contacts[k]
            row[PEAK] = max(row[PEAK], normal_force(law, contacts, k))
            row[DEPTH] = max(row[DEPTH], -contacts[GAP + k])
            if is_of_side(law, k):
                row[DEPTH] = max(row[DEPTH], -contacts[GAP + other_corner(k)])


@inner
def record(law: Law, run: Run, i: int, t: float, purpose: int) -> None:
    """Record node `i` at `t` (s, in the cycle)."""
    row, nodes, bit, at_end = run.rows[run.counters[RECORDED]], run.nodes, CLOSED, purpose & STEP > 0
    for k in range(CONTACTS):
        if run.modes[MEMORY + k] > 0.0:
            purpose += bit
        bit *= 2
    row[TIME], row[CYCLE], row[PURPOSE] = t, run.clock[3], purpose
    for j in range(9):
        row[SLIDER_FROM + j] = nodes.slider[i, j]
    for j in range(GAP, STATES):
        row[CONTACTS_FROM + j] = nodes.contacts[i, j]
    size = (row.size - STATE_FROM) // 2
    for j in range(size):
        row[STATE_FROM + j], row[STATE_FROM + size + j] = nodes.y[i, j], nodes.dy[i, j]
    run.counters[RECORDED] += 1
    note_worst(law, run, i, run.clock[3] + t, at_end)
    if purpose % CLOSED != SAMPLE:  # peaks must not depend on what is asked for
        note_forces(law, run, i)


@inlined
def find_peaks(law: Law, run: Run, peaks: NDArray[np.bool_]) -> bool:
    """Write which depths and forces are largest within a step, and return whether any is.

    Those that rise at its start and fall at its end: a depth by its rates there, a force by the parabola
    through it and two stages, for which almost flat is enough.
    """
    contacts, modes, some = run.nodes.contacts, run.modes, False
    for k in range(CONTACTS):
        turns = contacts[0, RATE + k] < 0.0 < contacts[END, RATE + k]
        peaks[k, 0], peaks[k, 1] = modes[INSIDE + k] > 0.0 and turns, False
        if modes[MEMORY + k] > 0.0:
            first, last = normal_force(law, contacts[0], k), normal_force(law, contacts[END], k)
            early, later = normal_force(law, contacts[_EARLY], k), normal_force(law, contacts[_LATER], k)
            late, sooner = normal_force(law, contacts[_LATE], k), normal_force(law, contacts[_SOONER], k)
            flat = -_FLAT * (abs(later - first) + abs(sooner - last) + abs(last - first))
            rises = (early - first) * _SQUARES[1] - (later - first) * _SQUARES[0] > flat
            falls = (late - last) * _SQUARES[3] - (sooner - last) * _SQUARES[2] > flat
            peaks[k, 1] = rises and falls
        some = some or peaks[k, 0] or peaks[k, 1]
    return some


@inner
def largest(values: Array) -> int:
    """Return the place of the largest of the values."""
    best = 0
    for j in range(1, values.size):
        if values[j] > values[best]:
            best = j
    return best


@inlined
def top(values: Array) -> float:
    """Return where the polynomial through the values at j / 4 is largest, next to the largest of them."""
    v0, v1, v2, v3, v4 = values[0], values[1], values[2], values[3], values[4]
    # Newton's divided differences, at s = 0 .. 4.
    a1, a2 = v1 - v0, (v2 - 2.0 * v1 + v0) / 2.0
    a3, a4 = (v3 - 3.0 * (v2 - v1) - v0) / 6.0, (v4 - 4.0 * (v3 + v1) + 6.0 * v2 + v0) / 24.0
    s = float(largest(values))
    lo, hi = max(0.0, s - 1.0), min(4.0, s + 1.0)
    for _ in range(16):  # the zero of its derivative, by halving
        s = 0.5 * (lo + hi)
        slope = a1 + a2 * (2.0 * s - 1.0) + a3 * (3.0 * s * s - 6.0 * s + 2.0)
        slope += a4 * (4.0 * s * s * s - 18.0 * s * s + 22.0 * s - 6.0)
        if slope > 0.0:
            lo = s
        else:
            hi = s
    return 0.25 * s


@inlined
def record_peaks(model: Model, law: Law, run: Run, work: Work, t: float, h: float) -> None:
    """Record the step from `t` to t + h (s, in the cycle) where a depth or a force is largest within it.

    Of each, first its parts are looked at. Accelerations do not peak together with any one force, as two
    corners push and the slider turns: they are kept for all parts of the step.
    """
    nodes, counters, values = run.nodes, run.counters, work.parts
    contacts, slider = nodes.contacts[POINT], nodes.slider[POINT]
    parted = False
    for place in range(2 * CONTACTS):
        k, force = place // 2, place % 2
        if not work.peaks[k, force]:
            continue
        for j in range(PARTS + 1):
            share = 0.25 * j if j < PARTS else top(values)
            dense(share, nodes.y.shape[1], nodes.y, work.f)
            evaluate_nodes(model, law, t + share * h, 0.0, POINT, POINT, run.modes, nodes)
            if j < PARTS:
                values[j] = normal_force(law, contacts, k) if force else -contacts[GAP + k]
            if j < PARTS and not parted:
                part = run.accelerations[counters[PARTED]]
                part[0] = t + share * h + run.clock[3]
                part[1], part[2], part[3] = slider[6], slider[7], slider[8]
                counters[PARTED] += 1
        parted = True
        record(law, run, POINT, t + share * h, EXTREMUM)
