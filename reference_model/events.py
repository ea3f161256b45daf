"""Where a mode ends: first touch, separation, a force that would turn to a pull, a kink of the friction.

Each is the zero of a margin (`reference_model.switching`). Which steps have to be searched at all
`reference_model.step_bounds` says; here every margin that it leaves open is followed through the step on the
dense output, in intervals on which it either certainly keeps its sign or certainly changes it once
(`reference_model.isolation`), and that zero is located.
"""

import numpy as np

from reference_model.compiled import bare, kernel
from reference_model.constants import Constants
from reference_model.dop853 import STAGES, dense
from reference_model.forces import CONTACTS, GAP, MEMORY, Array
from reference_model.formulations import free
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
from reference_model.step_bounds import LOCATED, is_settled, resolved_margin_of
from reference_model.switching import MARGINS, NONE, margin_at, margin_state, margin_value

ROUNDING = 1.0e-15
"""m or m/s; gaps are differences of coordinates near 0.55 m and round at 1e-16 m, slips of some m/s too."""
DEEPEST = 2.0 * LOCATED
"""m; twice what an open contact may begin with, where the one before was located a little too early."""
MOST_INTERVALS = 1000
"""A margin that is still not settled then is nothing but rounding: its mode ends. Usual are 1 to 10."""


@bare
def margin_within(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float, x: float,
    t: float, h: float, y: Array, f: Array, state: Array,
) -> float:  # fmt: skip
    """Return a margin (m or m/s) at the share `x` of a step, by its dense output; `state` is overwritten."""
    dense(y, f, x, free(c), state)
    gap, rate, slip = margin_state(c, k, kind, t + x * h, state)
    return margin_value(c, modes, k, kind, sign, bound, gap, rate, slip)


@bare
def end_of_mode(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float,
    at_start: float, at_end: float, t: float, h: float, y: Array, f: Array, state: Array, values: Array,
) -> float:  # fmt: skip
    """Return the share of the step at which a margin first turns negative; 2.0: it does not.

    `at_start`, `at_end`: its values there.

    A mode that has just begun starts at zero but for rounding, and can turn right before it ends; where it
    does not, it ends at once, at 0.0. So does that of an open contact which goes deeper into its wall than it
    is located to, whether or not it comes out again within the step: it starts at its wall and approaches.
    `state` and `values`, shape (POINTS,), are overwritten.
    """
    lo, width = 0.0, 1.0
    for _ in range(MOST_INTERVALS):
        hi = min(1.0, lo + width)
        for j in range(POINTS):
            x = lo + (hi - lo) * NODES[j]
            if x == 0.0:
                values[j] = at_start
            elif x == 1.0:
                values[j] = at_end
            else:
                values[j] = margin_within(c, modes, k, kind, sign, bound, x, t, h, y, f, state)
        # What a mode that begins within rounding does first is no matter of sign.
        starting = lo == 0.0 and values[0] <= ROUNDING
        if kind == GAP and sign > 0.0 and dips(values, DEEPEST):
            starting = False
        found = classify(values, starting, RESOLUTION)
        if found == CROSSES:
            return lo + (hi - lo) * crossing(values, RESOLUTION)
        if found == BELOW:
            return lo
        if found == UNCLEAR and width > NARROWEST:
            width *= 0.5
        else:
            if hi >= 1.0:
                return 2.0
            lo = hi
            width *= 2.0
    return lo


@bare
def first_switch(
    c: Constants, t: float, h: float, y: Array, f: Array, modes: Array, before: Array, stages: Array,
    deviations: Array, state: Array, values: Array,
) -> tuple[float, int, int]:  # fmt: skip
    """Return share of the step, contact and number of the margin that first turns negative; NONE: no such.

    Parameters
    ----------
    c, t, h, y, modes
        Constants, start (s) and length (s) of the step, state at its start, modes (MODES, CONTACTS).
    f
        Coefficients of the dense output, shape (7, state_size).
    before, stages
        States of the contacts at the start, shape (5, CONTACTS), and at the stages (STAGES + 1, 5, CONTACTS).
    deviations
        Of the gaps, as noted by `step_bounds.step_may_switch`, shape (CONTACTS,).
    state, values
        Overwritten, shapes (state_size,) and (POINTS,).
    """
    best, contact, which = 2.0, NONE, NONE
    for k in range(CONTACTS):
        if before[GAP, k] == np.inf:
            continue
        for number in range(MARGINS if modes[MEMORY, k] > 0.0 else 1):
            kind, sign, bound = resolved_margin_of(c, modes, k, number, before)
            if kind == NONE or is_settled(c, modes, k, kind, sign, bound, h, before, stages, deviations):
                continue
            first = margin_at(c, modes, k, kind, sign, bound, before)
            last = margin_at(c, modes, k, kind, sign, bound, stages[STAGES])
            x = end_of_mode(c, modes, k, kind, sign, bound, first, last, t, h, y, f, state, values)
            if x < best:
                best, contact, which = x, k, number
    return best, contact, which


@kernel
def touching(gap: float, rate: float, other_gap: float) -> bool:
    """Return whether a contact touches at the same instant as another one whose gap was just located."""
    return rate < 0.0 and gap <= abs(other_gap) + ROUNDING


@kernel
def next_regime(c: Constants, regime: int, slip: float) -> int:
    """Return the neighbouring friction regime towards which the located speed `slip` leaves `regime`."""
    lower, upper = regime_bounds(c, regime)
    if upper - slip < slip - lower:
        return friction_regime(c, np.nextafter(upper, np.inf))
    return friction_regime(c, np.nextafter(lower, -np.inf))
