"""A linkage that a scene states body by body: its lists, its start, its settings."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import CORNERS
from exudyn_model.five_bodies.balance import Constraints, Motion, constraints
from exudyn_model.five_bodies.contact import ANGLE, FRAME, PER_BODY, Y
from exudyn_model.five_bodies.settings import ROUND_OFF, Settings
from exudyn_model.five_bodies.system import (
    Body,
    Drive,
    JournalContact,
    Pin,
    SliderContact,
    Spring,
    System,
    Torque,
    TurnedGuide,
    ends,
)
from exudyn_model.laws import HERTZ, IMPACT, LAWS
from exudyn_model.parameters import METHODS, USUAL, compliance_of, contact_law, journal_law, read_load
from exudyn_model.workpiece import workpiece_array, workpiece_force

Array = NDArray[np.float64]

_POSITIONS, _RATES = ("x", "y", "angle_deg"), ("vx", "vy", "omega")
# Singular values of the constraints' Jacobian below this share of the largest one count as 0
_RANK = 1e-8
_ITERATIONS = 200
# Steps in a cycle of a drive by speed, whose errors do not add up, and in any other run
_STEPS_IN_CYCLE, _STEPS_IN_RUN = 50_000, 100_000


@dataclass(frozen=True)
class Linkage:
    """A linkage in its start."""

    system: System
    names: list[str]  # Of the bodies
    # Of all pins and guides, with clearance or without
    pins: list[str]
    guides: list[str]
    size: float  # The largest distance of two points of a body, m
    groups: list[str]  # Of channels
    settings: Settings
    forces: dict[str, float]  # Of the workpiece, if there is one: "load_at_start", N


def read_linkage(scene: Mapping[str, Any]) -> Linkage:
    """Read and assemble a scene with a table ``body``.

    Raises
    ------
    ValueError
        If this model does not simulate it; one line that begins with the key.
    """
    bodies = scene["body"]
    numbers = {"frame": FRAME} | {name: number for number, name in enumerate(bodies)}

    def point(body: str, at: Any) -> tuple[int, tuple[float, float]]:
        """Return the number of a body, and a point of its own frame from its centroid, m."""
        origin = (0.0, 0.0) if body == "frame" else bodies[body]["centroid"]
        return numbers[body], (float(at[0] - origin[0]), float(at[1] - origin[1]))

    def ends_of(table: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return numbers and points of the bodies that a pin or a spring joins."""
        parts: tuple[Any, ...] = ()
        for body, _, name in (join.partition(".") for join in table["joins"]):
            default = table.get("point", (0.0, 0.0))
            sites = {} if body == "frame" else {"centroid": bodies[body]["centroid"]} | bodies[body]["points"]
            parts += point(body, sites.get(name, default))
        return parts

    guides = []
    for name, table in scene.get("guide", {}).items():
        line = table.get("direction_deg", 0.0)
        angles = math.radians(line), math.radians(table.get("angle_deg", line))
        on = point(table.get("on", "frame"), table.get("point", (0.0, 0.0)))
        guides.append(TurnedGuide(name, numbers[table["body"]], *on, *angles))
    springs = [
        Spring(
            name, *ends_of(table), *(float(table.get(key, 0.0)) for key in ("stiffness", "length", "damping"))
        )
        for name, table in scene.get("spring", {}).items()
    ]
    load = read_load(scene) if scene.get("load") else None
    rest = (0.0, 0.0, 0.0)
    system = System(
        [Body(float(table["mass"]), float(table["inertia"]), rest, rest) for table in bodies.values()],
        [Pin(name, *ends_of(table)) for name, table in scene.get("pin", {}).items()],
        guides=[],
        contacts=[],
        drive=_drive(scene.get("drive", {}), numbers),
        observed=numbers[scene["load"]["body"]] if load is not None else 0,
        gravity=float(scene.get("environment", {}).get("gravity", 0.0)),
        load=load,
        turned_guides=guides,
        springs=springs,
    )
    shapes = [[*table["points"].values(), table["centroid"]] for table in bodies.values()]
    size = max(math.dist(a, b) for shape in shapes for a in shape for b in shape) or 1.0
    clearances = scene.get("clearance", {})
    system = _assemble(system, numbers, scene, size)
    forces, joints = _forces(system), ([pin.name for pin in system.pins], [guide.name for guide in guides])
    system = _loosen(system, clearances)
    settings = _settings(scene, system, size)
    return Linkage(system, [*bodies], *joints, size, scene["output"]["groups"], settings, forces)


def _loosen(system: System, clearances: Mapping[str, Any]) -> System:
    """Return the system with contacts in the place of pins and guides that have clearance."""
    contacts: list[SliderContact | JournalContact] = []
    pins = {pin.name: pin for pin in system.pins}
    guides = {guide.name: guide for guide in system.turned_guides}
    for name, table in clearances.items():
        size, law = float(table["size"]), table["contact"]["law"]
        if law not in (LAWS[HERTZ], LAWS[IMPACT]):
            raise ValueError(f"clearance.{name}.contact.law = {law!r} is the press's; use {LAWS[HERTZ]!r}")
        if name in pins:
            law = journal_law(table, size, float(table["journal_radius"]))
            contacts.append(JournalContact(*pins.pop(name), law, (name,)))
        else:
            law = contact_law(
                table,
                law,
                table["corner_radius"],
                2 * compliance_of(table, "guide"),
                clearance=size,
                half_width=table["width"] / 2,
                half_length=table["length"] / 2,
            )
            _, body, on, point, line, angle = guides.pop(name)
            across, rows = line - math.pi / 2, tuple(f"{name}.{corner}" for corner in CORNERS)
            contacts.append(SliderContact(body, point, across, law, on, angle - across, rows))
    return replace(system, pins=[*pins.values()], turned_guides=[*guides.values()], contacts=contacts)


def _offsets(system: System, clearances: Mapping[str, Any]) -> Array:
    """Return the values of the constraints and of their rates at the start: 0 without clearance."""
    values: list[tuple[float, float]] = []
    for pin in system.pins:
        table = clearances.get(pin.name, {})
        pairs = zip(table.get("offset", (0.0, 0.0)), table.get("offset_rate", (0.0, 0.0)), strict=True)
        values += [(-offset, -rate) for offset, rate in pairs]
    values += [(0.0, 0.0)] * len(system.prescribed)
    for guide in system.turned_guides:
        table = clearances.get(guide.name, {})
        values.append((-table.get("offset", 0.0), -table.get("offset_rate", 0.0)))
        values.append((math.radians(table.get("tilt_deg", 0.0)), table.get("tilt_rate", 0.0)))
    return np.array(values).reshape(-1, 2).T


def _drive(table: Mapping[str, Any], numbers: Mapping[str, int]) -> Drive | Torque | None:
    if table.get("speed_rpm"):
        return Drive(numbers[table["body"]], float(table["speed_rpm"]) * math.pi / 30)
    rows = np.array(table.get("torque_table") or [(0.0, table.get("torque") or 0.0)], float)
    return Torque(numbers[table["body"]], rows * [math.pi / 180, 1.0]) if rows[:, 1].any() else None


def _forces(system: System) -> dict[str, float]:
    """Return the workpiece's force at the start, and refuse springs without a direction."""
    start = np.array([body.position for body in system.bodies]).reshape(-1, 1)
    motion = Motion(system, start, 0.0 * start)
    for spring in system.springs:
        (x, y, *_), (other_x, other_y, *_) = (motion.point(*end) for end in ends(spring))
        if spring.length > 0.0 and not np.hypot(x - other_x, y - other_y) > 0.0:
            raise ValueError(f"spring.{spring.name}: its points coincide at the start, without a direction")
    if system.load is None:
        return {}
    force = workpiece_force(system.bodies[system.observed].position[Y], workpiece_array(system.load))[0]
    if not math.isfinite(force):
        raise ValueError(f"load.surface = {system.load.surface} m: its force overflows at the start")
    return {"load_at_start": force}


def jacobian(joints: Constraints, state: int, coordinates: int, size: float) -> Array:
    """Return the constraints' Jacobian in one state, with lengths in units of ``size`` (m)."""
    matrix = np.zeros((len(joints.rows), coordinates))
    for target, row in zip(matrix, joints.rows, strict=True):
        for coordinate, value in row.items():
            target[coordinate] = value[state] if np.ndim(value) else value
        if any(coordinate % PER_BODY != ANGLE for coordinate in row):
            target[ANGLE::PER_BODY] /= size
    return matrix


def _assemble(system: System, numbers: Mapping[str, int], scene: Mapping[str, Any], size: float) -> System:
    """Return the system with positions and rates that meet the constraints and the given initial values."""

    def read(table: str, keys: tuple[str, ...]) -> dict[int, float]:
        return {
            PER_BODY * numbers[name] + k: math.radians(values[key]) if key == "angle_deg" else values[key]
            for name, values in scene.get(table, {}).items()
            for k, key in enumerate(keys)
            if values.get(key) is not None
        }

    count, positions, rates = 3 * len(system.bodies), read("initial", _POSITIONS), read("initial", _RATES)
    driven = PER_BODY * system.drive.body + ANGLE if isinstance(system.drive, Drive) else -1
    if driven >= 0:
        positions.setdefault(driven, 0.0)
    starts = read("guess", _POSITIONS) | positions
    q = np.array([starts.get(coordinate, 0.0) for coordinate in range(count)])
    others = {coordinate: value for coordinate, value in positions.items() if coordinate != driven}
    # A linkage with too many given values cannot be assembled either: their number is reported first
    system = _with_start(system, q, 0.0 * q)
    offsets, offset_rates = _offsets(system, scene.get("clearance", {}))
    solution = _newton(system, q, offsets, others, size)
    refusal = ValueError(
        "guess: the linkage cannot be assembled from [initial], where the angle of a driven body is 0 by "
        "default, and [guess]"
    )
    closure = _newton(system, q, offsets, {}, size) if solution is None else solution
    if closure is None:
        raise refusal
    q = closure
    joints = constraints(system, np.zeros(1), q[:, None], 0.0 * q[:, None])
    matrix, unit = jacobian(joints, 0, count, size), np.eye(count)
    free = count - len(matrix)
    if surplus := len(matrix) - _rank(matrix):
        raise ValueError(
            f"pin: too many constraints, or a singular position: {surplus} of {len(matrix)} rows of the "
            "constraints are dependent at the start"
        )
    at_rest = not rates and driven < 0
    if len(others) != free or not (len(rates) == free or at_rest):
        counts = free + (driven >= 0), free, len(positions), len(rates)
        names = 2 * ["position", "rate"]
        texts = [f"{n} {name}{'s' * (n != 1)}" for n, name in zip(counts, names, strict=True)]
        rest = "" if driven >= 0 or not free else ", or no rate at rest"
        raise ValueError(
            "initial: the linkage needs {} and {}{}; {} and {} are given".format(*texts[:2], rest, *texts[2:])
        )
    if solution is None:
        raise refusal
    for name, targets in (("positions", others), ("rates", rates)):
        if targets and _rank(np.vstack([matrix, unit[[*targets]]])) < count:
            raise ValueError(f"initial: the given {name} do not determine the linkage's start")
    v = np.zeros(count)
    if at_rest and offset_rates.any():
        at_rest, rates = False, dict.fromkeys(others, 0.0)
    if not at_rest:
        rows = np.vstack([jacobian(joints, 0, count, 1.0), unit[[*rates]]])
        v = np.linalg.solve(rows, [*(offset_rates - joints.rates[:, 0]), *rates.values()])
    return _with_start(system, q, v)


def _rank(matrix: Array) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.count_nonzero(values > _RANK * values.max(initial=0.0)))


def _with_start(system: System, q: Array, v: Array) -> System:
    states = zip(system.bodies, q.reshape(-1, 3).tolist(), v.reshape(-1, 3).tolist(), strict=True)
    return replace(system, bodies=[body._replace(position=at, velocity=rate) for body, at, rate in states])


def _newton(system: System, q: Array, offsets: Array, targets: dict[int, float], size: float) -> Array | None:
    """Solve for all coordinates; None: without success.

    The constraints are to have the values ``offsets``, some coordinates those of ``targets``. Rows may be
    dependent: only the rank shows it. Angles change by half a radian at most.
    """
    q, last, scales = q.copy(), math.inf, np.where(np.arange(q.size) % PER_BODY == ANGLE, 1.0, size)
    for _ in range(_ITERATIONS):
        joints = constraints(system, np.zeros(1), q[:, None], 0.0 * q[:, None])
        gaps = np.append(joints.gaps[:, 0] - offsets, q[[*targets]] - [*targets.values()])
        largest = float(np.abs(gaps).max(initial=0.0))
        if not largest < 0.5 * last and largest <= 1e-12 * size:  # as exact as rounding permits
            return q
        last = largest
        rows = np.vstack([jacobian(joints, 0, q.size, 1.0), np.eye(q.size)[[*targets]]]) * scales
        change = np.linalg.lstsq(rows, -gaps, rcond=None)[0]
        q += scales * change / max(1.0, 2.0 * float(np.abs(change[ANGLE::PER_BODY]).max()))
    return None


def _settings(scene: Mapping[str, Any], system: System, size: float) -> Settings:
    """Choose the settings of a run; at equal steps the trapezoidal rule errs half as much as the other."""
    defaults = {"formulation": "full", "method": "trapezoidal-index2", "tolerance": 1e-7}
    journals, flights = bool(system.journals), bool(system.contacts)
    solver = defaults | {key: value for key, value in scene["solver"]["exudyn"].items() if value != "auto"}
    output, drive = scene["output"], system.drive
    for key, options in (("formulation", ["full"]), ("method", METHODS["full"])):
        if solver[key] not in options:
            raise ValueError(f"solver.exudyn.{key} = {solver[key]!r} is the press's; use {defaults[key]!r}")
    if isinstance(drive, Drive):
        period, per_period = 2.0 * math.pi / abs(drive.omega), output.get("samples_per_cycle", 1000)
        samples, step = round(scene["drive"].get("cycles", 1) * per_period), period / _STEPS_IN_CYCLE
    else:
        period, samples = float(output["duration"]), output.get("samples", 1000)
        per_period, step = samples, period / _STEPS_IN_RUN
    if flights:  # steps in contacts
        step = min(step, USUAL["full"]["step"])
    ticks = max(1, math.ceil(period / per_period / solver.get("step", step) * (1 - 1e-12)))
    tick = period / per_period / ticks
    # A measure of the forces, of which the round-off limits Newton's method
    spin = max(abs(body.velocity[ANGLE]) for body in system.bodies)
    force = (spin**2 * size + abs(system.gravity)) * math.fsum(body.mass for body in system.bodies)
    force += math.fsum(spring.stiffness * max(spring.length, size) for spring in system.springs)
    force += float(np.abs(drive.table[:, 1]).max()) / size if isinstance(drive, Torque) else 0.0
    # Rows in m/s, whose error over the step is one of accelerations: 1e-5 m/s^2, and in contacts 5e-5 m/s^2
    per_step = tick / (2e-3 if flights else 0.01) if solver["method"] == defaults["method"] else 1.0
    # In some contacts a journal's stiffness times a coordinate rounds to 1e-9 N, spread over all rows
    least = max(ROUND_OFF * force, 2e-10 if journals else 0.0)
    return Settings(
        method=solver["method"],
        sample_interval=period / per_period,
        samples=samples,
        period=period,
        energy=True,
        per_sample=ticks,
        per_state=ticks,
        fixed=not flights,
        tolerance=max(float(solver["tolerance"]) * per_step, least),
        jacobian_uses=8 if journals else 2 if flights else 3,
        differentiation_step=1e-7,
    )
