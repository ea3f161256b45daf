"""Record rows of a run: at its samples, at marks, at the ends of steps, and where contacts peak.

A row holds a state with the balance of forces in it; `reference_model.observation` computes channels,
extrema, energies and pulses from many rows at a time. Peaks of depth and force in a step are found on its
dense output.
"""

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import constant, inlined, inner, merged
from reference_model.contact import normal_force
from reference_model.dop853 import END, POINT, SHARES, dense, evaluate_nodes
from reference_model.formulations import Model
from reference_model.linkage import Array
from reference_model.results import MARKS
from reference_model.state import Records, Run

SAMPLE, EXTREMUM, STEP, PART = map(constant, (1, 2, 4, 8))
"""Purposes of a row, which add up: a sample; extrema; the end of a step; accelerations at PARTS of a step."""
CLOSED = 16
"""Purpose CLOSED 2^k marks that contact k is closed."""

_START_NEAR, _START_FAR, _END_NEAR, _END_FAR = 6, 5, 10, 9
"""Stages whose forces show whether a force rises at the start of a step and falls at its end."""
_SQUARES = np.append(SHARES[[_START_NEAR, _START_FAR]], 1.0 - SHARES[[_END_NEAR, _END_FAR]]) ** 2
"""Squares of the distances of these stages from the start or the end, as shares of the step."""
_FLAT = 2.0e-3
"""Slope against the rise or fall that still counts as flat, as a share of the change of the force in the step
times such a square: 0.1 to 0.3 of the parabola's slope. Peaks that are missed exceed an end by 3e-5 of it."""
PARTS = 5
"""Number of evenly spaced points of a step, ends included, from which a peak is interpolated."""


def schedule(samples: int, cycles: float, period: float) -> Array:
    """Return times and purposes of samples and marks for `Run.instants`, from the samples in a cycle.

    They cover three cycles, or `cycles` if the run is shorter: the last step before a run goes on to its next
    cycle may end well inside that.
    """
    ticks = np.union1d(
        *(each * np.arange(min(3.0, cycles) * n) for n, each in ((samples, MARKS), (MARKS, samples)))
    )
    purposes = np.where(ticks % MARKS == 0, SAMPLE, 0) + np.where(ticks % samples == 0, EXTREMUM, 0)
    return np.stack([np.append(ticks * (period / (MARKS * samples)), np.inf), np.append(purposes, 0)])


@inlined
def note_worst(contacts: Records, run: Run, i: int, now: float, at_end: bool) -> None:
    """Update the worst violations from node `i`: all `at_end` of a step, else the depth of open contacts."""
    touches, worst = run.nodes.touches[i], run.worst
    for k in range(contacts.size):
        touch = touches[k]
        normal = touch.normal
        if touch.gap >= 0.0 and normal == 0.0:
            continue
        power = touch.friction * touch.slip
        if contacts[k].one_side:
            other = touches[contacts[k].other]
            power += other.friction * other.slip
        # If the wall pulls, its friction drives, too; then only the pull is a violation.
        driving = power if normal >= 0.0 else 0.0
        depth = -touch.gap if not run.modes[k].inside else 0.0
        values = (depth, normal, -normal, driving)  # in the order of `state.WORST`
        for row in range(len(values) if at_end else 1):
            if not values[row] <= worst[row].value:
                worst[row].value, worst[row].time, worst[row].contact = values[row], now, k


@inlined
def note_forces(contacts: Records, run: Run, i: int) -> None:
    """Update peak force and largest depth of the closed contacts at node `i`."""
    touches = run.nodes.touches[i]
    for k in range(contacts.size):
        if run.modes[k].speed > 0.0:
            event = run.current_events[k]
            event.peak_force = max(event.peak_force, normal_force(contacts, touches, k))
            event.largest_depth = max(event.largest_depth, -touches[k].gap)
            if contacts[k].one_side:
                event.largest_depth = max(event.largest_depth, -touches[contacts[k].other].gap)


@inner
def record(contacts: Records, run: Run, i: int, t: float, purpose: int) -> None:
    """Record node `i` at `t` (s, in the cycle)."""
    rows, nodes, counters, bit, reason = run.rows, run.nodes, run.counters[0], CLOSED, purpose
    n, cycle = counters.recorded, run.clock[0].cycle
    for k in range(contacts.size):
        rows.touches[n, k] = nodes.touches[i, k]
        if run.modes[k].speed > 0.0:
            purpose += bit
        bit *= 2
    rows.times[n], rows.cycles[n], rows.purposes[n] = t, cycle, purpose
    rows.slider[n] = nodes.slider[i]
    for j in range(rows.y.shape[1]):
        rows.y[n, j], rows.dy[n, j] = nodes.y[i, j], nodes.dy[i, j]
    counters.recorded += 1
    if reason != PART:
        note_worst(contacts, run, i, cycle + t, reason & STEP > 0)
        if reason != SAMPLE:  # peaks must not depend on the samples
            note_forces(contacts, run, i)


@inlined
def find_peaks(contacts: Records, run: Run, peaks: NDArray[np.bool_]) -> bool:
    """Write which depths and forces peak within a step, and return whether any does.

    They rise at its start and fall at its end. The rates there show this for a depth; for a force the
    parabolas through an end and two stages do, which may be almost flat.
    """
    touches, any_peak = run.nodes.touches, False
    for k in range(contacts.size):
        turns = touches[0, k].rate < 0.0 < touches[END, k].rate
        peaks[k, 0], peaks[k, 1] = run.modes[k].inside and turns, False
        if run.modes[k].speed > 0.0:
            first = normal_force(contacts, touches[0], k)
            near_start = normal_force(contacts, touches[_START_NEAR], k)
            far_start = normal_force(contacts, touches[_START_FAR], k)
            far_end = normal_force(contacts, touches[_END_FAR], k)
            near_end = normal_force(contacts, touches[_END_NEAR], k)
            last = normal_force(contacts, touches[END], k)
            flat = -_FLAT * (abs(far_start - first) + abs(far_end - last) + abs(last - first))
            rises = (near_start - first) * _SQUARES[1] - (far_start - first) * _SQUARES[0] > flat
            falls = (near_end - last) * _SQUARES[3] - (far_end - last) * _SQUARES[2] > flat
            peaks[k, 1] = rises and falls
        any_peak = any_peak or peaks[k, 0] or peaks[k, 1]
    return any_peak


@inlined
def top(values: Array) -> float:
    """Return at which share the polynomial through the values at j / 4 peaks next to the largest of them."""
    v0, v1, v2, v3, v4 = values[0], values[1], values[2], values[3], values[4]
    # Newton's divided differences, at s = 0 .. 4.
    a1, a2 = v1 - v0, (v2 - 2.0 * v1 + v0) / 2.0
    a3, a4 = (v3 - 3.0 * (v2 - v1) - v0) / 6.0, (v4 - 4.0 * (v3 + v1) + 6.0 * v2 + v0) / 24.0
    s = float(np.argmax(values))
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
def find_top(model: Model, run: Run, t: float, h: float, place: int) -> float:
    """Return the share of the step from `t` of `h` (s) at which one of the flattened `Run.peaks` is."""
    k, force, nodes = place // 2, place % 2, run.nodes
    touches = nodes.touches[POINT]
    for j in range(PARTS):
        share = 0.25 * j
        dense(share, nodes.y.shape[1], nodes.y, run.f)
        evaluate_nodes(model, t + share * h, 0.0, POINT, POINT, run.modes, nodes)
        run.parts[j] = normal_force(model.contacts, touches, k) if force else -touches[k].gap
    return top(run.parts)


@merged
def record_peaks(model: Model, run: Run, t: float, h: float) -> None:
    """Record the step from `t` to t + h (s, in the cycle) where a depth or a force is largest within it.

    Each peak is interpolated from the parts of the step. The parts are recorded, too: accelerations do not
    peak together with any one force, as two corners push and the slider turns.
    """
    nodes, first_part = run.nodes, 0
    for place in range(run.peaks.size):
        if not run.peaks.flat[place]:
            continue
        peak = find_top(model, run, t, h, place)
        for j in range(first_part, PARTS + 1):
            share = 0.25 * j if j < PARTS else peak
            dense(share, nodes.y.shape[1], nodes.y, run.f)
            evaluate_nodes(model, t + share * h, 0.0, POINT, POINT, run.modes, nodes)
            record(model.contacts, run, POINT, t + share * h, PART if j < PARTS else EXTREMUM)
        first_part = PARTS
