"""Any planar linkage: the lists of a scene, their constraints and forces, and a start that meets them.

A body has the coordinates x, y, theta of its centroid. The fixed frame is the last body, of infinite mass and
at rest in zero. With a, b the arms of a joint, turned with their bodies, the rows of Phi(q, t) = 0 are, in the
scene's order,

    pin of i and j     r_j + b - r_i - a
    guide of i on j    n . (r_i - r_j) - c, with n the line's normal, turned with j; theta_i - theta_j - angle
    drive by a speed   theta - omega t - theta_0

A joint exerts -lambda of its rows on j of a pin, on i of a guide, and on the driven body.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import inlined, inner
from reference_model.linkage import Array
from reference_model.multiplier import load_force, solve_rows
from reference_model.parameters import read_load, require_known, require_tolerance
from reference_model.state import Nodes, Records
from reference_model.workpiece import NO_LOAD, Load

GROUPS = ("accelerations", "joints", "energy")
_LATER = ("clearance", "contact", "friction", "joints", "reliability", "mechanism")
_RANK = 1e-8
"""Smallest singular value of independent rows, relative to the largest."""
_ASSEMBLED = 1e-12
"""Largest |Phi| at the start, relative to the size of the linkage."""
_POSITIONS, _RATES = ("x", "y", "angle_deg"), ("vx", "vy", "omega")


class Planar(NamedTuple):
    """A linkage of n - 1 bodies and the frame: a state holds x, y, theta of each, their rates, three works."""

    masses: Array
    """The diagonal of M, shape (3 n,), kg and kg m^2."""
    weights: Array
    """The bodies' weights as generalized forces, shape (3 n,)."""
    joined: NDArray[np.int64]
    """Bodies i, j of each pin, shape (pins, 2)."""
    arms: Array
    """a and b of each pin from the centroids, in the bodies' own frames, shape (pins, 4), m."""
    guided: NDArray[np.int64]
    """Bodies i, j of each guide, shape (guides, 2)."""
    lines: Array
    """n in the frame of j, c (m) and angle (rad) of each guide, shape (guides, 4)."""
    sprung: NDArray[np.int64]
    """Bodies i, j of each spring, shape (springs, 2)."""
    spring_arms: Array
    """As `arms`."""
    springs: Array
    """Stiffness (N/m), free length (m), damping (N s/m) of each spring, shape (springs, 3)."""
    driven: int
    """Index of the driven angle in q; that of the frame without a drive."""
    omega: float
    """Rate of a driven body, rad/s; 0: it is not driven by a speed."""
    theta0: float
    """Its angle at t = 0, rad."""
    torque: float
    """Constant torque on it, N m."""
    table: Load
    """What a table adds to that, over the depth theta, rad."""
    load: Load
    """Load of a workpiece."""
    loaded: int
    """Index of the height in q that meets it."""
    phi: Array
    """Work array: Phi, shape (rows,); so are Phi', gamma and lambda."""
    rate: Array
    gamma: Array
    lambdas: Array
    applied: Array
    """Work array: Q, shape (3 n,), and a correction of q or q'."""
    correction: Array
    jacobian: Array
    """Work array: Phi_q, shape (rows, 3 n)."""
    matrix: Array
    """Work array: Phi_q M^-1 Phi_q^T, shape (rows, rows)."""


def constraints(model: Planar, t: float, q: Array, v: Array) -> None:
    """Write Phi, Phi', gamma and Phi_q of a state at `t` (s) to the model's arrays; see `multiplier`."""
    phi, rate, gamma, jacobian = model.phi, model.rate, model.gamma, model.jacobian
    for i in range(phi.size):
        phi[i] = gamma[i] = rate[i] = 0.0
        for k in range(q.size):
            jacobian[i, k] = 0.0
    row = 0
    for pin in range(model.joined.shape[0]):
        for end in range(2):
            x, sign = 3 * model.joined[pin, end], 2.0 * end - 1.0
            ax, ay = sign * model.arms[pin, 2 * end], sign * model.arms[pin, 2 * end + 1]
            c, s, spin = math.cos(q[x + 2]), math.sin(q[x + 2]), v[x + 2]
            rx, ry = c * ax - s * ay, s * ax + c * ay
            phi[row] += sign * q[x] + rx
            phi[row + 1] += sign * q[x + 1] + ry
            jacobian[row, x] = jacobian[row + 1, x + 1] = sign
            jacobian[row, x + 2], jacobian[row + 1, x + 2] = -ry, rx
            gamma[row] += rx * spin * spin
            gamma[row + 1] += ry * spin * spin
        row += 2
    for guide in range(model.guided.shape[0]):
        i, j = 3 * model.guided[guide, 0], 3 * model.guided[guide, 1]
        c, s, spin = math.cos(q[j + 2]), math.sin(q[j + 2]), v[j + 2]
        nx = c * model.lines[guide, 0] - s * model.lines[guide, 1]
        ny = s * model.lines[guide, 0] + c * model.lines[guide, 1]
        ex, ey = q[i] - q[j], q[i + 1] - q[j + 1]
        across, along = nx * ex + ny * ey, nx * ey - ny * ex
        phi[row] = across - model.lines[guide, 2]
        phi[row + 1] = q[i + 2] - q[j + 2] - model.lines[guide, 3]
        jacobian[row, i], jacobian[row, i + 1], jacobian[row, j], jacobian[row, j + 1] = nx, ny, -nx, -ny
        jacobian[row, j + 2], jacobian[row + 1, i + 2], jacobian[row + 1, j + 2] = along, 1.0, -1.0
        slip = nx * (v[i + 1] - v[j + 1]) - ny * (v[i] - v[j])
        gamma[row] = spin * (spin * across - 2.0 * slip)
        row += 2
    if row < phi.size:
        phi[row] = q[model.driven] - model.omega * t - model.theta0
        jacobian[row, model.driven], rate[row] = 1.0, -model.omega
    for i in range(phi.size):
        for k in range(q.size):
            rate[i] += jacobian[i, k] * v[k]


def stretch(model: Planar, k: int, q: Array, v: Array) -> tuple[Any, Any, Any, Any]:
    """Return the direction of a spring from i to j (zero if they meet), its length (m) and its rate (m/s).

    `q` and `v` have the shape (3 n,) or (3 n, states).
    """
    dx = dy = vx = vy = 0.0 * q[0]
    for end in range(2):
        x, sign = 3 * model.sprung[k, end], 2.0 * end - 1.0
        ax, ay = model.spring_arms[k, 2 * end], model.spring_arms[k, 2 * end + 1]
        c, s = np.cos(q[x + 2]), np.sin(q[x + 2])
        rx, ry = c * ax - s * ay, s * ax + c * ay
        dx, dy = dx + sign * (q[x] + rx), dy + sign * (q[x + 1] + ry)
        vx, vy = vx + sign * (v[x] - v[x + 2] * ry), vy + sign * (v[x + 1] + v[x + 2] * rx)
    length = np.sqrt(dx * dx + dy * dy)
    ux, uy = dx / np.maximum(length, 1e-300), dy / np.maximum(length, 1e-300)
    return ux, uy, length, ux * vx + uy * vy


_constraints, _stretch = inner(constraints), inner(stretch)


def tabulate(model: Planar, t: float, h: float, shares: Array) -> None:
    """Do nothing: no part of this motion is a function of time alone."""


def derivative(model: Planar, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write the derivatives of coordinates, rates and works; see `formulations.derivative`."""
    size, y, dy, applied, lost = model.masses.size, nodes.y[i], nodes.dy[i], model.applied, 0.0
    q, v, turn = y[:size], y[size : 2 * size], model.driven
    for k in range(size):
        applied[k] = model.weights[k]
        dy[k] = v[k]
    for k in range(model.springs.shape[0]):
        ux, uy, length, rate = _stretch(model, k, q, v)
        damping = model.springs[k, 2] * rate
        pull = model.springs[k, 0] * (length - model.springs[k, 1]) + damping
        lost += damping * rate
        for end in range(2):
            x, force = 3 * model.sprung[k, end], pull * (1.0 - 2.0 * end)
            ax, ay = model.spring_arms[k, 2 * end], model.spring_arms[k, 2 * end + 1]
            c, s = math.cos(q[x + 2]), math.sin(q[x + 2])
            applied[x] += force * ux
            applied[x + 1] += force * uy
            applied[x + 2] += force * ((c * ax - s * ay) * uy - (s * ax + c * ay) * ux)
    torque = model.torque + load_force(model.table, -(q[turn] % (2.0 * math.pi)))
    applied[turn] += torque
    applied[model.loaded] += load_force(model.load, q[model.loaded])
    _constraints(model, t, q, v)
    for row in range(model.phi.size):
        model.lambdas[row] = -model.gamma[row]
    solve_rows(model, dy[size : 2 * size])
    power = torque * v[turn]
    if model.omega != 0.0:
        power -= model.lambdas[model.phi.size - 1] * model.omega
    dy[2 * size], dy[2 * size + 1], dy[2 * size + 2] = power, lost, 0.0


@inlined
def correct(model: Planar, errors: Array, values: Array) -> None:
    """Subtract from coordinates or rates the M-shortest change that removes their errors in all rows."""
    for k in range(values.size):
        model.applied[k] = 0.0
    for row in range(errors.size):
        model.lambdas[row] = errors[row]
    solve_rows(model, model.correction)
    for k in range(values.size):
        values[k] += model.correction[k]


@inner
def project(model: Planar, t: float, y: Array, accuracy: float) -> bool:
    """Move a state at `t` (s) onto the constraints, |Phi| <= `accuracy` (m, rad); return whether it is there."""
    size, worst = model.masses.size, math.inf
    q, v = y[:size], y[size : 2 * size]
    _constraints(model, t, q, v)
    for _ in range(6):
        correct(model, model.phi, q)
        _constraints(model, t, q, v)
        worst = 0.0
        for row in range(model.phi.size):
            worst += abs(model.phi[row])
        if worst <= accuracy:
            break
    correct(model, model.rate, v)
    return worst <= accuracy


@dataclass(frozen=True)
class Assembly:
    """A linkage at its start, and what the scene asks to know of it."""

    model: Planar
    names: dict[str, list[str]]
    """Names by table: body, pin, guide, spring."""
    units: tuple[Array, Array]
    """Lengths of the linkage (m) and 1 for angles: of the rows, and of the bodies' coordinates."""
    start: Array
    """Coordinates and rates at t = 0, those of the frame with them, shape (6 n,)."""
    sigma: float
    """Smallest singular value of the constraints' Jacobian at the start, in these units."""
    freedom: int
    """Degrees of freedom that the drive leaves."""

    def jacobian(self, jacobians: Array) -> Array:
        """Return Jacobians (..., rows, 3 n) in the units, without the frame's columns."""
        rows, columns = self.units
        return np.asarray(jacobians[..., : columns.size] * (columns / rows[:, None]))

    def sigmas(self, jacobians: Array) -> Array:
        """Return the smallest singular value of each Jacobian; infinite without constraints."""
        values = np.linalg.svd(self.jacobian(jacobians), compute_uv=False)
        return np.asarray(values.min(axis=-1, initial=np.inf))

    def jacobian_at(self, q: Array) -> Array:
        """Return the Jacobian at coordinates (3 n,), until the next call."""
        constraints(self.model, 0.0, q, np.zeros_like(q))
        return self.model.jacobian


def assemble(scene: Mapping[str, Any]) -> Assembly:
    """Read a linkage's scene and assemble it at t = 0.

    Raises
    ------
    ValueError
        One line that names the key, if this model cannot simulate it. Names and ranges that the rules of
        `comparison.scene` forbid are not looked for.
    """
    solver = scene["solver"]["reference"]
    for table in _LATER:
        if table in scene:
            raise ValueError(f"{table}: not simulated for a linkage of bodies and pins; leave the table out")
    require_known(
        ("solver.reference.formulation", solver.get("formulation", "auto"), ("auto", "multiplier")),
        ("solver.reference.method", solver["method"], ("dop853",)),
        *(("output.groups", group, GROUPS) for group in scene["output"]["groups"]),
    )
    require_tolerance(solver["tolerance"])
    tables = {table: scene.get(table, {}) for table in ("body", "pin", "guide", "spring", "initial", "guess")}
    model, size = _read(scene, tables)
    bodies, pins, guides = len(tables["body"]), len(tables["pin"]), len(tables["guide"])
    rows = np.array([size] * 2 * pins + [size, 1.0] * guides + [1.0] * (model.omega != 0.0))
    names = {table: [*tables[table]] for table in ("body", "pin", "guide", "spring")}
    units = rows, np.array([size, size, 1.0] * bodies)
    start, sigma, freedom = _start(Assembly(model, names, units, np.empty(0), 0.0, 0), tables)
    return Assembly(model, names, units, start, sigma, freedom)


def _read(scene: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]]) -> tuple[Planar, float]:
    """Return the lists of a scene, and the size of its linkage: the largest distance on a body, m."""
    bodies, drive, load = tables["body"], scene.get("drive", {}), scene.get("load")
    number = {name: i for i, name in enumerate((*bodies, "frame"))}
    frame = 3 * len(bodies)
    points = {name: {"centroid": body["centroid"], **body["points"]} for name, body in bodies.items()}
    arms = {name: {at: np.subtract(point, bodies[name]["centroid"]) for at, point in own.items()}
            for name, own in points.items()}  # fmt: skip
    size = max(math.dist(a, b) for own in points.values() for a in own.values() for b in own.values())

    def joints(table: str) -> tuple[NDArray[np.int64], Array]:
        joined, ends = [], []
        for joint in tables[table].values():
            for end in joint["joins"]:
                name, _, at = end.partition(".")
                joined.append(number[name])
                ends.append(arms[name][at] if name != "frame" else joint.get("point", (0.0, 0.0)))
        return np.array(joined, np.int64).reshape(-1, 2), np.array(ends, np.float64).reshape(-1, 4)

    guided, lines = [], []
    for guide in tables["guide"].values():
        on, direction = guide.get("on", "frame"), math.radians(guide["direction_deg"])
        n = -math.sin(direction), math.cos(direction)
        point = np.subtract(guide["point"], bodies[on]["centroid"] if on != "frame" else (0.0, 0.0))
        guided.append((number[guide["body"]], number[on]))
        angle = math.radians(guide.get("angle_deg", guide["direction_deg"]))
        lines.append((*n, float(np.dot(n, point)), angle))
    speed, torques = drive.get("speed_rpm") or 0.0, np.array(drive.get("torque_table") or np.empty((0, 2)))
    torque, table = float(drive.get("torque") or 0.0), NO_LOAD
    if torques.size:
        torque = float(torques[0, 1])
        table = Load(0.0, 0.0, 1.0, 1.0, np.radians(torques[:, 0]), torques[:, 1] - torque)
    inertias = [(body["mass"], body["mass"], body["inertia"]) for body in bodies.values()]
    weights = np.zeros(frame + 3)
    weights[1:-3:3] = [-scene["environment"]["gravity"] * mass for mass, _, _ in inertias]
    rows = 2 * len(tables["pin"]) + 2 * len(guided) + (speed != 0.0)
    (joined, pin_arms), (sprung, spring_arms) = joints("pin"), joints("spring")
    springs = [
        (each["stiffness"], each["length"], each.get("damping", 0.0)) for each in tables["spring"].values()
    ]
    model = Planar(
        masses=np.array([*np.ravel(inertias), *[np.inf] * 3], np.float64),
        weights=weights,
        joined=joined,
        arms=pin_arms,
        guided=np.array(guided, np.int64).reshape(-1, 2),
        lines=np.array(lines, np.float64).reshape(-1, 4),
        sprung=sprung,
        spring_arms=spring_arms,
        springs=np.array(springs, np.float64).reshape(-1, 3),
        driven=3 * number[drive.get("body") or "frame"] + 2,
        omega=speed * 2.0 * math.pi / 60.0,
        theta0=math.radians(tables["initial"].get(drive.get("body"), {}).get("angle_deg", 0.0)),
        torque=torque,
        table=table,
        load=read_load(load) if load else NO_LOAD,
        loaded=3 * number[load["body"] if load else "frame"] + 1,
        phi=np.empty(rows),
        rate=np.empty(rows),
        gamma=np.empty(rows),
        lambdas=np.empty(rows),
        applied=np.empty(frame + 3),
        correction=np.empty(frame + 3),
        jacobian=np.empty((rows, frame + 3)),
        matrix=np.empty((rows, rows)),
    )  # fmt: skip
    return model, size or 1.0


def _given(tables: Mapping[str, Any], table: str, keys: Sequence[str]) -> dict[int, float]:
    """Return the values of a table for some of its keys, by their index in q or q'; m, rad and 1/s."""
    return {
        3 * list(tables["body"]).index(body) + k: math.radians(values[key])
        if key == "angle_deg"
        else values[key]
        for body, values in tables[table].items()
        for k, key in enumerate(keys)
        if key in values
    }


def _guess(model: Planar, known: Mapping[int, float]) -> Array:
    """Return coordinates from known ones and, along the pins from the frame, those that these leave open."""
    q, frame = np.zeros(model.masses.size), model.masses.size // 3 - 1
    q[[*known]] = [*known.values()]
    placed = {frame}
    for _ in range(frame):
        for (i, j), arms in zip(model.joined.tolist(), model.arms, strict=True):
            if (i in placed) == (j in placed):
                continue
            old, new = (i, j) if i in placed else (j, i)
            turned = []
            for body, arm in ((i, arms[:2]), (j, arms[2:])):
                c, s = math.cos(q[3 * body + 2]), math.sin(q[3 * body + 2])
                turned.append(np.array((c * arm[0] - s * arm[1], s * arm[0] + c * arm[1])))
            by = (turned[0] - turned[1]) * (1.0 if new == j else -1.0)
            for k in range(2):
                q[3 * new + k] = known.get(3 * new + k, q[3 * old + k] + by[k])
            placed.add(new)
    return q


def _start(assembly: Assembly, tables: Mapping[str, Any]) -> tuple[Array, float, int]:
    """Return coordinates and rates at t = 0, the smallest singular value there, and the freedom; or refuse."""
    model, (row_units, units) = assembly.model, assembly.units
    rows, size, by_speed = model.phi.size, units.size, model.omega != 0.0
    at, rates = _given(tables, "initial", _POSITIONS), _given(tables, "initial", _RATES)
    if by_speed:
        at[model.driven] = model.theta0
    holonomic, chosen, values = rows - by_speed, [*at], np.array([*at.values()])
    q, fixed, wrong = _guess(model, _given(tables, "guess", _POSITIONS) | at), np.eye(size), np.inf
    for _ in range(60):
        jacobian = assembly.jacobian(assembly.jacobian_at(q))
        wanted = np.array([*-(model.phi / row_units)[:holonomic], *(values - q[chosen]) / units[chosen]])
        matrix = np.vstack([jacobian[:holonomic], fixed[chosen]])
        wrong = np.abs(wanted).max(initial=0.0)
        if wrong <= 1e-15 or not math.isfinite(wrong):
            break
        step = np.linalg.lstsq(matrix, wanted)[0]
        q[:size] += units * step / max(1.0, np.abs(step).max())
    assembled = wrong <= _ASSEMBLED
    dependent = rows - _rank(jacobian)
    if dependent and (assembled or rows > size):
        raise ValueError(f"pin: too many constraints: {dependent} of {rows} rows are dependent at the start")
    needs, freedom = size - holonomic, size - rows
    at_rest = not by_speed and not rates
    if len(at) != needs or (len(rates) != freedom and not at_rest):
        free = f"{needs - by_speed} {'position' if needs - by_speed == 1 else 'positions'}"
        free += f" and {freedom} {'rate' if freedom == 1 else 'rates'}"
        raise ValueError(f"initial: this linkage needs {free}, not {len(at) - by_speed} and {len(rates)}")
    if not assembled:
        raise ValueError(
            f"guess: the linkage cannot be assembled from here: its joints stay {wrong:.1g} of its size apart"
        )
    v, moving = np.zeros_like(q), np.vstack([jacobian, fixed[[*rates]]])
    if _rank(matrix) < size or (not at_rest and _rank(moving) < size):
        raise ValueError("initial: the values given do not determine the start")
    if not at_rest:
        constraints(model, 0.0, q, v)
        right = np.array([*-model.rate / row_units, *(value / units[k] for k, value in rates.items())])
        v[:size] = units * np.linalg.solve(moving, right)
    for k, name in enumerate(tables["spring"]):
        if stretch(model, k, q, v)[2] <= _ASSEMBLED * units[0] and model.springs[k, 1] > 0.0:
            raise ValueError(f"spring.{name}: its ends coincide at the start, so its force has no direction")
    return np.concatenate([q, v]), float(assembly.sigmas(assembly.jacobian_at(q))), freedom


def _rank(matrix: Array) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > _RANK * values.max(initial=0.0)).sum())


def plan(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return formulation, bodies, numbers of coordinates and constraints, freedom; raise as `assemble`."""
    assembly = assemble(scene)
    rows, coordinates = (units.size for units in assembly.units)
    return {
        "formulation": f"multiplier ({coordinates} coordinates, {rows} multipliers)",
        "bodies": assembly.names["body"],
        "coordinates": coordinates,
        "constraints": rows,
        "freedom": assembly.freedom,
    }
