"""What moves freely, its right-hand side, and the surfaces at which that changes.

Free are the angles of rod 4 and of the slider, and none with an ideal slider. Integrals are carried along:
work of the motor, losses by damping and by friction, and the impulse of each corner.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pinocchio_press.contact import Corner, Force, Guide
from pinocchio_press.linkage import Linkage, Pose
from pinocchio_press.press import Balance, Press, Vector

FREE, INTEGRALS = 4, 7
"""Angles and rates of rod 4 and slider; drive, damping, friction and four impulses."""
DRIVE, DAMPING, FRICTION, IMPULSE = FREE, FREE + 1, FREE + 2, FREE + 3


@dataclass(frozen=True)
class Moment:
    """Everything known at a time."""

    centre: complex
    velocity: complex
    angles: Vector
    rates: Vector
    corners: list[Corner]
    forces: list[Force]
    load: Vector


class Motion:
    """The press in motion; its memory of the impact speeds is what `switch` changes."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        self.press, self.guide = Press(scene), Guide(scene)
        self.linkage = Linkage(scene["mechanism"], scene["drive"])
        self.rod4 = scene["mechanism"]["rod4"]["length"]
        self.line = scene["mechanism"]["guide_x"] + scene["mechanism"]["reference_offset"]
        self.impact_speeds = [0.0] * 4
        # Which side of each kink of the force a corner in contact is on.
        self.sides: dict[tuple[str, int], float] = {}

    @property
    def ideal(self) -> bool:
        """Whether the slider is tied to its line."""
        return self.press.ideal_slider

    def start(self, initial: Mapping[str, float]) -> Vector:
        """Return the initial state; corners inside their walls are in contact from there on."""
        y = np.zeros(FREE + INTEGRALS)
        if self.ideal:
            return y
        x = self.guide.x + initial["slider_offset"]
        angle4, rate4 = self.linkage.hang(self.linkage.at(0.0), x, initial["slider_vx"])
        y[:FREE] = angle4, initial["slider_angle"], rate4, initial["slider_omega"]
        for k, corner in enumerate(self.locate(0.0, y)):
            if corner.gap < 0.0:
                self.switch(("gap", k), 0.0, y)
        return y

    def locate(self, t: float, y: Vector) -> list[Corner]:
        """Return the corners."""
        return self.guide.locate(*self._slider(self.linkage.at(t), y), y[1], y[3])

    def _slider(self, pose: Pose, y: Vector) -> tuple[complex, complex]:
        u4 = complex(np.cos(y[0]), np.sin(y[0]))
        return pose.tip + self.rod4 * u4, pose.tip_velocity + 1j * y[2] * self.rod4 * u4

    def at(self, t: float, y: Vector) -> Moment:
        """Return positions, velocities and contact forces."""
        pose = self.linkage.at(t)
        if self.ideal:
            angle4, rate4 = self.linkage.hang(pose, self.line, 0.0)
            y = np.array([angle4, 0.0, rate4, 0.0])
        centre, velocity = self._slider(pose, y)
        corners = self.guide.locate(centre, velocity, y[1], y[3])
        forces = self.guide.forces(corners, self.impact_speeds)
        load = np.zeros(3)
        for corner, force, sign in zip(corners, forces, self.guide.normals, strict=True):
            x, y_ = sign * force.normal, force.friction
            load += x, y_, corner.arm.real * y_ - corner.arm.imag * x
        angles, rates = np.array([*pose.angles, y[0], y[1]]), np.array([*pose.rates, y[2], y[3]])
        return Moment(centre, velocity, angles, rates, corners, forces, load)

    def balance(self, now: Moment) -> Balance:
        """Return accelerations and multipliers."""
        return self.press.balance(now.angles, now.rates, now.load)

    def rates(self, t: float, y: Vector) -> Vector:
        """Right-hand side of the differential equations."""
        now = self.at(t, y)
        balance = self.balance(now)
        found = np.empty(FREE + INTEGRALS)
        if self.ideal:
            found[:FREE] = 0.0
        else:
            # From the rates of the joints' angles back to those of rod 4 and slider.
            rod4 = balance.joint_rates[2] + balance.joint_rates[3]
            found[:FREE] = y[2], y[3], rod4, balance.slider[2]
        found[DRIVE] = balance.torque * self.linkage.omega
        pairs = list(zip(now.corners, now.forces, strict=True))
        found[DAMPING] = sum((force.normal - force.elastic) * corner.depth_rate for corner, force in pairs)
        found[FRICTION] = -sum(force.friction * corner.slip for corner, force in pairs)
        found[IMPULSE:] = [force.normal for force in now.forces]
        return found

    def surfaces(self, t: float, y: Vector) -> dict[tuple[str, int], tuple[float, float]]:
        """Return what is positive until the next switch, with its rate (nan where that is not needed)."""
        found = {}
        for k, corner in enumerate(() if self.ideal else self.locate(t, y)):
            closed = self.impact_speeds[k] > 0.0
            sign = -1.0 if closed else 1.0
            found["gap", k] = sign * corner.gap, -sign * corner.depth_rate
            if closed:
                for kink, value in self._kinks(k, corner).items():
                    found[kink, k] = self.sides[kink, k] * value, np.nan
        return found

    def switch(self, surface: tuple[str, int], t: float, y: Vector) -> None:
        """Pass a surface: a contact begins or ends, or its force passes a kink."""
        kind, k = surface
        if kind != "gap":
            self.sides[kind, k] *= -1.0
        elif self.impact_speeds[k]:
            self.impact_speeds[k] = 0.0
        else:
            corner = self.locate(t, y)[k]
            self.impact_speeds[k] = max(corner.depth_rate, self.guide.floor)
            for kink, value in self._kinks(k, corner).items():
                self.sides[kink, k] = 1.0 if value >= 0.0 else -1.0

    def _kinks(self, k: int, corner: Corner) -> dict[str, float]:
        guide = self.guide
        return {
            "clip": guide.damping(corner.depth_rate, self.impact_speeds[k]),
            "static": abs(corner.slip) - guide.v0,
            "transition": abs(corner.slip) - guide.v1,
        }
