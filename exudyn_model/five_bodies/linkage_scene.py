"""A linkage that a scene states body by body: its lists, its start, its settings.

Lengths are scaled by the largest of the linkage wherever the rank of its constraints is asked for.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.balance import Constraints, constraints
from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY, Y
from exudyn_model.five_bodies.settings import ROUND_OFF, Settings
from exudyn_model.five_bodies.system import Body, Drive, Pin, Spring, System, Torque, TurnedGuide
from exudyn_model.parameters import METHODS, read_load
from exudyn_model.workpiece import workpiece_array, workpiece_force

Array = NDArray[np.float64]

POSITIONS, RATES = ("x", "y", "angle_deg"), ("vx", "vy", "omega")
# Singular values of the constraints' Jacobian below this share of the largest one count as 0
_RANK = 1e-8
_ITERATIONS = 200
# Steps in a cycle of the drive or in the whole run, where the scene states none: second order leaves some 1e-9
_USUAL_STEPS = 100_000


@dataclass(frozen=True)
class Linkage:
    """A linkage in its start."""

    system: System
    names: list[str]  # Of the bodies
    size: float  # Its largest length, m
    groups: list[str]  # Of channels
    settings: Settings
    requested: dict[str, Any]  # The scene's choice of method, step and tolerance


def read_linkage(scene: Mapping[str, Any]) -> Linkage:
    """Read and assemble a scene with a table ``body``.

    Raises
    ------
    ValueError
        If this model does not simulate it; one line that begins with the key.
    """
    names, tables = list(scene["body"]), scene["body"]
    centroids = [np.array(table["centroid"], float) for table in tables.values()]
    own = [{name: np.subtract(at, c) for name, at in table["points"].items()} | {"centroid": 0.0 * c}
           for table, c in zip(tables.values(), centroids, strict=True)]  # fmt: skip

    def number(name: str) -> int:
        return FRAME if name == "frame" else names.index(name)

    def point(body: int, at: Any) -> tuple[float, float]:
        x, y = np.array(at, float) if body == FRAME else np.subtract(at, centroids[body])
        return float(x), float(y)

    def ends(table: Mapping[str, Any]) -> tuple[Any, ...]:
        bodies = [join.partition(".") for join in table["joins"]]
        return tuple(
            part
            for name, _, at in bodies
            for body in [number(name)]
            for part in (
                body,
                tuple(map(float, table.get("point", (0, 0)) if body == FRAME else own[body][at])),
            )
        )

    drive = scene.get("drive", {})
    guides = []
    for name, table in scene.get("guide", {}).items():
        on, line = number(table.get("on", "frame")), float(table.get("direction_deg", 0.0))
        angles = math.radians(line), math.radians(table.get("angle_deg", line))
        guides.append(TurnedGuide(name, number(table["body"]), on, point(on, table["point"]), *angles))
    springs = [
        Spring(
            name, *ends(table), *(float(table.get(key, 0.0)) for key in ("stiffness", "length", "damping"))
        )
        for name, table in scene.get("spring", {}).items()
    ]
    load = read_load(scene) if "load" in scene else None
    system = System(
        [Body(float(t["mass"]), float(t["inertia"]), (0.0,) * 3, (0.0,) * 3) for t in tables.values()],
        [Pin(name, *ends(table)) for name, table in scene.get("pin", {}).items()],
        [],
        [],
        _drive(drive, names),
        number(scene["load"]["body"]) if load else 0,
        float(scene.get("environment", {}).get("gravity", 0.0)),
        load,
        guides,
        springs,
    )
    size = max(
        (math.dist(a, b) for points in own for a in points.values() for b in points.values()), default=0
    )
    system = _assembled(system, names, scene, size or 1.0)
    requested, settings = _settings(scene, system, size or 1.0)
    return Linkage(system, names, size or 1.0, list(scene["output"]["groups"]), settings, requested)


def _drive(table: Mapping[str, Any], names: list[str]) -> Drive | Torque | None:
    body = names.index(table["body"]) if "body" in table else FRAME
    if table.get("speed_rpm") is not None:
        return Drive(body, float(table["speed_rpm"]) * math.pi / 30)
    rows = np.array(table.get("torque_table") or [(0.0, table.get("torque") or 0.0)], float)
    return None if not rows.any() else Torque(body, rows * [math.pi / 180, 1.0])


def scaled(joints: Constraints, state: int, coordinates: int, size: float) -> Array:
    """Return the constraints' Jacobian in one state, with lengths in units of ``size`` (m)."""
    matrix = np.zeros((len(joints.rows), coordinates))
    for k, row in enumerate(joints.rows):
        for coordinate, value in row.items():
            matrix[k, coordinate] = value if np.ndim(value) == 0 else value[state]
        if row.keys() - set(range(ANGLE, coordinates, PER_BODY)):
            matrix[k, ANGLE::PER_BODY] /= size
    return matrix


def _assembled(system: System, names: list[str], scene: Mapping[str, Any], size: float) -> System:
    """Return the system with positions and rates that meet the constraints and the given initial values."""
    count, drive = PER_BODY * len(names), system.drive
    given: dict[str, dict[int, float]] = {}
    for table in ("initial", "guess"):
        given[table] = {
            PER_BODY * names.index(name) + k: math.radians(values[key]) if key == "angle_deg" else values[key]
            for name, values in scene.get(table, {}).items()
            for k, key in enumerate(POSITIONS)
            if values.get(key) is not None
        }
    rates = {
        PER_BODY * names.index(name) + k: float(values[key])
        for name, values in scene.get("initial", {}).items()
        for k, key in enumerate(RATES)
        if values.get(key) is not None
    }
    fixed = dict(given["initial"])
    if isinstance(drive, Drive):
        fixed.setdefault(PER_BODY * drive.body + ANGLE, 0.0)
    q = _walk(system, fixed, given["guess"])
    system = _started(system, q, np.zeros(count))
    driven = PER_BODY * drive.body + ANGLE if isinstance(drive, Drive) else -1
    others = [coordinate for coordinate in fixed if coordinate != driven]
    values = np.array([fixed[coordinate] for coordinate in others])
    scales = np.where(np.arange(count) % PER_BODY == ANGLE, 1.0, size)
    closed = _newton(system, q, others, values, scales)
    if closed is None:  # perhaps for too many given values, of which their number says
        closed = _newton(system, q, [], values[:0], scales)
    if closed is None:
        raise ValueError("body: the linkage cannot be assembled from these initial values and guesses")
    joints = constraints(system, np.zeros(1), closed[:, None], 0.0 * closed[:, None])
    matrix = scaled(joints, 0, count, size)
    dependent = len(matrix) - _rank(matrix)
    if dependent:
        raise ValueError(
            f"body: too many constraints: {dependent} of {len(matrix)} rows are dependent at the start"
        )
    free = count - len(matrix)
    needed, stated = (free + (driven >= 0), free), (len(fixed), len(rates))
    at_rest = not rates and driven < 0
    if stated[0] != needed[0] or (stated[1] != needed[1] and not at_rest):
        raise ValueError(
            f"initial: the linkage needs {_count(needed[0], 'position')} and {_count(needed[1], 'rate')}, "
            f"{_count(stated[0], 'position')} and {_count(stated[1], 'rate')} are given"
        )
    for key, chosen in (("position", others), ("rate", list(rates))):
        if len(chosen) == free and _rank(np.vstack([matrix, np.eye(count)[chosen]])) < count:
            raise ValueError(f"initial: the given {key}s do not determine the linkage's start")
    v = np.zeros(count)
    required = np.array([rate for _, _, rate in system.prescribed])
    known = np.concatenate(
        [np.zeros(2 * len(system.pins)), required, np.zeros(2 * len(system.turned_guides))]
    )
    if not at_rest:
        joints = constraints(system, np.zeros(1), closed[:, None], v[:, None])
        rows = np.vstack([scaled(joints, 0, count, 1.0), np.eye(count)[list(rates)]])
        v = np.linalg.solve(rows, np.concatenate([known, list(rates.values())]))
    if isinstance(drive, Drive):
        closed[driven] = fixed[driven]
    return _started(system, closed, v)


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'' if number == 1 else 's'}"


def _rank(matrix: Array) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.count_nonzero(values > _RANK * max(values, default=0.0)))


def _started(system: System, q: Array, v: Array) -> System:
    motion = zip(
        system.bodies, q.reshape(-1, PER_BODY).tolist(), v.reshape(-1, PER_BODY).tolist(), strict=True
    )
    return replace(system, bodies=[Body(b.mass, b.inertia, tuple(at), tuple(rate)) for b, at, rate in motion])


def _walk(system: System, fixed: dict[int, float], guess: dict[int, float]) -> Array:
    """Return the coordinates from which Newton's method starts: pins walked from the frame."""
    stated = guess | fixed
    q = np.array([stated.get(k, 0.0) for k in range(PER_BODY * len(system.bodies))], float)
    placed = {FRAME} | {
        k for k in range(len(system.bodies)) if {PER_BODY * k, PER_BODY * k + Y} <= stated.keys()
    }

    def arm(body: int, point: tuple[float, float]) -> Array:
        angle = 0.0 if body == FRAME else q[PER_BODY * body + ANGLE]
        (x, y), c, s = point, math.cos(angle), math.sin(angle)
        centre = (0.0, 0.0) if body == FRAME else q[PER_BODY * body : PER_BODY * body + ANGLE]
        return np.array([c * x - s * y, s * x + c * y]) + centre

    for _ in system.bodies:
        for pin in system.pins:
            ends = [(pin.first, pin.first_point), (pin.second, pin.second_point)]
            known, new = sorted(ends, key=lambda end: end[0] not in placed)
            if known[0] in placed and new[0] not in placed:
                first = PER_BODY * new[0]
                there = q[first : first + ANGLE] + arm(*known) - arm(*new)
                for k in range(ANGLE):
                    q[first + k] = stated.get(first + k, there[k])
                placed.add(new[0])
    return q


def _newton(system: System, q: Array, chosen: list[int], values: Array, scales: Array) -> Array | None:
    """Solve the constraints, and the chosen coordinates' values, for all coordinates; None: without success."""
    q, size, last = q.copy(), float(scales.max()), math.inf
    for _ in range(_ITERATIONS):
        joints = constraints(system, np.zeros(1), q[:, None], 0.0 * q[:, None])
        gaps = np.concatenate([joints.gaps[:, 0], q[chosen] - values])
        largest = float(np.abs(gaps).max(initial=0.0))
        if largest <= 1e-12 * size and not largest < 0.5 * last:  # as exact as rounding permits
            return q
        last = largest
        rows = np.vstack([scaled(joints, 0, q.size, 1.0), np.eye(q.size)[chosen]]) * scales
        change = np.linalg.lstsq(rows, -gaps, rcond=None)[0]
        q += scales * change / max(1.0, 2.0 * float(np.abs(change).max(initial=0.0)))
    return None


def _settings(scene: Mapping[str, Any], system: System, size: float) -> tuple[dict[str, Any], Settings]:
    """Return the scene's choice of the solver, and the settings of a run."""
    given = {key: value for key, value in scene["solver"]["exudyn"].items() if value != "auto"}
    output, drive = scene["output"], system.drive
    if given.get("formulation", "full") != "full":
        raise ValueError(
            f"solver.exudyn.formulation = {given['formulation']!r} is the press's; use 'full' for a linkage"
        )
    method = given.get("method", "trapezoidal-index2")
    if method not in METHODS["full"]:
        raise ValueError(
            f"solver.exudyn.method = {method!r} does not integrate solver.exudyn.formulation = 'full'; use "
            "'trapezoidal-index2'"
        )
    reactions = [group for group in output["groups"] if group in ("joints", "energy")]
    if reactions and method != "trapezoidal-index2":
        raise ValueError(
            f"output.groups = {reactions[0]!r} is not given by solver.exudyn.method = {method!r}; use "
            "'trapezoidal-index2'"
        )
    if isinstance(drive, Drive):
        period = 2.0 * math.pi / abs(drive.omega)
        samples, interval = (
            round(scene["drive"]["cycles"] * output.get("samples_per_cycle", 1000)),
            period / output.get("samples_per_cycle", 1000),
        )
    else:
        period, samples = float(output["duration"]), int(output.get("samples", 1000))
        interval = period / samples
    step = float(given.get("step", period / _USUAL_STEPS))
    ticks = max(1, math.ceil(interval / step * (1 - 1e-12)))
    tolerance = float(given.get("tolerance", 1e-7))
    settings = Settings(
        method=method, sample_interval=interval, samples=samples, period=period, energy=True, per_sample=ticks,
        per_state=ticks, fixed=True, tolerance=_newton_tolerance(tolerance, interval / ticks, method, system, size),
        jacobian_uses=2, differentiation_step=1e-7,
    )  # fmt: skip
    return {"formulation": "full", "method": method, "step": step, "tolerance": tolerance}, settings


def _newton_tolerance(tolerance: float, step: float, method: str, system: System, size: float) -> float:
    """Return the tolerance of Newton's method as `five_bodies.settings` does, with the linkage's own forces."""
    speeds = np.abs([body.velocity for body in system.bodies])
    fastest = float(speeds[:, ANGLE].max()) ** 2 * size + abs(system.gravity)
    force = fastest * math.fsum(body.mass for body in system.bodies)
    force += math.fsum(spring.stiffness * max(spring.length, size) for spring in system.springs)
    if isinstance(system.drive, Torque):
        force += float(np.abs(system.drive.table[:, 1]).max()) / size
    if method == "trapezoidal-index2":
        tolerance *= step / 0.1
    return max(tolerance, ROUND_OFF * force)


def load_at_start(linkage: Linkage) -> dict[str, float]:
    """Return the workpiece's force at the start as ``load_at_start``, N; nothing without a workpiece.

    Raises
    ------
    ValueError
        If it is not finite.
    """
    system = linkage.system
    if system.load is None:
        return {}
    height = system.bodies[system.observed].position[Y]
    force = float(workpiece_force(height, workpiece_array(system.load))[0])
    if not math.isfinite(force):
        raise ValueError(
            f"load.surface = {system.load.surface} m: the workpiece's force overflows at the start"
        )
    return {"load_at_start": force}
