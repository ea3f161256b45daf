"""Run a scene, with its channels at the samples and its contacts: the function that the entry point names."""

from collections.abc import Callable, Mapping
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

import numpy as np

from pinocchio_press.contact import CORNERS
from pinocchio_press.integration import Piece, StepError, integrate
from pinocchio_press.motion import DAMPING, DRIVE, FREE, FRICTION, IMPULSE, INTEGRALS, Moment, Motion
from pinocchio_press.press import Vector

TOLERANCE = 1e-10
"""Absolute local error of the angles, rad, where the scene gives none."""
LIMIT = 100_000
"""Steps and parts of steps in a cycle after which a run is stopped: over twenty times those of the shipped
scenes at 1e-12. The law "paper-switching" adds energy without bound where a slider is wedged.
"""
EVENTS = ("corner", "start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> SimpleNamespace:
    """Simulate the press.

    Parameters
    ----------
    scene
        Complete scene; of ``[solver.pinocchio]`` the ``tolerance``, absolute local error of the angles of
        rod 4 and slider (rad).
    progress
        Called with the finished share, 0 to 1.

    Returns
    -------
    SimpleNamespace
        As ``docs/engine.md`` requires. Status "step-too-small": the tolerance is below the rounding of the
        contact forces; "work-limit": more steps than `LIMIT` a cycle.

    Raises
    ------
    ValueError
        If the scene is outside the model, or the mechanism cannot be assembled.
    """
    if scene["joints"]["crank_pin"] == "clearance":
        raise ValueError("joints.crank_pin = 'clearance' must be 'ideal': only the slider has clearance here")
    tolerance = scene["solver"].get("pinocchio", {}).get("tolerance", TOLERANCE)
    if not (isinstance(tolerance, float) and 1e-14 <= tolerance < 1e-3):
        raise ValueError(f"solver.pinocchio.tolerance = {tolerance!r} must be real, 1e-14 to 1e-3 rad")
    drive, per_cycle = scene["drive"], scene["output"]["samples_per_cycle"]
    cycle = 60.0 / abs(drive["speed_rpm"])
    times = np.arange(round(drive["cycles"] * per_cycle) + 1) / per_cycle * cycle
    motion = Motion(scene)
    for t in times:  # what cannot be assembled is refused before it is run
        motion.linkage.at(t)
    y = motion.start(scene["initial"])
    record = Recording(motion, y, times, set(scene["output"]["groups"]))
    # Angles, their rates, integrals (J and N s); an error of a rate acts over a flight of some 10 ms.
    tolerances = np.full(FREE + INTEGRALS, tolerance)
    tolerances[2:4] = tolerance / 0.01
    status, remedy, pieces, switches = "success", "", 0, 0
    try:
        for piece in integrate(motion, y, times[-1], tolerances, cycle / 200.0):
            if pieces == LIMIT * max(1.0, drive["cycles"]):
                status, remedy = "work-limit", f"{pieces} steps up to {piece.start:g} s; run fewer cycles"
                break
            record.add(piece)
            pieces, switches = pieces + 1, switches + (piece.surface is not None)
            if progress:
                progress(piece.end / times[-1])
        else:
            record.begin_and_end(*record.last)
            record.sample(*record.last)
    except StepError as error:
        status, remedy = "step-too-small", f"{error}; set a larger solver.pinocchio.tolerance"
    for contact in list(record.open):  # they end with the run
        record.close(contact, *record.last)
    return SimpleNamespace(
        columns={name: np.array(values) for name, values in record.columns.items()},
        events={name: np.array([contact[name] for contact in record.contacts]) for name in EVENTS},
        extrema={},
        provenance={
            "integrator": "DOP853 between switching instants",
            "settings": {"tolerance": tolerance},
            "counters": {"pieces": pieces, "switches": switches},
            "versions": {name: version(name) for name in ("pin", "numpy", "scipy")},
        },
        status=status,
        remedy=remedy,
    )


class Recording:
    """Samples and contacts of a run, fed piece by piece."""

    def __init__(self, motion: Motion, y: Vector, times: Vector, groups: set[str]) -> None:
        self.motion, self.times, self.groups = motion, times, groups
        self.columns: dict[str, list[float]] = {}
        self.contacts: list[dict[str, Any]] = []
        self.open: dict[int, dict[str, Any]] = {}
        self.samples = 0
        self.last = 0.0, y
        self.at_start = self.energies(motion.at(0.0, y))

    def add(self, piece: Piece) -> None:
        """Record a piece: its samples, and the largest forces and depths of the contacts.

        A sample at the piece's end is left to the next one: at a jump the right limit counts.
        """
        self.begin_and_end(piece.start, piece.at(piece.start))
        self.last = piece.end, piece.at(piece.end)
        until = int(np.searchsorted(self.times, piece.end, side="left"))
        for t in self.times[self.samples : until]:
            self.sample(t, piece.at(t))
        for t in (*piece.check_times, piece.end) if self.open else ():
            now = self.motion.at(t, piece.at(t))
            for c, contact in self.open.items():
                contact["peak_force"] = max(contact["peak_force"], now.contacts[c].normal)
                depths = [-now.corners[k].gap for k in self.motion.guide.contacts[c]]
                contact["largest_depth"] = max(contact["largest_depth"], *depths)

    def begin_and_end(self, t: float, y: Vector) -> None:
        """Note the contacts that begin or end at a time."""
        for c, impact_speed in enumerate(self.motion.impact_speeds):
            if impact_speed and c not in self.open:
                contact = {"corner": CORNERS[self.motion.first[c]], "start": t, "normal_speed": impact_speed}
                contact |= {"impulse": y[IMPULSE + c], "peak_force": 0.0, "largest_depth": 0.0}
                self.open[c] = contact
                self.contacts.append(contact)
            if c in self.open and not impact_speed:
                self.close(c, t, y)

    def close(self, c: int, t: float, y: Vector) -> None:
        """End a contact."""
        contact = self.open.pop(c)
        contact |= {"end": t, "impulse": y[IMPULSE + c] - contact["impulse"]}

    def sample(self, t: float, y: Vector) -> None:
        """Record the channels at a time."""
        now, press = self.motion.at(t, y), self.motion.press
        result = {"time": t, "slider_x": now.centre.real, "slider_y": now.centre.imag}
        result |= {"slider_angle": now.angles[4], "slider_omega": now.rates[4]}
        result |= {"slider_vx": now.velocity.real, "slider_vy": now.velocity.imag}
        balance = press.balance(now.angles, now.rates, now.load)
        if "accelerations" in self.groups:
            result |= zip(("slider_ax", "slider_ay", "slider_alpha"), balance.slider, strict=True)
        if "corners" in self.groups and not self.motion.ideal:
            for name, corner, force in zip(CORNERS, now.corners, now.forces, strict=True):
                result |= {f"corner_{name}_gap": corner.gap, f"corner_{name}_normal": force.normal}
                result[f"corner_{name}_friction"] = force.friction
        if "joints" in self.groups:
            reactions = press.reactions(now.angles, now.rates, now.load, balance)
            for joint, (fx, fy) in reactions.items():
                result |= {f"reaction_{joint}_x": fx, f"reaction_{joint}_y": fy}
            result["crank_torque"] = balance.torque
            if self.motion.ideal:
                result["guide_force"], result["guide_moment"] = balance.guide
        if "energy" in self.groups:
            kinetic, elastic, load, potential = self.energies(now)
            gravity = self.at_start[3] - potential
            gain = kinetic + elastic + load - sum(self.at_start[:3])
            result |= {"energy_kinetic": kinetic, "energy_contact": elastic, "energy_gravity": gravity}
            if self.motion.workpiece.kinks:
                result["energy_load"] = load
            result |= {"energy_drive": y[DRIVE], "energy_damping": y[DAMPING], "energy_friction": y[FRICTION]}
            result["energy_residual"] = y[DRIVE] + gravity - gain - y[DAMPING] - y[FRICTION]
        for name, value in result.items():
            self.columns.setdefault(name, []).append(float(value))
        self.samples += 1

    def energies(self, now: Moment) -> tuple[float, float, float, float]:
        """Return kinetic energy, that stored in contacts and in a workpiece, and the potential one."""
        kinetic, potential = self.motion.press.energies(now.angles, now.rates)
        elastic = self.motion.guide.energy(now.corners, self.motion.inside)
        return kinetic, elastic, self.motion.workpiece.force(now.centre.imag)[1], potential
