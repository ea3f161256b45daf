"""Adaptive integration with located contact events.

Every step is taken in frozen modes, so the method sees a smooth right-hand side; a step in which a mode
ends is taken again up to the located instant. There the impact speed of a new contact is frozen.
The kernel works in chunks: it returns when it has passed `t_stop`, when its event buffer is full, or when
it fails, and can be called again with the same `Progress`.
"""

import numpy as np

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.contact_steps import first_step_in_contact, step_before_separation
from reference_model.dop853 import NODES, ROWS, STAGES, error_norm, prepare_dense, take_step
from reference_model.energy import ENERGIES
from reference_model.events import first_switch
from reference_model.forces import (
    CONTACTS,
    GAP,
    MEMORY,
    no_contacts,
)
from reference_model.formulations import DRIVEN, free, right_hand_side, state_size
from reference_model.isolation import POINTS
from reference_model.observation import CHANNELS, audit
from reference_model.progress import (
    BUFFERED,
    EVALUATIONS,
    EVENT_BUFFER,
    REJECTED,
    STEPS,
    SWITCHES,
    Progress,
    begin_cycle,
    cycle_start,
    nothing_touches,
    switch,
)
from reference_model.recording import Samples, note_step
from reference_model.step_bounds import has_ended, step_may_switch
from reference_model.switching import NONE, margin_of
from reference_model.watch import watch_energy

REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT, CHATTER = range(6)
"""Why the kernel returned."""

_SAFETY, _SHRINK, _GROW, _EXPONENT = 0.9, 0.333, 3.0, -1.0 / 8.0
VELOCITY_TIME = 1.0e-3
"""s; the error of a rate counts as the error of position that it makes in this time."""
# Once on the step as tried, once on the step that ends there; seldom once more, after loose tolerances.
_LOCATIONS = 10
SWITCHES_AT_ONCE = 100
"""At one instant; each contact can open or close and change its friction once."""


@kernel
def advance(
    c: Constants, p: Progress, t_stop: float, t_end: float, tolerance: float, max_step: float,
    step_limit: int, samples: Samples,
) -> int:  # fmt: skip
    """Integrate until `t_stop` is passed, never beyond `t_end`.

    To be called at least once per crank cycle: inside, time counts from the start of the cycle.

    Parameters
    ----------
    c, p
        Constants and progress; the latter is updated in place.
    t_stop, t_end
        s.
    tolerance
        Absolute local error of the coordinates, rad (in the multiplier form also m).
    max_step
        s.
    step_limit
        Attempted steps and switches since t = 0 after which the run is stopped.
    samples
        Written when their times are passed; one at `t_end` is left to `finish`.

    Returns
    -------
    int
        REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT or CHATTER.
    """
    begin_cycle(c, p)
    t_cycle = cycle_start(c, p)
    t, h = p.clock[0], p.clock[1]
    t_stop -= t_cycle
    t_end -= t_cycle
    size = state_size(c)
    k, f = np.zeros((ROWS, size)), np.empty((7, size))
    y1, state, dy = np.empty(size), np.empty(size), np.empty(size)
    table = np.empty((DRIVEN, NODES.size))
    before, contacts = no_contacts(), no_contacts()
    stages = np.zeros((STAGES + 1, *contacts.shape))
    stages[:, GAP] = np.inf
    after = stages[STAGES]
    observed, values, deviations = np.zeros(CHANNELS), np.empty(POINTS), np.empty(CONTACTS)
    weights = np.full(free(c), 1.0 / tolerance)
    # In a loop: for the same in one line numba compiles how to put its error into words, for over a second.
    for i in range(free(c) // 2, free(c)):
        weights[i] *= VELOCITY_TIME
    right_hand_side(c, t, p.y, p.modes, k[0], before)
    status = REACHED
    switched = p.counters[SWITCHES]
    while t < t_stop:
        if p.counters[BUFFERED] + CONTACTS > EVENT_BUFFER:
            status = BUFFER_FULL
            break
        if p.counters[STEPS] + p.counters[REJECTED] + p.counters[SWITCHES] >= step_limit:
            status = STEP_LIMIT
            break
        h = step_before_separation(c, p.modes, before, h, tolerance)
        remaining = t_end - t
        final = h >= remaining
        if final:
            h = remaining
        take_step(c, t, h, p.y, p.modes, k, y1, stages, table)
        p.counters[EVALUATIONS] += STAGES
        error = error_norm(h, k, weights)
        if not error <= 1.0:
            p.counters[REJECTED] += 1
            finite = np.isfinite(error)
            h *= max(_SHRINK, _SAFETY * error**_EXPONENT) if finite else _SHRINK
            if t + 0.1 * h == t:
                status = STEP_TOO_SMALL if finite else NOT_FINITE
                break
            continue
        if p.counters[SWITCHES] - switched > SWITCHES_AT_ONCE:
            status = CHATTER
            break
        next_h = min(max_step, h * (_GROW if error == 0.0 else min(_GROW, _SAFETY * error**_EXPONENT)))
        contact, number = NONE, NONE
        for _ in range(_LOCATIONS):
            if not step_may_switch(c, p.modes, h, before, stages, deviations):
                break
            prepare_dense(c, t, h, p.y, y1, p.modes, k, table, free(c), state, contacts, f)
            p.counters[EVALUATIONS] += 3
            share, ends, by = first_switch(
                c, t, h, p.y, f, p.modes, before, stages, deviations, state, values
            )
            if ends == NONE:
                break
            contact, number = ends, by
            if share >= 1.0:
                break
            final = False
            h *= share
            if t + h == t:
                break
            # Tested and searched like any other: the shorter step errs less, and could meet what the longer
            # one stepped over.
            take_step(c, t, h, p.y, p.modes, k, y1, stages, table)
            p.counters[EVALUATIONS] += STAGES
            error = error_norm(h, k, weights)
            if not error <= 1.0:
                break
        if not error <= 1.0:
            p.counters[REJECTED] += 1
            h *= _SHRINK
            continue
        if nothing_touches(p.modes):
            p.clock[2] = next_h
        if t + h > t:
            # Taken again, a step that is coarse for what it meets may end short of it: it goes on from there.
            if contact != NONE and not has_ended(c, p.modes, contact, number, after):
                contact = NONE
                next_h = min(next_h, h)
            p.counters[STEPS] += 1
            note_step(c, p, t, h, y1, k, table, f, before, after, samples, state, dy, contacts, observed)
            t = t_end if final else t + h
            switched = p.counters[SWITCHES]
            # In loops: for an array that it assigns numba first allocates a copy.
            for i in range(size):
                p.y[i] = y1[i]
                k[0, i] = k[STAGES, i]
            for i in range(before.size):
                before.flat[i] = after.flat[i]
        h = next_h
        if contact != NONE:
            kind, _, _ = margin_of(c, p.modes, contact, number)
            was_free, had_touched = nothing_touches(p.modes), p.modes[MEMORY, contact] > 0.0
            switch(c, t_cycle + t, kind, contact, before, p)
            if kind == GAP:
                if nothing_touches(p.modes) and not was_free:
                    h = max(h, p.clock[2])
                elif p.modes[MEMORY, contact] > 0.0 and not had_touched:
                    speed = p.modes[MEMORY, contact]
                    h = min(h, first_step_in_contact(c, contact, speed, before, tolerance))
            right_hand_side(c, t, p.y, p.modes, k[0], before)
            p.counters[EVALUATIONS] += 1
    p.clock[0], p.clock[1] = t, h
    energies = observed[: len(ENERGIES)]
    audit(c, t, p.y, p.modes, k[0], before, p.start, energies)
    watch_energy(c, energies, p.start, t_cycle + t, p.watch)
    return status
