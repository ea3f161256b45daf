"""The equations of the press as expressions of heyoka.

The equations hold with a given number of closed contacts. Four slots stand for the corners, the closed ones
first; which corner is in a slot, its impact speed and the regime of its friction are parameters. Factors that
are typed here are exact in binary; all other numbers are of the run's arithmetic.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from truth_press.arithmetic import Arithmetic

CORNERS = ("ll", "lr", "ul", "ur")
LAWS = ("hertz-corners", "adams-impact")
LOAD = ("on", "base", "slope", "stored", "low", "high")
"""Parameters of the load: whether it acts, its piece of a table, and the depths that bound the piece."""
SLOT = ("sx", "sy", "sigma", "v", "per_v", "live", "fa", "fb", "down", "low", "up", "high", "deep")
"""Parameters of a slot: its corner; v_i and its inverse; 1 unless clipped; friction fa + fb v_t, and the
bounds low < down v_t, up v_t < high of its regime; 1 beyond the damping depth."""
REACH = 16.0
"""Depth (m) that no workpiece has. Heyoka's steps grow with the size of the distances: no larger one."""
FREE = ("theta4", "theta5", "omega4", "omega5")
INTEGRALS = ("energy_drive", "energy_damping", "energy_friction")
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")


class Plane(NamedTuple):
    """A vector of two expressions."""

    x: Any
    y: Any

    def plus(self, other: "Plane", factor: Any = 1.0) -> "Plane":
        """Return the sum with a multiple of another one."""
        return Plane(self.x + factor * other.x, self.y + factor * other.y)

    def times(self, factor: Any) -> "Plane":
        """Return a multiple."""
        return Plane(factor * self.x, factor * self.y)

    def dot(self, other: "Plane") -> Any:
        """Return the scalar product."""
        return self.x * other.x + self.y * other.y

    @property
    def normal(self) -> "Plane":
        """The vector after a quarter turn to the left."""
        return Plane(-self.y, self.x)


REST = Plane(hy.expression(0.0), hy.expression(0.0))


class Rod(NamedTuple):
    """A rod on a known pin: direction, angular velocity and acceleration; pin with its derivatives."""

    u: Plane
    omega: Any
    alpha: Any
    pin: Plane
    velocity: Plane
    acceleration: Plane

    def at(self, along: Any) -> tuple[Plane, Plane, Plane]:
        """Return place, velocity and acceleration of the point so far along the rod."""
        n = self.u.normal
        acceleration = self.acceleration.plus(n, along * self.alpha).plus(self.u, -along * self.omega**2)
        return self.pin.plus(self.u, along), self.velocity.plus(n, along * self.omega), acceleration


class Press:
    """Numbers of a scene, and the expressions made of them."""

    def __init__(self, scene: Any, arithmetic: Arithmetic, depth: float) -> None:
        self.scene = scene = arithmetic.exact(scene)
        self.depth, self.zero, self.one = (arithmetic.number(value) for value in (depth, 0, 1))
        self.bodies, self.contact = scene["mechanism"], scene["contact"]
        half_turn = 4 * np.arctan(arithmetic.array([1]))[0]
        self.omega = half_turn * scene["drive"]["speed_rpm"] / 30
        self.start = half_turn * self.bodies["crank_angle_deg"] / 180
        self.gravity = Plane(self.zero, scene["environment"]["gravity"])
        self.energies = "energy" in scene["output"]["groups"]
        self.impact, e = self.contact["law"] == "adams-impact", self.contact["restitution"]
        pair = (self.contact["youngs_modulus"], self.contact["poisson"])
        E, nu = (value if isinstance(value, dict) else {"slider": value, "guide": value} for value in pair)
        sigma = sum(((1 - nu[partner] ** 2) / E[partner] for partner in nu), self.zero)
        self.K = 4 / (3 * sigma) * self.contact["corner_radius"] ** 0.5
        if self.impact and self.contact.get("stiffness"):
            self.K = self.contact["stiffness"]
        self.C = {
            "lankarani-nikravesh": 0.75 * (1 - e * e),
            "hunt-crossley": 1.5 * (1 - e),
            "flores": 8 * (1 - e) / (5 * e or 1),  # the scene refuses e = 0 there
            "gonthier": (1 - e * e) / (e or 1),
        }[self.contact["damping_model"]]
        self.load = scene["load"]
        self.loaded = bool(self.load["table"]) or self.load["force"] > 0
        self.load_parameters = {name: hy.par[k] for k, name in enumerate(LOAD)}
        self.first = len(LOAD) if self.loaded else 0
        self._drive()

    def _drive(self) -> None:
        """Close crank, rod 2 and rocker, whose motion is a function of time."""
        bodies, omega = self.bodies, self.omega
        L1, L2, arm = bodies["crank"]["length"], bodies["rod2"]["length"], bodies["rocker"]["centroid"]
        angle = omega * hy.time + self.start
        crank = Rod(Plane(hy.cos(angle), hy.sin(angle)), omega, REST.x, REST, REST, REST)
        H, A = Plane(*bodies["rocker_pivot"]), crank.at(L1)
        D = H.plus(A[0], -1.0)
        along = 0.5 + 0.5 * (L2 * L2 - arm * arm) / D.dot(D)
        across = bodies["rocker_branch"] * hy.sqrt(L2 * L2 / D.dot(D) - along * along)
        u2 = D.times(along).plus(D.normal, across).times(1 / L2)
        u3 = D.times(along - 1.0).plus(D.normal, across).times(1 / arm)
        n1, sine = crank.u.normal, u3.normal.dot(u2)
        omega2, omega3 = omega * L1 * n1.dot(u3) / (L2 * sine), omega * L1 * n1.dot(u2) / (arm * sine)
        # Second derivative of L1 u1 + L2 u2 = H + arm u3, along u3 and along u2.
        inward = crank.u.times(L1 * omega * omega).plus(u2, L2 * omega2**2).plus(u3, -arm * omega3**2)
        rod2 = Rod(u2, omega2, inward.dot(u3) / (L2 * u2.normal.dot(u3)), *A)
        rocker = Rod(u3, omega3, -inward.dot(u2) / (arm * sine), H, REST, REST)
        self.chain = {"crank": crank, "rod2": rod2, "rocker": rocker}
        self.tip = rocker.at(bodies["rocker"]["length"])

    def initial(self) -> list[Any]:
        """Return the free angles and their rates at the start."""
        start, C, L4 = self.scene["initial"], self.tip, self.bodies["rod4"]["length"]
        cosine = (self.bodies["guide_x"] + start["slider_offset"] - C[0].x) / L4
        sine = self.bodies["slider_branch"] * hy.sqrt(1.0 - cosine * cosine)
        angle, rate = hy.atan2(sine, cosine), (C[1].x - start["slider_vx"]) / (L4 * sine)
        return [angle, hy.expression(start["slider_angle"]), rate, hy.expression(start["slider_omega"])]

    def equations(self, n_closed: int) -> tuple[dict[str, Any], dict[tuple[str, int], Any], dict[str, Any]]:
        """Return rates of the states, distances (positive until a switch), and the recorded values.

        The names within a slot have its number.
        """
        theta4, theta5, omega4, omega5 = hy.make_vars(*FREE)
        rod, slider = self.bodies["rod4"], self.bodies["slider"]
        L4, S4 = rod["length"], rod["mass"] * rod["centroid"] + slider["mass"] * rod["length"]
        inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * L4**2
        u4, u5 = Plane(hy.cos(theta4), hy.sin(theta4)), Plane(hy.cos(theta5), hy.sin(theta5))
        n4, C = u4.normal, self.tip
        place, velocity = C[0].plus(u4, L4), C[1].plus(n4, L4 * omega4)
        slots = [self._slot(k, k < n_closed, (place, velocity), u5, omega5) for k in range(4)]
        load, energy, depth = self._load(place.y)
        F = Plane(hy.sum([s["force"].x for s in slots]), hy.sum([load, *(s["force"].y for s in slots)]))
        moment = hy.sum([s["arm"].x * s["force"].y - s["arm"].y * s["force"].x for s in slots])
        alpha4 = (L4 * n4.dot(F) - S4 * n4.dot(C[2].plus(self.gravity))) / inertia
        rod4 = Rod(u4, omega4, alpha4, *C)
        rates = dict(zip(FREE, (omega4, omega5, alpha4, moment / slider["inertia"]), strict=True))
        rates |= {f"impulse{k}": slots[k]["normal"] for k in range(n_closed)}
        outputs = dict(zip(MOTION, (*place, theta5, *velocity, omega5), strict=True))
        outputs |= zip(ACCELERATIONS, (*rod4.at(L4)[2], rates["omega5"]), strict=True)
        for k, slot in enumerate(slots):
            outputs |= {f"{name}{k}": slot[name] for name in ("gap", "normal", "friction", "rate", "slip")}
        if self.energies:
            kinetic, height, power = self._balance(rod4, F, omega5)
            losses = (hy.sum([s[name] for s in slots]) for name in ("damping", "rub"))
            rates |= zip(INTEGRALS, (power, *losses), strict=True)
            outputs |= {"energy_kinetic": kinetic, "energy_contact": hy.sum([s["stored"] for s in slots])}
            outputs |= {"energy_load": energy, "height": height}
        surfaces = {(name, k): value for k in range(4) for name, value in slots[k]["watched"].items()}
        if self.loaded:
            low, high = self.load_parameters["low"], self.load_parameters["high"]
            surfaces |= {("load-high", 0): high - depth, ("load-low", 0): depth - low}
        return rates, surfaces, outputs

    def _slot(self, k: int, closed: bool, centre: Any, u5: Plane, omega5: Any) -> dict[str, Any]:
        """Return geometry, forces, losses and switches of the corner in a slot."""
        (place, velocity), contact, zero = centre, self.contact, REST.x
        p = {name: hy.par[self.first + k * len(SLOT) + j] for j, name in enumerate(SLOT)}
        arm = Plane(p["sx"] * u5.x - p["sy"] * u5.y, p["sx"] * u5.y + p["sy"] * u5.x)
        wall = self.bodies["slider"]["width"] / 2 + self.scene["clearance"]["slider"]
        gap = p["sigma"] * (place.x + arm.x - self.bodies["guide_x"]) + wall
        rate, slip = -p["sigma"] * (velocity.x - omega5 * arm.y), velocity.y + omega5 * arm.x
        slot = {"arm": arm, "gap": gap, "rate": rate, "slip": slip, "force": REST}
        slot |= dict.fromkeys(("normal", "friction", "damping", "rub", "stored"), zero)
        if not closed:
            return slot | {"watched": {"touch": gap + self.depth}}
        elastic = self.K * (-gap) ** contact["exponent"]
        surfaces = {"part": -gap - self.depth}
        if self.impact:
            share = -gap / contact["damping_depth"]
            ramp = p["deep"] + (1.0 - p["deep"]) * share * share * (3.0 - 2.0 * share)
            unclipped = elastic + contact["damping"] * ramp * rate
            normal = p["live"] * unclipped
            surfaces["depth"] = (1.0 - 2.0 * p["deep"]) * (1.0 - share)
            unclipped = unclipped / 1024.0  # as a surface, about 1 at most
        else:
            unclipped = p["v"] + self.C * rate
            normal = p["live"] * elastic * unclipped * p["per_v"]
        surfaces["clip"] = (2.0 * p["live"] - 1.0) * unclipped
        if self.scene["friction"]["coefficient"] > 0:
            slot["friction"] = -self.scene["friction"]["coefficient"] * (p["fa"] + p["fb"] * slip) * normal
            surfaces |= {"faster": p["high"] - p["up"] * slip, "slower": p["down"] * slip - p["low"]}
        slot |= {"normal": normal, "force": Plane(p["sigma"] * normal, slot["friction"]), "watched": surfaces}
        slot |= {"damping": (normal - elastic) * rate, "rub": -slot["friction"] * slip}
        return slot | {"stored": elastic * -gap / (contact["exponent"] + 1)}

    def _load(self, height: Any) -> tuple[Any, Any, Any]:
        """Return force and stored energy of the workpiece, and the slider's depth in it."""
        load, p, depth = self.load, self.load_parameters, self.load["surface"] - height
        if not self.loaded:
            return REST.x, REST.x, REST.x
        if load["table"]:
            force = p["base"] + p["slope"] * depth
            return force, p["stored"] + depth * (p["base"] + 0.5 * p["slope"] * depth), depth
        # Outside of the workpiece the power is that of 1, which counts nothing.
        inside = p["on"] * depth / load["depth"] + (1.0 - p["on"])
        force = p["on"] * load["force"] * inside ** load["exponent"]
        return force, force * load["depth"] * inside / (load["exponent"] + 1), depth

    def pieces(self) -> list[dict[str, Any]]:
        """Return the parameters of the load's pieces: outside first, then by depth."""
        if not self.loaded:
            return []
        zero, far, rows = self.zero, self.one * REACH, self.load["table"]
        outside = dict.fromkeys(LOAD, zero) | {"low": -far, "high": rows[0][0] if rows else self.depth}
        if not rows:
            return [outside, outside | {"on": self.one, "low": self.depth, "high": far}]
        pieces, total = [outside], zero
        for (h0, P0), (h1, P1) in pairwise([*rows, (far, rows[-1][1])]):
            slope = (P1 - P0) / (h1 - h0)
            base = P0 - slope * h0
            energy = total - h0 * (base + 0.5 * slope * h0)
            pieces.append(dict(zip(LOAD, (self.one, base, slope, energy, h0, h1), strict=True)))
            total = total + 0.5 * (P0 + P1) * (h1 - h0)
        return pieces

    def _balance(self, rod4: Rod, force: Plane, omega5: Any) -> tuple[Any, Any, Any]:
        """Return kinetic energy, weights times heights, and the power of the motor on the rods."""
        slider, reaction = self.bodies["slider"], force.times(-1.0)
        kinetic, height, power = 0.5 * slider["inertia"] * omega5**2, REST.x, REST.x
        rods = [(name, rod, self.bodies[name]["centroid"]) for name, rod in self.chain.items()]
        for name, rod, along in [*rods, ("rod4", rod4, self.bodies["rod4"]["centroid"])]:
            m, J = self.bodies[name]["mass"], self.bodies[name]["inertia"]
            place, velocity, acceleration = rod.at(along)
            kinetic += 0.5 * m * velocity.dot(velocity) + 0.5 * J * rod.omega**2
            height += m * self.gravity.y * place.y
            if rod is rod4:
                reaction = reaction.plus(acceleration.plus(self.gravity), m)
            else:
                power += m * velocity.dot(acceleration.plus(self.gravity)) + J * rod.omega * rod.alpha
        place, velocity, acceleration = rod4.at(self.bodies["rod4"]["length"])
        kinetic += 0.5 * slider["mass"] * velocity.dot(velocity)
        height += slider["mass"] * self.gravity.y * place.y
        reaction = reaction.plus(acceleration.plus(self.gravity), slider["mass"])
        return kinetic, height, power + reaction.dot(rod4.velocity)
