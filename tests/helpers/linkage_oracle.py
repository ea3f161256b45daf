"""A minimal-coordinate program for linkages of one degree of freedom, and the balance of each body.

Every body has one coordinate, its angle or its travel along its guide. Walking the pins from the frame gives
each point as a sum of turned arms; pins left over close loops. One coordinate q of the linkage drives the
others through the loops, with influence coefficients x' = dx/dq, and Eksergian's equation moves it:

    M q'' + 1/2 M' q'^2 = Q,    M = sum m |c'|^2 + J phi'^2

Where q comes to a dead position another coordinate takes over. `balance` is a second formulation: Newton's
and Euler's equations of each body at the sampled state, which also give what the joints carry.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import minimize_scalar

SINGULAR = 1e-3
"""Smallest singular value over that of the start: there a run ends."""


class LostError(ArithmeticError):
    """Loops that do not close."""


@dataclass
class Place:
    """Coordinates and x' (m, rad); centroids, angles, springs' lengths, with derivatives."""

    x: np.ndarray
    dx: np.ndarray
    centroids: tuple
    angles: tuple
    lengths: tuple


class Linkage:
    """A linkage in one assembly; `k` is the body whose coordinate is q."""

    def __init__(self, scene):
        self.scene, self.names = scene, list(scene["body"])
        bodies, n = scene["body"].values(), len(scene["body"])
        self.mass = np.array([body["mass"] for body in bodies])
        self.inertia = np.array([body["inertia"] for body in bodies])
        self.own = np.array([complex(*body["centroid"]) for body in bodies])
        self.along, fixed = np.zeros(n, complex), np.append(np.zeros(n), 1.0)
        # Affine in exp(i angle) or travel x along: coefficients, then the constant.
        self.frames = {"frame": (0j * fixed, fixed)}
        self.tilt = np.zeros(n)
        for guide in scene["guide"].values():
            k = self.names.index(guide["body"])
            self.along[k] = np.exp(1j * math.radians(guide["direction_deg"]))
            self.tilt[k] = math.radians(guide["angle_deg"])
            turn = np.exp(1j * self.tilt[k]) * fixed
            origin = complex(*guide["point"]) * fixed + np.eye(n + 1)[k] - turn * self.own[k]
            self.frames[self.names[k]] = origin, turn
        loops, pins = [], [self.ends(pin) for pin in scene["pin"].values()]
        while pins:
            ends = next(ends for ends in pins if any(body in self.frames for body, _ in ends))
            pins.remove(ends)
            (one, own), (other, there) = sorted(ends, key=lambda end: end[0] not in self.frames)
            if other in self.frames:
                loops.append(self.at(one, own) - self.at(other, there))
            else:
                turn = np.eye(n + 1)[self.names.index(other)] + 0j
                self.frames[other] = self.at(one, own) - turn * there, turn
        self.loops = np.array(loops)
        self.middles = np.array([self.at(name, own) for name, own in zip(self.names, self.own, strict=True)])
        self.springs = list(scene["spring"].values())
        spans = [self.at(*second) - self.at(*first) for first, second in map(self.ends, self.springs)]
        self.spans = np.array(spans).reshape(-1, n + 1)
        self.assemble()

    def ends(self, joint):
        """Return (body, own point) of both ends of a pin or spring."""
        return [end_of(self.scene["body"], joint, end) for end in joint["joins"]]

    def at(self, body, own):
        origin, turn = self.frames[body]
        return origin + turn * own

    def turned(self, x):
        """Return exp(i angle) or travel x along, with first and second derivatives."""
        u, line = np.exp(1j * x) * (self.along == 0), self.along
        return u + x * line, 1j * u + line, -u

    def closure(self, x):
        """Return the loops' gaps and their derivatives by coordinate, real parts then imaginary ones."""
        u, du, _ = self.turned(x)
        return real(self.loops @ np.append(u, 1)), real(self.loops[:, :-1] * du)

    def newton(self, x, rest):
        """Close the loops from x; `rest(x)` returns one more equation and its row."""
        start = x
        for _ in range(40):
            gap, rows = self.closure(x)
            more, row = rest(x)
            try:
                step = np.linalg.solve(np.vstack([rows, row]), -np.append(gap, more))
            except np.linalg.LinAlgError:
                raise LostError from None
            x = x + step
            if np.abs(x - start)[self.along == 0].max() > 1:
                raise LostError
            if np.abs(step).max() < 1e-8:  # the next one is its square
                return x
        raise LostError

    def place(self, q):
        """Return the linkage at its coordinate q, near where it was."""
        k = self.k
        guess = self.x + self.dx * (q - self.x[k])
        row = np.eye(len(guess))[k]
        x = self.newton(guess, lambda x: (x[k] - q, row))
        matrix = np.vstack([self.closure(x)[1], row])
        dx = np.linalg.solve(matrix, np.eye(len(x))[-1])
        u, du, ddu = self.turned(x)
        curved = ddu * dx**2
        ddx = np.linalg.solve(matrix, np.append(-real(self.loops[:, :-1] @ curved), 0))
        self.x, self.dx = x, dx
        points = [np.vstack([self.middles, self.spans])[:, :-1] @ v for v in (u, du * dx, du * ddx + curved)]
        points[0] = points[0] + np.append(self.middles[:, -1], self.spans[:, -1])
        n = len(x)
        length = np.abs(points[0][n:])
        free = self.along == 0
        return Place(
            x, dx, tuple(p[:n] for p in points), (np.where(free, x, self.tilt), dx * free, ddx * free),
            (length, (points[0][n:].conj() * points[1][n:]).real / length),
        )  # fmt: skip

    def assemble(self):
        """Set assembly, q and its rate of the start from [initial] and [guess]."""
        scene = self.scene
        rows = {b: scene["guess"].get(b, {}) | scene["initial"].get(b, {}) for b in self.names}
        x = np.radians([row.get("angle_deg", 0.0) for row in rows.values()])
        initial = scene["initial"].items()
        given = [(self.names.index(b), key, value) for b, row in initial for key, value in row.items()]
        ((body, key, value),) = [row for row in given if row[1] in ("x", "y", "angle_deg")]

        def rest(x):
            if key == "angle_deg":
                return x[body] - math.radians(value), np.eye(len(x))[body]
            u, du, _ = self.turned(x)
            part = 1 if key == "x" else -1j
            middle = part * self.middles[body]
            return (middle @ np.append(u, 1)).real - value, (middle[:-1] * du).real

        self.x = self.newton(x, rest)
        self.k = self.names.index(scene["drive"].get("body", self.names[body]))
        if self.along[self.k]:
            self.k = int(np.argmax(self.along == 0))
        self.dx = np.zeros(len(x))
        place = self.place(self.x[self.k])
        self.rate = scene["drive"].get("speed_rpm", 0.0) * math.pi / 30
        for body, key, value in given:
            if key in ("vx", "vy", "omega"):
                c = place.centroids[1][body]
                self.rate = value / {"vx": c.real, "vy": c.imag, "omega": place.angles[1][body]}[key]

    def equation(self, place, rate):
        """Return M, M', Q without a drive by speed, the power of a torque and that of dampers."""
        scene, (c, dc, ddc), (_, dphi, ddphi) = self.scene, place.centroids, place.angles
        M = self.mass @ np.abs(dc) ** 2 + self.inertia @ dphi**2
        dM = 2 * (self.mass @ (dc.conj() * ddc).real + self.inertia @ (dphi * ddphi))
        Q = -scene["environment"]["gravity"] * (self.mass @ dc.imag)
        if scene.get("load"):
            k = self.names.index(scene["load"]["body"])
            Q += push(scene["load"], c[k].imag)[0] * dc[k].imag
        damped = 0.0
        for spring, length, slope in zip(self.springs, *place.lengths, strict=True):
            Q -= tension(spring, length, slope * rate) * slope
            damped += spring["damping"] * (slope * rate) ** 2
        k = self.names.index(scene["drive"].get("body", self.names[0]))
        torque = drive_torque(scene["drive"], place.angles[0][k]) * dphi[k]
        return M, dM, Q + torque, torque * rate, damped

    def rank(self, place):
        """Return the smallest singular value of the bodies' constraints, lengths over the largest one."""
        size = max(np.ptp([*b["points"].values()], axis=0).max() for b in self.scene["body"].values())
        c = place.centroids[0]
        matrix, _ = jacobian(self.scene, np.column_stack([c.real, c.imag, place.angles[0]]).ravel())
        shifts = np.abs(matrix).reshape(len(matrix), -1, 3)[:, :, :2].any(axis=(1, 2))
        matrix[np.ix_(shifts, np.arange(matrix.shape[1]) % 3 == 2)] /= size
        return np.linalg.svd(matrix, compute_uv=False)[-1]


def real(z):
    return np.concatenate([z.real, z.imag])


def end_of(bodies, joint, end):
    body, _, point = end.partition(".")
    place = joint if body == "frame" else bodies[body]["points"] | {"centroid": bodies[body]["centroid"]}
    return body, complex(*place[point or "point"])


def tension(spring, length, rate):
    return spring["stiffness"] * (length - spring["length"]) + spring["damping"] * rate


def drive_torque(drive, angle):
    if "torque_table" in drive:
        return float(np.interp(math.degrees(angle) % 360, *np.transpose(drive["torque_table"])))
    return drive.get("torque", 0.0)


def push(load, y):
    """Return force and stored energy of the workpiece where the body's centroid is at y."""
    h = max(load["surface"] - y, 0.0)
    if load["table"]:
        depths, forces = np.transpose(load["table"])
        inside = depths < h
        force = float(np.interp(h, depths, forces))
        return force, float(np.trapezoid([*forces[inside], force], [*depths[inside], h]))
    force = load["force"] * (h / load["depth"]) ** load["exponent"]
    return force, force * h / (load["exponent"] + 1)


@dataclass
class Motion:
    """Columns at the samples up to the end; outcome, "regular" or "singular", and when."""

    columns: dict
    outcome: str
    time: float


def times(scene):
    output, drive = scene["output"], scene["drive"]
    if "duration" in output:
        return np.linspace(0, output["duration"], output["samples"] + 1)
    cycles, samples = drive["cycles"], output["samples_per_cycle"]
    return np.arange(round(cycles * samples) + 1) * 60 / abs(drive["speed_rpm"]) / samples


def solve(scene, tolerance=1e-13):
    """Return the motion of a scene (complete mapping) at DOP853's relative tolerance."""
    linkage, grid = Linkage(scene), times(scene)
    run = Run(linkage, "speed_rpm" in scene["drive"], tolerance)
    # Coordinate and rate, work of the drive, heat of the dampers.
    state = np.array([linkage.x[linkage.k], linkage.rate, 0.0, 0.0])
    rows, end, t = [run.sample(state)], None, 0.0
    for after in grid[1:]:
        while t < after and end is None:
            t, state, end = run.advance(t, after, state)
        if end is not None:
            break
        rows.append(run.sample(state))
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    columns["energy_gravity"] = columns["energy_gravity"][0] - columns["energy_gravity"]
    columns["time"] = grid[: len(rows)]
    return Motion(columns, "regular" if end is None else "singular", end or grid[-1])


class Run:
    """A motion on its way: its step; least singular value over that of the start, now and in the step."""

    def __init__(self, linkage, driven, tolerance):
        self.linkage, self.driven, self.tolerance = linkage, driven, tolerance
        self.before, self.last, self.step = 1.0, 1.0, None
        self.initial = linkage.rank(linkage.place(linkage.x[linkage.k]))

    def derivative(self, _, state):
        q, rate = state[:2]
        try:
            M, dM, Q, power, damped = self.linkage.equation(self.linkage.place(q), rate)
        except LostError:
            return np.full(4, np.nan)
        if self.driven:
            return np.array([rate, 0.0, (dM * rate**2 / 2 - Q) * rate, damped])
        return np.array([rate, (Q - dM * rate**2 / 2) / M, power, damped])

    def advance(self, t, after, state):
        """Return time, state and singular time (or None) at `after` or at a change of the coordinate."""
        linkage = self.linkage
        first = None if self.step is None else min(self.step, after - t)
        solver = DOP853(self.derivative, t, state, after, first_step=first, rtol=self.tolerance)
        while solver.status == "running":
            self.step = solver.h_abs
            # Near a dead position differences round off.
            solver.rtol = max(self.tolerance, 1e-15 / self.last**2)
            solver.atol = solver.rtol / 10
            solver.step()
            if solver.status == "failed":
                return t, state, solver.t
            end = self.singular(solver.dense_output(), solver.t_old, solver.t)
            if end is not None:
                break
            place = linkage.place(solver.y[0])
            # How far each goes along q: angles, and travels over the longest arm.
            moved = np.abs(place.dx) / np.where(linkage.along == 0, 1, np.abs(linkage.loops).max())
            k = int(np.argmax(moved))
            if not self.driven and moved[k] > 3 * moved[linkage.k]:
                slope = place.dx[k]
                linkage.k, linkage.dx, self.step = k, place.dx / slope, None
                return solver.t, np.array([place.x[k], solver.y[1] * slope, *solver.y[2:]]), None
        return solver.t, solver.y, end

    def singular(self, dense, t0, t1):
        """Return the time of a singular position in a step, or None."""

        def sigma(t):
            try:
                return self.linkage.rank(self.linkage.place(dense(t)[0])) / self.initial
            except LostError:
                return 0.0

        grid = np.linspace(t0, t1, 4)
        values = [self.before, *map(sigma, grid[1:])]
        k = int(np.argmin(values))
        low, when = values[k], grid[k]
        if low < 0.1:
            bounds = grid[max(k - 1, 0)], grid[min(k + 1, 3)]
            best = minimize_scalar(sigma, bounds=bounds, method="bounded", options={"xatol": 1e-13})
            if best.fun < low:
                low, when = best.fun, best.x
        self.last, self.before = low, values[-1]
        if low >= SINGULAR:
            return None
        # At the end of a step it falls on, linearly, to a zero ahead.
        return when + low * (t1 - grid[-2]) / (values[-2] - low) if when > t1 - 1e-12 else when

    def sample(self, state):
        """Return the columns of one moment; gravity's energy from height 0."""
        q, rate, work, heat = state
        linkage, scene = self.linkage, self.linkage.scene
        place = linkage.place(q)
        M, dM, Q, _, _ = linkage.equation(place, rate)
        change = 0.0 if self.driven else (Q - dM * rate**2 / 2) / M
        row = {}
        for k, name in enumerate(linkage.names):
            c, dc, ddc = (z[k] for z in place.centroids)
            angle, first, second = (z[k] for z in place.angles)
            velocity, acceleration = dc * rate, ddc * rate**2 + dc * change
            values = (c, angle, velocity, first * rate, acceleration, first * change + second * rate**2)
            keys = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
            flat = [x for v in values for x in ((v.real, v.imag) if isinstance(v, complex) else (v,))]
            row |= {f"{name}.{key}": value for key, value in zip(keys, flat, strict=True)}
        if self.driven:
            row["drive.torque"] = dM * rate**2 / 2 - Q
        row |= {"energy_kinetic": M * rate**2 / 2, "energy_drive": work, "energy_damping": heat}
        row["energy_gravity"] = scene["environment"]["gravity"] * (linkage.mass @ place.centroids[0].imag)
        springs = zip(linkage.springs, place.lengths[0], strict=True)
        row["energy_spring"] = sum(s["stiffness"] * (x - s["length"]) ** 2 / 2 for s, x in springs)
        if scene.get("load"):
            k = linkage.names.index(scene["load"]["body"])
            row["energy_load"] = push(scene["load"], place.centroids[0][k].imag)[1]
        return row


def gap(scene, joint, pose):
    """Return second end less first (m, complex), with first and second derivatives by the bodies' pose."""
    names, value, rows, second = list(scene["body"]), 0j, np.zeros((2, len(pose))), np.zeros((2, len(pose)))
    for sign, end in zip((-1, 1), joint["joins"], strict=True):
        body, own = end_of(scene["body"], joint, end)
        if body != "frame":
            k = 3 * names.index(body)
            arm = np.exp(1j * pose[k + 2]) * (own - complex(*scene["body"][body]["centroid"]))
            rows[:, k : k + 3] = sign * np.array([[1, 0, -arm.imag], [0, 1, arm.real]])
            second[:, k + 2] = -sign * arm.real, -sign * arm.imag
            own = complex(*pose[k : k + 2]) + arm
        value += sign * own
    return value, rows, second


def jacobian(scene, pose):
    """Return the rows of pins, guides (normal, angle) and speed, and their second derivatives."""
    unit, place = np.eye(len(pose)), {name: 3 * k for k, name in enumerate(scene["body"])}
    pins = [gap(scene, pin, pose) for pin in scene["pin"].values()]
    rows = [rows for _, rows, _ in pins]
    for guide in scene["guide"].values():
        k, direction = place[guide["body"]], math.radians(guide["direction_deg"])
        rows.append([math.cos(direction) * unit[k + 1] - math.sin(direction) * unit[k], unit[k + 2]])
    if "speed_rpm" in scene["drive"]:
        rows.append(unit[[place[scene["drive"]["body"]] + 2]])
    rows, second = np.vstack(rows), np.vstack([second for _, _, second in pins])
    return rows, np.vstack([second, np.zeros((len(rows) - len(second), len(pose)))])


def balance(scene, columns):
    """Return accelerations, joint and spring forces by the balance of bodies, from places and rates."""
    names, drive, load = list(scene["body"]), scene["drive"], scene.get("load")
    keys = [f"{name}.{key}" for name in names for key in ("ax", "ay", "alpha")]
    keys += [f"{pin}.reaction_{part}" for pin in scene["pin"] for part in "xy"]
    keys += [f"{guide}.{part}" for guide in scene["guide"] for part in ("force", "moment")]
    keys += ["drive.torque"] if "speed_rpm" in drive else []
    mass = np.array([m for b in scene["body"].values() for m in (b["mass"], b["mass"], b["inertia"])])
    poses, rates = (
        np.transpose([columns[f"{name}.{key}"] for name in names for key in ends])
        for ends in (("x", "y", "angle"), ("vx", "vy", "omega"))
    )
    result = []
    for pose, rate in zip(poses, rates, strict=True):
        applied, pulls = np.zeros(len(mass)), []
        applied[1::3] = -scene["environment"]["gravity"] * mass[1::3]
        if load:
            k = 3 * names.index(load["body"]) + 1
            applied[k] += push(load, pose[k])[0]
        k = 3 * names.index(drive.get("body", names[0])) + 2
        applied[k] += drive_torque(drive, pose[k])
        for spring in scene["spring"].values():
            value, rows, _ = gap(scene, spring, pose)
            along = np.array([value.real, value.imag]) / abs(value) @ rows
            pulls.append(tension(spring, abs(value), along @ rate))
            applied -= pulls[-1] * along
        rows, second = jacobian(scene, pose)
        full = np.block([[np.diag(mass), -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        result.append([*np.linalg.solve(full, np.append(applied, -second @ rate**2)), *pulls])
    keys += [f"{spring}.force" for spring in scene["spring"]]
    return dict(zip(keys, np.transpose(result), strict=True))
