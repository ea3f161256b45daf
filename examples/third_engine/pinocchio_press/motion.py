"""The free motion, its right-hand side, and the surfaces at which that changes.

Free are the angles of rod 4 and of the slider, and none with an ideal slider. Integrals are carried along:
work of the motor, losses by damping and by friction, and the impulse of each contact.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from pinocchio_press.contact import Corner, Force, Guide, Point
from pinocchio_press.linkage import Linkage, Pose
from pinocchio_press.press import Press, Vector
from pinocchio_press.workpiece import Workpiece

FREE, INTEGRALS = 4, 7
"""Angles and rates of rod 4 and slider; drive, damping, friction and up to four impulses."""
DRIVE, DAMPING, FRICTION, IMPULSE = FREE, FREE + 1, FREE + 2, FREE + 3


class Moment(NamedTuple):
    """State of the press at a time, with its forces."""

    centre: complex
    velocity: complex
    angles: Vector
    rates: Vector
    corners: list[Corner]
    points: dict[int, Point]
    contacts: dict[int, Force]
    """Of the closed ones."""
    forces: list[Force]
    """Of the corners."""
    load: Vector


class Motion:
    """The press in motion; `switch` changes the corners inside their wall and the impact speeds."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        self.press, self.guide, self.workpiece = Press(scene), Guide(scene), Workpiece(scene["load"])
        self.ideal = self.press.ideal_slider
        self.linkage = Linkage(scene["mechanism"], scene["drive"])
        self.rod4 = scene["mechanism"]["rod4"]["length"]
        self.line = scene["mechanism"]["guide_x"] + scene["mechanism"]["reference_offset"]
        self.inside = [False] * 4
        self.impact_speeds = [0.0] * len(self.guide.contacts)
        """0 while a contact is open."""
        self.first = [0] * len(self.guide.contacts)
        """The corner that touched first."""
        # Which side of each kink of its force a contact is on, or the workpiece.
        self.sides: dict[tuple[str, int], float] = {}

    def start(self, initial: Mapping[str, float]) -> Vector:
        """Return the initial state; corners inside their walls are in contact from there on."""
        y = np.zeros(FREE + INTEGRALS)
        if not self.ideal:
            self._hang(y, initial)
        height = self.at(0.0, y).centre.imag
        for k, kink in enumerate(self.workpiece.kinks):
            self.sides["workpiece", k] = 1.0 if height >= kink else -1.0
        return y

    def _hang(self, y: Vector, initial: Mapping[str, float]) -> None:
        x = self.guide.x + initial["slider_offset"]
        angle4, rate4 = self.linkage.hang(self.linkage.at(0.0), x, initial["slider_vx"])
        y[:FREE] = angle4, initial["slider_angle"], rate4, initial["slider_omega"]
        corners = self.locate(0.0, y)
        self.inside = [corner.gap < 0.0 for corner in corners]
        for contact, ks in enumerate(self.guide.contacts):
            if any(self.inside[k] for k in ks):
                self._begin(contact, corners)

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
        points, contacts, forces = {}, {}, [Force()] * 4
        for c in (c for c, speed in enumerate(self.impact_speeds) if speed):
            points[c] = self.guide.point(c, corners, self.inside)
            normal, drag = contacts[c] = self.guide.force(c, points[c], self.impact_speeds[c], self.inside)
            for k, share in zip(self.guide.contacts[c], points[c].shares, strict=True):
                forces[k] = Force(share * normal, share * drag)
        load = np.array([0.0, self.workpiece.force(centre.imag)[0], 0.0])
        for corner, force, sign in zip(corners, forces, self.guide.normals, strict=True):
            x, y_ = sign * force.normal, force.friction
            load += x, y_, corner.arm.real * y_ - corner.arm.imag * x
        angles, rates = np.array([*pose.angles, y[0], y[1]]), np.array([*pose.rates, y[2], y[3]])
        return Moment(centre, velocity, angles, rates, corners, points, contacts, forces, load)

    def rates(self, t: float, y: Vector) -> Vector:
        """Right-hand side of the differential equations."""
        now = self.at(t, y)
        balance = self.press.balance(now.angles, now.rates, now.load)
        result = np.zeros(FREE + INTEGRALS)
        if not self.ideal:
            # From the rates of the joints' angles back to those of rod 4 and slider.
            rod4 = balance.joint_rates[2] + balance.joint_rates[3]
            result[:FREE] = y[2], y[3], rod4, balance.slider[2]
        result[DRIVE] = balance.torque * self.linkage.omega
        for c, point in now.points.items():
            force = now.contacts[c]
            result[DAMPING] += (force.normal - point.elastic) * point.depth_rate
            result[FRICTION] -= force.friction * point.slip
            result[IMPULSE + c] = force.normal
        return result

    def surfaces(self, t: float, y: Vector) -> dict[tuple[str, int], tuple[float, float]]:
        """Return values that are positive until the next switch, with their rates (nan where not needed)."""
        result: dict[tuple[str, int], tuple[float, float]] = {}
        if self.workpiece.kinks:
            now = self.at(t, y)
            for k, kink in enumerate(self.workpiece.kinks):
                side = self.sides["workpiece", k]
                result["workpiece", k] = side * (now.centre.imag - kink), side * now.velocity.imag
        corners = [] if self.ideal else self.locate(t, y)
        for k, corner in enumerate(corners):
            sign = -1.0 if self.inside[k] else 1.0
            result["gap", k] = sign * corner.gap, -sign * corner.depth_rate
        for c in (c for c, speed in enumerate(self.impact_speeds) if speed):
            for kink, value in self._kinks(c, corners).items():
                result[kink, c] = self.sides[kink, c] * value, np.nan
        return result

    def switch(self, surface: tuple[str, int], t: float, y: Vector) -> None:
        """Pass a surface: a corner goes in or comes out, or a contact's force passes a kink."""
        kind, k = surface
        if kind != "gap":
            self.sides[kind, k] *= -1.0
            return
        self.inside[k] = not self.inside[k]
        contact = next(c for c, ks in enumerate(self.guide.contacts) if k in ks)
        if not any(self.inside[each] for each in self.guide.contacts[contact]):
            self.impact_speeds[contact] = 0.0
        elif not self.impact_speeds[contact]:
            self._begin(contact, self.locate(t, y))

    def _begin(self, contact: int, corners: list[Corner]) -> None:
        point = self.guide.point(contact, corners, self.inside)
        self.impact_speeds[contact] = max(point.depth_rate, self.guide.floor)
        self.first[contact] = min(self.guide.contacts[contact], key=lambda k: corners[k].gap)
        for kink, value in self._kinks(contact, corners).items():
            self.sides[kink, contact] = 1.0 if value >= 0.0 else -1.0

    def _kinks(self, contact: int, corners: list[Corner]) -> dict[str, float]:
        guide, point = self.guide, self.guide.point(contact, corners, self.inside)
        return {
            "clip": guide.damped_force(point, self.impact_speeds[contact]),
            "static": abs(point.slip) - guide.v0,
            "transition": abs(point.slip) - guide.v1,
        }
