"""Minimal-coordinate programs for linkages with clearances, and the contact law of docs/model.md, section 6.

`Bodies` takes as many of the bodies' coordinates for independent as a pose leaves free; the loops give the
others by Newton's method. `SliderCrank` has equations written out. Contact acts by its virtual power,
-F_n rate + F_t slip, hence by the rows that give rate and slip from the velocities.

`solve` integrates one smooth piece after another: within a piece no contact closes, opens, is clipped or
passes into another part of friction's ramp. Guards are positive in a piece; the zero of one is located on the
dense output, integrated to again, and the next piece starts there.
"""

import cmath
import math
from dataclasses import dataclass, field

import numpy as np
from linkage_oracle import LostError, drive_torque, end_of, push, tension, times
from scipy.integrate import DOP853
from scipy.linalg import qr
from scipy.optimize import brentq, minimize_scalar

CORNERS = {"ll": (-1, 1), "lr": (-1, -1), "ul": (1, 1), "ur": (1, -1)}
"""Sides of a corner along the guide's direction and along its normal."""
ROUNDING = 1e-14
"""Of a guard."""
DAMPING = {
    "lankarani-nikravesh": lambda e: 0.75 * (1 - e**2),
    "hunt-crossley": lambda e: 1.5 * (1 - e),
    "flores": lambda e: 8 * (1 - e) / (5 * e),
    "gonthier": lambda e: (1 - e**2) / e,
}


class Contact:
    """A contact: its law, the piece of it that holds, and its events."""

    def __init__(self, name, clearance):
        contact, friction, c = clearance["contact"], clearance["friction"], clearance["size"]
        radius = clearance.get("corner_radius")
        if radius is None:
            radius = clearance["journal_radius"] * (clearance["journal_radius"] + c) / c
        self.name, self.clearance, self.n = name, clearance, contact["exponent"]
        self.K = 2 / 3 * contact["youngs_modulus"] / (1 - contact["poisson"] ** 2) * math.sqrt(radius)
        self.adams = contact["law"] == "adams-impact"
        if self.adams:
            self.K = contact.get("stiffness", self.K)
            self.c, self.d = contact["damping"], contact["damping_depth"]
        else:
            self.C = DAMPING[contact["damping_model"]](contact["restitution"])
        self.floor, self.mu = contact["impact_speed_floor"], friction["coefficient"]
        self.v0, self.v1 = friction["static_speed"], friction["transition_speed"]
        self.closed = self.clipped = self.deep = False
        self.zone, self.impact, self.events = 0, 0.0, []

    def share(self, depth, rate):
        """Return the normal force over its elastic part."""
        if not self.adams:
            return 1 + self.C * rate / self.impact
        s = 1.0 if self.deep else depth / self.d
        rest = depth**-self.n if self.deep else depth ** (2 - self.n) / self.d**2
        return 1 + self.c * (3 - 2 * s) * rest * rate / self.K

    def force(self, depth, rate, slip):
        """Return normal force, friction and the elastic part of the first, in the piece that holds."""
        if not self.closed:
            return 0.0, 0.0, 0.0
        depth = max(depth, 1e-30)
        elastic = self.K * depth**self.n
        normal = 0.0 if self.clipped else elastic * self.share(depth, rate)
        part = (0.0, (abs(slip) - self.v0) / (self.v1 - self.v0), 1.0)[abs(self.zone)]
        return normal, -self.mu * part * normal * math.copysign(1, self.zone), elastic

    def guards(self, depth, rate, slip):
        """Return what is positive in the piece that holds, with what changes where it is not."""
        if not self.closed:
            return [(-depth, "closed", True)]
        pull = self.share(max(depth, 1e-30), rate)
        result = [(depth, "closed", False), (-pull if self.clipped else pull, "clipped", not self.clipped)]
        if self.adams:
            result.append((depth - self.d if self.deep else self.d - depth, "deep", not self.deep))
        if self.mu:
            bounds = (-math.inf, -self.v1, -self.v0, self.v0, self.v1, math.inf)[
                self.zone + 2 : self.zone + 4
            ]
            result += [(slip - bounds[0], "zone", self.zone - 1), (bounds[1] - slip, "zone", self.zone + 1)]
        return result

    def switch(self, key, value, t, gap, impulse):
        setattr(self, key, value)
        if key != "closed":
            return
        _, rate, slip = gap
        if value:
            self.impact, self.clipped, self.deep = max(rate, self.floor), False, False
            self.zone = int(np.searchsorted([-self.v1, -self.v0, self.v0, self.v1], slip)) - 2
            self.events.append(
                {"corner": self.name, "start": t, "end": math.inf, "normal_speed": self.impact}
            )
            self.events[-1] |= {"impulse": -impulse, "peak_force": 0.0, "largest_depth": 0.0}
        else:
            self.events[-1]["end"] = t
            self.events[-1]["impulse"] += impulse

    def watch(self, depth, rate, slip):
        if self.closed:
            event = self.events[-1]
            event["largest_depth"] = max(event["largest_depth"], depth)
            event["peak_force"] = max(event["peak_force"], self.force(depth, rate, slip)[0])


def contacts_of(scene):
    return [
        Contact(f"{name}.{corner}" if corner else name, clearance)
        for name, clearance in scene["clearance"].items()
        for corner in (CORNERS if name in scene["guide"] else [""])
    ]


@dataclass
class Look:
    """A linkage at a time: pose, velocity; of each contact depth, rate, slip and the rows of the last two."""

    t: float
    pose: np.ndarray
    velocity: np.ndarray
    gaps: list = field(default_factory=list)
    rows: list = field(default_factory=list)
    places: list = field(default_factory=list)
    slope: np.ndarray | None = None
    drift: np.ndarray | None = None
    curved: np.ndarray | None = None


@dataclass
class Motion:
    columns: dict
    events: list
    evaluations: int


class March:
    """A motion: state (coordinates, rates, work of the drive, losses to damping, friction; impulses)."""

    def __init__(self, system, tolerance):
        self.system, self.contacts, self.tolerance = system, system.contacts, tolerance
        self.sums, self.step, self.fresh, self.evaluations = np.zeros(3 + len(self.contacts)), 1e-8, True, 0

    def derivative(self, t, state):
        self.evaluations += 1
        f = len(self.system.free)
        try:
            look = self.look(t, state)
        except LostError:  # a trial too far
            return np.full(len(state), np.nan)
        forces = [contact.force(*gap) for contact, gap in zip(self.contacts, look.gaps, strict=True)]
        change, _, power, heat = self.system.accelerate(look, forces)
        lost = sum((F - elastic) * gap[1] for (F, _, elastic), gap in zip(forces, look.gaps, strict=True))
        slid = sum(F * gap[2] for (_, F, _), gap in zip(forces, look.gaps, strict=True))
        sums = [power, heat + lost, -slid, *(F for F, _, _ in forces)]
        return np.concatenate([state[f : 2 * f], change, sums])

    def look(self, t, state):
        f = len(self.system.free)
        return self.system.look(t, state[:f], state[f : 2 * f])

    def guards(self, look):
        return [
            (*guard, k)
            for k, (contact, gap) in enumerate(zip(self.contacts, look.gaps, strict=True))
            for guard in contact.guards(*gap)
        ]

    def solver(self, t, state, until):
        first = min(self.step, abs(until - t))
        rtol = self.tolerance
        return DOP853(self.derivative, t, state, until, rtol=rtol, atol=rtol / 100, first_step=first)

    def advance(self, look, until):
        """Return the look at `until` or at the first switch before it."""
        state = np.concatenate([*self.system.begin(look), self.sums])
        solver = self.solver(look.t, state, until)
        while solver.status == "running":
            before = solver.t, solver.y
            solver.step()
            if solver.status == "failed":
                raise ArithmeticError(f"integrator failed at {solver.t}")
            event = self.first(solver.dense_output(), before[0], solver.t)
            self.fresh = False
            if event is not None:
                return self.cross(*before, *event)
            self.step = solver.h_abs
        self.sums = solver.y[-len(self.sums) :]
        return self.look(solver.t, solver.y)

    def first(self, dense, start, end):
        """Return guard and time of the first zero of one in a step, or None."""
        h, table = end - start, []

        def values(part):
            look = self.look(start + part * h, dense(start + part * h))
            for contact, gap in zip(self.contacts, look.gaps, strict=True):
                contact.watch(*gap)
            return np.array([guard[0] for guard in self.guards(look)])

        early = 2.0 ** -np.arange(40, 3, -4) if self.fresh else []
        for part in [0.0, *early, *np.linspace(0, 1, 13)[1:]]:
            table.append((part, values(part)))
            least = np.minimum(table[0][1], 0) - ROUNDING  # one just passed starts at zero but for rounding
            zeros = []
            for k, value in enumerate(table[-1][1]):
                trio = [(p, row[k]) for p, row in table[-3:]]
                low = part if value < least[k] else math.inf
                if len(trio) == 3 and trio[0][1] > trio[1][1] < value < math.inf:
                    # Of a parabola the least is not below the middle by more than an eighth of its bend.
                    if trio[1][1] > trio[0][1] + value - 2 * trio[1][1]:
                        continue
                    ends = trio[0][0], part
                    best = minimize_scalar(lambda p, k=k: values(p)[k], bounds=ends, options={"xatol": 1e-9})
                    low = best.x if best.fun < least[k] else low
                if low < math.inf:
                    high = max(p for p, _ in trio if p < low)
                    inside = values(high)[k] > 0 > values(low)[k]
                    zero = brentq(lambda p, k=k: values(p)[k], high, low, xtol=1e-15) if inside else high
                    zeros.append((zero, k))
            if zeros:
                return min(zeros)[1], start + min(zeros)[0] * h
        return None

    def cross(self, t, state, k, when):
        """Integrate to the zero of guard k, change what it guards, and return the look there."""
        for _ in range(2):
            if when != t:
                solver = self.solver(t, state, when)
                while solver.status == "running":
                    solver.step()
                t, state = solver.t, solver.y
            look = self.look(t, state)
            _, key, value, which = self.guards(look)[k]
            depth, rate, _ = look.gaps[which]
            if key == "closed" and abs(depth) < 1e-9 * abs(rate):
                when = t - depth / rate
        self.sums, self.step, self.fresh = state[-len(self.sums) :], 1e-8, True
        self.contacts[which].switch(key, value, t, look.gaps[which], self.sums[3 + which])
        return look


def solve(system, grid=None, tolerance=1e-13, contacts=math.inf):
    """Return the motion of a system up to the end of its n-th contact, at DOP853's relative tolerance."""
    march, look, rows = March(system, tolerance), system.start, []
    for after in times(system.scene) if grid is None else grid:
        while look.t < after:
            look = march.advance(look, after)
            if sum(event["end"] < math.inf for c in system.contacts for event in c.events) >= contacts:
                break
        if look.t < after:
            break
        rows.append({"time": after} | sample(system, look, march.sums))
    events = sorted((event for c in system.contacts for event in c.events), key=lambda event: event["start"])
    for contact, total in zip(system.contacts, march.sums[3:], strict=True):
        if contact.closed:
            contact.events[-1]["end"] = look.t
            contact.events[-1]["impulse"] += total
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    columns["energy_gravity"] = columns["energy_gravity"][0] - columns["energy_gravity"]
    stored = sum(columns.get(f"energy_{part}", 0.0) for part in ("kinetic", "spring", "contact", "load"))
    columns["energy_residual"] = columns["energy_drive"] + columns["energy_gravity"] - (stored - stored[0])
    columns["energy_residual"] -= columns["energy_damping"] + columns["energy_friction"]
    return Motion(columns, events, march.evaluations)


def sample(system, look, sums):
    """Return the columns of one moment; gravity's energy from height 0."""
    scene, row, n = system.scene, {}, len(system.names)
    forces = [contact.force(*gap) for contact, gap in zip(system.contacts, look.gaps, strict=True)]
    _, acceleration, _, _ = system.accelerate(look, forces)
    keys = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
    values = np.hstack([part.reshape(n, 3) for part in (look.pose, look.velocity, acceleration)])
    for name, of_body in zip(system.names, values, strict=True):
        row |= {f"{name}.{key}": value for key, value in zip(keys, of_body, strict=True)}
    for contact, gap, (normal, slid, _), at in zip(
        system.contacts, look.gaps, forces, look.places, strict=True
    ):
        if "." in contact.name:
            row[f"{contact.name}_gap"] = -gap[0]
        else:
            row |= {f"{contact.name}.x": at.real, f"{contact.name}.y": at.imag}
        mark = "_" if "." in contact.name else "."
        row |= {f"{contact.name}{mark}normal": normal, f"{contact.name}{mark}friction": slid}
    row |= {"energy_kinetic": system.mass @ look.velocity**2 / 2, "energy_drive": sums[0]}
    row |= {"energy_damping": sums[1], "energy_friction": sums[2]}
    row["energy_gravity"] = scene["environment"]["gravity"] * (system.mass[::3] @ look.pose[1::3])
    row["energy_contact"] = sum(
        elastic * max(gap[0], 0) / (contact.n + 1)
        for contact, gap, (_, _, elastic) in zip(system.contacts, look.gaps, forces, strict=True)
    )
    return row | system.more(look, acceleration, forces)


class Bodies:
    """Any linkage; `free` are its independent coordinates of (x, y, angle) of each body."""

    def __init__(self, scene):
        self.scene, self.names, loose = scene, list(scene["body"]), scene["clearance"]
        self.mass = np.array(
            [m for b in scene["body"].values() for m in (b["mass"], b["mass"], b["inertia"])]
        )
        self.contacts, self.place = (
            contacts_of(scene),
            {name: k for k, name in enumerate([*self.names, "frame"])},
        )
        self.pins = {name: self.ends(pin) for name, pin in scene["pin"].items()}
        self.springs = [(spring, self.ends(spring)) for spring in scene["spring"].values()]
        self.guides = {name: self.line(guide) for name, guide in scene["guide"].items()}
        self.rate = scene["drive"].get("speed_rpm", 0.0) * math.pi / 30
        self.driven = 3 * self.place[scene["drive"].get("body", self.names[0])] + 2
        self.angle = math.radians(scene["initial"].get(scene["drive"].get("body"), {}).get("angle_deg", 0.0))
        self.tight = [name for name in (*self.pins, *self.guides) if name not in loose]
        self.start = self.look(0.0, *self.begin(self.assemble()))

    def ends(self, joint):
        """Return body and point, from its centroid, of both ends of a joint."""
        ends = [end_of(self.scene["body"], joint, end) for end in joint["joins"]]
        return [(self.place[body], own - self.middle(body)) for body, own in ends]

    def middle(self, body):
        return 0j if body == "frame" else complex(*self.scene["body"][body]["centroid"])

    def line(self, guide):
        own = complex(*guide["point"]) - self.middle(guide["on"])
        direction = cmath.exp(1j * math.radians(guide["direction_deg"]))
        return (
            self.place[guide["body"]],
            self.place[guide["on"]],
            own,
            direction,
            math.radians(guide["angle_deg"]),
        )

    def constraints(self, names, t, pose, velocity):
        """Return values, rows, their change by time alone and the accelerations at none of the coordinates'."""
        c, u, v, w = split(pose, velocity)
        a = [*pose[2::3].tolist(), 0.0]
        value, change, bias, rows = [], [], [], [np.zeros((0, len(pose)))]
        for name in names:
            row = np.zeros((2, len(pose) + 3))
            if name in self.pins:
                gap = curved = 0j
                for sign, (b, own) in zip((-1, 1), self.pins[name], strict=True):
                    arm = u[b] * own
                    gap += sign * (c[b] + arm)
                    curved -= sign * w[b] ** 2 * arm
                    velocity_row(row[0], b, sign, arm)
                    velocity_row(row[1], b, sign * 1j, arm)
                value += [gap.real, gap.imag]
                bias += [curved.real, curved.imag]
            else:
                b, on, own, direction, angle = self.guides[name]
                normal, arm = 1j * direction * u[on], u[on] * own
                across = c[b] - c[on] - arm
                velocity_row(row[0], b, normal, 0j)
                velocity_row(row[0], on, -normal, arm + across)
                row[1, 3 * b + 2], row[1, 3 * on + 2] = 1, -1
                value += [dot(normal, across), a[b] - a[on] - angle]
                moved = v[b] - v[on] - 1j * w[on] * arm
                bias += [dot(normal, w[on] ** 2 * (arm - across)) + 2 * dot(1j * w[on] * normal, moved), 0.0]
            change += [0.0, 0.0]
            rows.append(row[:, :-3])
        if self.rate:
            value.append(pose[self.driven] - self.angle - self.rate * t)
            change, bias = [*change, -self.rate], [*bias, 0.0]
            rows.append(np.eye(len(pose))[[self.driven]])
        return np.array(value), np.vstack(rows), np.array(change), np.array(bias)

    def assemble(self):
        """Return the look at the start: ideal joints but for the offsets of loose ones."""
        scene, n, names = self.scene, len(self.mass), [*self.pins, *self.guides]
        pose, zero, offsets, rates = np.zeros(n), np.zeros(n), [], []
        for name in names:
            loose = scene["clearance"].get(name)
            pin = name in self.pins
            for part, values in ("", offsets), ("_rate", rates):
                if loose is None:
                    values += [0.0, 0.0]
                elif pin:
                    values += [-x for x in loose["offset" + part]]
                else:
                    tilt = loose["tilt" + (part or "_deg")]
                    values += [loose["offset" + part], tilt if part else math.radians(tilt)]
        given, speeds = [], []
        for body, row in scene["initial"].items():
            for key, value in row.items():
                k = 3 * self.place[body]
                if key in ("x", "y", "angle_deg") and not self.rate:
                    given.append((k + ("x", "y", "angle_deg").index(key), value))
                elif not self.rate:
                    speeds.append((k + ("vx", "vy", "omega").index(key), value))
        given = [(k, math.radians(value) if k % 3 == 2 else value) for k, value in given]
        for body, row in [*scene["guess"].items(), *scene["initial"].items()]:
            if "angle_deg" in row:
                pose[3 * self.place[body] + 2] = math.radians(row["angle_deg"])
        value, rows, change, _ = self.constraints(names, 0.0, pose, zero)
        flat = [k for k in range(n) if k % 3 < 2]
        pose[flat] -= np.linalg.lstsq(rows[:, flat], value, rcond=None)[0]
        extra = np.eye(n)[[k for k, _ in given]]
        for _ in range(50):
            value, rows, change, _ = self.constraints(names, 0.0, pose, zero)
            value[: len(offsets)] -= offsets
            value = np.append(value, [pose[k] - x for k, x in given])
            step = np.linalg.solve(np.vstack([rows, extra]), -value)
            pose = pose + step
            if np.abs(step).max() < 1e-12:
                break
        else:
            raise ArithmeticError("does not assemble")
        rhs = -change
        rhs[: len(rates)] += rates
        extra = np.eye(n)[[k for k, _ in speeds or given]]
        rhs = np.append(rhs, [x for _, x in speeds] or [0.0] * len(given))
        velocity = np.linalg.solve(np.vstack([rows, extra]), rhs)
        return self.contact_look(Look(0.0, pose, velocity))

    def begin(self, look):
        """Choose the independent coordinates, and return them and their rates."""
        _, rows, _, _ = self.constraints(self.tight, look.t, look.pose, look.velocity)
        rows = np.where(np.arange(rows.shape[1]) % 3 == 2, rows * 5, rows)  # arms of 0.2 m are as good as 1
        order = qr(rows, pivoting=True, mode="r")[1]
        self.bound, self.free = np.sort(order[: len(rows)]), np.sort(order[len(rows) :])
        self.near, self.slope = look.pose, np.zeros((len(self.mass), len(self.free)))
        return look.pose[self.free], look.velocity[self.free]

    def look(self, t, z, dz):
        """Return the linkage at given independent coordinates, near where it was."""
        n, f = len(self.mass), len(self.free)
        pose = self.near + self.slope @ (z - self.near[self.free])
        pose[self.free] = z
        for _ in range(20):
            value, rows, change, _ = self.constraints(self.tight, t, pose, np.zeros(n))
            step = np.linalg.solve(rows[:, self.bound], value)
            pose[self.bound] -= step
            if np.abs(pose - self.near).max() > 0.5:
                raise LostError
            if np.abs(step).max(initial=0) < 1e-8:  # the next one is its square
                break
        else:
            raise LostError
        rows = self.constraints(self.tight, t, pose, np.zeros(n))[1]
        inverse = np.linalg.inv(rows[:, self.bound])
        slope, drift = np.zeros((n, f)), np.zeros(n)
        slope[self.free] = np.eye(f)
        slope[self.bound] = -inverse @ rows[:, self.free]
        drift[self.bound] = -inverse @ change
        velocity, curved = slope @ dz + drift, np.zeros(n)
        curved[self.bound] = -inverse @ self.constraints(self.tight, t, pose, velocity)[3]
        self.near, self.slope = pose, slope
        return self.contact_look(Look(t, pose, velocity, slope=slope, drift=drift, curved=curved))

    def contact_look(self, look):
        """Add depth, rate, slip and rows of the contacts."""
        c, u, _, _ = split(look.pose, look.velocity)
        for contact in self.contacts:
            name, _, corner = contact.name.partition(".")
            gap = contact.clearance["size"]
            if corner:
                first, second, own, direction, angle = self.guides[name]
                along, across = CORNERS[corner]
                length, width = contact.clearance["length"], contact.clearance["width"]
                turned = direction * cmath.exp(-1j * angle) * u[first]
                spot = c[first] + (along * length / 2 + 1j * across * width / 2) * turned
                tangent = direction * u[second]
                normal = 1j * across * tangent
                at = spot - c[second] - u[second] * own
                depth = dot(normal, at) - width / 2 - gap
            else:
                (first, own), (second, there) = self.pins[name]
                bearing = c[second] + u[second] * there
                at = c[first] + u[first] * own - bearing
                normal = at / abs(at) if at else 1 + 0j
                tangent, depth = 1j * normal, abs(at) - gap
                spot = bearing + (contact.clearance["journal_radius"] + gap) * normal
            rows = np.zeros((2, len(look.pose) + 3))
            for row, way in zip(rows, (normal, tangent), strict=True):
                velocity_row(row, first, way, spot - c[first])
                velocity_row(row, second, -way, spot - c[second])
            look.rows.append(rows[:, :-3])
            look.gaps.append((depth, *(rows[:, :-3] @ look.velocity)))
            look.places.append(at)
        return look

    def spans(self, c, u):
        """Yield springs, the rows that give the rates of their lengths, and these."""
        for spring, ((a, own), (b, there)) in self.springs:
            arms, row = (u[a] * own, u[b] * there), np.zeros(3 * len(c))
            span = c[b] + arms[1] - c[a] - arms[0]
            velocity_row(row, a, -span / abs(span), arms[0])
            velocity_row(row, b, span / abs(span), arms[1])
            yield spring, row[:-3], abs(span)

    def applied(self, look, forces):
        """Return all forces but those of constraints, the power of a torque and that of dampers."""
        scene, (c, u, _, _) = self.scene, split(look.pose, look.velocity)
        applied, damped = np.zeros(len(self.mass)), 0.0
        applied[1::3] = -scene["environment"]["gravity"] * self.mass[1::3]
        for (normal, slid, _), (row, along) in zip(forces, look.rows, strict=True):
            applied += slid * along - normal * row
        for spring, row, span in self.spans(c, u):
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
        """Return accelerations of the independent coordinates and of all, powers of drive and dampers."""
        applied, power, damped = self.applied(look, forces)
        weighed = look.slope * self.mass[:, None]
        change = np.linalg.solve(look.slope.T @ weighed, look.slope.T @ applied - weighed.T @ look.curved)
        acceleration = look.slope @ change + look.curved
        return change, acceleration, power + look.drift @ (self.mass * acceleration - applied), damped

    def more(self, look, acceleration, forces):
        """Return what the joints carry, and energies of springs and load."""
        scene, row = self.scene, {}
        applied, _, _ = self.applied(look, forces)
        _, rows, _, _ = self.constraints(self.tight, look.t, look.pose, look.velocity)
        carried = np.linalg.lstsq(rows.T, self.mass * acceleration - applied, rcond=None)[0]
        for k, name in enumerate(self.tight):
            keys = ("reaction_x", "reaction_y") if name in self.pins else ("force", "moment")
            row |= {f"{name}.{key}": value for key, value in zip(keys, carried[2 * k :], strict=False)}
        if self.rate:
            row["drive.torque"] = carried[-1]
        loads = [slid * a - F * n for (F, slid, _), (n, a) in zip(forces, look.rows, strict=True)]
        for name in scene["clearance"]:
            total = sum(x for x, c in zip(loads, self.contacts, strict=True) if c.name.split(".")[0] == name)
            if name in self.pins:
                k = 3 * self.pins[name][1][0]
                row |= {f"{name}.reaction_{part}": total[k + i] for i, part in enumerate("xy")}
            else:
                b, on, _, direction, _ = self.guides[name]
                normal = 1j * direction * split(look.pose, look.velocity)[1][on]
                row[f"{name}.force"] = dot(normal, complex(*total[3 * b : 3 * b + 2]))
                row[f"{name}.moment"] = total[3 * b + 2]
        c, u, _, _ = split(look.pose, look.velocity)
        row["energy_spring"] = 0.0
        for name, (spring, rates, span) in zip(scene["spring"], self.spans(c, u), strict=True):
            row[f"{name}.force"] = tension(spring, span, rates @ look.velocity)
            row["energy_spring"] += spring["stiffness"] * (span - spring["length"]) ** 2 / 2
        if scene.get("load"):
            row["energy_load"] = push(scene["load"], look.pose[3 * self.place[scene["load"]["body"]] + 1])[1]
        return row


def split(pose, velocity):
    """Return centroids, exp(i angle), velocities and angular velocities, those of the frame last."""
    c, v = (np.append(x[::3] + 1j * x[1::3], 0).tolist() for x in (pose, velocity))
    return c, [*map(cmath.exp, (1j * pose[2::3]).tolist()), 1], v, [*velocity[2::3].tolist(), 0.0]


def dot(a, b):
    return (a.conjugate() * b).real


def velocity_row(row, b, way, arm):
    """Add the row that gives, along a way, the velocity of body b's point at an arm from its centroid."""
    way = complex(way)
    row[3 * b] += way.real
    row[3 * b + 1] += way.imag
    row[3 * b + 2] += dot(way, 1j * arm)


class SliderCrank:
    """A slider-crank with its guide along x: rods with centroids on their axes, the slider pinned at its own.

    Its coordinates are crank's angle, rod's angle, and the slider's angle (guide loose) or travel (crank pin).
    """

    names = ("crank", "rod", "slider")

    def __init__(self, scene):
        self.scene, self.contacts = scene, contacts_of(scene)
        (self.m1, self.J1, self.L1, self.c1), (self.m2, self.J2, self.L2, self.c2) = (
            (rod["mass"], rod["inertia"], rod["length"], rod["centroid"][0])
            for rod in map(scene["body"].get, ("crank", "rod"))
        )
        self.m3, self.J3 = (scene["body"]["slider"][key] for key in ("mass", "inertia"))
        self.mass = np.repeat([self.m1, self.m2, self.m3], 3)
        self.mass[2::3] = self.J1, self.J2, self.J3
        self.O, self.height = complex(*scene["pin"]["O"]["point"]), scene["guide"]["G"]["point"][1]
        self.loose, self.g = "G" in scene["clearance"], scene["environment"]["gravity"]
        self.rate = scene["drive"].get("speed_rpm", 0.0) * math.pi / 30
        self.free = [1, 2] if self.rate else [0, 1, 2]
        angles = [math.radians({**scene["guess"].get(name, {}), **scene["initial"].get(name, {})}["angle_deg"])
                  for name in ("crank", "rod")]  # fmt: skip
        self.angle, down = angles[0], math.cos(angles[1])
        omega = self.rate or scene["initial"]["crank"].get("omega", 0.0)
        (clearance,), tip = scene["clearance"].values(), self.O + self.L1 * cmath.exp(1j * self.angle)
        tip_rate = 1j * omega * (tip - self.O)
        end = self.height * 1j
        if self.loose:
            end, end_rate = end + 1j * clearance["offset"], 1j * clearance["offset_rate"]
        else:
            tip, end_rate = tip - complex(*clearance["offset"]), 0j
            tip_rate -= complex(*clearance["offset_rate"])
        rod = math.asin((end - tip).imag / self.L2)
        rod = rod if down > 0 else math.pi - rod
        turn = (end_rate - tip_rate).imag / (self.L2 * math.cos(rod))
        if self.loose:
            last = math.radians(clearance["tilt_deg"]), clearance["tilt_rate"]
        else:
            last = tip.real + self.L2 * math.cos(rod), tip_rate.real - self.L2 * math.sin(rod) * turn
        z, dz = np.array([self.angle, rod, last[0]]), np.array([omega, turn, last[1]])
        self.start = self.look(0.0, z[self.free], dz[self.free])

    def begin(self, look):
        return look.slope[self.free], look.drift[self.free]

    def look(self, t, z, dz):
        if self.rate:
            z, dz = np.append(self.angle + self.rate * t, z), np.append(self.rate, dz)
        look = Look(t, np.zeros(9), np.zeros(9), slope=z, drift=dz)
        u, self.arms = np.exp(1j * z[:2]), np.zeros((3, 3), complex)
        if self.loose:
            base = np.full(3, self.O)
            self.arms[:, :2] = [[self.c1, 0], [self.L1, self.c2], [self.L1, self.L2]]
            angles = z
        else:
            base = np.array([self.O, self.height * 1j + z[2], self.height * 1j + z[2]])
            self.arms[:, :2], self.arms[1:, 2] = [[self.c1, 0], [0, self.c2 - self.L2], [0, 0]], 1
            angles = np.append(z[:2], 0)
        self.put(look.pose, base + self.arms[:, :2] @ u, angles)
        self.put(look.velocity, self.arms @ [*(1j * dz[:2] * u), dz[2]], dz * [1, 1, self.loose])
        for contact in self.contacts:
            depth, at, rows = (self.corner if self.loose else self.journal)(contact, z, *u)
            look.rows.append(np.array(rows))
            look.gaps.append((depth, *(look.rows[-1] @ dz)))
            look.places.append(at)
        return look

    def put(self, pose, middles, angles):
        pose[::3], pose[1::3], pose[2::3] = middles.real, middles.imag, angles

    def corner(self, contact, z, u1, u2):
        along, side = CORNERS[contact.name[2:]]
        length, width, c = (contact.clearance[key] for key in ("length", "width", "size"))
        arm = cmath.exp(1j * z[2]) * complex(along * length, side * width) / 2
        arms = [1j * self.L1 * u1, 1j * self.L2 * u2, 1j * arm]
        y = (self.O + self.L1 * u1 + self.L2 * u2 + arm).imag - self.height
        return side * y - width / 2 - c, 0j, ([side * a.imag for a in arms], [a.real for a in arms])

    def journal(self, contact, z, u1, u2):
        e = self.O + self.L1 * u1 - (z[2] + 1j * self.height - self.L2 * u2)
        n = e / abs(e) if e else 1 + 0j
        bearing = contact.clearance["journal_radius"] + contact.clearance["size"]
        arms = [dot(n, 1j * self.L1 * u1), dot(n, 1j * self.L2 * u2), -n.real]
        across = [dot(1j * n, 1j * self.L1 * u1), dot(1j * n, 1j * self.L2 * u2), n.imag]
        slip = [across[0] + bearing - abs(e), across[1] - bearing, across[2]]
        return abs(e) - contact.clearance["size"], e, (arms, slip)

    def accelerate(self, look, forces):
        (one, two, _), (w1, w2, _), m2, m3, g = look.slope, look.drift, self.m2, self.m3, self.g
        I1, I2 = self.J1 + self.m1 * self.c1**2, self.J2
        if self.loose:
            S = m2 * self.c2 + m3 * self.L2
            a, b, c = I1 + (m2 + m3) * self.L1**2, self.L1 * S * math.cos(one - two), I2 + m2 * self.c2**2
            M = np.array([[a, b, 0], [b, c + m3 * self.L2**2, 0], [0, 0, self.J3]])
            swing = self.L1 * S * math.sin(one - two)
            weight = (self.m1 * self.c1 + (m2 + m3) * self.L1) * math.cos(one)
            Q = [-swing * w2**2 - g * weight, swing * w1**2 - g * S * math.cos(two), 0]
        else:
            b, I2 = m2 * (self.L2 - self.c2), I2 + m2 * (self.L2 - self.c2) ** 2
            M = np.array([[I1, 0, 0], [0, I2, b * math.sin(two)], [0, b * math.sin(two), m2 + m3]])
            Q = [-g * self.m1 * self.c1 * math.cos(one), g * b * math.cos(two), -b * math.cos(two) * w2**2]
        Q[0] += (torque := drive_torque(self.scene["drive"], one))
        for (normal, slid, _), (row, along) in zip(forces, look.rows, strict=True):
            Q = Q + slid * along - normal * row
        change, k = np.zeros(3), self.free
        change[k] = np.linalg.solve(M[np.ix_(k, k)], np.asarray(Q)[k])
        if self.rate:
            torque = M[0] @ change - Q[0]
        u, acceleration = np.exp(1j * look.slope[:2]), np.zeros(9)
        turned = [*((1j * change[:2] - look.drift[:2] ** 2) * u), change[2]]
        self.put(acceleration, self.arms @ turned, change * [1, 1, self.loose])
        return change[k], acceleration, torque * w1, 0.0

    def more(self, look, acceleration, forces):
        return {}
