"""One step of the eighth-order Dormand-Prince method with its seventh-order dense output.

E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd ed., Sec. II.5-II.6.
The stages need only the free coordinates: the integrals behind them are quadratures, which the method's
weights give at the same order without further evaluations.
"""

import math

import numpy as np

from reference_model.compiled import constant, inlined, inner, kernel
from reference_model.equations import Model, derivative, tabulate
from reference_model.linkage import Array
from reference_model.state import NODES, WORKS, Nodes, Records
from reference_model.tableau import E3, E5, SHARES, A, D

START, FIRST, END, FIRST_DENSE, LAST_DENSE, POINT = map(constant, (0, 1, 12, 13, 15, NODES - 1))
"""Nodes of a step: its start, the stages from the first to the step's end, those that only the dense output
needs, and any other point."""
STAGES = 12
ROWS = 16
"""Number of the stage derivatives in the dense output."""
NOW = np.zeros(1)
"""Shares of a step of no length: those of a single state."""
VELOCITY_TIME = 1.0e-3
"""Time in which the error of a rate counts as an error of position, s."""


@inlined
def free_states(nodes: Nodes) -> int:
    """Return the number of coordinates and rates: of a state all but the impulses and works."""
    return int(nodes.y.shape[1] - nodes.touches.shape[1] - WORKS)


@inner
def evaluate_nodes(
    model: Model, t: float, h: float, first: int, last: int, modes: Records, nodes: Nodes
) -> None:
    """Evaluate the nodes `first` to `last` of a step of `h` (s) from `t` in frozen modes.

    The states at START and POINT (there `t` is the time) are given; the others follow from the nodes before
    them.
    """
    y, dy = nodes.y, nodes.dy
    size, free = y.shape[1], free_states(nodes)
    if first != FIRST_DENSE:  # the stages of the dense output were tabulated with the step's own
        tabulate(model, t, h, SHARES if first < last else NOW)
    for i in range(first, last + 1):
        if START < i < POINT:
            for m in range(size if i == END else free):
                total = 0.0
                for j in range(i):
                    total += A[i, j] * dy[j, m]
                y[i, m] = y[0, m] + h * total
        node = i % POINT  # POINT has the share of START: zero
        derivative(model, t + SHARES[node] * h, i, modes, nodes)


@kernel
def evaluate(model: Model, t: float, node: int, modes: Records, nodes: Nodes) -> None:
    """Evaluate the state at START or POINT at time `t` (s), for Python."""
    evaluate_nodes(model, t, 0.0, node, node, modes, nodes)


@inlined
def error_norm(h: float, k: Array, free: int, tolerance: float) -> float:
    """Return the local error of a step in units of the tolerance (Hairer's combination of orders 5 and 3).

    It is that of the first `free` states, of which the second half are rates. It is infinite if the square of
    a stage overflows: divided by that, any error would seem to be zero.
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


@inlined
def prepare_dense(h: float, y: Array, dy: Array, f: Array) -> None:
    """Write the coefficients `f` of the dense output of a step all nodes of which are evaluated."""
    for m in range(y.shape[1]):
        change = y[END, m] - y[0, m]
        f[0, m], f[1, m] = change, h * dy[0, m] - change
        f[2, m] = 2.0 * change - h * (dy[END, m] + dy[0, m])
        for i in range(4):
            total = 0.0
            for j in range(ROWS):
                total += D[i, j] * dy[j, m]
            f[3 + i, m] = h * total


@inner
def dense(share: float, count: int, y: Array, f: Array) -> None:
    """Write the first `count` states at a share in [0, 1] of the step into row POINT of `y`."""
    rest = 1.0 - share
    for m in range(count):
        value = f[6, m] * share
        value = (value + f[5, m]) * rest
        value = (value + f[4, m]) * share
        value = (value + f[3, m]) * rest
        value = (value + f[2, m]) * share
        value = (value + f[1, m]) * rest
        y[POINT, m] = y[0, m] + (value + f[0, m]) * share
