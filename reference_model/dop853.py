"""One step of the eighth-order Dormand-Prince method with its seventh-order dense output.

E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd ed., Sec. II.5-II.6.
The stages need only the free coordinates: the integrals behind them are quadratures, which the method's
weights give at the same order without further evaluations.
"""

import math

import numpy as np

from reference_model.compiled import bare, inlined
from reference_model.constants import Constants
from reference_model.dop853_coefficients import A_EXTRA, C_EXTRA, E3, E5, STAGE_SHARES, A, D
from reference_model.forces import Array
from reference_model.formulations import derivative, driven_of, free, tabulate_driven

STAGES = 12
"""Of the step; row 12 of the stage array is the derivative at its end, rows 13-15 serve the dense output."""
ROWS = 16
NODES = np.concatenate((STAGE_SHARES[1:], C_EXTRA, STAGE_SHARES[-1:]))
"""Shares of a step at which what is driven is tabulated: stages, its end, the dense output's stages. The last
one is there twice, for a number that goes into the processor's vectors without a rest."""
AT_END, AT_EXTRA = STAGES - 1, STAGES
"""Columns of that table: the step's end; the first stage of the dense output."""


@bare
def take_step(
    c: Constants, t: float, h: float, y: Array, modes: Array, k: Array, y1: Array, stages: Array,
    table: Array,
) -> None:  # fmt: skip
    """Advance `y` by `h` in frozen modes.

    Parameters
    ----------
    c, t, h, y, modes
        Constants, time (s), step (s), state (state_size,), modes (MODES, CONTACTS).
    k
        Stage derivatives, shape (ROWS, state_size): row 0 holds the derivative at `t`; rows 1-12 are written.
    y1
        Written: the state at t + h.
    stages
        Written but for row 0: states of the contacts at the stages, at t + h in the last row, shape
        (STAGES + 1, 5, CONTACTS).
    table
        Written: what is driven at the step's `NODES`, shape (DRIVEN, NODES.size).
    """
    n = free(c)
    tabulate_driven(c, t, h, NODES, table)
    for i in range(1, STAGES + 1):
        for m in range(n if i < STAGES else y.size):
            s = 0.0
            for j in range(i):
                s += A[i, j] * k[j, m]
            y1[m] = y[m] + h * s
        derivative(c, t + STAGE_SHARES[i] * h, driven_of(c, table, i - 1), y1, modes, k[i], stages[i])


@inlined
def error_norm(h: float, k: Array, weights: Array) -> float:
    """Return the local error of a step in units of the tolerance (Hairer's combination of orders 5 and 3).

    `weights`: one over the tolerated error of each coordinate and rate. Infinite where a stage was so far off
    that its square is: divided by that, any error would seem to be zero.
    """
    n = weights.size
    e5 = e3 = 0.0
    for m in range(n):
        s5 = s3 = 0.0
        for j in range(STAGES + 1):
            s5 += E5[j] * k[j, m]
            s3 += E3[j] * k[j, m]
        e5 += (s5 * weights[m]) ** 2
        e3 += (s3 * weights[m]) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    scale = (e5 + 0.01 * e3) * n
    return abs(h) * e5 / math.sqrt(scale) if scale < math.inf else math.inf


@bare
def prepare_dense(
    c: Constants,
    t: float,
    h: float,
    y: Array,
    y1: Array,
    modes: Array,
    k: Array,
    table: Array,
    count: int,
    scratch: Array,
    contacts: Array,
    f: Array,
) -> None:
    """Compute the coefficients `f`, shape (7, state_size), of the dense output over [t, t + h].

    Only those of the first `count` states. Costs three evaluations; `table` is what `take_step` has written.
    `scratch` (state_size,) and `contacts` (5, CONTACTS) are overwritten.
    """
    n = free(c)
    for i in range(3):
        for m in range(n):
            s = 0.0
            for j in range(STAGES + 1 + i):
                s += A_EXTRA[i, j] * k[j, m]
            scratch[m] = y[m] + h * s
        at = driven_of(c, table, AT_EXTRA + i)
        derivative(c, t + C_EXTRA[i] * h, at, scratch, modes, k[STAGES + 1 + i], contacts)
    for m in range(count):
        change = y1[m] - y[m]
        f[0, m] = change
        f[1, m] = h * k[0, m] - change
        f[2, m] = 2.0 * change - h * (k[STAGES, m] + k[0, m])
        for i in range(4):
            s = 0.0
            for j in range(ROWS):
                s += D[i, j] * k[j, m]
            f[3 + i, m] = h * s


@bare
def dense(y: Array, f: Array, x: float, count: int, out: Array) -> None:
    """Evaluate the first `count` states at the share `x` in [0, 1] of the step that started in `y`."""
    for m in range(count):
        value = 0.0
        for i in range(6, -1, -1):
            value += f[i, m]
            value *= x if i % 2 == 0 else 1.0 - x
        out[m] = y[m] + value
