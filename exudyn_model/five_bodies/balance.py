"""Constraints of a linkage (Eq. 16), and accelerations by balance of forces under them (Eq. 21).

Exudyn's own accelerations are not recorded: with constraints at position level they carry the Newton
iteration's error divided by the square of the step. Here they follow from positions, velocities and contact
forces alone, so they are as accurate as the state.

All functions treat many states at once: the last axis of their arrays is the state.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY, Y
from exudyn_model.five_bodies.system import System, Torque, TurnedGuide, ends

Array = NDArray[np.float64]


class Motion:
    """Motion of a linkage in n states, from coordinates and their rates, shape (3 bodies, n)."""

    def __init__(self, system: System, q: Array, v: Array) -> None:
        self.reference, self.q, self.v = system.reference, q, v
        self.cosines, self.sines = np.cos(q[ANGLE::PER_BODY]), np.sin(q[ANGLE::PER_BODY])

    def rotate(self, body: int, vector: tuple[float, float]) -> tuple[Any, Any]:
        """Return x and y of a vector of a body's frame, or of the fixed one."""
        if body == FRAME:
            return vector
        along, across = vector
        return (
            self.cosines[body] * along - self.sines[body] * across,
            self.sines[body] * along + self.cosines[body] * across,
        )

    def point(self, body: int, point: tuple[float, float]) -> tuple[Any, ...]:
        """Return x, y (m), their rates (m/s), and the arm's x and y (m) of a point of a body."""
        arm_x, arm_y = self.rotate(body, point)
        if body == FRAME:
            return arm_x, arm_y, 0.0, 0.0, 0.0, 0.0
        first, angle = PER_BODY * body, PER_BODY * body + ANGLE
        return (
            self.reference[first] + self.q[first] + arm_x,
            self.reference[first + 1] + self.q[first + 1] + arm_y,
            self.v[first] - self.v[angle] * arm_y,
            self.v[first + 1] + self.v[angle] * arm_x,
            arm_x,
            arm_y,
        )


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
    gaps, rates : ndarray, shape (rows, n)
        Violations of the constraints (m, rad), and of their rates (m/s, rad/s).
    """

    rows: list[dict[int, Any]]
    products: list[Any]
    gaps: Array
    rates: Array


def constraints(system: System, times: Array, q: Array, v: Array) -> Constraints:
    """Return the constraints at times in s.

    Parameters
    ----------
    system : System
    times : ndarray, shape (n,)
    q, v : ndarray, shape (3 bodies, n)
        Coordinates and their rates.
    """
    reference, motion, gaps, rates = system.reference, Motion(system, q, v), [], []
    rows: list[dict[int, Any]] = []
    products: list[Any] = []
    for pin in system.pins:
        x_row: dict[int, Any] = {}
        y_row: dict[int, Any] = {}
        x, y, vx, vy, ax, ay = (np.zeros(len(times)) for _ in range(6))
        for sign, (body, point) in zip((-1.0, 1.0), ends(pin), strict=True):
            point_x, point_y, point_vx, point_vy, arm_x, arm_y = motion.point(body, point)
            x += sign * point_x
            y += sign * point_y
            if body == FRAME:
                continue
            first, angle = PER_BODY * body, PER_BODY * body + ANGLE
            x_row[first], x_row[angle] = sign, -sign * arm_y
            y_row[first + 1], y_row[angle] = sign, sign * arm_x
            vx += sign * point_vx
            vy += sign * point_vy
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
    for guide in system.turned_guides:
        across, rotation, guide_gaps, guide_rates, product = _turned_guide(guide, motion)
        rows += [across, rotation]
        products += [product, 0.0]
        gaps += guide_gaps
        rates += guide_rates
    shape = len(rows), len(times)
    return Constraints(rows, products, np.reshape(gaps, shape), np.reshape(rates, shape))


def _turned_guide(guide: TurnedGuide, motion: Motion) -> tuple[Any, ...]:
    """Return both rows of a turned guide, their gaps and rates, and the product of the first one.

    n . (point - centre), with n across the line, which turns with the body ``on``; and the angle.
    """
    q, v, on, base = motion.q, motion.v, guide.on, PER_BODY * guide.body
    tx, ty = motion.rotate(on, (math.cos(guide.direction), math.sin(guide.direction)))
    px, py, vx, vy, arm_x, arm_y = motion.point(on, guide.point)
    x, y, vx, vy = px - q[base], py - q[base + 1], vx - v[base], vy - v[base + 1]
    across = {base: ty, base + 1: -tx}
    rotation = {base + ANGLE: 1.0}
    rate, product = -ty * vx + tx * vy, np.zeros_like(x)
    angle, spin = q[base + ANGLE] - guide.angle, v[base + ANGLE]
    if on != FRAME:
        first, omega = PER_BODY * on, v[PER_BODY * on + ANGLE]
        along = tx * (arm_x - x) + ty * (arm_y - y)
        across |= {first: -ty, first + 1: tx, first + ANGLE: along}
        rotation[first + ANGLE] = -1.0
        rate = rate - omega * (tx * x + ty * y)
        product = omega**2 * (-ty * (arm_x + x) + tx * (arm_y + y)) + 2.0 * omega * (tx * vx + ty * vy)
        angle, spin = angle - q[first + ANGLE], spin - omega
    return across, rotation, [-ty * x + tx * y, angle], [rate, spin], product


def applied_forces(system: System, q: Array, v: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return forces, energy and powers of gravity, springs and a motor's torque in n states ``q``, ``v``.

    Returns
    -------
    force : ndarray, shape (3 bodies, n)
        N, N m.
    tensions : ndarray, shape (springs, n)
        N.
    spring_energy, damper_power, motor_power : ndarray, shape (n,)
        Energy in all springs (J), powers of their dampers and of the motor's torque (W).
    """
    force, motion = np.zeros_like(q), Motion(system, q, v)
    force[Y::PER_BODY] = -system.gravity * system.masses[Y::PER_BODY, None]
    spring_energy, damper_power, motor_power = np.zeros((3, q.shape[1]))
    tensions = np.zeros((len(system.springs), q.shape[1]))
    for spring, tension in zip(system.springs, tensions, strict=True):
        points = [motion.point(*end) for end in ends(spring)]
        x, y, vx, vy = (second - first for first, second in list(zip(*points, strict=True))[:4])
        length = np.hypot(x, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            ux, uy = (np.where(length > 0.0, part / length, 0.0) for part in (x, y))
        rate, extension = ux * vx + uy * vy, length - spring.length
        tension += spring.stiffness * extension + spring.damping * rate
        spring_energy += 0.5 * spring.stiffness * extension**2
        damper_power += spring.damping * rate**2
        for sign, (body, _), (*_, arm_x, arm_y) in zip((1.0, -1.0), ends(spring), points, strict=True):
            if body != FRAME:
                base = PER_BODY * body
                force[base : base + PER_BODY] += sign * tension * np.array([ux, uy, arm_x * uy - arm_y * ux])
    if isinstance(system.drive, Torque):
        angle = PER_BODY * system.drive.body + ANGLE
        torque = np.interp(q[angle] % (2.0 * math.pi), *system.drive.table.T)
        force[angle] += torque
        motor_power += torque * v[angle]
    return force, tensions, spring_energy, damper_power, motor_power


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
        entries: dict[int, Any] = {}
        for j in range(i + 1):
            products = [weighted[k] * joints.rows[j][k] for k in weighted.keys() & joints.rows[j].keys()]
            other = factor[j] if j < i else entries
            fill_in = [entries[k] * other[k] for k in entries.keys() & other.keys() if k < j]
            if products or fill_in:
                total = sum(products) - sum(fill_in)
                entries[j] = np.sqrt(total) if j == i else total / factor[j][j]
        factor.append(entries)
        value = sum(coefficient * result[k] for k, coefficient in row.items()) - joints.products[i]
        right.append((value - sum(entries[k] * right[k] for k in entries if k < i)) / entries[i])
    for i in range(len(factor) - 1, -1, -1):
        right[i] = right[i] / factor[i][i]
        for k in factor[i]:
            if k < i:
                right[k] = right[k] - factor[i][k] * right[i]
    for row, multiplier in zip(joints.rows, right, strict=True):
        for k, coefficient in row.items():
            result[k] -= coefficient / masses[k] * multiplier
    return result, np.reshape(right, (len(right), force.shape[1]))


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
    solution, change = accelerations(system, joints, (system.masses * acceleration)[:, None])
    acceleration[:] = solution[:, 0]
    multipliers += change[:, 0]
