"""A minimal-coordinate program for linkages with and without clearances; contact by docs/model.md, section 6.

`Bodies` takes as many of the bodies' coordinates for independent as a pose leaves free, anew at each sample;
the loops give the others by Newton's method. Contact acts by its virtual power, -F_n rate + F_t slip, hence
by the rows that give rate and slip from the velocities. Touches and separations are zeros of gaps on DOP853's
dense output, integrated to again; there the integration starts anew.
"""

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from page_formulas import (
    DAMPING,
    compliances,
    conformal_radius,
    friction,
    impact_force,
    normal_force,
    point_elastic,
    point_stiffness,
)
from scipy.integrate import DOP853
from scipy.linalg import qr
from scipy.optimize import brentq, minimize_scalar

CORNERS = {"ll": (-1, 1), "lr": (-1, -1), "ul": (1, 1), "ur": (1, -1)}
"""Sides of a corner along the guide's direction and along its normal."""
SINGULAR = 1e-3  # smallest singular value over that of the start: there a run ends


class LostError(ArithmeticError):
    """Loops that do not close."""


class Contact:
    """A contact: its law, the impact speed while it is closed, and its events."""

    def __init__(self, name, clearance):
        self.name, self.events, self.impact = name, [], None
        self.clearance, self.contact, self.friction = clearance, clearance["contact"], clearance["friction"]
        radius, law = clearance.get("journal_radius"), self.contact
        radius = conformal_radius(radius, clearance["size"]) if radius else clearance["corner_radius"]
        material = compliances(*[law["youngs_modulus"]] * 2, *[law["poisson"]] * 2)
        stiffness = law.get("stiffness") if law["law"] == "adams-impact" else None
        self.K = stiffness or point_stiffness(*material, radius)

    def force(self, depth, rate, slip):
        """Return normal force, friction and the elastic part of the first."""
        if self.impact is None or depth <= 0:
            return 0.0, 0.0, 0.0
        law, rub, n = self.contact, self.friction, self.contact["exponent"]
        elastic = point_elastic(self.K, depth, n)
        if law["law"] == "adams-impact":
            normal = impact_force(self.K, n, law["damping"], law["damping_depth"], depth, rate)
        else:
            C = DAMPING[law["damping_model"]](law["restitution"])
            normal = normal_force(elastic, C, depth, rate, self.impact)
        numbers = rub["coefficient"], rub["static_speed"], rub["transition_speed"]
        return normal, friction(*numbers, normal, slip), elastic

    def switch(self, t, rate, impulse):
        if self.impact is None:
            self.impact = max(rate, self.contact["impact_speed_floor"])
            row = {"corner": self.name, "start": t, "end": math.inf, "normal_speed": self.impact}
            self.events.append(row | {"impulse": -impulse, "peak_force": 0.0, "largest_depth": 0.0})
        else:
            self.events[-1] |= {"end": t, "impulse": self.events[-1]["impulse"] + impulse}
            self.impact = None

    def watch(self, depth, rate, slip):
        if self.impact:
            event, force = self.events[-1], self.force(depth, rate, slip)[0]
            event["largest_depth"] = max(event["largest_depth"], depth)
            event["peak_force"] = max(event["peak_force"], force)


class March:
    """A motion: coordinates, rates; work of the drive, losses to damping and friction; impulses."""

    def __init__(self, system, tolerance):
        self.system, self.contacts, self.tolerance = system, system.contacts, tolerance
        self.sums, self.step, self.singular = np.zeros(3 + len(self.contacts)), 1e-8, math.inf
        # Least singular value over that of the start, now and in the last step.
        self.sigma = self.least = 1.0

    def separations(self):
        return sum(len(contact.events) - bool(contact.impact) for contact in self.contacts)

    def look(self, t, state):
        f = len(self.system.free)
        return self.system.look(t, state[:f], state[f : 2 * f])

    def derivative(self, t, state):
        try:
            look = self.look(t, state)
        except LostError:  # a trial too far
            return np.full(len(state), np.nan)
        forces = [contact.force(*gap) for contact, gap in zip(self.contacts, look.gaps, strict=True)]
        change, power, heat = self.system.accelerate(look, forces)
        (normal, shear, elastic), (_, rate, slip) = (np.reshape(x, (-1, 3)).T for x in (forces, look.gaps))
        sums = [power, heat + (normal - elastic) @ rate, -shear @ slip, *normal]
        return np.concatenate([state[len(change) : 2 * len(change)], change, sums])

    def solver(self, t, state, until):
        first = min(self.step, abs(until - t))
        return DOP853(self.derivative, t, state, until, first_step=first, **self.tolerances())

    def tolerances(self):
        # Near a singular position differences round off. Rates have the error that a depth's rounding gives a
        # light body in a stiff contact.
        f, rtol = len(self.system.free), max(self.tolerance, 1e-15 / self.least**2)
        atol = rtol * np.concatenate([np.full(f, 0.01), np.full(f, 100.0), np.ones(len(self.sums))])
        return {"rtol": rtol, "atol": atol}

    def advance(self, look, until):
        """Return the look at `until`, or before it at a touch, a separation or near a singular position."""
        solver = self.solver(look.t, np.concatenate([*self.system.begin(look), self.sums]), until)
        parts = np.append(2.0 ** -np.arange(40, 3, -4), np.linspace(0, 1, 8)[1:])
        while solver.status == "running":
            before = solver.t, solver.y
            vars(solver).update(self.tolerances())
            if solver.step():
                self.singular = solver.t
                return look
            dense = solver.dense_output()
            if self.contacts:
                zero = self.first(dense, solver.t_old + parts * solver.step_size)
                parts = parts[-7:]
                if zero:
                    return self.cross(*before, *zero)
            elif self.locks(dense):
                return look
            self.step = solver.h_abs
        self.sums = solver.y[-len(self.sums) :]
        return self.look(solver.t, solver.y)

    def locks(self, dense):
        """Note the time of a singular position in a step, and return True if there is one."""

        def sigma(t):
            try:
                return self.system.rank(self.look(t, dense(t))) / self.system.rank(self.system.start)
            except LostError:
                return 0.0

        grid = np.linspace(dense.t_old, dense.t, 4)
        values = [self.sigma, *map(sigma, grid[1:])]
        k = int(np.argmin(values))
        low, time = values[k], grid[k]
        if low < 0.1:
            bounds = grid[max(k - 1, 0)], grid[min(k + 1, 3)]
            best = minimize_scalar(sigma, bounds=bounds, method="bounded", options={"xatol": 1e-13})
            if best.fun < low:
                low, time = best.fun, best.x
        self.least, self.sigma = low, values[-1]
        if low < SINGULAR:
            # At the end of a step the value falls on, linearly, to a zero ahead.
            ahead = low * (grid[-1] - grid[-2]) / (values[-2] - low) if time > grid[-1] - 1e-12 else 0.0
            self.singular = time + ahead
        return low < SINGULAR

    def first(self, dense, at):
        """Return time and contact of the first touch or separation among times of a step, or None."""

        def depths(t):
            """Return margins that are positive until a contact switches."""
            gaps = self.look(t, dense(t)).gaps
            for contact, gap in zip(self.contacts, gaps, strict=True):
                contact.watch(*gap)
            return [gap[0] * (1 if c.impact else -1) for c, gap in zip(self.contacts, gaps, strict=True)]

        # A margin that has just switched starts at zero, up to rounding.
        for (start, start_depths), (end, end_depths) in pairwise((t, depths(t)) for t in [dense.t_old, *at]):
            zeros = []
            for k, (a, b) in enumerate(zip(start_depths, end_depths, strict=True)):
                if b < min(a, 0) - 1e-14:
                    inside = depths(start)[k] > 0 > depths(end)[k]
                    zero = brentq(lambda t, k=k: depths(t)[k], start, end, xtol=1e-18) if inside else start
                    zeros.append((zero, k))
            if zeros:
                return min(zeros)
        return None

    def cross(self, t, state, time, k):
        """Integrate to a zero of gap k, twice for its error on the dense output, and switch contact k."""
        for _ in range(2):
            if time != t:
                solver = self.solver(t, state, time)
                while solver.status == "running":
                    solver.step()
                t, state = solver.t, solver.y
            look = self.look(t, state)
            depth, rate, _ = look.gaps[k]
            time -= depth / rate if abs(depth) < 1e-9 * abs(rate) else 0
        self.sums, self.step = state[-len(self.sums) :], 1e-8
        self.contacts[k].switch(t, rate, self.sums[3 + k])
        return look


def times(scene):
    output, drive = scene["output"], scene["drive"]
    if "duration" in output:
        return np.linspace(0, output["duration"], output["samples"] + 1)
    cycles, samples = drive["cycles"], output["samples_per_cycle"]
    return np.arange(round(cycles * samples) + 1) * 60 / abs(drive["speed_rpm"]) / samples


def solve(scene, grid=None, tolerance=1e-13, contacts=math.inf):
    """Return columns at the times of a grid, events, and the time of a singular position.

    The motion ends there, or at the end of the n-th contact.
    """
    system, rows = Bodies(scene), []
    march, look = March(system, tolerance), system.start
    for time in times(scene) if grid is None else grid:
        while look.t < time and march.singular == math.inf and march.separations() < contacts:
            look = march.advance(look, time)
        if look.t == time:
            rows.append({"time": time} | system.sample(look, march.sums))
    for contact, impulse in zip(system.contacts, march.sums[3:], strict=True):
        if contact.impact:
            contact.switch(look.t, 0, impulse)
    events = [event for contact in system.contacts for event in contact.events]
    events.sort(key=lambda event: round(event["start"], 12))
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return columns, events, march.singular


class Bodies:
    """Any linkage; `free` are its independent coordinates among x, y, angle of each body."""

    def __init__(self, scene):
        self.scene, self.names, clearances = scene, list(scene["body"]), scene.get("clearance", {})
        self.contacts = [
            Contact(f"{name}.{corner}" if corner else name, clearance)
            for name, clearance in clearances.items()
            for corner in (CORNERS if name in scene["guide"] else [""])
        ]
        bodies, drive = scene["body"].values(), scene["drive"]
        self.mass = np.array([m for body in bodies for m in (body["mass"], body["mass"], body["inertia"])])
        self.size = max(np.ptp([*body["points"].values()], axis=0).max() for body in bodies)
        self.place = {name: k for k, name in enumerate([*self.names, "frame"])}
        self.joints = [*scene["pin"], *scene["guide"]]
        self.points = {
            body: row["points"] | {"centroid": row["centroid"]} for body, row in scene["body"].items()
        }
        self.points["frame"] = {"centroid": [0.0, 0.0]}
        self.ends = [self.both(pin, pin["joins"]) for pin in scene["pin"].values()]
        for guide in scene["guide"].values():
            self.ends.append(self.both(guide, [guide["on"], guide["body"] + ".centroid"]))
        self.chords = self.chord(self.ends)
        self.turns = np.eye(len(self.mass) + 3)[2::3, : len(self.mass)]  # the frame has none
        self.springs = self.chord([self.both(row, row["joins"]) for row in scene["spring"].values()])
        self.rate = drive.get("speed_rpm", 0.0) * math.pi / 30
        self.driven = 3 * self.place[drive.get("body", self.names[0])] + 2
        self.angle = math.radians(scene["initial"].get(drive.get("body"), {}).get("angle_deg", 0.0))
        self.tight = [*range(len(self.joints))]
        pose, velocity = self.assemble()
        self.tight = [k for k in self.tight if self.joints[k] not in clearances]
        self.start = self.look(0.0, *self.begin(SimpleNamespace(t=0.0, pose=pose, velocity=velocity)))

    def both(self, joint, joins):
        """Return body and point, from its centroid, of both ends of a joint or spring."""
        ends = []
        for end in joins:
            body, _, name = end.partition(".")
            point = complex(*(self.points[body].get(name) or joint["point"]))
            ends.append((self.place[body], point - complex(*self.points[body]["centroid"])))
        return ends

    def chord(self, joints):
        """Return second ends less first ones, by centroids, exp(i angle) and 1, and by rates of centroids."""
        sides, arms = np.zeros((2, len(joints), len(self.place)), complex)
        for side, arm, ends in zip(sides, arms, joints, strict=True):
            for sign, (body, point) in zip((-1, 1), ends, strict=True):
                side[body] += sign
                arm[body] += sign * point
        rows = np.kron(sides[:, :-1], [1, 1j, 0])
        return sides[:, :-1], arms[:, :-1], arms[:, -1], rows

    def spans(self, chords, pose):
        """Return chords, the rows that give their rates, and the arms as vectors."""
        sides, arms, fixed, rows = chords
        vectors, rows = arms * np.exp(1j * pose[2::3]), rows.copy()
        rows[:, 2::3] = 1j * vectors
        return sides @ (pose[0::3] + 1j * pose[1::3]) + vectors.sum(axis=1) + fixed, rows, vectors

    def guides(self):
        """Return number, body, body that it is on, direction and angle of each guide."""
        for k, row in enumerate(self.scene["guide"].values(), len(self.scene["pin"])):
            angles = math.radians(row["direction_deg"]), math.radians(row["angle_deg"])
            yield k, self.place[row["body"]], self.place[row["on"]], *angles

    def constraints(self, t, pose, velocity):
        """Return values and rows, with their rates at no velocity, and rates of these at no acceleration."""
        angles, omega, turns = [*pose[2::3], 0.0], [*velocity[2::3], 0.0], self.turns
        value, rows, vectors = self.spans(self.chords, pose)
        bias = -vectors @ velocity[2::3] ** 2
        for k, body, on, direction, angle in self.guides():
            # Along the normal, which turns with the body that the guide is on
            normal, w = 1j * np.exp(1j * (direction + angles[on])), omega[on]
            bias[k] = dot(normal, bias[k] - 2j * w * (rows[k] @ velocity) - w**2 * value[k])
            rows[k] = dot(normal, rows[k] - 1j * value[k] * turns[on]) + 1j * (turns[body] - turns[on])
            value[k] = dot(normal, value[k]) + 1j * (angles[body] - angles[on] - angle)
        value, bias, rows = (z[self.tight].view(float) for z in (value, bias, rows))
        rows = rows.reshape(len(rows), -1, 2).swapaxes(1, 2).reshape(-1, len(pose))
        change = np.zeros(len(value))
        if self.rate:
            value = np.array([*value, pose[self.driven] - self.angle - self.rate * t])
            driven = turns[self.driven // 3, None]
            rows, change, bias = np.concatenate([rows, driven]), [*change, -self.rate], [*bias, 0.0]
        return value, rows, np.array(change), np.array(bias)

    def assemble(self):
        """Return pose and velocity at the start: ideal joints, loose ones off by their offsets."""
        scene, n, offsets, keys = self.scene, len(self.mass), [], ("x", "y", "angle_deg", "vx", "vy", "omega")
        for name in self.joints:
            row, pair = scene.get("clearance", {}).get(name), np.zeros((2, 2))
            if row and name in scene["pin"]:
                pair = -np.array([row["offset"], row["offset_rate"]])
            elif row:
                tilt = math.radians(row["tilt_deg"])
                pair = np.array([[row["offset"], tilt], [row["offset_rate"], row["tilt_rate"]]])
            offsets.append(pair)
        (places, rates), pose = np.hstack(offsets), np.zeros(n)
        for body, row in [*scene["guess"].items(), *scene["initial"].items()]:
            k = 3 * self.place[body] + 2
            pose[k] = math.radians(row["angle_deg"]) if "angle_deg" in row else pose[k]
        starts = {}, {}
        for body, row in [] if self.rate else scene["initial"].items():
            for key, value in row.items():
                order, k = divmod(keys.index(key), 3)
                starts[order][3 * self.place[body] + k] = math.radians(value) if key == "angle_deg" else value
        at, speeds = [*starts[0]], starts[1] or dict.fromkeys(starts[0], 0.0)
        flat, unit = np.arange(n) % 3 < 2, np.eye(n)
        value, rows, _, _ = self.constraints(0.0, pose, pose)
        pose[flat] -= np.linalg.lstsq(rows[:, flat], value, rcond=None)[0]
        for _ in range(20):
            value, rows, change, _ = self.constraints(0.0, pose, pose)
            value[: len(places)] -= places
            value = np.append(value, pose[at] - [*starts[0].values()])
            pose = pose - solve_linear(np.vstack([rows, unit[at]]), value)
        if not np.abs(value).max() < 1e-12:
            raise LostError
        change[: len(rates)] -= rates
        rows = np.vstack([rows, unit[[*speeds]]])
        return pose, solve_linear(rows, np.append(-change, [*speeds.values()]))

    def rank(self, look):
        """Return the smallest singular value of the constraints, lengths over the largest one."""
        matrix = look.jacobian.copy()
        shifts = np.abs(matrix).reshape(len(matrix), -1, 3)[:, :, :2].any(axis=(1, 2))
        matrix[np.ix_(shifts, np.arange(matrix.shape[1]) % 3 == 2)] /= self.size
        return np.linalg.svd(matrix, compute_uv=False)[-1]

    def begin(self, look):
        """Choose the independent coordinates, and return them and their rates."""
        rows = self.constraints(look.t, look.pose, look.velocity)[1]
        rows[:, 2::3] *= 5  # arms of 0.2 m are as good as 1
        order = qr(rows, pivoting=True, mode="r")[1] if len(rows) else np.arange(rows.shape[1])
        self.bound, self.free = order[: len(rows)], order[len(rows) :]
        self.near = look.t, look.pose, np.zeros((len(self.mass), len(self.free))), 0 * look.pose
        return look.pose[self.free], look.velocity[self.free]

    def look(self, t, z, dz):
        """Return the linkage at given coordinates: depth, rate, slip of contacts, rows of the last two."""
        n, free, bound, (origin, near, slope, drift) = len(self.mass), self.free, self.bound, self.near
        pose, step = near + slope @ (z - near[free]) + drift * (t - origin), np.ones(1)
        pose[free] = z
        while np.abs(step).max(initial=0) > 1e-10:  # the next step is its square, over a small singular value
            value, rows, change, _ = self.constraints(t, pose, np.zeros(n))
            step = solve_linear(rows[:, bound], value)
            pose[bound] -= step
            if not np.abs(pose - near).max() < 0.5:
                raise LostError
        rows = self.constraints(t, pose, np.zeros(n))[1]
        slope, drift, bend = np.zeros((n, len(free))), np.zeros(n), np.zeros(n)
        slope[free], slope[bound] = np.eye(len(free)), -solve_linear(rows[:, bound], rows[:, free])
        drift[bound] = -solve_linear(rows[:, bound], change)
        velocity = slope @ dz + drift
        bend[bound] = -solve_linear(rows[:, bound], self.constraints(t, pose, velocity)[3])
        self.near = t, pose, slope, drift
        look = SimpleNamespace(t=t, pose=pose, velocity=velocity, slope=slope, drift=drift, bend=bend)
        look.jacobian, look.gaps, look.rows, look.places = rows, [], [], []
        c, u = np.append(pose[0::3] + 1j * pose[1::3], 0), np.append(np.exp(1j * pose[2::3]), 1)
        chords, guides = self.spans(self.chords, pose)[0], {k: guide for k, *guide in self.guides()}
        for contact in self.contacts:
            name, _, corner = contact.name.partition(".")
            row, k = contact.clearance, self.joints.index(name)
            if corner:
                (first, second, direction, angle), (along, across) = guides[k], CORNERS[corner]
                tangent = np.exp(1j * direction) * u[second]
                normal = 1j * across * tangent
                half = complex(along * row["length"], across * row["width"]) / 2
                spot = c[first] + half * np.exp(1j * (direction - angle)) * u[first]
                at = chords[k] + spot - c[first]
                depth = dot(normal, at) - row["width"] / 2 - row["size"]
            else:
                (first, _), (second, point) = self.ends[k]
                at = -chords[k]
                normal = at / abs(at) if at else 1 + 0j
                tangent, depth = 1j * normal, abs(at) - row["size"]
                spot = c[second] + u[second] * point + (row["journal_radius"] + row["size"]) * normal
            rows = np.zeros((2, n + 3))
            for target, way in zip(rows, (normal, tangent), strict=True):
                for body, to in ((first, way), (second, -way)):
                    target[3 * body : 3 * body + 3] += to.real, to.imag, dot(to, 1j * (spot - c[body]))
            look.rows.append(rows[:, :-3])
            look.gaps.append((depth, *(rows[:, :-3] @ velocity)))
            look.places.append(at)
        return look

    def spring_spans(self, look):
        """Return springs, their lengths, and the rows that give the rates of these."""
        spans, rows, _ = self.spans(self.springs, look.pose)
        rows = dot(spans / np.abs(spans), rows.T).T
        return [*zip(self.scene["spring"].items(), np.abs(spans), rows, strict=True)]

    def loads(self, look, forces):
        """Return all forces but those of constraints, the power of a torque and that of dampers."""
        scene, loads, loss = self.scene, np.zeros(len(self.mass)), 0.0
        loads[1::3] = -scene["environment"]["gravity"] * self.mass[1::3]
        for (normal, shear, _), (row, along) in zip(forces, look.rows, strict=True):
            loads += shear * along - normal * row
        for (_, spring), span, row in self.spring_spans(look):
            rate = row @ look.velocity
            loads -= tension(spring, span, rate) * row
            loss += spring["damping"] * rate**2
        if scene.get("load"):
            k = 3 * self.place[scene["load"]["body"]] + 1
            loads[k] += push(scene["load"], look.pose[k])[0]
        torque = scene["drive"].get("torque", 0.0)
        if "torque_table" in scene["drive"]:
            degrees = math.degrees(look.pose[self.driven]) % 360
            torque = float(np.interp(degrees, *np.transpose(scene["drive"]["torque_table"])))
        loads[self.driven] += torque
        return loads, torque * look.velocity[self.driven], loss

    def accelerate(self, look, forces):
        """Return the independent coordinates' accelerations and powers of drive and dampers."""
        loads, power, loss = self.loads(look, forces)
        momenta = look.slope * self.mass[:, None]
        change = np.linalg.solve(look.slope.T @ momenta, look.slope.T @ loads - momenta.T @ look.bend)
        look.acceleration = look.slope @ change + look.bend
        look.reaction = self.mass * look.acceleration - loads  # by the joints
        return change, power + look.drift @ look.reaction, loss

    def sample(self, look, sums):
        scene, row, gravity = self.scene, {}, self.scene["environment"]["gravity"]
        forces = [contact.force(*gap) for contact, gap in zip(self.contacts, look.gaps, strict=True)]
        self.accelerate(look, forces)
        keys = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
        for k, name in enumerate(self.names):
            motion = look.pose, look.velocity, look.acceleration
            values = [x for part in motion for x in part[3 * k : 3 * k + 3]]
            row |= {f"{name}.{key}": value for key, value in zip(keys, values, strict=True)}
        multipliers = np.linalg.lstsq(look.jacobian.T, look.reaction, rcond=None)[0]
        joints = dict(zip(self.tight, multipliers[: 2 * len(self.tight)].reshape(-1, 2), strict=True))
        guides = {k: guide for k, *guide in self.guides()}
        for contact, gap, (normal, shear, _), at, (across, along) in zip(
            self.contacts, look.gaps, forces, look.places, look.rows, strict=True
        ):
            name, _, corner = contact.name.partition(".")
            k, total, prefix = self.joints.index(name), shear * along - normal * across, contact.name
            prefix += "_" if corner else "."
            row |= {prefix + "gap": -gap[0]} if corner else {prefix + "x": at.real, prefix + "y": at.imag}
            row |= {prefix + "normal": normal, prefix + "friction": shear}
            if corner:
                b, on, direction, _ = guides[k]
                angle = direction + (0 if on == len(self.names) else look.pose[3 * on + 2])
                force = dot(1j * np.exp(1j * angle), complex(*total[3 * b : 3 * b + 2]))
                joints[k] = joints.get(k, 0) + np.array([force, total[3 * b + 2]])
            else:
                b = 3 * self.ends[k][1][0]
                joints[k] = total[b : b + 2]
        for k, pair in joints.items():
            keys = ("force", "moment") if k in guides else ("reaction_x", "reaction_y")
            row |= {f"{self.joints[k]}.{key}": value for key, value in zip(keys, pair, strict=True)}
        row |= {"drive.torque": multipliers[-1]} if self.rate else {}
        drop = gravity * self.mass[1::3] @ (self.start.pose - look.pose)[1::3]
        row |= {"energy_kinetic": self.mass @ look.velocity**2 / 2, "energy_gravity": drop}
        row |= {"energy_drive": sums[0], "energy_damping": sums[1], "energy_spring": 0.0}
        for (name, spring), span, rates in self.spring_spans(look):
            row[f"{name}.force"] = tension(spring, span, rates @ look.velocity)
            row["energy_spring"] += spring["stiffness"] * (span - spring["length"]) ** 2 / 2
        if self.contacts:
            gaps = zip(self.contacts, look.gaps, strict=True)
            energy = sum(c.force(*gap)[2] * gap[0] / (c.contact["exponent"] + 1) for c, gap in gaps)
            row |= {"energy_friction": sums[2], "energy_contact": energy}
        if scene.get("load"):
            row["energy_load"] = push(scene["load"], look.pose[3 * self.place[scene["load"]["body"]] + 1])[1]
        return row


def dot(a, b):
    return (np.conj(a) * b).real


def solve_linear(matrix, right):
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        raise LostError from None


def tension(spring, length, rate):
    return spring["stiffness"] * (length - spring["length"]) + spring["damping"] * rate


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
