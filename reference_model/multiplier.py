"""The paper's own form: three coordinates a body, one multiplier a constraint, Baumgarte (Eqs. 14-21).

q_i = (x_i, y_i, theta_i). With Phi(q, t) = 0 the rows of Eq. 16,

    M q'' + Phi_q^T lambda = Q,    Phi_q q'' = gamma - 2 alpha Phi' - beta^2 Phi.

`assemble` describes a planar linkage by lists: bodies, pins, ideal guides, one drive, and the body whose four
corners are in a guide with clearance. A pin between bodies i and j gives the rows
r_i + R_i a - r_j - R_j b = 0 with arms a, b in the bodies' own frames (in the fixed frame, j = -1, b is a
point), a guide x_i - line = 0 and theta_i = 0, the drive theta_i - omega t - theta0 = 0. `press` lists the
press with its rows in the paper's order. Rows 7-13 are corrected: as printed the rods would not close.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model import workpiece
from reference_model.compiled import inlined, inner, kernel
from reference_model.contact import corner_motion, slider_forces, write_tail
from reference_model.linkage import Array, Mechanism
from reference_model.state import Nodes, Records
from reference_model.workpiece import NO_LOAD, Load

load_force = inlined(workpiece.load_force)

FRAME = -1
"""Number that stands for the fixed frame in the place of a body."""
Point = tuple[float, float]


class Linkage(NamedTuple):
    """The formulation with multipliers: a state holds x, y, theta of all bodies, their rates, integrals."""

    masses: Array
    """The diagonal of M, shape (3 n,), kg and kg m^2."""
    weights: Array
    """The bodies' weights as generalized forces, shape (3 n,)."""
    joined: NDArray[np.int64]
    """Bodies i, j of each pin, shape (pins, 2)."""
    arms: Array
    """a and b of each pin, shape (pins, 4), m."""
    guided: NDArray[np.int64]
    """Bodies on an ideal guide, shape (guides,)."""
    lines: Array
    """x of each ideal guide, m."""
    driven: int
    """Number of the driven body."""
    slider: int
    """Number of the slider."""
    contacts: Records
    """Contacts of the slider's corners; none if it is on an ideal guide."""
    load: Load
    """Load of the workpiece below the slider."""
    omega: float
    """Rate of the driven body, rad/s."""
    theta0: float
    """Angle of the driven body at t = 0, rad."""
    alpha: float
    """Baumgarte's alpha and beta, 1/s."""
    beta: float
    phi: Array
    """Work array: Phi, shape (rows,); so are Phi', gamma and lambda."""
    rate: Array
    gamma: Array
    lambdas: Array
    applied: Array
    """Work array: Q, shape (3 n,)."""
    jacobian: Array
    """Work array: Phi_q, shape (rows, 3 n)."""
    matrix: Array
    """Work array: Phi_q M^-1 Phi_q^T, shape (rows, rows)."""

    @property
    def rows(self) -> int:
        """Number of constraints: pins, guides, drive."""
        return self.phi.size


def assemble(
    bodies: Sequence[tuple[float, float]],
    pins: Sequence[tuple[int, Point, int, Point]],
    guides: Sequence[tuple[int, float]],
    drive: tuple[int, float, float],
    slider: tuple[int, Records],
    *,
    gravity: float = 0.0,
    baumgarte: tuple[float, float] = (0.0, 0.0),
    load: Load = NO_LOAD,
) -> Linkage:
    """Describe a planar linkage.

    Parameters
    ----------
    bodies
        Mass (kg) and inertia about the centroid (kg m^2) of each body.
    pins
        Body i, its point (m, from the centroid, in its own frame), body j or FRAME, its point.
    guides
        Body that stays upright on a vertical line, and the x of that line, m.
    drive
        Body whose angle grows uniformly, its rate (rad/s), its angle at t = 0 (rad).
    slider
        Number of the slider, and the contacts of its corners; none without clearance.
    gravity
        Acceleration of gravity along -y, m/s^2.
    baumgarte
        alpha and beta, 1/s.
    load
        Load of the workpiece below the slider.

    Returns
    -------
    Linkage
    """
    size, rows = 3 * len(bodies), 2 * len(pins) + 1 + 2 * len(guides)
    weights = np.zeros(size)
    weights[1::3] = [-gravity * mass for mass, _ in bodies]
    return Linkage(
        masses=np.array([value for mass, inertia in bodies for value in (mass, mass, inertia)]),
        weights=weights,
        joined=np.array([(i, j) for i, _, j, _ in pins], dtype=np.int64).reshape(-1, 2),
        arms=np.array([(*a, *b) for _, a, _, b in pins], dtype=np.float64).reshape(-1, 4),
        guided=np.array([body for body, _ in guides], dtype=np.int64),
        lines=np.array([line for _, line in guides], dtype=np.float64),
        driven=drive[0],
        slider=slider[0],
        contacts=slider[1],
        load=load,
        omega=drive[1],
        theta0=drive[2],
        alpha=baumgarte[0],
        beta=baumgarte[1],
        phi=np.empty(rows),
        rate=np.empty(rows),
        gamma=np.empty(rows),
        lambdas=np.empty(rows),
        applied=np.empty(size),
        jacobian=np.empty((rows, size)),
        matrix=np.empty((rows, rows)),
    )


def press(m: Mechanism, contacts: Records, load: Load, baumgarte: tuple[float, float]) -> Linkage:
    """Describe the press, its joints in the order of the paper's rows: O, A, H, B, C, F, drive, guide.

    Without contacts the slider is on an ideal guide.
    """
    return assemble(
        bodies=list(zip(m.masses, m.inertias, strict=True)),
        pins=[
            (0, (-m.Ls1, 0.0), FRAME, (0.0, 0.0)),
            (1, (-m.Ls2, 0.0), 0, (m.L1 - m.Ls1, 0.0)),
            (2, (-m.Ls3, 0.0), FRAME, (m.Hx, m.Hy)),
            (2, (0.0, 0.0), 1, (m.L2 - m.Ls2, 0.0)),
            (3, (-m.Ls4, 0.0), 2, (m.L3 - m.Ls3, 0.0)),
            (4, (0.0, 0.0), 3, (m.L4 - m.Ls4, 0.0)),
        ],
        guides=[] if contacts.size else [(4, m.line_x)],
        drive=(0, m.omega, m.theta0),
        slider=(4, contacts),
        gravity=m.gravity,
        baumgarte=baumgarte,
        load=load,
    )


@inlined
def add_pin_end(model: Linkage, pin: int, end: int, q: Array, v: Array) -> None:
    """Add one end (0 or 1) of a pin to the pin's rows of Phi, Phi_q and gamma."""
    body, ax, ay = model.joined[pin, end], model.arms[pin, 2 * end], model.arms[pin, 2 * end + 1]
    row, sign = 2 * pin, 1.0 - 2.0 * end
    if body == FRAME:
        model.phi[row] -= ax
        model.phi[row + 1] -= ay
        return
    x, y, turn = 3 * body, 3 * body + 1, 3 * body + 2
    c, s = math.cos(q[turn]), math.sin(q[turn])
    rx, ry = sign * (c * ax - s * ay), sign * (s * ax + c * ay)
    model.phi[row] += sign * q[x] + rx
    model.phi[row + 1] += sign * q[y] + ry
    model.jacobian[row, x] = model.jacobian[row + 1, y] = sign
    model.jacobian[row, turn], model.jacobian[row + 1, turn] = -ry, rx
    model.gamma[row] += rx * v[turn] * v[turn]
    model.gamma[row + 1] += ry * v[turn] * v[turn]


@inner
def constraints(model: Linkage, t: float, q: Array, v: Array) -> None:
    """Write Phi of Eq. 16, Phi' = Phi_q v + Phi_t, gamma of Phi_q q'' = gamma, and Phi_q.

    They go to the model's arrays; `q` and `v` are coordinates and velocities at `t` (s), shape (3 n,).
    """
    phi, rate, gamma, jacobian = model.phi, model.rate, model.gamma, model.jacobian
    for i in range(phi.size):
        phi[i] = gamma[i] = 0.0
        for k in range(q.size):
            jacobian[i, k] = 0.0
    for pin in range(model.joined.shape[0]):
        add_pin_end(model, pin, 0, q, v)
        add_pin_end(model, pin, 1, q, v)
    row = 2 * model.joined.shape[0]
    phi[row] = q[3 * model.driven + 2] - model.omega * t - model.theta0
    jacobian[row, 3 * model.driven + 2] = 1.0
    for guide in range(model.guided.size):
        x, at = 3 * model.guided[guide], row + 1 + 2 * guide
        phi[at], phi[at + 1] = q[x] - model.lines[guide], q[x + 2]
        jacobian[at, x] = jacobian[at + 1, x + 2] = 1.0
    for i in range(phi.size):
        total = 0.0
        for k in range(q.size):
            total += jacobian[i, k] * v[k]
        rate[i] = total
    rate[row] -= model.omega


@inner
def solve_definite(matrix: Array, right: Array) -> None:
    """Solve a symmetric positive definite system by Cholesky's factorization; an indefinite one gives nan.

    The factor overwrites the lower triangle of the matrix, (n, n), which alone is read, and the solution
    overwrites `right`, (n,). With numba's call of LAPACK a run takes 1.8 times as long, the first 5 s more.
    """
    n = right.size
    for i in range(n):
        for j in range(i):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
            matrix[i, i] -= matrix[i, j] * matrix[i, j]
            right[i] -= matrix[i, j] * right[j]
        matrix[i, i] = math.sqrt(matrix[i, i])
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        right[i] /= matrix[i, i]
        for j in range(i):
            right[j] -= matrix[i, j] * right[i]


@inner
def solve_rows(model: Any, acceleration: Array) -> None:
    """Solve M q'' + Phi_q^T lambda = Q, Phi_q q'' = -r for q'' and lambda.

    Of the model's arrays `applied` holds Q (N and N m) and `lambdas` holds r, which the multipliers overwrite.
    """
    lambdas, matrix, jacobian = model.lambdas, model.matrix, model.jacobian
    applied, mass = model.applied, model.masses
    for i in range(lambdas.size):
        right = lambdas[i]
        for j in range(i + 1):
            matrix[i, j] = 0.0
        for k in range(mass.size):
            if jacobian[i, k] != 0.0:
                weighted = jacobian[i, k] / mass[k]
                right += weighted * applied[k]
                for j in range(i + 1):
                    matrix[i, j] += weighted * jacobian[j, k]
        lambdas[i] = right
    solve_definite(matrix, lambdas)
    for k in range(mass.size):
        force = applied[k]
        for i in range(lambdas.size):
            force -= jacobian[i, k] * lambdas[i]
        acceleration[k] = force / mass[k]


@inner
def solve(model: Linkage, t: float, q: Array, v: Array, acceleration: Array) -> None:
    """Solve Eqs. 19-21 in one state.

    `model.applied` holds the forces Q (weights, contacts, load; N and N m). Results are `acceleration`, q'',
    shape (3 n,), and `model.lambdas` (N and N m): a joint exerts -lambda on the first body of its pin.
    """
    constraints(model, t, q, v)
    for i in range(model.lambdas.size):
        right = -model.gamma[i] + 2.0 * model.alpha * model.rate[i] + model.beta * model.beta * model.phi[i]
        model.lambdas[i] = right
    solve_rows(model, acceleration)


def motion(model: Linkage, t: float, i: int, nodes: Nodes) -> None:
    """Write gaps, rates and slips of a state."""
    if model.contacts.size > 0:
        y, x, w = nodes.y[i], 3 * model.slider, model.masses.size + 3 * model.slider
        pose = (y[x], y[x + 1], y[x + 2], y[w], y[w + 1], y[w + 2])
        corner_motion(model.contacts, pose, nodes.touches[i])


def tabulate(model: Linkage, t: float, h: float, shares: Array) -> None:
    """Do nothing: no part of this motion is a function of time alone."""


def derivative(model: Linkage, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write the derivatives of coordinates and rates; see `formulations.derivative`."""
    size, x, y, dy, slider = model.masses.size, 3 * model.slider, nodes.y[i], nodes.dy[i], nodes.slider[i]
    q, v, acceleration = y[:size], y[size : 2 * size], dy[size : 2 * size]
    applied, damping, friction = model.applied, 0.0, 0.0
    for k in range(size):
        applied[k] = model.weights[k]
        dy[k] = v[k]
    if model.contacts.size > 0:
        pose = (q[x], q[x + 1], q[x + 2], v[x], v[x + 1], v[x + 2])
        Fx, Fy, M, damping, friction = slider_forces(model.contacts, pose, modes, nodes.touches[i])
        applied[x] += Fx
        applied[x + 1] += Fy
        applied[x + 2] += M
    if q[x + 1] < model.load.surface:
        applied[x + 1] += load_force(model.load, q[x + 1])
    solve(model, t, q, v, acceleration)
    slider.x, slider.y, slider.angle = q[x], q[x + 1], q[x + 2]
    slider.vx, slider.vy, slider.omega = v[x], v[x + 1], v[x + 2]
    slider.ax, slider.ay, slider.alpha = acceleration[x], acceleration[x + 1], acceleration[x + 2]
    power = -model.lambdas[2 * model.joined.shape[0]] * model.omega
    write_tail(dy, nodes.touches[i], power, damping, friction)


@kernel
def drift(model: Linkage, times: Array, states: Array, out: Array) -> None:
    """Write the largest |Phi| (m, rad) and |Phi'| (m/s, rad/s) of each state into `out`, shape (2, n).

    A state at one of the times (s), (n,), is a row of `states`, (n, size), that begins with q and v.
    """
    size = model.masses.size
    for i in range(times.size):
        constraints(model, times[i], states[i, :size], states[i, size : 2 * size])
        out[0, i] = out[1, i] = 0.0
        for row in range(model.phi.size):
            out[0, i] = max(out[0, i], abs(model.phi[row]))
            out[1, i] = max(out[1, i], abs(model.rate[row]))
