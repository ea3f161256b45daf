"""Minimal-coordinate programs of the textbook linkages: one coordinate, closures in closed form, Eksergian's equation.

The coordinate q is the angle of one link (the travel of a slider); every other link follows from circles and lines
that meet. With the influence coefficients c' = dc/dq of the centroids and phi' of the angles,

    M q'' + 1/2 M' q'^2 = Q,    M = sum m |c'|^2 + J phi'^2

Jets carry first and second derivatives through the closures. Where q comes to a dead position another link takes
over (`Linkage.choose`), so that motions pass where a fixed coordinate turns around.

Read from a scene by the names of bodies and pins: crank (frame-O-crank), rod (A to B), and rocker (frame-C-rocker-B) or
slider (B, guide G); with them, in a six-bar, five (D to E) and six (F to E) between any two of these and the frame.
"""

import cmath
import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import minimize_scalar

SINGULAR = 1e-3
"""Of the start's smallest singular value: there a run ends."""


class Lost(ArithmeticError):
    """Circles and lines that do not meet."""


class Jet:
    """A number, real or complex, with its first and second derivative along one parameter."""

    __slots__ = ("d", "s", "v")

    def __init__(self, v, d=0.0, s=0.0):
        self.v, self.d, self.s = v, d, s

    def __add__(self, other):
        if not isinstance(other, Jet):
            return Jet(self.v + other, self.d, self.s)
        return Jet(self.v + other.v, self.d + other.d, self.s + other.s)

    def __neg__(self):
        return Jet(-self.v, -self.d, -self.s)

    def __sub__(self, other):
        return self + -other

    def __mul__(self, other):
        if not isinstance(other, Jet):
            return Jet(self.v * other, self.d * other, self.s * other)
        v, d, s, w, e, t = self.v, self.d, self.s, other.v, other.d, other.s
        return Jet(v * w, d * w + v * e, s * w + 2 * d * e + v * t)

    __radd__, __rmul__ = __add__, __mul__

    def function(self, v, first, second):
        """Return f of it, from f and its derivatives there."""
        return Jet(v, first * self.d, first * self.s + second * self.d**2)

    def inverse(self):
        v = 1 / self.v
        return self.function(v, -v * v, 2 * v**3)

    def root(self):
        if self.v <= 0:
            raise Lost
        v = math.sqrt(self.v)
        return self.function(v, 0.5 / v, -0.25 / v**3)

    def unit(self):
        """Return exp(i q)."""
        v = cmath.exp(1j * self.v)
        return self.function(v, 1j * v, -v)

    def conjugate(self):
        return Jet(*(complex(x).conjugate() for x in (self.v, self.d, self.s)))

    @property
    def real(self):
        return Jet(self.v.real, self.d.real, self.s.real)

    @property
    def imag(self):
        return Jet(self.v.imag, self.d.imag, self.s.imag)

    def square(self):
        """Return |z|^2."""
        return (self * self.conjugate()).real


def meet(P, r, Q, s, side):
    """Return the point at r from P and s from Q, left (side 1) or right (-1) of the line from P to Q."""
    D = Q - P
    over = D.square().inverse()
    along = over * (0.5 * (r * r - s * s)) + 0.5
    across = (over * (r * r) - along * along).root()
    return P + D * (along + across * (1j * side))


def meet_line(P, r, line, along, side):
    """Return the point at r from P on a line, ahead of P's foot (side 1) or behind it."""
    z = (P - line) * along.conjugate()
    return line + (z.real + (Jet(r * r) - z.imag * z.imag).root() * side) * along


@dataclass
class Frame:
    """Where a body is: origin and direction (|z| = 1) of its own frame."""

    origin: Jet
    turn: Jet

    def at(self, own):
        """Return the place of a point of the body."""
        return self.origin + self.turn * own

    @property
    def angular(self):
        """phi' and phi''."""
        first = self.turn.d / self.turn.v
        return first.imag, (self.turn.s / self.turn.v - first * first).imag


def carried(P, Q, own_P, own_Q):
    """Return the frame of a body with own_P at P and own_Q at Q."""
    turn = (Q - P) * (1 / (own_Q - own_P))
    return Frame(P - turn * own_P, turn)


FIXED = Frame(Jet(0j), Jet(1 + 0j))


class Linkage:
    """A linkage of a scene in one assembly, with a coordinate that `choose` may exchange."""

    def __init__(self, scene):
        self.bodies, self.drive = scene["body"], scene["drive"]
        self.guide = scene.get("guide", {}).get("G")
        self.loads = [scene["load"]] if scene.get("load") else []
        self.gravity = scene["environment"]["gravity"]
        self.pins = {name: self.ends(pin) for name, pin in scene["pin"].items()}
        self.springs = [(spring, *self.ends(spring).items()) for spring in scene.get("spring", {}).values()]
        self.length = {
            body: abs(self.own(pin, body) - self.own(other, body))
            for body, (pin, other) in {"crank": "OA", "rod": "AB", "rocker": "CB", "five": "DE", "six": "FE"}.items()
            if body in self.bodies
        }
        if self.guide:
            self.along = cmath.exp(1j * math.radians(self.guide["direction_deg"]))
            self.tilt = cmath.exp(1j * math.radians(self.guide.get("angle_deg", self.guide["direction_deg"])))
            arm = self.tilt * (complex(*self.bodies["slider"]["centroid"]) - self.own("B", "slider"))
            self.line = Jet(complex(*self.guide["point"]) - arm)
        self.inner, self.outer = "crank", None
        self.warm = (0.0, 0.0, 0.0)
        self.assemble(scene)

    def ends(self, joint):
        """Return {body: own point} of the two ends of a pin or spring."""
        points = {}
        for end in joint["joins"]:
            body, _, point = end.partition(".")
            place = joint.get("point", [0, 0]) if body == "frame" else self.bodies[body]["points"].get(point)
            points[body] = complex(*(self.bodies[body]["centroid"] if point == "centroid" else place))
        return points

    def own(self, pin, body):
        return self.pins[pin][body]

    def loop(self, q, side):
        """Return the points A and B from the coordinate of the inner link."""
        O = Jet(self.own("O", "frame"))  # noqa: E741
        a, b, inner = self.length["crank"], self.length["rod"], self.inner
        if self.guide:
            if inner == "slider":
                B = self.line + q * self.along
                return meet(O, a, B, b, side), B
            if inner == "crank":
                A = O + q.unit() * a
                return A, meet_line(A, b, self.line, self.along, side)
            A = meet_line(O, a, self.line - q.unit() * b, self.along, side)
            return A, A + q.unit() * b
        C, c = Jet(self.own("C", "frame")), self.length["rocker"]
        if inner == "rocker":
            B = C + q.unit() * c
            return meet(O, a, B, b, side), B
        if inner == "crank":
            A = O + q.unit() * a
            return A, meet(A, b, C, c, side)
        A = meet(O, a, C - q.unit() * b, c, side)
        return A, A + q.unit() * b

    def first(self, q, side):
        """Return the frames of the first loop, and of the fixed one."""
        A, B = self.loop(q, side)
        own = self.own
        frames = {"frame": FIXED, "crank": carried(Jet(own("O", "frame")), A, own("O", "crank"), own("A", "crank"))}
        frames["rod"] = carried(A, B, own("A", "rod"), own("B", "rod"))
        if self.guide:
            turn = Jet(self.tilt)
            frames["slider"] = Frame(B - turn * own("B", "slider"), turn)
        else:
            frames["rocker"] = carried(Jet(own("C", "frame")), B, own("C", "rocker"), own("B", "rocker"))
        return frames

    def pivot(self, frames, pin, dyad):
        """Return where a link of the dyad hangs from the first loop."""
        (body,) = set(self.pins[pin]) - {dyad}
        return frames[body].at(self.own(pin, body))

    def second(self, frames, p, side):
        """Return E, and how far |link|^2 of the other link is from its own where p is the angle of one link."""
        D, F = self.pivot(frames, "D", "five"), self.pivot(frames, "F", "six")
        five, six = self.length["five"], self.length["six"]
        if p is None:
            return meet(D, five, F, six, side), None
        near, far, r, s = (F, D, six, five) if self.outer == "six" else (D, F, five, six)
        E = near + p.unit() * r
        return E, (E - far).square() - s * s

    def place(self, q):
        """Return the frames of all bodies, with derivatives along the coordinate."""
        jet = Jet(q, 1.0)
        inner = jet
        if self.outer:
            before, value, slope = self.warm
            value += slope * (q - before)
            for _ in range(30):
                gap = self.second(self.first(Jet(value, 1.0), self.sides[0]), Jet(q), 0)[1]
                value -= gap.v / gap.d
                if abs(gap.v / gap.d) < 1e-14:
                    break
            else:
                raise Lost
            across = self.second(self.first(Jet(value), self.sides[0]), jet, 0)[1].d
            slope = -across / gap.d
            curved = self.second(self.first(Jet(value, slope), self.sides[0]), jet, 0)[1].s
            inner = Jet(value, slope, -curved / gap.d)
            self.warm = (q, value, slope)
        frames = self.first(inner, self.sides[0])
        if "six" in self.bodies:
            D, F = self.pivot(frames, "D", "five"), self.pivot(frames, "F", "six")
            E, _ = self.second(frames, jet if self.outer else None, self.sides[1])
            frames["five"] = carried(D, E, self.own("D", "five"), self.own("E", "five"))
            frames["six"] = carried(F, E, self.own("F", "six"), self.own("E", "six"))
        return frames

    def coordinate(self, frames, link):
        """Return the coordinate of a link: the angle of its line, or the slider's travel."""
        if link == "slider":
            return ((frames["slider"].at(self.own("B", "slider")) - self.line) * self.along.conjugate()).real.v
        pin, other = {"crank": "OA", "rod": "AB", "rocker": "CB", "five": "DE", "six": "FE"}[link]
        return cmath.phase((frames[link].turn * (self.own(other, link) - self.own(pin, link))).v)

    def ratios(self, frames):
        """Return |d coordinate / dq| of each link, a slider's over the crank's length."""
        ratios = {link: abs(frames[link].angular[0]) for link in self.bodies if link != "slider"}
        if self.guide:
            ratios["slider"] = abs(frames["slider"].origin.d) / self.length["crank"]
        return ratios

    def choose(self, frames, rate, keep=None):
        """Take the link that moves most (or keep) as the coordinate; return it and its rate."""
        ratios = self.ratios(frames)
        loop = {link: ratio for link, ratio in ratios.items() if link not in ("five", "six")}
        inner, outer = max(loop, key=loop.get), max(ratios, key=ratios.get)
        if keep:
            inner, outer = keep, None
        velocity = {link: frames[link].angular[0] for link in loop}
        if self.guide:
            velocity["slider"] = (frames["slider"].origin.d * self.along.conjugate()).real
        pivot = outer if outer in ("five", "six") else None
        value = self.coordinate(frames, pivot or inner)
        slope = frames[pivot].angular[0] if pivot else velocity[inner]
        self.inner, self.outer = inner, pivot
        self.warm = (value, self.coordinate(frames, inner), velocity[inner] / slope)
        self.pick(frames, value)
        return value, rate * slope

    def pick(self, frames, value):
        """Set the sides on which circles meet to those of given frames."""
        best = math.inf
        warm = self.warm
        for sides in ((s, t) for s in (1, -1) for t in ((1, -1) if "six" in self.bodies and not self.outer else (1,))):
            self.sides, self.warm = sides, warm
            try:
                other = self.place(value)
            except Lost:
                continue
            far = sum(abs(other[b].turn.v - frames[b].turn.v) + abs(other[b].origin.v - frames[b].origin.v) for b in other)
            if far < best:
                best, chosen = far, sides
        if math.isinf(best):
            raise Lost
        self.sides, self.warm = chosen, warm

    def assemble(self, scene):
        """Set q and its rate of the start from [initial], the assembly by [guess]."""
        initial, guess = scene.get("initial", {}), scene.get("guess", {})
        degrees = {b: (guess.get(b, {}) | initial.get(b, {})).get("angle_deg", 0.0) for b in self.bodies}
        turned = {b: cmath.exp(1j * math.radians(angle)) for b, angle in degrees.items()}
        crank = turned["crank"] * (self.own("A", "crank") - self.own("O", "crank"))
        q = cmath.phase(crank)

        def distance(sides):
            self.sides = sides
            try:
                frames = self.place(q)
            except Lost:
                return math.inf
            return sum(abs(frames[b].turn.v - turned[b]) for b in self.bodies)

        self.sides = min(((s, t) for s in (1, -1) for t in (1, -1)), key=distance)
        given = [(b, k, v) for b, row in initial.items() for k, v in row.items()]
        ((body, key, value),) = [row for row in given if row[1] in ("x", "y", "angle_deg")]
        for _ in range(50):
            frames = self.place(q)
            if key == "angle_deg":
                error = cmath.phase(frames[body].turn.v * cmath.exp(-1j * math.radians(value)))
                slope = frames[body].angular[0]
            else:
                centroid = self.centroid(frames, body)
                error = (centroid.v.real if key == "x" else centroid.v.imag) - value
                slope = centroid.d.real if key == "x" else centroid.d.imag
            q -= error / slope
            if abs(error / slope) < 1e-15:
                break
        frames = self.place(q)
        self.start = {b: near(cmath.phase(frames[b].turn.v), math.radians(degrees[b])) for b in self.bodies}
        self.q, self.rate = q, 0.0
        if "speed_rpm" in self.drive:
            self.q, _ = self.choose(frames, 0.0, keep=self.drive["body"])
            self.rate = self.drive["speed_rpm"] * math.pi / 30
        for body, key, value in given:
            if key in ("vx", "vy", "omega"):
                centroid = self.centroid(frames, body).d
                slope = {"vx": centroid.real, "vy": centroid.imag, "omega": frames[body].angular[0]}[key]
                self.rate = value / slope

    def centroid(self, frames, body):
        return frames[body].at(complex(*self.bodies[body]["centroid"]))

    def equation(self, frames, rate):
        """Return M, M', Q without a drive by speed, power of the torque, and that which dampers take."""
        M = dM = Q = 0.0
        for name, body in self.bodies.items():
            c, (first, second) = self.centroid(frames, name), frames[name].angular
            m, J = body["mass"], body["inertia"]
            M += m * abs(c.d) ** 2 + J * first**2
            dM += 2 * (m * (c.d.conjugate() * c.s).real + J * first * second)
            Q -= m * self.gravity * c.d.imag
        for load in self.loads:
            c = self.centroid(frames, load["body"])
            Q += push(load, load["surface"] - c.v.imag)[0] * c.d.imag
        damped = 0.0
        for spring, length in self.lengths(frames):
            damping = spring.get("damping", 0.0) * length.d * rate
            Q -= (spring["stiffness"] * (length.v - spring["length"]) + damping) * length.d
            damped += damping * length.d * rate
        power = 0.0
        if "torque" in self.drive or "torque_table" in self.drive:
            driven = frames[self.drive["body"]]
            torque = self.drive.get("torque")
            if torque is None:
                degrees, torques = zip(*self.drive["torque_table"], strict=True)
                torque = float(np.interp(math.degrees(cmath.phase(driven.turn.v)) % 360, degrees, torques))
            Q += torque * driven.angular[0]
            power = torque * driven.angular[0] * rate
        return M, dM, Q, power, damped

    def lengths(self, frames):
        for spring, (body, own), (other, there) in self.springs:
            yield spring, (frames[other].at(there) - frames[body].at(own)).square().root()

    def rank(self, frames):
        """Return the smallest singular value of the constraints, lengths over the largest: the judge of the end."""
        names = list(self.bodies)
        far = [p for pin in self.pins.values() for body, p in pin.items() if body == "frame"]
        scale = max([*self.length.values(), *(abs(p - o) for p in far for o in far)])
        rows = []
        for pin in self.pins.values():
            for part in (0, 1):
                row = np.zeros(3 * len(names))
                for sign, (body, own) in zip((1, -1), pin.items(), strict=True):
                    if body != "frame":
                        arm = 1j * (frames[body].at(own).v - self.centroid(frames, body).v) / scale
                        k = 3 * names.index(body)
                        row[k + part], row[k + 2] = sign, sign * (arm.real, arm.imag)[part]
                rows.append(row)
        if self.guide:
            k = 3 * names.index("slider")
            normal = 1j * self.along
            rows += [np.zeros(3 * len(names)) for _ in range(2)]
            rows[-2][k], rows[-2][k + 1], rows[-1][k + 2] = normal.real, normal.imag, 1.0
        if "speed_rpm" in self.drive:
            rows.append(np.eye(3 * len(names))[3 * names.index(self.drive["body"]) + 2])
        return np.linalg.svd(np.array(rows), compute_uv=False)[-1]


def near(angle, other):
    """Return the angle plus whole turns that is nearest to another."""
    return angle + 2 * math.pi * round((other - angle) / (2 * math.pi))


def push(load, h):
    """Return force and stored energy of a workpiece at the depth h."""
    if h <= 0:
        return 0.0, 0.0
    if load.get("table"):
        depths, forces = (list(column) for column in zip(*load["table"], strict=True))
        force = float(np.interp(h, depths, forces))
        inside = [d for d in depths if d < h]
        x, y = [*inside, h], [*forces[: len(inside)], force]
        return force, float(np.trapezoid(y, x))
    ratio, q = h / load["depth"], load["exponent"]
    return load["force"] * ratio**q, load["force"] * load["depth"] * ratio ** (q + 1) / (q + 1)


@dataclass
class Motion:
    """Columns at the samples up to the end, the outcome and when; `turns` counts dead positions passed."""

    columns: dict
    outcome: str
    time: float
    turns: int
    lowest: float
    """Smallest singular value over that of the start."""


def times(scene):
    output, drive = scene["output"], scene["drive"]
    if "speed_rpm" in drive:
        n = round(drive.get("cycles", 1) * output["samples_per_cycle"])
        return np.arange(n + 1) * 60 / abs(drive["speed_rpm"]) / output["samples_per_cycle"]
    return np.arange(output["samples"] + 1) * output["duration"] / output["samples"]


def solve(scene, tolerance=1e-13):
    """Return the motion of a scene.

    Parameters
    ----------
    scene
        Complete mapping of a linkage scene.
    tolerance
        Of DOP853, relative; absolute a tenth.
    """
    linkage = Linkage(scene)
    grid = times(scene)
    speed = linkage.rate if "speed_rpm" in scene["drive"] else None
    q, rate = linkage.q, linkage.rate
    initial = linkage.rank(linkage.place(q))
    if speed is None:
        q, rate = linkage.choose(linkage.place(q), rate)
    watch = Watch(linkage, initial)
    state = np.array([q, rate, 0.0, 0.0])
    rows = [sample(linkage, state, speed)]
    end, first = None, None
    for t, after in zip(grid[:-1], grid[1:], strict=True):
        while t < after and end is None:
            end_of_step, state, first, end = advance(linkage, watch, speed, (t, after, state, first), tolerance)
            t = end_of_step  # noqa: PLW2901
        if end is not None:
            break
        rows.append(sample(linkage, state, speed))
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for body, angle in linkage.start.items():
        turned = np.unwrap(columns[f"{body}.angle"])
        columns[f"{body}.angle"] = turned - turned[0] + angle
    columns["energy_gravity"] = columns["energy_gravity"][0] - columns["energy_gravity"]
    columns["time"] = grid[: len(rows)]
    return Motion(columns, "regular" if end is None else "singular", end or grid[-1], watch.turns, watch.lowest)


class Watch:
    """The smallest singular value along a run, and dead positions of the first coordinate (crossings of `sines`)."""

    def __init__(self, linkage, initial):
        self.linkage, self.initial = linkage, initial
        self.turns, self.lowest, self.signs, self.last = 0, 1.0, None, 1.0

    def __call__(self, step, t0, t1):
        """Return the time of a singular position within a step (dense output), or None."""
        linkage = self.linkage

        def sigma(t):
            try:
                return linkage.rank(linkage.place(step(t)[0])) / self.initial
            except Lost:
                return 0.0

        points = np.linspace(t0, t1, 6)
        values = [sigma(t) for t in points]
        k = int(np.argmin(values))
        low, when = values[k], points[k]
        if low < 0.1:
            near_k = points[max(k - 1, 0)], points[min(k + 1, 5)]
            best = minimize_scalar(sigma, near_k, bounds=near_k, method="bounded", options={"xatol": 1e-13})
            if best.fun < low:
                low, when = best.fun, best.x
        self.lowest, self.last = min(self.lowest, low), low
        signs = self.signs_of(linkage.place(step(t1)[0]))
        if self.signs is not None:
            self.turns += sum(a != b for a, b in zip(signs, self.signs, strict=True))
        self.signs = signs
        if low < SINGULAR:
            slope = (values[0] - low) / (when - t0) if when > t0 else math.inf
            # At the end of a step the zero lies ahead: sigma falls on linearly.
            return when + (low / slope if when >= t1 - 1e-12 else 0.0)
        return None

    def signs_of(self, frames):
        """Return on which side of its dead positions each dyad is: rod and rocker (slider), five and six."""
        lk = self.linkage
        line = {
            link: cmath.exp(1j * lk.coordinate(frames, link)) for link in lk.bodies if link not in ("slider", "crank")
        }
        signs = [(line["rod"].conjugate() * (line["rocker"] if "rocker" in line else 1j * lk.along)).imag > 0]
        return signs + ([(line["five"].conjugate() * line["six"]).imag > 0] if "six" in line else [])


def derivative(linkage, speed, state):
    q, rate = state[:2]
    try:
        frames = linkage.place(q)
    except Lost:
        return np.full(4, np.nan)
    M, dM, Q, power, damped = linkage.equation(frames, rate)
    if speed is not None:
        return np.array([speed, 0.0, (dM * speed**2 / 2 - Q) * speed, damped])
    return np.array([rate, (Q - dM * rate**2 / 2) / M, power, damped])


def advance(linkage, watch, speed, start, tolerance):
    """Return time, state, step and singular time (or None) after one step or at a change of the coordinate."""
    t, after, state, first = start
    solver = DOP853(
        lambda _, y: derivative(linkage, speed, y), t, state, after, rtol=tolerance, atol=tolerance / 10,
        first_step=None if first is None else min(first, after - t),
    )  # fmt: skip
    while solver.status == "running":
        tried = solver.h_abs
        # Near a dead position roots of small differences round off.
        solver.rtol = max(tolerance, 1e-15 / watch.last**2)
        solver.atol = solver.rtol / 10
        solver.step()
        if solver.status == "failed":
            return t, state, first, solver.t
        first = max(solver.h_abs, 0.0 if solver.status == "running" else tried)
        step = solver.dense_output()
        end = watch(step, solver.t_old, solver.t)
        if end is not None:
            return solver.t, solver.y, first, end
        if speed is None:
            frames = linkage.place(solver.y[0])
            ratios = linkage.ratios(frames)
            loop = [ratio for link, ratio in ratios.items() if link not in ("five", "six")]
            inner = ratios[linkage.inner]
            if max(ratios.values()) > 3 * ratios[linkage.outer or linkage.inner] or max(loop) > 3 * inner:
                q, rate = linkage.choose(frames, solver.y[1])
                return solver.t, np.array([q, rate, *solver.y[2:]]), None, None
    return solver.t, solver.y, first, None


def sample(linkage, state, speed):
    """Return the columns of one moment; angles within a turn, gravity's energy from height 0."""
    q, rate, work, damping = state
    frames = linkage.place(q)
    M, dM, Q, _, _ = linkage.equation(frames, rate)
    change = 0.0 if speed is not None else (Q - dM * rate**2 / 2) / M
    row = {}
    for name in linkage.bodies:
        c, (first, second) = linkage.centroid(frames, name), frames[name].angular
        velocity, acceleration = c.d * rate, c.d * change + c.s * rate**2
        row |= {f"{name}.x": c.v.real, f"{name}.y": c.v.imag, f"{name}.angle": cmath.phase(frames[name].turn.v)}
        row |= {f"{name}.vx": velocity.real, f"{name}.vy": velocity.imag, f"{name}.omega": first * rate}
        row |= {f"{name}.ax": acceleration.real, f"{name}.ay": acceleration.imag}
        row[f"{name}.alpha"] = first * change + second * rate**2
    if speed is not None:
        row["drive.torque"] = dM * rate**2 / 2 - Q
    row["energy_kinetic"] = M * rate**2 / 2
    row["energy_gravity"] = sum(
        body["mass"] * linkage.gravity * linkage.centroid(frames, name).v.imag for name, body in linkage.bodies.items()
    )
    row["energy_drive"], row["energy_damping"] = work, damping
    lengths = [(spring, length.v) for spring, length in linkage.lengths(frames)]
    row["energy_spring"] = sum(s["stiffness"] * (length - s["length"]) ** 2 / 2 for s, length in lengths)
    if linkage.loads:
        (load,) = linkage.loads
        row["energy_load"] = push(load, load["surface"] - linkage.centroid(frames, load["body"]).v.imag)[1]
    return row
