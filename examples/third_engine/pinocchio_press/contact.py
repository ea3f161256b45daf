"""Contact of the slider's corners with the walls of the guide: geometry, force, stored energy."""

from __future__ import annotations

from cmath import exp
from collections.abc import Mapping, Sequence
from math import copysign, sqrt
from typing import Any, NamedTuple

CORNERS = ("ll", "lr", "ul", "ur")
SIDES = ((0, 2), (1, 3))
"""Corners of the left and of the right side."""


class Corner(NamedTuple):
    """Place and motion of a corner: arm from the slider's centre, gap, rate of its depth, slip along +y."""

    arm: complex
    gap: float
    depth_rate: float
    slip: float


class Force(NamedTuple):
    """Force of a corner: normal, friction (along +y on the slider), and elastic part of the normal one."""

    normal: float = 0.0
    friction: float = 0.0
    elastic: float = 0.0


class Guide:
    """The two walls and the law of contact with them."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        slider, contact, friction = (
            scene["mechanism"]["slider"],
            scene["contact"],
            scene["friction"],
        )
        width, length = slider["width"], slider["length"]
        self.corners = [complex(x * width / 2.0, y * length / 2.0) for y in (-1, 1) for x in (-1, 1)]
        self.normals = (1, -1, 1, -1)
        self.x = scene["mechanism"]["guide_x"]
        self.half_width = width / 2.0 + scene["clearance"]["slider"]
        sigma = (1.0 - contact["poisson"] ** 2) / contact["youngs_modulus"]
        self.K = 4.0 / (3.0 * (sigma + sigma)) * sqrt(contact["corner_radius"])
        self.K_surface = (slider["thickness"] + length) / (0.475 * (sigma + sigma))
        self.C = 0.75 * (1.0 - contact["restitution"] ** 2)
        self.n, self.law, self.floor = contact["exponent"], contact["law"], contact["impact_speed_floor"]
        self.c_f = friction["coefficient"]
        self.v0, self.v1 = friction["static_speed"], friction["transition_speed"]

    def locate(self, centre: complex, velocity: complex, angle: float, rate: float) -> list[Corner]:
        """Return the corners at a state of the slider."""
        turned = exp(1j * angle)
        found = []
        for place, sign in zip(self.corners, self.normals, strict=True):
            arm = place * turned
            found.append(
                Corner(
                    arm,
                    sign * (centre.real + arm.real - self.x) + self.half_width,
                    -sign * (velocity.real - rate * arm.imag),
                    velocity.imag + rate * arm.real,
                )
            )
        return found

    def forces(self, corners: Sequence[Corner], impact_speeds: Sequence[float]) -> list[Force]:
        """Return the forces of the corners; an impact speed of 0 is that of a corner out of contact."""
        found = [Force()] * 4
        for k, (corner, impact_speed) in enumerate(zip(corners, impact_speeds, strict=True)):
            if not impact_speed:
                continue
            both = impact_speeds[k ^ 2] > 0.0
            elastic = self._elastic(-corner.gap, -corners[k ^ 2].gap if both else None)
            normal = elastic
            if not (both and self.law == "paper-switching"):
                normal *= max(0.0, self.damping(corner.depth_rate, impact_speed))
            found[k] = Force(normal, self._friction(normal, corner.slip), elastic)
        return found

    def damping(self, depth_rate: float, impact_speed: float) -> float:
        """Return the factor of damping on the elastic force, before clipping."""
        return float(1.0 + self.C * depth_rate / impact_speed)

    def stored(self, corners: Sequence[Corner], impact_speeds: Sequence[float]) -> float:
        """Return the energy stored in the contacts that are closed."""
        return sum(
            self._stored([max(-corners[k].gap, 0.0) for k in side if impact_speeds[k]]) for side in SIDES
        )

    def _elastic(self, depth: float, other: float | None) -> float:
        d1, d2 = max(depth, 0.0), max(other or 0.0, 0.0)
        if other is not None and self.law == "paper-switching":
            return float(self.K_surface * (2.0 * d1 + d2) / 6.0)
        point = self.K * d1**self.n
        if other is None or self.law == "hertz-corners" or not d1 * d2:
            return float(point)
        h = d1 * d2 / (d1 + d2)
        return float(point + 4.0 * self.K_surface * h * (d2 / (d1 + d2)) ** 2)

    def _stored(self, depths: Sequence[float]) -> float:
        both = len(depths) == 2
        if both and self.law == "paper-switching":
            d1, d2 = depths
            return float(self.K_surface / 6.0 * (d1 * d1 + d1 * d2 + d2 * d2))
        energy = sum(self.K / (self.n + 1.0) * d ** (self.n + 1.0) for d in depths)
        if both and self.law == "strip" and sum(depths):
            h = depths[0] * depths[1] / sum(depths)
            energy += 2.0 * self.K_surface * h * h
        return float(energy)

    def _friction(self, normal: float, slip: float) -> float:
        ramp = min(1.0, max(0.0, (abs(slip) - self.v0) / (self.v1 - self.v0)))
        return float(-self.c_f * ramp * copysign(normal, slip))
