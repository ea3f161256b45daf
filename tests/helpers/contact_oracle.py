"""A minimal-coordinate program for linkages with clearances, and the contact law of docs/model.md, section 6.

`Bodies` takes as many of the bodies' coordinates for independent as a pose leaves free; the loops give the
others by Newton's method. Contact acts by its virtual power,
-F_n rate + F_t slip, hence by the rows that give rate and slip from the velocities. Touches and separations
are zeros of gaps on DOP853's dense output, integrated to again; there the integration starts anew.
"""

import cmath
import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from linkage_oracle import LostError, drive_torque, end_of, push, tension, times
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
from scipy.optimize import brentq

CORNERS = {"ll": (-1, 1), "lr": (-1, -1), "ul": (1, 1), "ur": (1, -1)}
"""Sides of a corner along the guide's direction and along its normal."""


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


def contacts_of(scene):
    return [
        Contact(f"{name}.{corner}" if corner else name, clearance)
        for name, clearance in scene["clearance"].items()
        for corner in (CORNERS if name in scene["guide"] else [""])
    ]


class March:
    """A motion: coordinates, rates; work of the drive, losses to damping and friction; impulses."""

    def __init__(self, system, tolerance):
        self.system, self.contacts, self.tolerance = system, system.contacts, tolerance
        self.sums, self.step = np.zeros(3 + len(self.contacts)), 1e-8

    def look(self, t, state):
        f = len(self.system.free)
        return self.system.look(t, state[:f], state[f : 2 * f])

    def derivative(self, t, state):
        try:
            look = self.look(t, state)
        except (LostError, np.linalg.LinAlgError):  # a trial too far
            return np.full(len(state), np.nan)
        forces = [contact.force(*gap) for contact, gap in zip(self.contacts, look.gaps, strict=True)]
        change, power, heat = self.system.accelerate(look, forces)
        (normal, slid, elastic), (_, rate, slip) = (np.reshape(x, (-1, 3)).T for x in (forces, look.gaps))
        sums = [power, heat + (normal - elastic) @ rate, -slid @ slip, *normal]
        return np.concatenate([state[len(change) : 2 * len(change)], change, sums])

    def solver(self, t, state, until):
        # Of the rates by what rounding of a depth gives a light body of a stiff contact.
        f, rtol = len(self.system.free), self.tolerance
        atol = rtol * np.concatenate([np.full(f, 0.01), np.full(f, 100.0), np.ones(len(self.sums))])
        options = {"rtol": rtol, "atol": atol, "first_step": min(self.step, abs(until - t))}
        return DOP853(self.derivative, t, state, until, **options)

    def advance(self, look, until):
        """Return the look at `until` or at the first touch or separation before it."""
        solver = self.solver(look.t, np.concatenate([*self.system.begin(look), self.sums]), until)
        parts = np.append(2.0 ** -np.arange(40, 3, -4), np.linspace(0, 1, 8)[1:])
        while solver.status == "running":
            before = solver.t, solver.y
            if solver.step():
                raise ArithmeticError(f"integrator failed at {solver.t}")
            zero = self.first(solver.dense_output(), solver.t_old + parts * solver.step_size)
            parts = parts[-7:]
            if zero:
                return self.cross(*before, *zero)
            self.step = solver.h_abs
        self.sums = solver.y[-len(self.sums) :]
        return self.look(solver.t, solver.y)

    def first(self, dense, at):
        """Return time and contact of the first touch or separation among times of a step, or None."""

        def depths(t):
            """Return what is positive until a contact switches."""
            gaps = self.look(t, dense(t)).gaps
            for contact, gap in zip(self.contacts, gaps, strict=True):
                contact.watch(*gap)
            return [gap[0] * (1 if c.impact else -1) for c, gap in zip(self.contacts, gaps, strict=True)]

        # A margin that has just switched starts at zero, up to rounding.
        for (start, early), (end, late) in pairwise((t, depths(t)) for t in [dense.t_old, *at]):
            zeros = []
            for k, (a, b) in enumerate(zip(early, late, strict=True)):
                if b < min(a, 0) - 1e-14:
                    inside = depths(start)[k] > 0 > depths(end)[k]
                    zero = brentq(lambda t, k=k: depths(t)[k], start, end, xtol=1e-18) if inside else start
                    zeros.append((zero, k))
            if zeros:
                return min(zeros)
        return None

    def cross(self, t, state, when, k):
        """Integrate to a zero of gap k, twice for its error on the dense output, and switch contact k."""
        for _ in range(2):
            if when != t:
                solver = self.solver(t, state, when)
                while solver.status == "running":
                    solver.step()
                t, state = solver.t, solver.y
            look = self.look(t, state)
            depth, rate, _ = look.gaps[k]
            when -= depth / rate if abs(depth) < 1e-9 * abs(rate) else 0
        self.sums, self.step = state[-len(self.sums) :], 1e-8
        self.contacts[k].switch(t, rate, self.sums[3 + k])
        return look


def solve(system, grid=None, tolerance=1e-13, contacts=math.inf):
    """Return columns at the times of a grid and events, up to the end of the n-th contact."""
    march, look, rows = March(system, tolerance), system.start, []
    for after in times(system.scene) if grid is None else grid:
        while look.t < after and sum(len(c.events) - bool(c.impact) for c in system.contacts) < contacts:
            look = march.advance(look, after)
        if look.t == after:
            rows.append({"time": after} | system.sample(look, march.sums))
    for contact, impulse in zip(system.contacts, march.sums[3:], strict=True):
        if contact.impact:
            contact.switch(look.t, 0, impulse)
    events = sorted(
        (event for c in system.contacts for event in c.events), key=lambda e: round(e["start"], 12)
    )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, events


class Bodies:
    """Any linkage; `free` are its independent coordinates among x, y, angle of each body."""

    def __init__(self, scene):
        self.scene, self.names, self.contacts = scene, list(scene["body"]), contacts_of(scene)
        bodies, drive = scene["body"].values(), scene["drive"]
        self.mass = np.array([m for body in bodies for m in (body["mass"], body["mass"], body["inertia"])])
        self.place = {name: k for k, name in enumerate([*self.names, "frame"])}
        self.pins = {name: self.ends(pin) for name, pin in scene["pin"].items()}
        self.guides = {}
        for name, row in scene["guide"].items():
            direction, angle = (
                cmath.exp(1j * math.radians(row[key])) for key in ("direction_deg", "angle_deg")
            )
            point = complex(*row["point"]) - self.middle(row["on"])
            ends = self.place[row["body"]], self.place[row["on"]]
            self.guides[name] = *ends, point, direction, angle, math.radians(row["angle_deg"])
        self.rate = drive.get("speed_rpm", 0.0) * math.pi / 30
        self.driven = 3 * self.place[drive.get("body", self.names[0])] + 2
        self.angle = math.radians(scene["initial"].get(drive.get("body"), {}).get("angle_deg", 0.0))
        self.tight = [*self.pins, *self.guides]
        pose, velocity = self.assemble()
        self.tight = [name for name in self.tight if name not in scene["clearance"]]
        start = SimpleNamespace(t=0.0, pose=pose, velocity=velocity)
        self.start = self.look(0.0, *self.begin(start))

    def ends(self, joint):
        """Return body and point, from its centroid, of both ends of a joint."""
        ends = [end_of(self.scene["body"], joint, end) for end in joint["joins"]]
        return [(self.place[body], own - self.middle(body)) for body, own in ends]

    def middle(self, body):
        return 0j if body == "frame" else complex(*self.scene["body"][body]["centroid"])

    def constraints(self, t, pose, velocity):
        """Return values and rows, with their rates at no velocity, and rates of these at no acceleration."""
        c, u, v, w = split(pose, velocity)
        value, change, bias, rows = [], [], [], np.zeros((2 * len(self.tight), len(pose) + 3))
        for name, row in zip(self.tight, rows.reshape(-1, 2, len(pose) + 3), strict=True):
            if name in self.pins:
                gap = curved = 0j
                for sign, (b, own) in zip((-1, 1), self.pins[name], strict=True):
                    arm = sign * u[b] * own
                    gap, curved = gap + sign * c[b] + arm, curved - w[b] ** 2 * arm
                    velocity_row(row[0], b, sign, u[b] * own)
                    velocity_row(row[1], b, sign * 1j, u[b] * own)
                value += [gap.real, gap.imag]
                bias += [curved.real, curved.imag]
            else:
                b, on, own, direction, _, angle = self.guides[name]
                normal, arm = 1j * direction * u[on], u[on] * own
                across, moved = c[b] - c[on] - arm, v[b] - v[on] - 1j * w[on] * arm
                velocity_row(row[0], b, normal, 0j)
                velocity_row(row[0], on, -normal, arm + across)
                row[1, 3 * b + 2], row[1, 3 * on + 2] = 1, -1
                angles = np.append(pose[2::3], 0)
                value += [dot(normal, across), angles[b] - angles[on] - angle]
                bias += [dot(normal, w[on] ** 2 * (arm - across)) + 2 * dot(1j * w[on] * normal, moved), 0]
        change, rows = [0.0] * len(value), rows[:, :-3]
        if self.rate:
            value, change, bias = (
                [*value, pose[self.driven] - self.angle - self.rate * t],
                [*change, -self.rate],
                [*bias, 0],
            )
            rows = np.vstack([rows, np.eye(len(pose))[self.driven]])
        return np.array(value), rows, np.array(change), np.array(bias)

    def assemble(self):
        """Return pose and velocity at the start: ideal joints, loose ones off by their offsets."""
        scene, n, offsets, keys = self.scene, len(self.mass), [], ("x", "y", "angle_deg", "vx", "vy", "omega")
        for name in self.tight:
            row, pair = scene["clearance"].get(name), np.zeros((2, 2))
            if row and name in self.pins:
                pair = -np.array([row["offset"], row["offset_rate"]])
            elif row:
                tilt = math.radians(row["tilt_deg"])
                pair = np.array([[row["offset"], tilt], [row["offset_rate"], row["tilt_rate"]]])
            offsets.append(pair)
        (places, rates), pose = np.hstack(offsets), np.zeros(n)
        for body, row in [*scene["guess"].items(), *scene["initial"].items()]:
            k = 3 * self.place[body] + 2
            pose[k] = math.radians(row["angle_deg"]) if "angle_deg" in row else pose[k]
        initial = [] if self.rate else scene["initial"].items()
        given = [
            (divmod(keys.index(key), 3), 3 * self.place[body], value)
            for body, row in initial
            for key, value in row.items()
        ]
        given = [
            [
                (at + k, math.radians(value) if (k, order) == (2, 0) else value)
                for (o, k), at, value in given
                if o == order
            ]
            for order in (0, 1)
        ]
        speeds = given[1] or [(k, 0.0) for k, _ in given[0]]
        flat = [k for k in range(n) if k % 3 < 2]
        value, rows, change, _ = self.constraints(0.0, pose, pose)
        pose[flat] -= np.linalg.lstsq(rows[:, flat], value, rcond=None)[0]
        for _ in range(20):
            value, rows, change, _ = self.constraints(0.0, pose, pose)
            value[: len(places)] -= places
            value = np.append(value, [pose[k] - x for k, x in given[0]])
            pose = pose - np.linalg.solve(np.vstack([rows, np.eye(n)[[k for k, _ in given[0]]]]), value)
        change[: len(rates)] -= rates
        rows = np.vstack([rows, np.eye(n)[[k for k, _ in speeds]]])
        return pose, np.linalg.solve(rows, np.append(-change, [x for _, x in speeds]))

    def begin(self, look):
        """Choose the independent coordinates, and return them and their rates."""
        rows = self.constraints(look.t, look.pose, look.velocity)[1]
        rows[:, 2::3] *= 5  # arms of 0.2 m are as good as 1
        order = qr(rows, pivoting=True, mode="r")[1] if len(rows) else np.arange(rows.shape[1])
        self.bound, self.free = order[: len(rows)], order[len(rows) :]
        self.near, self.slope = look.pose, np.zeros((len(self.mass), len(self.free)))
        return look.pose[self.free], look.velocity[self.free]

    def look(self, t, z, dz):
        """Return the linkage at given coordinates: depth, rate, slip of contacts, rows of the last two."""
        n, free, bound = len(self.mass), self.free, self.bound
        pose = self.near + self.slope @ (z - self.near[free])
        pose[free], step = z, np.ones(1)
        while np.abs(step).max(initial=0) > 1e-8:  # the next one is its square
            value, rows, change, _ = self.constraints(t, pose, np.zeros(n))
            step = np.linalg.solve(rows[:, bound], value)
            pose[bound] -= step
            if not np.abs(pose - self.near).max() < 0.5:
                raise LostError
        rows = self.constraints(t, pose, np.zeros(n))[1]
        inverse, slope, drift, curved = (
            np.linalg.inv(rows[:, bound]),
            np.zeros((n, len(free))),
            np.zeros(n),
            np.zeros(n),
        )
        slope[free], slope[bound], drift[bound] = (
            np.eye(len(free)),
            -inverse @ rows[:, free],
            -inverse @ change,
        )
        velocity = slope @ dz + drift
        curved[bound] = -inverse @ self.constraints(t, pose, velocity)[3]
        self.near, self.slope = pose, slope
        look = SimpleNamespace(t=t, pose=pose, velocity=velocity, slope=slope, drift=drift, curved=curved)
        look.gaps, look.rows, look.places = [], [], []
        c, u, _, _ = split(pose, velocity)
        for contact in self.contacts:
            name, _, corner = contact.name.partition(".")
            row, gap = contact.clearance, contact.clearance["size"]
            if corner:
                first, second, own, direction, angle, _ = self.guides[name]
                along, across = CORNERS[corner]
                tangent = direction * u[second]
                normal = 1j * across * tangent
                spot = (
                    complex(along * row["length"], across * row["width"]) / 2 * direction / angle * u[first]
                    + c[first]
                )
                at = spot - c[second] - u[second] * own
                depth = dot(normal, at) - row["width"] / 2 - gap
            else:
                (first, own), (second, there) = self.pins[name]
                bearing = c[second] + u[second] * there
                at = c[first] + u[first] * own - bearing
                normal = at / abs(at) if at else 1 + 0j
                tangent, depth = 1j * normal, abs(at) - gap
                spot = bearing + (row["journal_radius"] + gap) * normal
            rows = np.zeros((2, n + 3))
            for target, way in zip(rows, (normal, tangent), strict=True):
                velocity_row(target, first, way, spot - c[first])
                velocity_row(target, second, -way, spot - c[second])
            look.rows.append(rows[:, :-3])
            look.gaps.append((depth, *(rows[:, :-3] @ velocity)))
            look.places.append(at)
        return look

    def springs(self, look):
        """Return springs, their lengths, and the rows that give the rates of these."""
        c, u, _, _ = split(look.pose, look.velocity)
        for spring in self.scene["spring"].values():
            (a, own), (b, there) = self.ends(spring)
            span, row = c[b] + u[b] * there - c[a] - u[a] * own, np.zeros(3 * len(c))
            velocity_row(row, a, -span / abs(span), u[a] * own)
            velocity_row(row, b, span / abs(span), u[b] * there)
            yield spring, abs(span), row[:-3]

    def applied(self, look, forces):
        """Return all forces but those of constraints, the power of a torque and that of dampers."""
        scene, applied, damped = self.scene, np.zeros(len(self.mass)), 0.0
        applied[1::3] = -scene["environment"]["gravity"] * self.mass[1::3]
        for (normal, slid, _), (row, along) in zip(forces, look.rows, strict=True):
            applied += slid * along - normal * row
        for spring, span, row in self.springs(look):
            rate = row @ look.velocity
            applied -= tension(spring, span, rate) * row
            damped += spring["damping"] * rate**2
        if scene.get("load"):
            k = 3 * self.place[scene["load"]["body"]] + 1
            applied[k] += push(scene["load"], look.pose[k])[0]
        torque = drive_torque(scene["drive"], look.pose[self.driven])
        applied[self.driven] += torque
        return applied, torque * look.velocity[self.driven], damped

    def accelerate(self, look, forces):
        """Return the independent coordinates' accelerations and powers of drive and dampers."""
        applied, power, damped = self.applied(look, forces)
        weighed = look.slope * self.mass[:, None]
        change = np.linalg.solve(look.slope.T @ weighed, look.slope.T @ applied - weighed.T @ look.curved)
        look.carried = self.mass * (look.slope @ change + look.curved) - applied  # by the joints
        return change, power + look.drift @ look.carried, damped

    def energies(self, look):
        scene = self.scene
        row = {"energy_kinetic": self.mass @ look.velocity**2 / 2}
        row["energy_spring"] = sum(
            s["stiffness"] * (x - s["length"]) ** 2 / 2 for s, x, _ in self.springs(look)
        )
        gaps = zip(self.contacts, look.gaps, strict=True)
        row["energy_contact"] = sum(
            c.force(*gap)[2] * gap[0] / (c.contact["exponent"] + 1) for c, gap in gaps
        )
        if scene.get("load"):
            row["energy_load"] = push(scene["load"], look.pose[3 * self.place[scene["load"]["body"]] + 1])[1]
        return row

    def sample(self, look, sums):
        """Return the columns of one moment."""
        scene, row, (_, u, _, _) = self.scene, {}, split(look.pose, look.velocity)
        forces = [contact.force(*gap) for contact, gap in zip(self.contacts, look.gaps, strict=True)]
        self.accelerate(look, forces)
        acceleration = (look.carried + self.applied(look, forces)[0]) / self.mass
        keys = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
        for k, name in enumerate(self.names):
            values = [x for part in (look.pose, look.velocity, acceleration) for x in part[3 * k : 3 * k + 3]]
            row |= {f"{name}.{key}": value for key, value in zip(keys, values, strict=True)}
        carried = np.linalg.lstsq(
            self.constraints(look.t, look.pose, look.velocity)[1].T, look.carried, rcond=None
        )[0]
        joints = dict(zip(self.tight, carried.reshape(-1)[: 2 * len(self.tight)].reshape(-1, 2), strict=True))
        for contact, gap, (normal, slid, _), at, (across, along) in zip(
            self.contacts, look.gaps, forces, look.places, look.rows, strict=True
        ):
            name, _, corner = contact.name.partition(".")
            total, prefix = slid * along - normal * across, contact.name + ("_" if corner else ".")
            row |= {prefix + "gap": -gap[0]} if corner else {prefix + "x": at.real, prefix + "y": at.imag}
            row |= {prefix + "normal": normal, prefix + "friction": slid}
            if corner:
                b, on, _, direction, _, _ = self.guides[name]
                pushed = dot(1j * direction * u[on], complex(*total[3 * b : 3 * b + 2]))
                joints[name] = joints.get(name, 0) + np.array([pushed, total[3 * b + 2]])
            else:
                k = 3 * self.pins[name][1][0]
                joints[name] = total[k : k + 2]
        for name, pair in joints.items():
            keys = ("reaction_x", "reaction_y") if name in self.pins else ("force", "moment")
            row |= {f"{name}.{key}": value for key, value in zip(keys, pair, strict=True)}
        row |= {"drive.torque": carried[-1]} if self.rate else {}
        for name, (spring, span, rates) in zip(scene["spring"], self.springs(look), strict=True):
            row[f"{name}.force"] = tension(spring, span, rates @ look.velocity)
        fallen = scene["environment"]["gravity"] * self.mass[1::3] @ (self.start.pose - look.pose)[1::3]
        row |= {"energy_drive": sums[0], "energy_damping": sums[1], "energy_friction": sums[2]}
        return row | self.energies(look) | {"energy_gravity": fallen}


def split(pose, velocity):
    """Return centroids, exp(i angle), velocities and angular velocities, those of the frame last."""
    (x, y, angle), (vx, vy, omega) = (z.reshape(-1, 3).T.tolist() for z in (pose, velocity))
    u = [complex(math.cos(a), math.sin(a)) for a in angle]
    return [*map(complex, x, y), 0j], [*u, 1], [*map(complex, vx, vy), 0j], [*omega, 0.0]


def dot(a, b):
    return (a.conjugate() * b).real


def velocity_row(row, b, way, arm):
    """Add the row that gives, along a way, the velocity of body b's point at an arm from its centroid."""
    row[3 * b] += way.real
    row[3 * b + 1] += way.imag
    row[3 * b + 2] += dot(way, 1j * arm)
