"""One step of the eighth-order Dormand-Prince method with its seventh-order dense output.

E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd ed., Sec. II.5-II.6. The
coefficients, at the end, are the same doubles as in scipy, whose integrators take longer to import than a
short run. The stages need only the free coordinates: the integrals behind them are quadratures, which the
method's weights give at the same order without further evaluations.
"""

import math

import numpy as np

from reference_model.compiled import constant, inlined, inner, kernel
from reference_model.formulations import Model, derivative, tabulate
from reference_model.linkage import Array
from reference_model.state import NODES, WORKS, Nodes, Records

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
def error_norm(h: float, k: Array, free: int, tolerance: float, rate_time: float = VELOCITY_TIME) -> float:
    """Return the local error of a step in units of the tolerance (Hairer's combination of orders 5 and 3).

    It is that of the first `free` states, of which the second half are rates, whose error in `rate_time` (s)
    counts. It is infinite if the square of a stage overflows: divided by that, any error would seem to be
    zero.
    """
    e5 = e3 = 0.0
    for m in range(free):
        s5 = s3 = 0.0
        for j in range(STAGES + 1):
            s5 += E5[j] * k[j, m]
            s3 += E3[j] * k[j, m]
        weight = (1.0 if 2 * m < free else rate_time) / tolerance
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


def _rows(columns: int, *rows: tuple[float, ...]) -> Array:
    """Return rows of coefficients with their trailing zeros."""
    return np.array([row + (0.0,) * (columns - len(row)) for row in rows])


# fmt: off

A = _rows(
    16,
    (),
    (0.05260015195876773,),
    (0.0197250569845379, 0.0591751709536137),
    (0.02958758547680685, 0, 0.08876275643042054),
    (0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792),
    (0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242),
    (0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
    (
        0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
        0.008273789163814023,
    ),
    (
        0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
        20.154067550477894, -43.48988418106996,
    ),
    (
        0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
        15.279233632882423, -33.28821096898486, -0.020331201708508627,
    ),
    (
        -0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
        -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196,
    ),
    (
        2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
        27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636,
    ),
    (
        0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
        0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
    ),
    (
        0.056167502283047954, 0, 0, 0, 0, 0, 0.25350021021662483, -0.2462390374708025,
        -0.12419142326381637, 0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298,
    ),
    (
        0.03183464816350214, 0, 0, 0, 0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099,
        0, 0, -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325,
    ),
    (
        -0.42889630158379194, 0, 0, 0, 0, -4.697621415361164, 7.683421196062599, 4.06898981839711,
        0.3567271874552811, 0, 0, 0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987,
    ),
)
"""Of the stages, of the weights (row 12: the derivative at the step's end is the next step's first stage),
and of the three further stages of the dense output, shape (16, 16)."""
SHARES = np.array([
    0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333,
    0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2,
    0.7777777777777778,
])
"""Shares of the step at which they lie, shape (16,)."""
E3 = np.array([
    -0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082, 0,
])
"""Error estimate of order 3, shape (13,)."""
E5 = np.array([
    0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294, 0,
])
"""Error estimate of order 5, shape (13,)."""
D = _rows(
    16,
    (
        -8.428938276109013, 0, 0, 0, 0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
        2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688,
        -0.08899033645133331, 18.148505520854727, -9.194632392478356, -4.436036387594894,
    ),
    (
        10.427508642579134, 0, 0, 0, 0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
        -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229,
        15.697238121770845, -31.139403219565178, -9.35292435884448, 35.81684148639408,
    ),
    (
        19.985053242002433, 0, 0, 0, 0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
        -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
        -60.19669523126412, 84.32040550667716, 11.99229113618279,
    ),
    (
        -25.69393346270375, 0, 0, 0, 0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
        93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114,
        96.32455395918828, -39.17726167561544, -149.72683625798564,
    ),
)
"""Dense output, shape (4, 16)."""
# fmt: on
