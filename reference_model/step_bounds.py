"""A cheap proof that no mode ends within a step, from the stages that the step has evaluated anyway.

Most steps are settled by it, without dense output. A gap is compared with the cubic Hermite polynomial of
both ends, a rate or slip with the straight line. What the interior stages deviate from it, over the shape
16 x^2 (1 - x)^2 or 4 x (1 - x) of such an interpolant's error, estimates that error; twice the largest is
taken off, and the Bernstein coefficients of what is left must be positive. Where the stages are less
accurate than the step's end, more steps than necessary are looked at closely.
"""

import numpy as np

from reference_model.compiled import bare, inlined
from reference_model.constants import Constants
from reference_model.dop853 import STAGES
from reference_model.dop853_coefficients import STAGE_SHARES
from reference_model.forces import CONTACTS, GAP, MEMORY, RATE, Array, of_side, other_corner
from reference_model.journal import JOURNAL
from reference_model.switching import (
    MARGINS,
    NONE,
    PULL,
    SECOND_CORNER,
    margin_at,
    margin_of,
    smooth_gap,
    smooth_rate,
)

LOCATED = 2.0e-12
"""m; a touch is located where the gap is no more negative: a fifth of what no corner may be in its wall."""
LOCATED_SPEED = 1.0e-10
"""m/s; what friction regimes and pulls are located to. There the force has kinks but no jumps."""

_FIRST, _LAST = 4, 10
"""The interior stages whose states are accurate to the fourth order or better."""
_SAFETY = 2.0

_X = STAGE_SHARES[_FIRST : _LAST + 1]
_HERMITE = np.stack(
    [(1.0 + 2.0 * _X) * (1.0 - _X) ** 2, _X * (1.0 - _X) ** 2, _X**2 * (3.0 - 2.0 * _X), _X**2 * (_X - 1.0)]
)
_CUBIC_WEIGHT = 1.0 / (16.0 * (_X * (1.0 - _X)) ** 2)
_LINEAR_WEIGHT = 1.0 / (4.0 * _X * (1.0 - _X))


@inlined
def note_deviations(c: Constants, h: float, before: Array, stages: Array, deviations: Array) -> None:
    """Estimate by how much each contact's gap deviates from its cubic Hermite polynomial within a step, m.

    Parameters
    ----------
    c, h
        Constants, step (s).
    before
        The contacts' states at the step's start, shape (5, CONTACTS).
    stages
        Those at its stages, shape (STAGES + 1, 5, CONTACTS), the end last.
    deviations
        Overwritten, shape (CONTACTS,); nan of a contact that the formulation does not have.
    """
    after = stages[STAGES]
    deviations[:] = 0.0
    for i in range(_X.size):
        # The corners side by side, which the compiler takes at once.
        for k in range(JOURNAL):
            cubic = _HERMITE[0, i] * before[GAP, k] + _HERMITE[1, i] * (h * before[RATE, k])
            cubic += _HERMITE[2, i] * after[GAP, k] + _HERMITE[3, i] * (h * after[RATE, k])
            away = abs(stages[_FIRST + i, GAP, k] - cubic) * _CUBIC_WEIGHT[i]
            deviations[k] = away if away > deviations[k] else deviations[k]
    if before[GAP, JOURNAL] == np.inf:
        return
    gap0, gap1 = before[GAP, JOURNAL], after[GAP, JOURNAL]
    p0, p1 = smooth_gap(c, JOURNAL, gap0), smooth_gap(c, JOURNAL, gap1)
    d0 = h * smooth_rate(c, JOURNAL, gap0, before[RATE, JOURNAL])
    d1 = h * smooth_rate(c, JOURNAL, gap1, after[RATE, JOURNAL])
    for i in range(_X.size):
        p = smooth_gap(c, JOURNAL, stages[_FIRST + i, GAP, JOURNAL])
        cubic = _HERMITE[0, i] * p0 + _HERMITE[1, i] * d0 + _HERMITE[2, i] * p1 + _HERMITE[3, i] * d1
        deviations[JOURNAL] = max(deviations[JOURNAL], abs(p - cubic) * _CUBIC_WEIGHT[i])


@inlined
def gap_is_settled(
    c: Constants, k: int, sign: float, h: float, before: Array, after: Array, deviation: float
) -> bool:
    """Return whether sign * gap of contact `k` stays positive within a step of `h` (s).

    Parameters
    ----------
    c, k, sign, h
        Constants, contact, +1 open or -1 closed, step.
    before, after
        The contacts' states at the step's ends, shape (5, CONTACTS).
    deviation
        Of `note_deviations`, m.
    """
    gap0, gap1 = before[GAP, k], after[GAP, k]
    p0, p1 = sign * smooth_gap(c, k, gap0), sign * smooth_gap(c, k, gap1)
    d0 = sign * h * smooth_rate(c, k, gap0, before[RATE, k])
    d1 = sign * h * smooth_rate(c, k, gap1, after[RATE, k])
    # The quartic's Bernstein coefficients but for the middle one, which the error lowers.
    if p0 < -LOCATED or p1 < -LOCATED or p0 + 0.25 * d0 <= 0.0 or p1 - 0.25 * d1 <= 0.0:
        return False
    return 0.5 * (p0 + p1) + (d0 - d1) / 6.0 > _SAFETY * deviation * 16.0 / 6.0


@inlined
def speed_is_settled(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float, before: Array, stages: Array
) -> bool:
    """Return whether a margin of kind PULL or SLIP stays positive; arguments as of `gap_is_settled`."""
    p0 = margin_at(c, modes, k, kind, sign, bound, before)
    p1 = margin_at(c, modes, k, kind, sign, bound, stages[STAGES])
    if p0 < -LOCATED_SPEED or p1 < -LOCATED_SPEED:
        return False
    error = 0.0
    for i in range(_X.size):
        p = margin_at(c, modes, k, kind, sign, bound, stages[_FIRST + i])
        error = max(error, abs(p - (1.0 - _X[i]) * p0 - _X[i] * p1) * _LINEAR_WEIGHT[i])
    return 0.5 * (p0 + p1) > _SAFETY * error * 2.0


@inlined
def resolved_margin_of(
    c: Constants, modes: Array, k: int, number: int, contacts: Array
) -> tuple[int, float, float]:
    """Return what `margin_of` does, the pull of a side times a factor: it then rounds no more than others.

    A change of depth moves the resultant's point by up to a third of that over |d1| + |d2|, as a share of the
    side; so the rounding of depths, 1e-16 m, moves the pull's margin by more than what counts as zero where
    the side is hardly inside. The factor is that of the depths (nowhere 0) and rates in `contacts`, shape
    (5, CONTACTS).
    """
    kind, sign, bound = margin_of(c, modes, k, number)
    if kind == PULL and of_side(c, k):
        other = other_corner(k)
        extent = abs(contacts[GAP, k]) + abs(contacts[GAP, other]) + SECOND_CORNER
        sign *= extent / (extent + c.C * abs(contacts[RATE, k] - contacts[RATE, other]))
    return kind, sign, bound


@bare
def is_settled(
    c: Constants, modes: Array, k: int, kind: int, sign: float, bound: float, h: float, before: Array,
    stages: Array, deviations: Array,
) -> bool:  # fmt: skip
    """Return whether a margin (`switching.margin_of`) stays positive within a step for certain."""
    if kind == GAP:
        return gap_is_settled(c, k, sign, h, before, stages[STAGES], deviations[k])
    return speed_is_settled(c, modes, k, kind, sign, bound, before, stages)


@bare
def has_ended(c: Constants, modes: Array, k: int, number: int, contacts: Array) -> bool:
    """Return whether a margin is down to what it is located to, in the contacts' states (5, CONTACTS)."""
    kind, sign, bound = resolved_margin_of(c, modes, k, number, contacts)
    left = margin_at(c, modes, k, kind, sign, bound, contacts)
    return left <= (LOCATED if kind == GAP else LOCATED_SPEED)


@inlined
def step_may_switch(
    c: Constants, modes: Array, h: float, before: Array, stages: Array, deviations: Array
) -> bool:
    """Return whether it is not certain that all modes last throughout a step; `deviations` are noted."""
    note_deviations(c, h, before, stages, deviations)
    for k in range(CONTACTS):
        if before[GAP, k] == np.inf:  # a contact that the formulation does not have
            continue
        for number in range(MARGINS if modes[MEMORY, k] > 0.0 else 1):
            kind, sign, bound = resolved_margin_of(c, modes, k, number, before)
            if kind != NONE and not is_settled(c, modes, k, kind, sign, bound, h, before, stages, deviations):
                return True
    return False
