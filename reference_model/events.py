"""Events: where in a step the first mode ends, and how the modes change there.

A mode ends where one of its margins (`reference_model.margins`) turns negative: first touch, separation, a
force that would turn to a pull, a kink of the friction. Every margin that the stages leave open is followed
through the step on the dense output, in intervals on which it either certainly keeps its sign or certainly
changes it once (`reference_model.isolation`), and that zero is located. At a touch the impact speed is
frozen.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import inlined, inner
from reference_model.contact import (
    CLIPPED,
    CONTACTS,
    GAP,
    INSIDE,
    MEMORY,
    MODES,
    RATE,
    REGIME,
    SLIP,
    TAIL,
    is_of_side,
    other_corner,
    stiffness,
)
from reference_model.dop853 import END, NOW, POINT, Nodes, Work, dense
from reference_model.equations import Model, motion, tabulate
from reference_model.friction import friction_regime, regime_bounds
from reference_model.isolation import (
    BELOW,
    CROSSES,
    NARROWEST,
    NODES,
    POINTS,
    RESOLUTION,
    UNCLEAR,
    classify,
    crossing,
    dips,
)
from reference_model.laws import is_lossless, push
from reference_model.linkage import Array
from reference_model.margins import GATE, LOCATED, MARGINS, NONE, PULL, UPPER, margin
from reference_model.parameters import Law

ROUNDING = 1.0e-15
"""m or m/s; gaps are differences of coordinates near 0.55 m and round at 1e-16 m, slips of some m/s too."""
DEEPEST = 2.0 * LOCATED
"""m; twice what an open contact may begin with, where the one before was located a little too early."""
MOST_INTERVALS = 1000
"""A margin that is still not settled then is nothing but rounding: its mode ends. Usual are 1 to 10."""

STEPS, REJECTED, EVALUATIONS, SWITCHES, ENDED, EVENTS, RECORDED, INSTANT, STARTED, PARTED = range(10)
"""What `Run.counters` counts. ENDED: contacts since t = 0; EVENTS, RECORDED, PARTED: rows in the
buffers; INSTANT: which of `Run.instants` is next."""
COUNTERS = 10
EVENT_BUFFER, PART_BUFFER = 4096, 10_000
CONTACT, BEGIN, STOP, SPEED, IMPULSE, PEAK, DEPTH, START_GAP, START_RATE = range(9)
"""Columns of a contact's row: number, s, s, m/s, N s, N, m, and gap (m) and rate (m/s) at which it began."""
COLUMNS = 9


class Run(NamedTuple):
    """Everything the integration carries from one call to the next, arrays only."""

    clock: Array
    """(4,): time since the start of the present cycle, next step, last step in free flight, start of the
    cycle; s.

    Rounding of a time far from zero would move the mechanism by its speed times that, and a corner that has
    just left its wall back into it.
    """
    nodes: Nodes
    """The state now is that at START."""
    modes: Array
    """(MODES,)."""
    open_contacts: Array
    """(CONTACTS, COLUMNS): rows of the contacts that have not ended; IMPULSE holds that before the touch."""
    events: Array
    """(EVENT_BUFFER, COLUMNS): those of the contacts that have, emptied by the caller."""
    counters: NDArray[np.int64]
    """(COUNTERS,)."""
    rows: Array
    """(capacity, row): what is recorded (`reference_model.recording`), emptied by the caller."""
    accelerations: Array
    """(PART_BUFFER, 4): time (s) and accelerations of the slider at the parts of steps with a peak."""
    instants: Array
    """(2, n): when to record a row, s since the start of the present cycle, ascending up to infinity; and
    what for (`reference_model.recording`)."""
    worst: Array
    """(WORST, 3): what no correct run shows (`reference_model.invariants`): the largest value, when, s, and
    of which contact."""


@inlined
def first_end(model: Model, law: Law, t: float, h: float, run: Run, work: Work) -> tuple[float, int]:
    """Return share of the step and place of the margin that first turns negative; place NONE: there is none.

    With place NONE and a share below 1 that is certain up to there only: the step should end there.

    Of the margins that `work.unsettled` names, in the step from `t` (s) of length `h` whose dense output is
    in `work`.
    """
    modes, nodes, scales, values = run.modes, run.nodes, work.scales, work.values
    lo, width = 0.0, 1.0
    for interval in range(MOST_INTERVALS):
        hi = min(1.0, lo + width)
        for j in range(POINTS):
            x = lo + (hi - lo) * NODES[j]
            node = 0 if x == 0.0 else (END if x == 1.0 else POINT)
            if node == POINT:
                dense(x, nodes.y.shape[1] - TAIL, nodes.y, work.f)
                tabulate(model, t + x * h, 0.0, NOW)
                motion(model, law, t + x * h, 0, nodes.y[POINT], nodes.contacts[POINT])
            for place in range(CONTACTS * MARGINS):
                if work.unsettled[place]:
                    k = place // MARGINS
                    values[place, j] = margin(law, modes, k, place % MARGINS, nodes.contacts[node], scales[k])
        share, first, unclear = 2.0, NONE, NONE
        for place in range(CONTACTS * MARGINS):
            if work.unsettled[place]:
                column = values[place]
                # A mode that has just begun starts at zero but for rounding, and can turn right before it
                # ends. Not so an open contact that goes deeper into its wall than it is located to, whether
                # or not it comes out again within the step: it starts at its wall and approaches, and ends at
                # once.
                starting = lo == 0.0 and column[0] <= ROUNDING
                if (
                    place % MARGINS == GATE
                    and modes[INSIDE + place // MARGINS] == 0.0
                    and dips(column, DEEPEST)
                ):
                    starting = False
                verdict = classify(column, starting, RESOLUTION)
                at_share = 2.0
                if verdict == CROSSES:
                    at_share = lo + (hi - lo) * crossing(column, RESOLUTION)
                elif verdict == BELOW:
                    at_share = lo
                elif verdict == UNCLEAR:
                    unclear = place
                if at_share < share:
                    share, first = at_share, place
        if unclear != NONE and (width > NARROWEST or interval == MOST_INTERVALS - 1):
            width *= 0.5
            if interval == MOST_INTERVALS - 1:
                return lo, unclear
        elif first != NONE or hi >= 1.0:
            return share, first
        else:
            lo, width = hi, 2.0 * width
    return lo, NONE


@inner
def touches_too(gap: float, rate: float, other_gap: float) -> bool:
    """Return whether a contact touches at the same instant as another one whose gap was just located."""
    return rate < 0.0 and gap <= abs(other_gap) + ROUNDING


@inlined
def next_regime(law: Law, regime: float, number: int) -> float:
    """Return the neighbouring friction regime into which the margin LOWER or UPPER ends `regime`."""
    lower, upper = regime_bounds(law, regime)
    beyond = np.nextafter(upper, np.inf) if number == UPPER else np.nextafter(lower, -np.inf)
    return friction_regime(law, beyond)


@inner
def impulse(law: Law, k: int, run: Run) -> float:
    """Return the impulse of a contact, or of its side, since t = 0, N s."""
    y = run.nodes.y
    tail = y.shape[1] - TAIL
    total: float = y[0, tail + k]
    if is_of_side(law, k):
        total += y[0, tail + other_corner(k)]
    return total


@inner
def start_contact(law: Law, k: int, t: float, rate: float, slip: float, run: Run) -> None:
    """Freeze the impact speed of contact `k`, or of its side, and open its row of the event table."""
    speed = max(-rate, law.speed_floor)
    run.modes[INSIDE + k], run.modes[MEMORY + k] = 1.0, speed
    run.modes[REGIME + k] = friction_regime(law, slip)
    depth = -run.nodes.contacts[0, GAP + k]
    pulls = not is_lossless(law) and push(law, stiffness(law, k), depth, -rate, speed) < 0.0
    run.modes[CLIPPED + k] = 1.0 if pulls else 0.0
    row, contacts = run.open_contacts[k], run.nodes.contacts
    row[CONTACT], row[BEGIN], row[SPEED], row[IMPULSE] = k, t, speed, impulse(law, k, run)
    row[PEAK], row[DEPTH] = 0.0, 0.0
    row[START_GAP], row[START_RATE] = contacts[0, GAP + k], contacts[0, RATE + k]


@inner
def end_contact(law: Law, k: int, t: float, run: Run) -> None:
    """Write the event row of contact `k` and free it."""
    row = run.events[run.counters[EVENTS]]
    for i in range(COLUMNS):
        row[i] = run.open_contacts[k, i]
    row[STOP], row[IMPULSE] = t, impulse(law, k, run) - row[IMPULSE]
    run.counters[EVENTS] += 1
    run.counters[ENDED] += 1
    for i in range(k, MODES, CONTACTS):
        run.modes[i] = 0.0


@inner
def enter(law: Law, k: int, t: float, run: Run) -> None:
    """Let contact `k` close; of a side that is in contact already only the other corner goes in."""
    run.modes[INSIDE + k] = 1.0
    contacts = run.nodes.contacts[0]
    rate, slip = contacts[RATE + k], contacts[SLIP + k]
    if is_of_side(law, k):
        m = other_corner(k)
        if max(run.modes[MEMORY + k], run.modes[MEMORY + m]) > 0.0:
            return
        # Of two that touch at once the faster one is ahead from there on; which is located first is rounding.
        if touches_too(contacts[GAP + m], contacts[RATE + m], contacts[GAP + k]):
            rate = min(rate, contacts[RATE + m])
    start_contact(law, k, t, rate, slip, run)


@inner
def leave(law: Law, k: int, t: float, run: Run) -> None:
    """Let contact `k` open; of a side that still has the other corner inside only this one goes out."""
    run.modes[INSIDE + k] = 0.0
    if is_of_side(law, k):
        m = other_corner(k)
        if run.nodes.contacts[0, GAP + m] < 0.0:
            run.modes[INSIDE + m] = 1.0
        if run.modes[INSIDE + m] > 0.0:
            return
        if run.modes[MEMORY + k] == 0.0:
            k = m
    end_contact(law, k, t, run)


@inlined
def switch(law: Law, t: float, place: int, run: Run) -> None:
    """Change the mode whose margin ended at `t` (s); contacts that close at the same instant follow."""
    k, number, contacts = place // MARGINS, place % MARGINS, run.nodes.contacts[0]
    run.counters[SWITCHES] += 1
    if number == GATE and run.modes[INSIDE + k] > 0.0:
        leave(law, k, t, run)
    elif number == GATE:
        located = contacts[GAP + k]
        enter(law, k, t, run)
        for m in range(CONTACTS):
            if run.modes[INSIDE + m] == 0.0 and touches_too(contacts[GAP + m], contacts[RATE + m], located):
                enter(law, m, t, run)
    elif number == PULL:
        run.modes[CLIPPED + k] = 1.0 - run.modes[CLIPPED + k]
    else:
        run.modes[REGIME + k] = next_regime(law, run.modes[REGIME + k], number)
