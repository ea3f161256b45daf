"""Adaptive integration with located contact events.

Every step is taken in frozen modes, so the method sees a smooth right-hand side; a step in which a mode ends
is taken again up to the located instant. The kernel works in stretches: it returns when it has passed
`t_stop`, when a buffer is full, or when it fails, and can be called again with the same `Run`.
"""

import math

import numpy as np

from reference_model.compiled import inlined, inner, kernel
from reference_model.contact import (
    CLIPPED,
    CONTACTS,
    GAP,
    INSIDE,
    JOURNAL,
    MEMORY,
    MODES,
    RATE,
    SLIP,
    STATES,
    TAIL,
    is_of_side,
    other_corner,
    side_motion,
)
from reference_model.dop853 import (
    END,
    FIRST,
    FIRST_DENSE,
    LAST_DENSE,
    POINT,
    STAGES,
    START,
    Work,
    dense,
    error_norm,
    evaluate_nodes,
    new_nodes,
    prepare_dense,
)
from reference_model.equations import Model
from reference_model.events import (
    COLUMNS,
    COUNTERS,
    EVALUATIONS,
    EVENT_BUFFER,
    EVENTS,
    INSTANT,
    PART_BUFFER,
    PARTED,
    RECORDED,
    REJECTED,
    ROUNDING,
    STARTED,
    STEPS,
    SWITCHES,
    Run,
    first_end,
    start_contact,
    switch,
)
from reference_model.isolation import POINTS
from reference_model.kinks import share_to_kink, step_in_workpiece
from reference_model.linkage import Array
from reference_model.margins import GATE, MARGINS, NONE, has_ended, unsettled
from reference_model.parameters import Law
from reference_model.recording import (
    EXTREMUM,
    PARTS,
    SAMPLE,
    STATE_FROM,
    STEP,
    WORST,
    find_peaks,
    record,
    record_peaks,
)

REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT, CHATTER = range(6)
"""Why the kernel returned."""

_SAFETY, _SHRINK, _GROW, _EXPONENT = 0.9, 0.333, 3.0, -1.0 / 8.0
# Once on the step as tried, once on the step that ends there; seldom once more, after loose tolerances.
_LOCATIONS = 10
SWITCHES_AT_ONCE = 100
"""At one instant; each contact can open or close and change its friction once."""

# A 32nd of an elastic contact; rules at loose tolerances: at 1e-7 0.05 costs 14 % more evaluations.
_FIRST_SHARE = 0.1
# All that the force moves in the first step is 2^3.5 / (2.5 * 3.5) = 1.3 tolerances; 4.0 fails more often.
_FIRST_ERROR = 2.0
# Short of the opening, where the force is not smooth; 0.5 costs 4 to 16 % more evaluations (1e-10 to 1e-7).
_EXIT_SHARE = 0.8
# While the wall does not pull nothing moves the state by the depth, so no error controls the steps over which
# the loss of what is stored, K d^1.5 d', is integrated: of that, 2e-4 is missing with 0.8, 3e-9 with 0.3.
_CLIPPED_SHARE = 0.3


@inner
def first_step_in_contact(law: Law, k: int, speed: float, contacts: Array, tolerance: float) -> float:
    """Return a first step (s) after a touch at `speed` (m/s), for the lightest mass m that it can hit.

    The force K (v t)^1.5 is not smooth at its start, and an estimate of eighth order knows nothing of it: the
    motion errs by about K v^1.5 h^3.5 / m in the first step, which is held against the tolerance. And no more
    than a share of (m^2 / (K^2 v))^0.2, of which an elastic contact lasts 3.2.

    The force of a foundation is smooth, so only such a share counts: of (m / K_s)^0.5, or where the other
    corner in `contacts` is a gap g away and the force K_s (v t)^2 / 2 g, of (2 m g / (K_s v))^1/3.
    """
    if is_of_side(law, k):
        gap = max(0.0, contacts[GAP + other_corner(k)])
        flat = math.sqrt(law.corner_mass / law.Ks)
        return _FIRST_SHARE * max(flat, math.pow(2.0 * law.corner_mass * gap / (law.Ks * speed), 1.0 / 3.0))
    pin = k == JOURNAL
    mass, stiffness = (law.pin_mass, law.Kj) if pin else (law.corner_mass, law.K)
    arm = law.pin_arm if pin else law.half_length
    longest = math.pow(mass * mass / (stiffness * stiffness * speed), 0.2)
    resolved = math.pow(tolerance * arm * mass / (stiffness * speed * math.sqrt(speed)), 1.0 / 3.5)
    return min(_FIRST_SHARE * longest, _FIRST_ERROR * resolved)


@inlined
def step_before_separation(law: Law, modes: Array, contacts: Array, h: float, tolerance: float) -> float:
    """Return the step to take instead of `h` (s) where a contact will open within it.

    The force K d^1.5 is not smooth where it ends either; a step across that instant fails, and again when it
    is shortened. The instant is foreseen from depth and rate: the steps towards it shorten in proportion to
    what is left, until what is left is as short as a first step.
    """
    for k in range(CONTACTS):
        if is_of_side(law, k) and modes[INSIDE + other_corner(k)] > 0.0:
            continue
        if modes[INSIDE + k] > 0.0 and contacts[RATE + k] > 0.0 and contacts[GAP + k] < 0.0:
            left = -contacts[GAP + k] / contacts[RATE + k]
            share = _EXIT_SHARE if modes[CLIPPED + k] == 0.0 else _CLIPPED_SHARE
            if h > share * left:
                last = first_step_in_contact(law, k, contacts[RATE + k], contacts, tolerance)
                h = min(h, max(share * left, last))
    return h


@inner
def nothing_touches(modes: Array) -> bool:
    """Return whether no contact is closed."""
    closed = 0.0
    for k in range(CONTACTS):
        closed += modes[MEMORY + k]
    return closed == 0.0


@inlined
def begin(law: Law, run: Run) -> None:
    """Close the contacts that start inside their wall."""
    modes, contacts = run.modes, run.nodes.contacts[0]
    for k in range(CONTACTS):
        # What starts on its wall, but for rounding, is not inside it: it touches like any other.
        if contacts[GAP + k] < -ROUNDING:
            modes[INSIDE + k] = 1.0
            # Of a side that is inside with both corners the deeper one, or the lower, stands for the first.
            side = is_of_side(law, k)
            ahead = contacts[GAP + other_corner(k)] - contacts[GAP + k] if side else 1.0
            if ahead > 0.0 or (ahead == 0.0 and k < 2):
                rate, slip = contacts[RATE + k], contacts[SLIP + k]
                if side:
                    _, rate, slip = side_motion(law, contacts, k)
                start_contact(law, k, 0.0, rate, slip, run)


@kernel
def advance(
    model: Model, law: Law, run: Run, work: Work, t_stop: float, t_end: float, tolerance: float, largest:
    float, room: int, limit: int,
) -> int:  # fmt: skip
    """Integrate until `t_stop` is passed, never beyond `t_end`; what is there is the last sample.

    Parameters
    ----------
    model, law, run, work
        Formulation, contacts, the run, which is updated in place, and what its steps are computed in.
    t_stop, t_end
        s, in the present cycle.
    tolerance
        Absolute local error of the coordinates, m and rad.
    largest
        Longest step, s.
    room
        Rows that one step may need.
    limit
        Attempted steps and switches since t = 0 after which the run is stopped.

    Returns
    -------
    int
        REACHED, BUFFER_FULL, STEP_TOO_SMALL, NOT_FINITE, STEP_LIMIT or CHATTER.
    """
    nodes, modes, counters = run.nodes, run.modes, run.counters
    y, dy, contacts, instants = nodes.y, nodes.dy, nodes.contacts, run.instants
    if counters[STARTED] == 0:
        evaluate_nodes(model, law, 0.0, 0.0, START, START, modes, nodes)
        begin(law, run)
        evaluate_nodes(model, law, 0.0, 0.0, START, START, modes, nodes)
        record(law, run, START, 0.0, EXTREMUM)
        counters[STARTED] = 1
    t, h, status, switched = run.clock[0], run.clock[1], REACHED, counters[SWITCHES]
    while t < t_stop:
        full = counters[EVENTS] + CONTACTS > EVENT_BUFFER or counters[PARTED] + PARTS > PART_BUFFER
        if full or counters[RECORDED] + room > run.rows.shape[0]:
            status = BUFFER_FULL
            break
        if counters[STEPS] + counters[REJECTED] + counters[SWITCHES] >= limit:
            status = STEP_LIMIT
            break
        if counters[SWITCHES] - switched > SWITCHES_AT_ONCE:
            status = CHATTER
            break
        h = step_before_separation(law, modes, contacts[0], h, tolerance)
        h = step_in_workpiece(model.load, nodes.slider[0], h)
        final = h >= t_end - t
        if final:
            h = t_end - t
        place, next_h, is_dense, error = NONE, h, False, 0.0
        for attempt in range(_LOCATIONS + 1):
            is_dense = False
            evaluate_nodes(model, law, t, h, FIRST, END, modes, nodes)
            counters[EVALUATIONS] += STAGES
            error = error_norm(h, dy, y.shape[1] - TAIL, tolerance)
            if not error <= 1.0 or attempt == _LOCATIONS:
                break
            if attempt == 0:
                factor = _GROW if error == 0.0 else min(_GROW, _SAFETY * math.pow(error, _EXPONENT))
                next_h = min(largest, h * factor)
            to_kink = share_to_kink(model.load, nodes.slider[0], nodes.slider[END], h)
            if to_kink < 1.0 and t + h * to_kink > t:
                place, final = NONE, False
                h *= to_kink
                continue
            # Also a step that was taken again: it errs less, and could meet what the longer one stepped over.
            is_dense = unsettled(law, modes, h, contacts, work.scales, work.unsettled)
            if not is_dense:
                break
            evaluate_nodes(model, law, t, h, FIRST_DENSE, LAST_DENSE, modes, nodes)
            prepare_dense(h, y, dy, work.f)
            counters[EVALUATIONS] += 3
            share, first = first_end(model, law, t, h, run, work)
            if first == NONE and (share >= 1.0 or t + h * share == t):
                break
            place = first
            if share >= 1.0:
                break
            final = False
            h *= share
            if t + h == t:
                break
        if not error <= 1.0:
            counters[REJECTED] += 1
            finite = np.isfinite(error)
            h *= max(_SHRINK, _SAFETY * math.pow(error, _EXPONENT)) if finite and place == NONE else _SHRINK
            if t + 0.1 * h == t:
                status = STEP_TOO_SMALL if finite else NOT_FINITE
                break
            continue
        if nothing_touches(modes):
            run.clock[2] = next_h
        if t + h > t:
            # Taken again, a step that is coarse for what it meets may end short of it: it goes on from there.
            if place != NONE and not has_ended(law, modes, place, work.scales, contacts[END]):
                place, next_h = NONE, min(next_h, h)
            counters[STEPS] += 1
            peak = find_peaks(law, run, work.peaks)
            if not is_dense and (peak or instants[0, counters[INSTANT]] < t + h):
                evaluate_nodes(model, law, t, h, FIRST_DENSE, LAST_DENSE, modes, nodes)
                prepare_dense(h, y, dy, work.f)
                counters[EVALUATIONS] += 3
            # What is on a step's end belongs to the next step: the right limit at a jump.
            while instants[0, counters[INSTANT]] < t + h:
                now, purpose = instants[0, counters[INSTANT]], int(instants[1, counters[INSTANT]])
                dense((now - t) / h, y.shape[1], y, work.f)
                evaluate_nodes(model, law, now, 0.0, POINT, POINT, modes, nodes)
                record(law, run, POINT, now, purpose)
                counters[INSTANT] += 1
            if peak:
                record_peaks(model, law, run, work, t, h)
            record(law, run, END, t + h, EXTREMUM + STEP)
            t = t_end if final else t + h
            switched = counters[SWITCHES]
            for i in range(y.shape[1]):
                y[0, i], dy[0, i] = y[END, i], dy[END, i]
            for i in range(STATES):
                contacts[0, i] = contacts[END, i]
            for i in range(9):
                nodes.slider[0, i] = nodes.slider[END, i]
        h = next_h
        if place != NONE:
            contact = place // MARGINS
            was_free, had_touched = nothing_touches(modes), modes[MEMORY + contact] > 0.0
            switch(law, run.clock[3] + t, place, run)
            if place % MARGINS == GATE:
                speed = modes[MEMORY + contact]
                if nothing_touches(modes) and not was_free:
                    h = max(h, run.clock[2])
                elif speed > 0.0 and not had_touched:
                    h = min(h, first_step_in_contact(law, contact, speed, contacts[0], tolerance))
            evaluate_nodes(model, law, t, 0.0, START, START, modes, nodes)
            counters[EVALUATIONS] += 1
    run.clock[0], run.clock[1] = t, h
    if t >= t_end:
        record(law, run, START, t, SAMPLE)
    return status


def new_run(
    y0: Array, first_step: float, instants: Array, capacity: int, *, states: bool = True
) -> tuple[Run, Work]:
    """Return a run at t = 0 from coordinates and rates `y0`, and what its steps are computed in.

    Parameters
    ----------
    y0
        Coordinates and rates.
    first_step
        s.
    instants
        When to record, and what for (`recording.instants`).
    capacity
        Rows that are recorded until the caller empties the buffer.
    states
        Whether they hold the states, too.
    """
    size = y0.size + TAIL
    run = Run(
        clock=np.array([0.0, first_step, first_step, 0.0]),
        nodes=new_nodes(y0),
        modes=np.zeros(MODES),
        open_contacts=np.zeros((CONTACTS, COLUMNS)),
        events=np.empty((EVENT_BUFFER, COLUMNS)),
        counters=np.zeros(COUNTERS, dtype=np.int64),
        rows=np.empty((capacity, STATE_FROM + (2 * size if states else 0))),
        accelerations=np.empty((PART_BUFFER, 4)),
        instants=instants,
        worst=np.tile([0.0, 0.0, -1.0], (WORST, 1)),
    )
    work = Work(
        f=np.empty((7, size)),
        values=np.empty((CONTACTS * MARGINS, POINTS)),
        scales=np.ones(CONTACTS),
        unsettled=np.zeros(CONTACTS * MARGINS, dtype=np.bool_),
        parts=np.empty(PARTS),
        peaks=np.zeros((CONTACTS, 2), dtype=np.bool_),
    )
    return run, work
