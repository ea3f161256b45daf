"""Error of the paper's own solver, u_D: its formulation, integrated as a user of ode15s integrates it.

15 coordinates, 13 multipliers and Baumgarte's stabilization, written from sections 1 to 6 of docs/model.md,
not from a model. The paper names ode15s and no setting. Its defaults are RelTol 1e-3 and AbsTol 1e-6
(MathWorks, odeset) on the largest of the 30 components; scipy's BDF is of the same family, but takes the root
mean square: at tolerances smaller by sqrt(30) it is at least as strict, so that ode15s lies between
`DEFAULTS`. No contact is located. Where contacts chatter the last bits of a tolerance decide the numbers
of a run, which makes it one draw: each setting is run several times.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import acos, atan2, cos, radians, sin, sqrt
from typing import NamedTuple

import numpy as np
import pandas as pd
from numba import njit
from scipy.integrate import BDF

from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import Task, measure_all, on_processes
from comparison.reliability.errors import QUANTITIES
from comparison.scene import Scene, load_scene
from comparison.scene.schema import PARTNERS
from comparison.studies.paper.runs import DATA, PEAKS, RANGES, numbers
from comparison.studies.shared.scenes import key_values
from comparison.tables.channels import Array

NORM = sqrt(30)  # of the components of the state, between both norms
DEFAULTS = ((1e-3, 1e-6), (1e-3 / NORM, 1e-6 / NORM))
"""Relative and absolute tolerances between which ode15s at its defaults lies."""
LIMIT = 900.0  # s, of a run; most take 5
OTHERS = ((1e-5, 1e-8), (1e-12, 1e-6), (1e-12, 1e-7))  # a tighter one, and two whose control is absolute
CHANNELS = {f"slider_{name}": k for k, name in enumerate(("x", "y", "vx", "vy", "ay"))}


class Setting(NamedTuple):
    """Settings of the solver that the paper does not print."""

    relative: float
    absolute: float  # m, rad and their rates
    gain: float  # alpha = beta, 1/s
    inside: bool  # the right-hand side itself remembers the impact speed; else each accepted step does


class Press(NamedTuple):
    """Numbers of a scene with clearance at the slider, SI, as `derivative` takes them."""

    joints: Array  # of O, A, H, B, C, F: body (-1: frame) and its arm from the centroid, twice; shape (6, 4)
    lengths: Array  # crank, rod 2, H to B, rod 4, rocker
    mass: Array  # diagonal of M, shape (15,)
    pivot: Array  # H
    branches: tuple[int, int]
    lines: tuple[float, float]  # x of the guide and of the ideal slider
    half: tuple[float, float, float]  # of the slider's width and length, and the clearance
    drive: tuple[float, float]  # rad, rad/s
    gravity: float
    contact: tuple[float, float, float, float]  # K, exponent, C, floor of the impact speed
    friction: tuple[float, float, float]  # coefficient, v0, v1
    start: tuple[float, float, float, float]  # x, angle and their rates


def press(scene: Scene) -> Press:
    """Return the numbers of a scene; its contact law is that of points, Eqs. 9 to 11."""
    data, key = scene.data, key_values(scene.data)
    parts, contact, friction, initial = (data[k] for k in ("mechanism", "contact", "friction", "initial"))
    bodies = [parts[name] for name in ("crank", "rod2", "rocker", "rod4", "slider")]
    (l1, l2, l3, l4), (s1, s2, s3, s4) = ([rod[k] for rod in bodies[:4]] for k in ("length", "centroid"))
    joints = [[-1, 0.0, 0, -s1], [0, l1 - s1, 1, -s2], [-1, 0.0, 2, -s3]]
    joints += [[1, l2 - s2, 2, 0.0], [2, l3 - s3, 3, -s4], [3, l4 - s4, 4, 0.0]]
    e, nu = ([key[f"contact.{k}.{one}"] for one in PARTNERS] for k in ("youngs_modulus", "poisson"))
    soft = sum((1 - ratio**2) / modulus for modulus, ratio in zip(e, nu, strict=True))
    guide, offset = parts["guide_x"], parts["reference_offset"]
    at = initial.get("slider_offset")
    stiffness = 4 / (3 * soft) * sqrt(contact["corner_radius"])
    damping = 0.75 * (1 - contact["restitution"] ** 2)
    return Press(
        np.array(joints),
        np.array([l1, l2, s3, l4, l3]),
        np.array([body[k] for body in bodies for k in ("mass", "mass", "inertia")]),
        np.array(parts["rocker_pivot"]),
        (parts["rocker_branch"], parts["slider_branch"]),
        (guide, guide + offset),
        (parts["slider"]["width"] / 2, parts["slider"]["length"] / 2, data["clearance"]["slider"]),
        (radians(parts["crank_angle_deg"]), 2 * np.pi / 60 * data["drive"]["speed_rpm"]),
        data["environment"]["gravity"],
        (stiffness, contact["exponent"], damping, contact["impact_speed_floor"]),
        (friction["coefficient"], friction["static_speed"], friction["transition_speed"]),
        (guide + (offset if at is None else at), *(initial[f"slider_{k}"] for k in ("angle", "vx", "omega"))),
    )


# ---- equations


@njit(cache=True)
def closure(p: Press, t: float, x: float, shift: Array) -> Array:
    """Return positions (15,): the upright slider at x, the start of rod 2 at the crank's tip plus a shift."""
    one = p.drive[0] + p.drive[1] * t
    tip = p.lengths[0] * np.array([cos(one), sin(one)]) + shift
    way = p.pivot - tip
    distance = sqrt(way[0] ** 2 + way[1] ** 2)
    along = (distance**2 + p.lengths[1] ** 2 - p.lengths[2] ** 2) / (2 * distance)
    across = p.branches[0] * sqrt(p.lengths[1] ** 2 - along**2)
    middle = tip + (along * way + across * np.array([-way[1], way[0]])) / distance
    two = atan2(middle[1] - tip[1], middle[0] - tip[0])
    three = atan2(middle[1] - p.pivot[1], middle[0] - p.pivot[0])
    end = p.pivot + p.lengths[4] * np.array([cos(three), sin(three)])
    four = p.branches[1] * acos((x - end[0]) / p.lengths[3])
    q = np.zeros(15)
    rods = ((0, 0, one, 0 * tip), (1, 1, two, tip), (2, 2, three, p.pivot), (3, 4, four, end))
    for body, joint, angle, at in rods:
        u = np.array([cos(angle), sin(angle)])
        q[3 * body : 3 * body + 2] = at - p.joints[joint, 3] * u
        q[3 * body + 2] = angle
        q[12:14] = at + p.lengths[3] * u
    return q


@njit(cache=True)
def constraints(p: Press, t: float, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Return the 13 rows of section 3 and the two of an ideal slider: values, Jacobian, rates, gamma."""
    phi, jacobian, gamma = np.zeros(15), np.zeros((15, 15)), np.zeros(15)
    for joint in range(6):
        for side in range(2):
            body, arm, sign = int(p.joints[joint, 2 * side]), p.joints[joint, 2 * side + 1], 2.0 * side - 1.0
            for xy in range(2 * (body >= 0)):
                row, k = 2 * joint + xy, 3 * body
                angle = q[k + 2] - xy * np.pi / 2  # sin is a cos
                phi[row] += sign * (q[k + xy] + arm * cos(angle))
                jacobian[row, k + xy] = sign
                jacobian[row, k + 2] = -sign * arm * sin(angle)
                gamma[row] += sign * arm * cos(angle) * v[k + 2] ** 2
    phi[4:6] -= p.pivot
    phi[12] = q[2] - p.drive[1] * t - p.drive[0]
    phi[13] = q[12] - p.lines[1]
    phi[14] = q[14]
    jacobian[12, 2] = 1.0
    jacobian[13, 12] = 1.0
    jacobian[14, 14] = 1.0
    rate = jacobian @ v
    rate[12] -= p.drive[1]
    return phi, jacobian, rate, gamma


@njit(cache=True)
def corners(p: Press, q: Array, v: Array) -> Array:
    """Return depth, its rate, slip, arm x and arm y of each corner, shape (4, 5): two left, two right."""
    result = np.empty((4, 5))
    c, s = cos(q[14]), sin(q[14])
    for k in range(4):
        inward = 1.0 if k < 2 else -1.0  # the wall's normal
        across, along = -inward * p.half[0], (2.0 * (k % 2) - 1.0) * p.half[1]
        x, y = across * c - along * s, across * s + along * c
        result[k, 0] = -inward * (q[12] + x - p.lines[0]) - p.half[0] - p.half[2]
        result[k, 1] = -inward * (v[12] - v[14] * y)
        result[k, 2] = v[13] + v[14] * x
        result[k, 3] = x
        result[k, 4] = y
    return result


@njit(cache=True)
def derivative(p: Press, t: float, state: Array, gain: float, memory: Array, inside: bool) -> Array:
    """Return the rates of states, columns of shape (30, n).

    ``memory``: impact speeds of the corners, shape (4,). ``inside``: it is written here, zero of an open
    corner, as by a persistent variable of a function that any call changes.
    """
    rates = np.empty_like(state)
    stiffness, exponent, damping, floor = p.contact
    for column in range(state.shape[1]):
        q, v = state[:15, column].copy(), state[15:, column].copy()
        force = np.zeros(15)
        for k in range(5):
            force[3 * k + 1] = -p.mass[3 * k + 1] * p.gravity
        at = corners(p, q, v)
        for k in range(4):
            depth, speed, slip, x, y = at[k, 0], at[k, 1], at[k, 2], at[k, 3], at[k, 4]
            if inside and depth <= 0.0:
                memory[k] = 0.0
            elif inside and memory[k] == 0.0:
                memory[k] = max(speed, floor)
            if depth <= 0.0:
                continue
            normal = max(stiffness * depth**exponent * (1.0 + damping * speed / memory[k]), 0.0)
            ramp = (abs(slip) - p.friction[1]) / (p.friction[2] - p.friction[1])
            along = -p.friction[0] * min(max(ramp, 0.0), 1.0) * normal * np.sign(slip)
            across = normal if k < 2 else -normal
            force[12] += across
            force[13] += along
            force[14] += x * along - y * across
        phi, jacobian, rate, gamma = constraints(p, t, q, v)
        target = gamma[:13] - 2.0 * gain * rate[:13] - gain**2 * phi[:13]
        rows = jacobian[:13].copy()
        light = rows / p.mass
        multipliers = np.linalg.solve(light @ rows.T, light @ force - target)
        rates[:15, column] = v
        rates[15:, column] = (force - rows.T @ multipliers) / p.mass
    return rates


@njit(cache=True)
def ideal(p: Press, times: Array) -> Array:
    """Return y, its rate and acceleration of the ideal slider, shape (3, n)."""
    result = np.empty((3, times.size))
    for k in range(times.size):
        q = closure(p, times[k], p.lines[1], np.zeros(2))
        _, jacobian, rate, _ = constraints(p, times[k], q, np.zeros(15))
        v = np.linalg.solve(jacobian, -rate)
        gamma = constraints(p, times[k], q, v)[3]
        result[0, k] = q[13]
        result[1, k] = v[13]
        result[2, k] = np.linalg.solve(jacobian, gamma)[13]
    return result


def initial_state(p: Press) -> Array:
    """Return positions and velocities at t = 0, shape (30,)."""
    x, angle, vx, omega = p.start
    q = closure(p, 0.0, x, np.zeros(2))
    q[14] = angle
    _, jacobian, rate, _ = constraints(p, 0.0, q, np.zeros(15))
    rate[13:] = -vx, -omega
    return np.concatenate([q, np.linalg.solve(jacobian, -rate)])


@cache
def bound(name: str) -> float:
    """Return the largest error of y, m, that the clearance of a scene leaves to rigid bodies."""
    scene = load_scene(name)
    pin = 0.0 if scene.data["joints"]["crank_pin"] == "ideal" else scene.data["clearance"]["crank_pin"]
    p, times = press(scene), np.linspace(0.0, scene.period, 721)
    turns = np.linspace(0.0, 2 * np.pi, 73)[:-1]
    positions = [(p.lines[1], pin * np.array([cos(a), sin(a)])) for a in turns]
    if not pin:
        positions = [(p.lines[0] + side * p.half[2], np.zeros(2)) for side in (-1, 1)]
    y = [[closure(p, t, *each)[13] for t in times] for each in positions]
    return float(np.abs(np.array(y) - ideal(p, times)[0]).max())


# ---- runs


def integrate(p: Press, setting: Setting, times: Array) -> tuple[Array, Array]:
    """Return times (s) of samples and accepted steps, and `CHANNELS` there, shape (5, n).

    The impact speed of a corner is its speed at the last accepted step outside its wall, or, with ``inside``,
    at the first call of the right-hand side in which it is inside; at least the floor. `ArithmeticError` if
    the integrator gives up.
    """
    state = initial_state(p)
    memory = np.zeros(4)

    def rates(t: float, states: Array) -> Array:
        return np.asarray(derivative(p, t, states, setting.gain, memory, setting.inside))

    def remember(state: Array) -> None:
        at = corners(p, state[:15], state[15:])
        open_ = (at[:, 0] <= 0.0) | (memory == 0.0)  # or inside from the start on
        memory[open_] = np.maximum(at[open_, 1], p.contact[3])

    if not setting.inside:
        remember(state)
    solver = BDF(rates, 0.0, state, times[-1], rtol=setting.relative, atol=setting.absolute, vectorized=True)
    at, samples = [], []
    while solver.status == "running":
        if message := solver.step():
            raise ArithmeticError(message)
        within = times[(times > solver.t_old) & (times < solver.t)]
        instants = np.append(within, solver.t)
        states = np.column_stack([solver.dense_output()(within).reshape(30, -1), solver.y])
        ay = [
            derivative(p, t, states[:, k : k + 1], setting.gain, memory.copy(), setting.inside)[28, 0]
            for k, t in enumerate(instants)
        ]
        at.append(instants)
        samples.append(np.vstack([states[[12, 13, 27, 28]], ay]))
        if not setting.inside:
            remember(solver.y)
    return np.concatenate(at), np.hstack(samples)


@dataclass(frozen=True)
class Run(Task):
    """Two cycles of a condition at a setting."""

    scene: Scene
    setting: Setting
    draw: int  # by so many bits of the absolute tolerance
    samples: int  # a cycle
    models = ()


def measure_run(task: Run, progress: Progress) -> Row:
    """Return ``values``: id -> reading of the run, signed, peaks those of the second cycle."""
    del progress
    p, period = press(task.scene), task.scene.period
    times: Array = np.linspace(0.0, 2 * period, 2 * task.samples + 1)[1:]
    bits = task.setting.absolute * (1.0 + task.draw * np.finfo(np.float64).eps)
    at, run = integrate(p, task.setting._replace(absolute=bits), times)
    exact, first = ideal(p, at), ideal(p, np.zeros(1))
    motion = {"slider_x": p.lines[1], "slider_vx": 0.0, **dict(zip(QUANTITIES.values(), exact, strict=True))}
    origins = {"start": {"slider_x": p.lines[1], "slider_y": first[0, 0]}, "nothing": {}, "motion": motion}
    values, rows = {}, numbers()
    for name, quantity in rows.loc[rows["scene"] == task.scene.name, "quantity"].items():
        if channel := PEAKS.get(quantity):
            error = np.where(at >= period * (1 - 1e-9), run[CHANNELS[channel]] - motion[channel], 0.0)
            values[name] = float(error[np.abs(error).argmax()])
        elif quantity.startswith("range_"):
            kind, _, end = quantity.rpartition("_")
            channel, origin = RANGES[kind]
            deviation = run[CHANNELS[channel]] - origins[origin].get(channel, 0.0)
            values[name] = float(deviation.max() if end == "high" else deviation.min())
    return {"values": values}


class Config(NamedTuple):
    """Settings and conditions of the runs."""

    scenes: Sequence[str]
    tolerances: Sequence[tuple[float, float]]  # relative, absolute
    gains: Sequence[float]
    draws: int  # of each setting at `DEFAULTS`; one of any other
    samples: int  # a cycle


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Return a row a run and printed number of it: ``id``, `Setting`, ``default``, ``draw``, ``value``."""
    tasks = [
        Run(load_scene(name), Setting(*pair, gain, inside), draw, config.samples)
        for name, pair, gain, inside in product(config.scenes, config.tolerances, config.gains, (False, True))
        for draw in range(config.draws if pair in DEFAULTS else 1)
    ]
    rows = []
    results = measure_all(measure_run, tasks, on_processes(n_jobs, LIMIT), on_progress)
    for task, row in zip(tasks, results, strict=True):
        head = {"scene": task.scene.name, **task.setting._asdict(), "default": task.setting[:2] in DEFAULTS}
        head |= {"draw": task.draw, "status": row["status"]}
        for name, value in row.get("values", {"": np.nan}).items():
            rows.append({"id": name, **head, "value": value})
    return pd.DataFrame(rows)


def u_d(runs: pd.DataFrame, converged: Mapping[str, float]) -> dict[str, float]:
    """Return by id the solver's relative error of a size at `DEFAULTS`, stabilized.

    It is the bound of |size / converged size - 1| in 95 % of the runs.
    """
    runs = runs[runs["default"] & (runs["gain"] > 0)].dropna(subset=["value"])
    miss = (runs["value"].abs() / runs["id"].map(converged) - 1.0).abs()
    return {str(key): float(share) for key, share in miss.groupby(runs["id"]).quantile(DATA["level"]).items()}
