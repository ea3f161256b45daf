"""Constraints of a linkage (Eq. 16), and accelerations by balance of forces under them (Eq. 21).

Exudyn's own accelerations are not recorded: with constraints at position level they carry the Newton
iteration's error divided by the square of the step. Here they follow from positions, velocities and contact
forces alone, so they are as accurate as the state.

All functions treat many states at once: the last axis of their arrays is the state.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY
from exudyn_model.five_bodies.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Constraints:
    """Constraints of a linkage in many states.

    Attributes
    ----------
    rows : list of dict
        Coordinate to derivative (a number, or shape (n,)) of each constraint, in the order of
        ``System.multipliers``.
    products : list
        Required product of each row with the accelerations, m/s^2 or rad/s^2.
    position, velocity : ndarray, shape (n,)
        Largest violation of a constraint (m, rad), and of its rate (m/s, rad/s).
    """

    rows: list[dict[int, Any]]
    products: list[Any]
    position: Array
    velocity: Array


def constraints(system: System, times: Array, q: Array, v: Array) -> Constraints:
    """Return the constraints at times in s.

    Parameters
    ----------
    system : System
    times : ndarray, shape (n,)
    q, v : ndarray, shape (3 bodies, n)
        Coordinates and their rates.
    """
    reference, gaps, rates = system.reference, [], []
    rows: list[dict[int, Any]] = []
    products: list[Any] = []
    cosines, sines = np.cos(q[ANGLE::PER_BODY]), np.sin(q[ANGLE::PER_BODY])
    for pin in system.pins:
        x_row: dict[int, Any] = {}
        y_row: dict[int, Any] = {}
        x, y, vx, vy, ax, ay = (np.zeros(len(times)) for _ in range(6))
        for sign, body, (along, across) in (
            (-1.0, pin.first, pin.first_point),
            (1.0, pin.second, pin.second_point),
        ):
            if body == FRAME:
                x += sign * along
                y += sign * across
                continue
            first, angle = PER_BODY * body, PER_BODY * body + ANGLE
            arm_x = cosines[body] * along - sines[body] * across
            arm_y = sines[body] * along + cosines[body] * across
            x_row[first], x_row[angle] = sign, -sign * arm_y
            y_row[first + 1], y_row[angle] = sign, sign * arm_x
            x += sign * (reference[first] + q[first] + arm_x)
            y += sign * (reference[first + 1] + q[first + 1] + arm_y)
            vx += sign * (v[first] - v[angle] * arm_y)
            vy += sign * (v[first + 1] + v[angle] * arm_x)
            ax += sign * v[angle] ** 2 * arm_x
            ay += sign * v[angle] ** 2 * arm_y
        rows += [x_row, y_row]
        products += [ax, ay]
        gaps += [x, y]
        rates += [vx, vy]
    for coordinate, value, rate in system.prescribed:
        rows.append({coordinate: 1.0})
        products.append(0.0)
        gaps.append(reference[coordinate] + q[coordinate] - value - rate * times)
        rates.append(v[coordinate] - rate)
    return Constraints(rows, products, np.abs(gaps).max(axis=0), np.abs(rates).max(axis=0))


def accelerations(system: System, joints: Constraints, force: Array) -> tuple[Array, Array]:
    """Solve M a + G^T l = f, G a = p for a (m/s^2, rad/s^2), shape (3 bodies, n), and l, shape (rows, n).

    The loop runs over the few elements of Cholesky's factor of G M^-1 G^T, not over the states.

    Parameters
    ----------
    system : System
    joints : Constraints
    force : ndarray, shape (3 bodies, n)
        N, N m.
    """
    masses = system.masses
    result = force / masses[:, None]
    factor: list[dict[int, Any]] = []
    right: list[Any] = []
    for i, row in enumerate(joints.rows):
        weighted = {k: value / masses[k] for k, value in row.items()}
        own: dict[int, Any] = {}
        for j in range(i + 1):
            shared = [weighted[k] * joints.rows[j][k] for k in weighted.keys() & joints.rows[j].keys()]
            other = factor[j] if j < i else own
            filled = [own[k] * other[k] for k in own.keys() & other.keys() if k < j]
            if shared or filled:
                total = sum(shared) - sum(filled)
                own[j] = np.sqrt(total) if j == i else total / factor[j][j]
        factor.append(own)
        value = sum(coefficient * result[k] for k, coefficient in row.items()) - joints.products[i]
        right.append((value - sum(own[k] * right[k] for k in own if k < i)) / own[i])
    for i in range(len(factor) - 1, -1, -1):
        right[i] = right[i] / factor[i][i]
        for k in factor[i]:
            if k < i:
                right[k] = right[k] - factor[i][k] * right[i]
    for row, multiplier in zip(joints.rows, right, strict=True):
        for k, coefficient in row.items():
            result[k] -= coefficient / masses[k] * multiplier
    return result, np.array(right)


def correct_start(system: System, q: Array, v: Array, acceleration: Array, multipliers: Array) -> None:
    """Correct Exudyn's initial accelerations and multipliers in place, so that they meet the constraints.

    Exudyn differentiates the constraints' Jacobian along the velocities by a one-sided difference, which
    leaves some 1e-9 of the accelerations and of the reactions. The trapezoidal rule does not damp such an
    error: it alternates from step to step, as large after two cycles as at t = 0, and no shorter step shows
    it. The forces are not at issue: M da + G^T dl = 0 and G (a + da) = p.

    Parameters
    ----------
    system : System
    q, v, acceleration : ndarray, shape (3 bodies,)
    multipliers : ndarray, shape (rows,)
    """
    joints = constraints(system, np.zeros(1), q[:, None], v[:, None])
    corrected, change = accelerations(system, joints, (system.masses * acceleration)[:, None])
    acceleration[:] = corrected[:, 0]
    multipliers += change[:, 0]
