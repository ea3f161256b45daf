"""Contact of the slider with the walls of the guide: geometry, laws, forces, stored energy.

A contact is one of a corner, or of a whole side with two corners (law "foundation"). Its force acts at one
point of it, whose motion its damping and friction see, and is shared by its corners.
"""

from cmath import exp
from collections.abc import Mapping, Sequence
from math import copysign, sqrt
from typing import Any, NamedTuple

CORNERS = ("ll", "lr", "ul", "ur")
SIDES = ((0, 2), (1, 3))
"""Corners of the left and of the right side, the lower one first."""
LAWS = ("hertz-corners", "paper-switching", "foundation", "adams-impact")


class Corner(NamedTuple):
    """Place and motion of a corner: arm from the slider's centre, gap, rate of its depth, slip along +y."""

    arm: complex
    gap: float
    depth_rate: float
    slip: float


class Point(NamedTuple):
    """Point of action of a contact: elastic force, depth, its rate, slip, and each corner's share."""

    elastic: float
    depth: float
    depth_rate: float
    slip: float
    shares: tuple[float, ...]


class Force(NamedTuple):
    """Force of a contact or of a corner: normal, and friction along +y on the slider."""

    normal: float = 0.0
    friction: float = 0.0


class Guide:
    """The two walls and the law of contact with them; ``inside``: for each corner, true if in its wall."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        slider, contact, friction = scene["mechanism"]["slider"], scene["contact"], scene["friction"]
        self.law = contact["law"]
        if self.law not in LAWS:
            raise ValueError(f"contact.law = {self.law!r} must be one of {', '.join(LAWS)}")
        self.contacts = SIDES if self.law == "foundation" else tuple((k,) for k in range(4))
        width, length = slider["width"], slider["length"]
        self.corners = [complex(x * width / 2.0, y * length / 2.0) for y in (-1, 1) for x in (-1, 1)]
        self.normals = (1, -1, 1, -1)
        self.x = scene["mechanism"]["guide_x"]
        self.half_width = width / 2.0 + scene["clearance"]["slider"]
        sigma = sum(_compliance(contact, partner) for partner in ("slider", "guide"))
        self.K = 4.0 / (3.0 * sigma) * sqrt(contact["corner_radius"])
        self.K_surface = (slider["thickness"] + length) / (0.475 * sigma)
        e = contact["restitution"]
        self.C = {
            "lankarani-nikravesh": 0.75 * (1.0 - e * e),
            "hunt-crossley": 1.5 * (1.0 - e),
            "flores": 1.6 * (1.0 - e) / (e or 1.0),  # the scene refuses e = 0 there
            "gonthier": (1.0 - e * e) / (e or 1.0),
        }[contact["damping_model"]]
        self.n, self.floor = contact["exponent"], contact["impact_speed_floor"]
        self.impact = self.law == "adams-impact"
        if self.impact:
            self.K = contact.get("stiffness") or self.K
        self.c_max, self.d_max = contact["damping"], contact["damping_depth"]
        self.c_f = friction["coefficient"]
        self.v0, self.v1 = friction["static_speed"], friction["transition_speed"]

    def locate(self, centre: complex, velocity: complex, angle: float, rate: float) -> list[Corner]:
        """Return the corners at a state of the slider."""
        result = []
        for place, sign in zip(self.corners, self.normals, strict=True):
            arm = place * exp(1j * angle)
            gap = sign * (centre.real + arm.real - self.x) + self.half_width
            depth_rate, slip = -sign * (velocity.real - rate * arm.imag), velocity.imag + rate * arm.real
            result.append(Corner(arm, gap, depth_rate, slip))
        return result

    def point(self, contact: int, corners: Sequence[Corner], inside: Sequence[bool]) -> Point:
        """Return the point at which the force of a closed contact acts."""
        ks = self.contacts[contact]
        side = SIDES[ks[0] % 2]
        a, b = (-corners[k].gap for k in side)
        forces = self._elastic(a, b, self._surface(side, inside))
        elastic = [forces[side.index(k)] for k in ks]
        total, deepest = sum(elastic), min(ks, key=lambda k: corners[k].gap)
        depth = -corners[deepest].gap
        shares = tuple(f / total if total else float(k == deepest) for k, f in zip(ks, elastic, strict=True))
        rate = sum(share * corners[k].depth_rate for k, share in zip(ks, shares, strict=True))
        slip = sum(share * corners[k].slip for k, share in zip(ks, shares, strict=True))
        return Point(total, depth, rate, slip, shares)

    def force(self, contact: int, point: Point, impact_speed: float, inside: Sequence[bool]) -> Force:
        """Return the force of a closed contact."""
        normal = point.elastic
        if not self._surface(SIDES[contact % 2], inside):
            unclipped = self.damped_force(point, impact_speed)
            normal = max(0.0, unclipped if self.impact else normal * unclipped)
        ramp = min(1.0, max(0.0, (abs(point.slip) - self.v0) / (self.v1 - self.v0)))
        return Force(normal, -self.c_f * ramp * copysign(normal, point.slip))

    def damped_force(self, point: Point, impact_speed: float) -> float:
        """Return the force with its damping before clipping: in Eq. 11 over the elastic one."""
        if not self.impact:
            return float(1.0 + self.C * point.depth_rate / impact_speed)
        share = min(max(point.depth / self.d_max, 0.0), 1.0)
        return float(point.elastic + self.c_max * share**2 * (3.0 - 2.0 * share) * point.depth_rate)

    def energy(self, corners: Sequence[Corner], inside: Sequence[bool]) -> float:
        """Return the energy stored in the contacts that are closed."""
        total = 0.0
        for side in SIDES:
            a, b = (-corners[k].gap for k in side)
            if self.law == "foundation" and min(a, b) <= 0.0:
                a, b = max(a, b), min(a, b)
                total += self.K_surface * a**3 / (6.0 * (a - b)) if a > 0.0 else 0.0
            elif self.law == "foundation" or self._surface(side, inside):
                total += self.K_surface / 6.0 * (a * a + a * b + b * b)
            else:
                depths = [max(-corners[k].gap, 0.0) for k in side if inside[k]]
                total += sum(self.K / (self.n + 1.0) * depth ** (self.n + 1.0) for depth in depths)
        return total

    def _surface(self, side: tuple[int, int], inside: Sequence[bool]) -> bool:
        """Return whether a side has the undamped law of two corners."""
        return self.law == "paper-switching" and all(inside[k] for k in side)

    def _elastic(self, a: float, b: float, surface: bool) -> tuple[float, float]:
        """Return the elastic forces of a side's corners at their depths."""
        if self.law != "foundation":
            a, b = max(a, 0.0), max(b, 0.0)
        elif b > a:
            return self._elastic(b, a, surface)[::-1]
        if surface or (self.law == "foundation" and b > 0.0):
            return self.K_surface * (2.0 * a + b) / 6.0, self.K_surface * (a + 2.0 * b) / 6.0
        if self.law != "foundation":
            return self.K * a**self.n, self.K * b**self.n
        k = self.K_surface * a * a / (6.0 * (a - b) ** 2) if a > 0.0 else 0.0
        return k * (2.0 * a - 3.0 * b), k * a


def _compliance(contact: Mapping[str, Any], partner: str) -> float:
    """Return sigma of a partner; a material's number may be one for both."""
    modulus, poisson = (
        number[partner] if isinstance(number, Mapping) else number
        for number in (contact["youngs_modulus"], contact["poisson"])
    )
    return float((1.0 - poisson**2) / modulus)
