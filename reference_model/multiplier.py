"""The paper's own form: 15 coordinates, one multiplier a constraint, Baumgarte (Eqs. 14-21).

q_i = (x_i, y_i, theta_i), i = 1..5. With Phi(q, t) = 0 the rows of Eq. 16,

    M q'' + Phi_q^T lambda = Q,    Phi_q q'' = gamma - 2 alpha Phi' - beta^2 Phi.

Rows 1-12 are the six revolutes O, A, H, B, C, F, each r_i - r_j - a u_i - b u_j - const with u = (cos, sin)
of a body's angle; row 13 drives the crank; an ideal slider adds rows 14 and 15 (x5 on its line, theta_5 = 0).
The paper's print of rows 7-12 and of the driver is corrected: as printed the rods would not close.
"""

import math

import numpy as np

from reference_model.compiled import bare, kernel
from reference_model.constants import Constants
from reference_model.forces import Array, slider_forces

COORDINATES = 15
ROWS_CLEARANCE, ROWS_IDEAL = 13, 15
DRIVER_ROW = 12


@kernel
def joint_table(c: Constants) -> Array:
    """Return bodies i, j (0-based, -1: the frame) and arms a of i, b of j of each joint, shape (6, 4)."""
    return np.array(
        [
            [0.0, -1.0, c.Ls1, 0.0],
            [1.0, 0.0, c.Ls2, c.L1 - c.Ls1],
            [2.0, -1.0, c.Ls3, 0.0],
            [2.0, 1.0, 0.0, c.L2 - c.Ls2],
            [3.0, 2.0, c.Ls4, c.L3 - c.Ls3],
            [4.0, 3.0, 0.0, c.L4 - c.Ls4],
        ]
    )


@kernel
def constraints(
    c: Constants, t: float, q: Array, v: Array, phi: Array, rate: Array, jacobian: Array, gamma: Array
) -> None:
    """Evaluate the rows of Eq. 16 and what derives from them.

    Parameters
    ----------
    c, t
        Constants, time (s).
    q, v
        Coordinates and velocities, shape (15,).
    phi, rate, gamma
        Written, shape (13,) or (15,): Phi, Phi' = Phi_q v + Phi_t, and gamma of Phi_q q'' = gamma.
    jacobian
        Written, shape (rows, 15): Phi_q.
    """
    rows = phi.size
    jacobian.fill(0.0)
    joints = joint_table(c)
    for joint in range(6):
        i, j = int(joints[joint, 0]), int(joints[joint, 1])
        a, b = joints[joint, 2], joints[joint, 3]
        ci, si = math.cos(q[3 * i + 2]), math.sin(q[3 * i + 2])
        x, y = 2 * joint, 2 * joint + 1
        phi[x], phi[y] = q[3 * i] - a * ci, q[3 * i + 1] - a * si
        jacobian[x, 3 * i] = jacobian[y, 3 * i + 1] = 1.0
        jacobian[x, 3 * i + 2], jacobian[y, 3 * i + 2] = a * si, -a * ci
        square = v[3 * i + 2] ** 2
        gamma[x], gamma[y] = -a * ci * square, -a * si * square
        if j >= 0:
            cj, sj = math.cos(q[3 * j + 2]), math.sin(q[3 * j + 2])
            phi[x] -= q[3 * j] + b * cj
            phi[y] -= q[3 * j + 1] + b * sj
            jacobian[x, 3 * j] = jacobian[y, 3 * j + 1] = -1.0
            jacobian[x, 3 * j + 2], jacobian[y, 3 * j + 2] = b * sj, -b * cj
            square = v[3 * j + 2] ** 2
            gamma[x] -= b * cj * square
            gamma[y] -= b * sj * square
        elif joint > 0:
            phi[x] -= c.Hx
            phi[y] -= c.Hy
    phi[DRIVER_ROW] = q[2] - c.omega * t - c.theta0
    jacobian[DRIVER_ROW, 2] = 1.0
    gamma[DRIVER_ROW] = 0.0
    if rows == ROWS_IDEAL:
        phi[13], phi[14] = q[12] - c.line_x, q[14]
        jacobian[13, 12] = jacobian[14, 14] = 1.0
        gamma[13] = gamma[14] = 0.0
    for i in range(rows):
        rate[i] = 0.0
        for k in range(COORDINATES):
            rate[i] += jacobian[i, k] * v[k]
    rate[DRIVER_ROW] -= c.omega


@kernel
def drift(c: Constants, t: float, y: Array, rows: int) -> tuple[float, float]:
    """Return the largest |Phi| (m, rad) and |Phi'| (m/s, rad/s) of a state's coordinates and velocities."""
    phi, rate, gamma = np.empty(rows), np.empty(rows), np.empty(rows)
    jacobian = np.empty((rows, COORDINATES))
    constraints(c, t, y[:COORDINATES], y[COORDINATES : 2 * COORDINATES], phi, rate, jacobian, gamma)
    return np.max(np.abs(phi)), np.max(np.abs(rate))


@kernel
def masses(c: Constants) -> Array:
    """Return the diagonal of M, shape (15,), kg and kg m^2."""
    return np.array([
        c.m1, c.m1, c.J1, c.m2, c.m2, c.J2, c.m3, c.m3, c.J3, c.m4, c.m4, c.J4, c.m5, c.m5, c.J5,
    ])  # fmt: skip


@bare
def solve_definite(matrix: Array, right: Array) -> None:
    """Solve a symmetric positive definite system by Cholesky's factorization; not a number where it is not.

    With numba's call of LAPACK in its place a first run takes 5 s longer, and each run 1.8 times as long.

    Parameters
    ----------
    matrix
        Shape (n, n); its lower triangle counts, and is overwritten with the factor.
    right
        Shape (n,); overwritten with the solution.
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


@kernel
def multipliers(
    c: Constants, t: float, q: Array, v: Array, applied: Array, rows: int, acceleration: Array
) -> Array:
    """Solve Eqs. 19-21 in one state.

    Parameters
    ----------
    c, t, q, v
        Constants, time (s), coordinates and velocities (15,).
    applied
        Q, shape (15,): weights and contact forces, N and N m.
    rows
        13 or 15.
    acceleration
        Written: q'', shape (15,).

    Returns
    -------
    lambda
        Shape (rows,), N and N m: -lambda is what the joint exerts on the higher-numbered body.
    """
    phi, rate, gamma = np.empty(rows), np.empty(rows), np.empty(rows)
    jacobian = np.empty((rows, COORDINATES))
    constraints(c, t, q, v, phi, rate, jacobian, gamma)
    mass = masses(c)
    matrix, solution = np.zeros((rows, rows)), np.empty(rows)
    for i in range(rows):
        solution[i] = -gamma[i] + 2.0 * c.alpha * rate[i] + c.beta * c.beta * phi[i]
        for k in range(COORDINATES):
            if jacobian[i, k] != 0.0:
                weighted = jacobian[i, k] / mass[k]
                solution[i] += weighted * applied[k]
                for j in range(i + 1):
                    matrix[i, j] += weighted * jacobian[j, k]
    solve_definite(matrix, solution)
    for k in range(COORDINATES):
        force = applied[k]
        for i in range(rows):
            force -= jacobian[i, k] * solution[i]
        acceleration[k] = force / mass[k]
    return solution


@kernel
def weights(c: Constants) -> Array:
    """Return the bodies' weights as generalized forces, shape (15,)."""
    applied = np.zeros(COORDINATES)
    mass = masses(c)
    for i in range(1, COORDINATES, 3):
        applied[i] = -c.gravity * mass[i]
    return applied


@kernel
def equations(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array, rows: int
) -> tuple[float, float, float]:
    """Write the derivatives of the coordinates and velocities into dy[:30].

    Returns the motor's power, -lambda_13 omega, and the power lost by damping and by friction, W.
    """
    q, v = y[:COORDINATES], y[COORDINATES : 2 * COORDINATES]
    applied = weights(c)
    damping = friction = 0.0
    if rows == ROWS_CLEARANCE:
        slider = (q[12], q[13], q[14], v[12], v[13], v[14])
        Fx, Fy, M, damping, friction = slider_forces(c, slider, modes, contacts)
        applied[12] += Fx
        applied[13] += Fy
        applied[14] += M
    solution = multipliers(c, t, q, v, applied, rows, dy[COORDINATES : 2 * COORDINATES])
    for i in range(COORDINATES):
        dy[i] = v[i]
    return -solution[DRIVER_ROW] * c.omega, damping, friction
