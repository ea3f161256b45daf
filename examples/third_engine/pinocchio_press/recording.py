"""Channels at the samples, and the contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from pinocchio_press.contact import CORNERS
from pinocchio_press.integration import Piece
from pinocchio_press.motion import DAMPING, DRIVE, FRICTION, IMPULSE, Moment, Motion
from pinocchio_press.press import Vector

COLUMNS = ("corner", "start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


class Recording:
    """Samples and contacts of a run, fed piece by piece."""

    def __init__(self, motion: Motion, y: Vector, times: Vector, groups: list[str]) -> None:
        self.motion, self.times, self.groups = motion, times, groups
        self.columns: dict[str, list[float]] = {}
        self.contacts: list[dict[str, Any]] = []
        self.open: dict[int, dict[str, Any]] = {}
        self.samples = 0
        self.last = 0.0, y
        self.at_start = self._now(motion.at(0.0, y))

    def add(self, piece: Piece) -> None:
        """Record a piece: its samples, and the largest forces and depths of the contacts.

        A sample at the piece's end is left to the next one: at a jump the right limit counts.
        """
        self._begin_and_end(piece.start, piece.at(piece.start))
        self.last = piece.end, piece.at(piece.end)
        until = int(np.searchsorted(self.times, piece.end, side="left"))
        for t in self.times[self.samples : until]:
            self._sample(t, piece.at(t))
        for t in (*piece.checked, piece.end) if self.open else ():
            now = self.motion.at(t, piece.at(t))
            for c, contact in self.open.items():
                contact["peak_force"] = max(contact["peak_force"], now.contacts[c].normal)
                depths = [-now.corners[k].gap for k in self.motion.guide.contacts[c]]
                contact["largest_depth"] = max(contact["largest_depth"], *depths)

    def finish(self) -> None:
        """Record the last sample of a complete run."""
        self._begin_and_end(*self.last)
        self._sample(*self.last)

    def close(self) -> None:
        """End the contacts that are still closed with the run."""
        for c in list(self.open):
            self._close(c, *self.last)

    def events(self) -> dict[str, Vector]:
        """Return the table of contacts."""
        return {name: np.array([contact[name] for contact in self.contacts]) for name in COLUMNS}

    def _begin_and_end(self, t: float, y: Vector) -> None:
        for c, impact_speed in enumerate(self.motion.impact_speeds):
            if impact_speed and c not in self.open:
                name = CORNERS[self.motion.first[c]]
                contact = {"corner": name, "start": t, "normal_speed": impact_speed}
                contact |= {"impulse": y[IMPULSE + c], "peak_force": 0.0, "largest_depth": 0.0}
                self.open[c] = contact
                self.contacts.append(contact)
            if c in self.open and not impact_speed:
                self._close(c, t, y)

    def _close(self, c: int, t: float, y: Vector) -> None:
        contact = self.open.pop(c)
        contact |= {"end": t, "impulse": y[IMPULSE + c] - contact["impulse"]}

    def _sample(self, t: float, y: Vector) -> None:
        """Record the channels at a time."""
        now = self.motion.at(t, y)
        found = {
            "time": t,
            "slider_x": now.centre.real,
            "slider_y": now.centre.imag,
            "slider_angle": now.angles[4],
            "slider_vx": now.velocity.real,
            "slider_vy": now.velocity.imag,
            "slider_omega": now.rates[4],
        }
        if {"accelerations", "joints"} & set(self.groups):
            balance = self.motion.balance(now)
        if "accelerations" in self.groups:
            found |= zip(("slider_ax", "slider_ay", "slider_alpha"), balance.slider, strict=True)
        if "corners" in self.groups and not self.motion.ideal:
            for name, corner, force in zip(CORNERS, now.corners, now.forces, strict=True):
                found[f"corner_{name}_gap"] = corner.gap
                found[f"corner_{name}_normal"] = force.normal
                found[f"corner_{name}_friction"] = force.friction
        if "joints" in self.groups:
            reactions = self.motion.press.reactions(now.angles, now.rates, now.load, balance)
            for joint, (x, y_) in reactions.items():
                found[f"reaction_{joint}_x"], found[f"reaction_{joint}_y"] = x, y_
            found["crank_torque"] = balance.torque
            if self.motion.ideal:
                found["guide_force"], found["guide_moment"] = balance.guide
        if "energy" in self.groups:
            found |= self._energies(now, y)
        for name, value in found.items():
            self.columns.setdefault(name, []).append(float(value))
        self.samples += 1

    def _energies(self, now: Moment, y: Vector) -> dict[str, float]:
        kinetic, stored, potential = self._now(now)
        gravity = self.at_start[2] - potential
        gained = kinetic + stored - sum(self.at_start[:2])
        return {
            "energy_drive": y[DRIVE],
            "energy_gravity": gravity,
            "energy_kinetic": kinetic,
            "energy_contact": stored,
            "energy_damping": y[DAMPING],
            "energy_friction": y[FRICTION],
            "energy_residual": y[DRIVE] + gravity - gained - y[DAMPING] - y[FRICTION],
        }

    def _now(self, now: Moment) -> tuple[float, float, float]:
        """Return kinetic, stored and potential energy."""
        kinetic, potential = self.motion.press.energies(now.angles, now.rates)
        return kinetic, self.motion.guide.stored(now.corners, self.motion.inside), potential
