"""Any planar linkage of bodies, pins, guides, springs and clearances: its lists, its start."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from reference_model.linkage import Array
from reference_model.multiplier import FRAME, GuideOf, Linkage, PinOf, assemble, drift
from reference_model.parameters import Contact, read_clearance, read_load, require_known, require_tolerance
from reference_model.state import contact_list
from reference_model.workpiece import NO_LOAD, Load

GROUPS = ("accelerations", "contacts", "joints", "energy")
_PLACE = ("x", "y", "angle_deg")
_RANK = 1e-8
"""Smallest singular value of independent rows, relative to the largest."""
_ASSEMBLED = 1e-12
"""Largest |Phi| at the start, relative to the size of the linkage."""


class Assembly(NamedTuple):
    """A linkage at t = 0."""

    model: Linkage
    units: Array
    """Unit of a coordinate by that of a row, the linkage's size (m) or 1 for angles, shape (rows, 3 n)."""
    start: Array
    """Coordinates and rates, shape (6 n,)."""
    smallest: float
    """Smallest singular value of the Jacobian in these units."""
    size: float
    """Largest length of a body, m."""
    contacts: dict[str, Contact]
    """Contacts of the clearances by name."""

    def sigma(self, jacobians: Array) -> Any:
        """Return the smallest singular value of Jacobians (..., rows, 3 n), relative to the start's."""
        return np.linalg.svd(jacobians * self.units, compute_uv=False)[..., -1] / self.smallest

    @property
    def formulation(self) -> str:
        """Formulation, as `plan` and the provenance name it."""
        rows, columns = self.units.shape
        return f"multiplier ({columns} coordinates, {rows} multipliers)"


def jacobian(model: Linkage, q: Array) -> Array:
    """Return the constraints' Jacobian at coordinates (3 n,), t = 0; the model's arrays are those of rest."""
    drift(model, np.zeros(1), np.concatenate([q, 0.0 * q])[None], np.empty((2, 1)))
    return model.jacobian[: model.rows]


def read_linkage(scene: Mapping[str, Any]) -> Assembly:
    """Read a linkage's scene and assemble it.

    Raises
    ------
    ValueError
        One line that names the key, if this model cannot simulate the scene. Names and ranges that the rules
        of `comparison.scene` forbid are not looked for.
    """
    solver, bodies, drive = scene["solver"]["reference"], scene["body"], scene.get("drive", {})
    require_known(
        ("solver.reference.formulation", solver.get("formulation", "auto"), ("auto", "multiplier")),
        ("solver.reference.method", solver["method"], ("dop853",)),
        *(("output.groups", group, GROUPS) for group in scene["output"]["groups"]),
    )
    require_tolerance(solver["tolerance"])
    numbers = {name: i for i, name in enumerate(bodies)} | {"frame": FRAME}
    centroids = {name: body["centroid"] for name, body in bodies.items()} | {"frame": (0.0, 0.0)}
    springs, load, clearances = scene.get("spring", {}), scene.get("load"), scene.get("clearance", {})
    pins, guides = dict[str, PinOf](), dict[str, GuideOf]()
    for key, joint in (scene.get("pin", {}) | springs).items():
        ends: list[Any] = []
        for name, _, at in (end.partition(".") for end in joint["joins"]):
            points = {"centroid": centroids[name], "": joint.get("point", (0.0, 0.0))}
            points |= bodies[name]["points"] if at else {}
            ends = [numbers[name], np.subtract(points[at], centroids[name]), *ends]
        pins[key] = tuple(ends)
    for key, guide in scene.get("guide", {}).items():
        on, direction = guide.get("on", "frame"), guide["direction_deg"]
        n = -math.sin(math.radians(direction)), math.cos(math.radians(direction))
        offset = float(np.dot(n, np.subtract(guide["point"], centroids[on])))
        angle = math.radians(guide.get("angle_deg", direction))
        guides[key] = numbers[guide["body"]], numbers[on], (*n, offset, angle)
    initial, driven = scene.get("initial", {}), drive.get("body") or "frame"
    theta0 = math.radians(initial.get(driven, {}).get("angle_deg", 0.0))
    degrees, torques = np.transpose(drive.get("torque_table") or [(0.0, drive.get("torque") or 0.0)])
    surface = 0.0 if len(torques) > 1 else -math.inf  # below which a load has kinks

    def build(loose: Mapping[str, Any], contacts: Mapping[str, Contact]) -> Linkage:
        return assemble(
            bodies=[(body["mass"], body["inertia"]) for body in bodies.values()],
            pins=[pin for name, pin in pins.items() if name not in loose],
            guides=[guide for name, guide in guides.items() if name not in loose],
            drive=(numbers[driven], (drive.get("speed_rpm") or 0.0) * 2.0 * math.pi / 60.0, theta0),
            gravity=scene["environment"]["gravity"],
            springs=[(one["stiffness"], one["length"], one.get("damping", 0.0)) for one in springs.values()],
            loose=[(pins | guides)[name] for name in loose],
        )._replace(
            contacts=contact_list(tuple(contacts.values())),
            load=read_load(load) if load else NO_LOAD,
            slider=numbers[load["body"]] if load else 0,
            torque=Load(surface, torques[0], 1.0, 0.0, np.radians(degrees), torques - torques[0]),
        )

    places = [[body["centroid"], *body["points"].values()] for body in bodies.values()]
    size = max(math.dist(a, b) for points in places for a in points for b in points) or 1.0
    start, contacts = _start(build({}, {}), size, scene), dict[str, Contact]()
    for name, clearance in clearances.items():
        contacts |= read_clearance(name, clearance, bodies[[*bodies][(pins | guides)[name][0]]])
    model = build(clearances, contacts)
    units, _ = _units(model, size)
    smallest = _singular(jacobian(model, start[: model.masses.size]) * units).min(initial=np.inf)
    return Assembly(model, units, start, smallest, size, contacts)


def _units(model: Linkage, size: float) -> tuple[Array, Array]:
    """Return `Assembly.units` and the units of rows, shape (rows,): with them all is of one magnitude."""
    speed, guides = int(model.omega != 0.0), model.ideal[1]
    units = np.array([size, size, 1.0] * (model.masses.size // 3))
    row_units = np.array([size] * (model.rows - speed - 2 * guides) + [1.0] * speed + [size, 1.0] * guides)
    return units / row_units[:, None], row_units


def _offsets(scene: Mapping[str, Any], rows: int) -> Array:
    """Return Phi and Phi' of ideal joints' rows at the start, shape (2, rows); raise as `read_linkage`."""
    pins, guides, out = [*scene.get("pin", {})], [*scene.get("guide", {})], np.zeros((2, rows))
    for name, start in scene.get("clearance", {}).items():
        if name in pins:
            row, values = 2 * pins.index(name), np.negative([start["offset"], start["offset_rate"]])
            reach = math.hypot(*start["offset"])
        else:
            row, tilt = rows - 2 * (len(guides) - guides.index(name)), math.radians(start["tilt_deg"])
            values = np.array([(start["offset"], tilt), (start["offset_rate"], start["tilt_rate"])])
            reach = start["length"] * abs(math.sin(tilt)) + start["width"] * (abs(math.cos(tilt)) - 1.0)
            reach = abs(start["offset"]) + 0.5 * reach
        if reach > start["size"]:
            raise ValueError(f"clearance.{name}: it is closed by {reach - start['size']:.2g} m at the start")
        out[:, row : row + 2] = values
    return out


def _values(scene: Mapping[str, Any], table: str, *keys: str) -> dict[int, float]:
    """Return the values of three keys by their index in q or q'; m, rad and s."""
    return {
        3 * [*scene["body"]].index(body) + k: math.radians(values[key]) if key == "angle_deg" else values[key]
        for body, values in scene.get(table, {}).items()
        for k, key in enumerate(keys)
        if key in values
    }


def _start(model: Linkage, size: float, scene: Mapping[str, Any]) -> Array:
    """Close the linkage by Newton's method, solve for the rates, return both; raise as `read_linkage`.

    All joints of `model` are ideal, except for the offsets of clearances.
    """
    rows, columns, turn = model.rows, model.masses.size, 3 * model.driven + 2
    positions, rates = _values(scene, "initial", *_PLACE), _values(scene, "initial", "vx", "vy", "omega")
    q, v, by_speed, free = np.zeros(columns), np.zeros(columns), int(model.omega != 0.0), columns - rows
    by_default = by_speed and turn not in positions
    if by_speed:
        positions[turn] = model.theta0
    for k, value in (_values(scene, "guess", *_PLACE) | positions).items():
        q[k] = value
    units, identity, indices = np.array([size, size, 1.0] * (columns // 3)), np.eye(columns), [*positions]
    (ratio, row_units), (places, shifts) = _units(model, size), _offsets(scene, rows)
    # First with ideal joints: the guess chooses among their assemblies.
    for target in [0.0 * places, places] if places.any() else [places]:
        for _ in range(100):
            matrix = np.vstack([jacobian(model, q) * ratio, identity[indices]])
            errors = np.append(
                (model.phi[:rows] - target) / row_units, (q[indices] - [*positions.values()]) / units[indices]
            )
            error = float(np.abs(errors).max(initial=0.0))
            if error <= 0.01 * _ASSEMBLED or not math.isfinite(error):
                break
            step = np.linalg.lstsq(matrix, errors)[0]
            q -= units * step / max(1.0, np.abs(step[2::3]).max())
    n_dependent, assembled = rows - _rank(matrix[:rows]), error <= _ASSEMBLED
    if n_dependent and (assembled or free < 0):
        count = f"{n_dependent} of {rows} rows of the constraints are dependent at the start"
        raise ValueError(f"pin: too many constraints, or a singular position: {count}")
    at_rest = not by_speed and not rates
    if at_rest and shifts.any():  # of clearances, while the coordinates that are given rest
        at_rest, rates = False, dict.fromkeys(positions, 0.0)
    if len(positions) != free + by_speed or not (at_rest or len(rates) == free):
        needs, has = (f"{n} position{'s' * (n != 1)} and {m} rate{'s' * (m != 1)}"
                      for n, m in ((free + by_speed, free), (len(positions), len(rates))))  # fmt: skip
        rest = "" if by_speed or not free else ", or no rate at rest"
        raise ValueError(f"initial: this linkage needs {needs}{rest}, and has {has}")
    if not assembled:
        zero = "; [initial] gives no angle of the driven body, so it is 0"
        raise ValueError(
            f"guess: the linkage cannot be assembled: joints stay apart by {error:.1g} of its size"
            f"{zero if by_default else ' with the values of [initial]'}"
        )
    rate_matrix = np.vstack([matrix[:rows], identity[[*rates]]])
    if _rank(matrix) < columns or not (at_rest or _rank(rate_matrix) == columns):
        raise ValueError("initial: the values given do not determine the start")
    for k, name in enumerate(scene.get("spring", {})):
        if model.springs[k, 1] > 0.0 and math.hypot(*model.phi[rows + 2 * k :][:2]) <= _ASSEMBLED * size:
            raise ValueError(f"spring.{name}: its ends coincide at the start: the force has no direction")
    if not at_rest:
        right = np.append(
            -(model.rate[:rows] - shifts) / row_units, [value / units[k] for k, value in rates.items()]
        )
        v = units * np.linalg.solve(rate_matrix, right)
    return np.concatenate([q, v])


def _singular(matrix: Array) -> Array:
    return np.asarray(np.linalg.svd(matrix, compute_uv=False))


def _rank(matrix: Array) -> int:
    values = _singular(matrix)
    return int((values > _RANK * values.max(initial=0.0)).sum())


def plan(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return formulation, bodies, coordinates, constraints, freedom, start; raise as `read_linkage`."""
    assembly = read_linkage(scene)
    rows, columns = assembly.units.shape
    return {
        "formulation": assembly.formulation,
        "bodies": [*scene["body"]],
        "coordinates": columns,
        "constraints": rows,
        "freedom": columns - rows,
        "start": dict(zip(scene["body"], assembly.start[:columns].reshape(-1, 3).tolist(), strict=True)),
        "contacts": [*assembly.contacts],
    }
