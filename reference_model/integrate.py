"""Adaptive integration with located contact events.

Every step is taken in frozen modes, so the method sees a smooth right-hand side; a step in which a mode ends
is taken again up to the located instant. `advance` integrates one stretch: it returns when it has passed
`t_stop`, when a buffer is full, or when it fails, and can be called again with the same `Run`.
"""

import math
from typing import NamedTuple

import numpy as np

from reference_model.compiled import inlined, inner, kernel, merged
from reference_model.dop853 import (
    END,
    FIRST,
    FIRST_DENSE,
    LAST_DENSE,
    POINT,
    STAGES,
    START,
    dense,
    error_norm,
    evaluate_nodes,
    free_states,
    prepare_dense,
)
from reference_model.events import begin, first_end, switch
from reference_model.formulations import Model
from reference_model.margins import GATE, MARGINS, NONE, has_ended, unsettled
from reference_model.recording import EXTREMUM, SAMPLE, STEP, find_peaks, record, record_peaks
from reference_model.state import EVENT_BUFFER, Records, Run
from reference_model.steps import (
    first_step_in_contact,
    share_to_kink,
    step_before_separation,
    step_in_workpiece,
)

REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT, CHATTER = range(6)
"""Codes with which `advance` returns."""

_SAFETY, _SHRINK, _GROW, _EXPONENT = 0.9, 0.333, 3.0, -1.0 / 8.0
LOCATIONS = 10
"""Times that a step is located again. Usually two: as tried, and on the step that ends there."""
SWITCHES_AT_ONCE = 100
"""Largest number of switches at one instant; each contact can open or close and change its friction once."""


class Settings(NamedTuple):
    """Limits of the steps of a run."""

    tolerance: float
    """Absolute local error of the coordinates, m and rad."""
    largest: float
    """Longest step, s."""
    room: int
    """Rows that one step may need."""
    limit: int
    """Attempted steps and switches since t = 0 after which the run is stopped."""


@inner
def nothing_touches(modes: Records) -> bool:
    """Return whether no contact is closed."""
    speed_sum = 0.0
    for k in range(modes.size):
        speed_sum += modes[k].speed
    return speed_sum == 0.0


@merged
def prepare_dense_output(model: Model, t: float, h: float, run: Run) -> None:
    """Prepare the dense output of a step from `t` of length `h` (s)."""
    evaluate_nodes(model, t, h, FIRST_DENSE, LAST_DENSE, run.modes, run.nodes)
    prepare_dense(h, run.nodes.y, run.nodes.dy, run.f)
    run.counters[0].evaluations += 3


@merged
def attempt(
    model: Model, run: Run, settings: Settings, t: float, h: float
) -> tuple[float, float, int, bool, float]:
    """Try a step of `h` (s) from `t`, and again up to the first instant in it at which a mode ends.

    Return the step (s) that was tried last, its error in units of the tolerance, the place of the margin that
    ends with it, whether its dense output is prepared, and the step (s) that the first error allows next.
    """
    nodes, modes, place, next_h, error = run.nodes, run.modes, NONE, h, 0.0
    for again in range(LOCATIONS + 1):
        evaluate_nodes(model, t, h, FIRST, END, modes, nodes)
        run.counters[0].evaluations += STAGES
        error = error_norm(h, nodes.dy, free_states(nodes), settings.tolerance)
        if not error <= 1.0 or again == LOCATIONS:
            break
        if again == 0:
            factor = _GROW if error == 0.0 else min(_GROW, _SAFETY * math.pow(error, _EXPONENT))
            next_h = min(settings.largest, h * factor)
        start, end = nodes.slider[0], nodes.slider[END]
        kink_share = share_to_kink(model.load, start.y, h * start.vy, end.y, h * end.vy)
        if kink_share < 1.0 and t + h * kink_share > t:
            place = NONE
            h *= kink_share
            continue
        # A step that was taken again errs less, and may meet an event that the longer one stepped over.
        if not unsettled(model.contacts, modes, nodes.touches, h, run.scales, run.unsettled):
            break
        prepare_dense_output(model, t, h, run)
        share, first = first_end(model, t, h, run)
        if first == NONE and (share >= 1.0 or t + h * share == t):
            return h, error, place, True, next_h
        place = first
        if share >= 1.0:
            return h, error, place, True, next_h
        h *= share
        if t + h == t:
            return h, error, place, True, next_h
    return h, error, place, False, next_h


@merged
def accept(model: Model, run: Run, t: float, h: float, is_dense: bool) -> None:
    """Record a step from `t` of length `h` (s), and go on to its end."""
    nodes, counters, instants = run.nodes, run.counters[0], run.instants
    counters.steps += 1
    peak = find_peaks(model.contacts, run, run.peaks)
    if not is_dense and (peak or instants[0, counters.instant] < t + h):
        prepare_dense_output(model, t, h, run)
    # An instant at the end of a step belongs to the next step: the right limit counts at a jump.
    while instants[0, counters.instant] < t + h:
        now, purpose = instants[0, counters.instant], int(instants[1, counters.instant])
        dense((now - t) / h, nodes.y.shape[1], nodes.y, run.f)
        evaluate_nodes(model, now, 0.0, POINT, POINT, run.modes, nodes)
        record(model.contacts, run, POINT, now, purpose)
        counters.instant += 1
    if peak:
        record_peaks(model, run, t, h)
    record(model.contacts, run, END, t + h, EXTREMUM + STEP)
    for i in range(nodes.y.shape[1]):
        nodes.y[0, i], nodes.dy[0, i] = nodes.y[END, i], nodes.dy[END, i]
    for k in range(model.contacts.size):
        nodes.touches[0, k] = nodes.touches[END, k]
    nodes.slider[0] = nodes.slider[END]


@merged
def change_mode(model: Model, run: Run, t: float, h: float, place: int, tolerance: float) -> float:
    """Change the mode whose margin ended at `t` (s); return the step (s) to take then instead of `h`."""
    modes, clock, k = run.modes, run.clock[0], place // MARGINS
    was_free, had_touched = nothing_touches(modes), modes[k].speed > 0.0
    switch(model.contacts, clock.cycle + t, place, run)
    if place % MARGINS == GATE:
        speed = modes[k].speed
        if nothing_touches(modes) and not was_free:
            h = max(h, clock.flight_step)
        elif speed > 0.0 and not had_touched:
            touches = run.nodes.touches[0]
            h = min(h, first_step_in_contact(model.contacts, k, speed, touches, tolerance))
    evaluate_nodes(model, t, 0.0, START, START, modes, run.nodes)
    run.counters[0].evaluations += 1
    return h


@inlined
def stop_code(run: Run, settings: Settings, last_switches: int) -> int:
    """Return the code of the limit that forbids a further step; REACHED if none does."""
    counters = run.counters[0]
    full = counters.events + run.modes.size > EVENT_BUFFER
    if full or counters.recorded + settings.room > run.rows.times.size:
        return BUFFER_FULL
    if counters.steps + counters.rejected + counters.switches >= settings.limit:
        return STEP_LIMIT
    return CHATTER if counters.switches - last_switches > SWITCHES_AT_ONCE else REACHED


@kernel
def advance(model: Model, run: Run, settings: Settings, t_stop: float, t_end: float) -> int:
    """Integrate until `t_stop` is passed, never beyond the last sample at `t_end` (s, in the cycle).

    Return REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT or CHATTER.
    """
    contacts, nodes, modes = model.contacts, run.nodes, run.modes
    clock, counters = run.clock[0], run.counters[0]
    if not counters.started:
        evaluate_nodes(model, 0.0, 0.0, START, START, modes, nodes)
        begin(contacts, run)
        evaluate_nodes(model, 0.0, 0.0, START, START, modes, nodes)
        record(contacts, run, START, 0.0, EXTREMUM)
        counters.started = True
    t, h, status, last_switches = clock.time, clock.step, REACHED, counters.switches
    while t < t_stop:
        status = stop_code(run, settings, last_switches)
        if status != REACHED:
            break
        h = step_before_separation(contacts, modes, nodes.touches[0], h, settings.tolerance)
        h = step_in_workpiece(model.load, nodes.slider[0], h)
        final = h >= t_end - t
        if final:
            h = t_end - t
        longest = h
        h, error, place, is_dense, next_h = attempt(model, run, settings, t, h)
        if not error <= 1.0:
            counters.rejected += 1
            finite = np.isfinite(error)
            h *= max(_SHRINK, _SAFETY * math.pow(error, _EXPONENT)) if finite and place == NONE else _SHRINK
            if t + 0.1 * h == t:
                status = STEP_TOO_SMALL if finite else NOT_FINITE
                break
            continue
        if nothing_touches(modes):
            clock.flight_step = next_h
        if t + h > t:
            # A step that was taken again may end short of the event if it is coarse: the run goes on there.
            if place != NONE and not has_ended(contacts, modes, nodes.touches[END], place, run.scales):
                place, next_h = NONE, min(next_h, h)
            accept(model, run, t, h, is_dense)
            t = t_end if final and h == longest else t + h
            last_switches = counters.switches
        h = next_h
        if place != NONE:
            h = change_mode(model, run, t, h, place, settings.tolerance)
    clock.time, clock.step = t, h
    if t >= t_end:
        record(contacts, run, START, t, SAMPLE)
    return status
