"""One step of the eighth-order Dormand-Prince method with its seventh-order dense output.

E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd ed., Sec. II.5-II.6.
The stages need only the free coordinates: the integrals behind them are quadratures, which the method's
weights give at the same order without further evaluations.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import inner
from reference_model.contact import TAIL
from reference_model.equations import Model, derivative, right_hand_side, tabulate
from reference_model.linkage import Array
from reference_model.parameters import Law
from reference_model.tableau import A_EXTRA, C_EXTRA, E3, E5, STAGE_SHARES, A, D

STAGES = 12
"""Of the step; row 12 of the stage derivatives is that at its end, rows 13-15 serve the dense output."""
ROWS = 16
NODES = np.concatenate((STAGE_SHARES[1:], C_EXTRA, STAGE_SHARES[-1:]))
"""Shares of a step: stages, its end, the dense output's stages. The last one is there twice, for a number
that goes into the processor's vectors without a rest."""
VELOCITY_TIME = 1.0e-3
"""s; the error of a rate counts as the error of position that it makes in this time."""


class Work(NamedTuple):
    """What a step is computed in: arrays that are allocated once for a run."""

    k: Array
    """Stage derivatives, shape (ROWS, y.size): row 0 holds the derivative at the step's start."""
    f: Array
    """Coefficients of the dense output, shape (7, y.size)."""
    y1: Array
    """State at the step's end."""
    stages: Array
    """States of the contacts at the stages, the step's end last, (STAGES + 1, STATES); row 0 is free."""
    slider: Array
    """Motion of the slider at the step's end, (9,): x, y, angle, their rates and second derivatives."""
    state: Array
    """A state within the step, ..."""
    rate: Array
    """... its derivative, ..."""
    contacts: Array
    """... the contacts in it, (STATES,), ..."""
    aside: Array
    """... and the slider, (9,)."""
    values: Array
    """Margins along the step, shape (CONTACTS MARGINS, POINTS)."""
    scales: Array
    """`margins.pull_scale` of each contact, (CONTACTS,)."""
    unsettled: NDArray[np.bool_]
    """Which margins the stages leave open, (CONTACTS MARGINS,)."""
    parts: Array
    """Depth and force of each contact at parts of the step, shape (2 CONTACTS, PARTS)."""
    peaks: NDArray[np.bool_]
    """Whether they peak within the step, (2 CONTACTS,)."""
    interval: float
    """Between marks, s."""


@inner
def take_step(model: Model, law: Law, t: float, h: float, y: Array, modes: Array, work: Work) -> None:
    """Advance `y` by `h` (s) from `t` in frozen modes.

    Row 0 of the stage derivatives is given; written are their rows 1 to 12, the stages of the contacts, state
    and slider at the step's end.
    """
    k, y1, free = work.k, work.y1, y.size - TAIL
    tabulate(model, t, h, NODES)
    for i in range(1, STAGES + 1):
        for m in range(free if i < STAGES else y.size):
            total = 0.0
            for j in range(i):
                total += A[i, j] * k[j, m]
            y1[m] = y[m] + h * total
        derivative(model, law, t + STAGE_SHARES[i] * h, i - 1, y1, modes, k[i], work.stages[i], work.slider)


@inner
def error_norm(h: float, k: Array, free: int, tolerance: float) -> float:
    """Return the local error of a step in units of the tolerance (Hairer's combination of orders 5 and 3).

    Of the first `free` states, rates the second half of them. Infinite where a stage was so far off that its
    square is: divided by that, any error would seem to be zero.
    """
    e5 = e3 = 0.0
    for m in range(free):
        s5 = s3 = 0.0
        for j in range(STAGES + 1):
            s5 += E5[j] * k[j, m]
            s3 += E3[j] * k[j, m]
        weight = (1.0 if 2 * m < free else VELOCITY_TIME) / tolerance
        e5 += (s5 * weight) ** 2
        e3 += (s3 * weight) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    scale = (e5 + 0.01 * e3) * free
    return abs(h) * e5 / math.sqrt(scale) if scale < math.inf else math.inf


@inner
def prepare_dense(model: Model, law: Law, t: float, h: float, y: Array, modes: Array, work: Work) -> None:
    """Compute the dense output over [t, t + h], right after `take_step`; costs three evaluations."""
    k, f = work.k, work.f
    for i in range(3):
        for m in range(y.size - TAIL):
            total = 0.0
            for j in range(STAGES + 1 + i):
                total += A_EXTRA[i, j] * k[j, m]
            work.state[m] = y[m] + h * total
        node = STAGES + i
        right_hand_side(
            model, law, t + C_EXTRA[i] * h, node, work.state, modes, k[node + 1], work.contacts, work.aside
        )
    for m in range(y.size):
        change = work.y1[m] - y[m]
        f[0, m], f[1, m], f[2, m] = change, h * k[0, m] - change, 2.0 * change - h * (k[STAGES, m] + k[0, m])
        for i in range(4):
            total = 0.0
            for j in range(ROWS):
                total += D[i, j] * k[j, m]
            f[3 + i, m] = h * total


@inner
def dense(y: Array, f: Array, share: float, count: int, out: Array) -> None:
    """Evaluate the first `count` states at the share in [0, 1] of the step that started in `y`."""
    rest = 1.0 - share
    for m in range(count):
        value = f[6, m] * share
        value = (value + f[5, m]) * rest
        value = (value + f[4, m]) * share
        value = (value + f[3, m]) * rest
        value = (value + f[2, m]) * share
        value = (value + f[1, m]) * rest
        out[m] = y[m] + (value + f[0, m]) * share
