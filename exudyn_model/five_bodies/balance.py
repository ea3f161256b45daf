"""Constraints of a linkage (Eq. 16), and accelerations by balance of forces under them (Eq. 21).

Exudyn's own accelerations are not recorded: with constraints at position level they carry the Newton
iteration's error divided by the square of the step. Here they follow from positions, velocities and contact
forces alone, so they are as accurate as the state.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.system import ANGLE, FRAME, PER_BODY, Constants
from exudyn_model.kernels import entry, kernel

Array = NDArray[np.float64]


@entry
def constraints(
    time: float, q: Array, v: Array, constants: Constants, jacobian: Array, wanted: Array
) -> tuple[float, float]:
    """Fill the constraints' Jacobian and what it has to make of the accelerations.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray, shape (3 n,)
        Coordinates and their rates.
    constants : Constants
    jacobian : ndarray, shape (rows, 3 n)
        Two rows a pin, then those of the prescribed coordinates; zero but for what is filled here.
    wanted : ndarray, shape (rows,)

    Returns
    -------
    position, velocity : float
        Largest violation (m and rad alike) and that of a rate (m/s and rad/s).
    """
    pins, fixed, reference = constants.pins, constants.fixed, constants.reference
    position, velocity = 0.0, 0.0
    for number in range(len(pins)):
        x, y, vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        row = 2 * number
        for end in range(2):
            sign, body = 2.0 * end - 1.0, int(pins[number, 3 * end])
            along, across = pins[number, 3 * end + 1], pins[number, 3 * end + 2]
            if body == FRAME:
                x, y = x + sign * along, y + sign * across
                continue
            first, angle = PER_BODY * body, PER_BODY * body + ANGLE
            cosine, sine, speed = np.cos(q[angle]), np.sin(q[angle]), v[angle]
            arm_x, arm_y = cosine * along - sine * across, sine * along + cosine * across
            jacobian[row, first], jacobian[row, angle] = sign, -sign * arm_y
            jacobian[row + 1, first + 1], jacobian[row + 1, angle] = sign, sign * arm_x
            x += sign * (reference[first] + q[first] + arm_x)
            y += sign * (reference[first + 1] + q[first + 1] + arm_y)
            vx, vy = vx + sign * (v[first] - speed * arm_y), vy + sign * (v[first + 1] + speed * arm_x)
            ax, ay = ax + sign * speed * speed * arm_x, ay + sign * speed * speed * arm_y
        wanted[row], wanted[row + 1] = ax, ay
        position, velocity = max(position, abs(x), abs(y)), max(velocity, abs(vx), abs(vy))
    for number in range(len(fixed)):
        row, coordinate = 2 * len(pins) + number, int(fixed[number, 0])
        value, rate = fixed[number, 1], fixed[number, 2]
        jacobian[row, coordinate], wanted[row] = 1.0, 0.0
        position = max(position, abs(reference[coordinate] + q[coordinate] - value - rate * time))
        velocity = max(velocity, abs(v[coordinate] - rate))
    return position, velocity


@kernel
def accelerations(
    force: Array, constants: Constants, jacobian: Array, wanted: Array, matrix: Array, found: Array
) -> None:
    """Solve M a + G^T l = f, G a = wanted for the accelerations (m/s^2, rad/s^2), by the Schur complement.

    Parameters
    ----------
    force : ndarray, shape (3 n,)
    constants : Constants
    jacobian : ndarray, shape (rows, 3 n)
        G: each row has at most two bodies.
    wanted : ndarray, shape (rows,)
        Overwritten by the multipliers l.
    matrix : ndarray, shape (rows, rows)
        Overwritten.
    found : ndarray, shape (3 n,)
        Filled with a.
    """
    rows, bodies, masses = len(wanted), constants.bodies_of_rows, constants.masses
    for k in range(len(found)):
        found[k] = force[k] / masses[k]
    # Cholesky's factor of G M^-1 G^T, row by row, and forward substitution of its right side
    for i in range(rows):
        right = -wanted[i]
        for j in range(i):
            matrix[i, j] = 0.0
        matrix[i, i] = 0.0
        for end in range(2):
            if bodies[i, end] == FRAME:
                continue
            for k in range(PER_BODY * bodies[i, end], PER_BODY * bodies[i, end] + PER_BODY):
                right += jacobian[i, k] * found[k]
                weighted = jacobian[i, k] / masses[k]
                for j in range(i + 1):
                    matrix[i, j] += weighted * jacobian[j, k]
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = np.sqrt(total) if i == j else total / matrix[j, j]
        for k in range(i):
            right -= matrix[i, k] * wanted[k]
        wanted[i] = right / matrix[i, i]
    for i in range(rows - 1, -1, -1):
        for k in range(i + 1, rows):
            wanted[i] -= matrix[k, i] * wanted[k]
        wanted[i] /= matrix[i, i]
        for end in range(2):
            if bodies[i, end] != FRAME:
                for k in range(PER_BODY * bodies[i, end], PER_BODY * bodies[i, end] + PER_BODY):
                    found[k] -= jacobian[i, k] * wanted[i] / masses[k]


def correct_start(
    constants: Constants, q: Array, v: Array, accelerations_: Array, multipliers: Array
) -> None:
    """Correct Exudyn's initial accelerations and multipliers in place, so that they meet the constraints.

    Exudyn differentiates the constraints' Jacobian along the velocities by a one-sided difference, which
    leaves some 1e-9 of the accelerations and of the reactions. The trapezoidal rule does not damp such an
    error: it alternates from step to step, as large after two cycles as at t = 0, and no shorter step shows
    it. The forces are not at issue: M da + G^T dl = 0 and G (a + da) = wanted.

    Parameters
    ----------
    constants : Constants
    q, v, accelerations_ : ndarray, shape (3 n,)
    multipliers : ndarray, shape (rows,)
    """
    jacobian, wanted = np.zeros((len(multipliers), len(q))), np.zeros(len(multipliers))
    constraints(0.0, q, v, constants, jacobian, wanted)
    weighted = jacobian / constants.masses
    change = np.linalg.solve(weighted @ jacobian.T, jacobian @ accelerations_ - wanted)
    multipliers += change
    accelerations_ -= change @ weighted
