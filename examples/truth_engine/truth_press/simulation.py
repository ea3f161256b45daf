"""Run a scene: channels, contacts and extrema, by the function that the entry point names."""

from collections.abc import Callable, Mapping
from importlib.metadata import version
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from truth_press.arithmetic import DOUBLE, QUADRUPLE, Arithmetic
from truth_press.motion import Motion, Segment, evaluate
from truth_press.press import ACCELERATIONS, CORNERS, INTEGRALS, LAWS, MOTION, Press

TOLERANCE = 1e-30
"""Error of a step, relative to the largest state; below the rounding of the numbers it has no effect."""
GRID, ZOOMS = 4, 14
"""Points of a step where extrema are looked for; rounds that locate one, each four times closer."""
EVENTS = ("corner", "start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


class Settings(NamedTuple):
    """``[solver.truth]``: bits of a number, error of a step, depth (m) at which contacts start and end."""

    bits: int
    tolerance: float
    starting_depth: float


def settings(scene: Mapping[str, Any]) -> Settings:
    """Return the settings of a scene; of a bad one a `ValueError`."""
    keys = scene["solver"].get("truth", {})
    bits = keys.get("bits", QUADRUPLE)
    if type(bits) is not int or not DOUBLE <= bits <= 1000:
        raise ValueError(
            f"solver.truth.bits = {bits!r} must be an integer: 53 (double), 113 (quadruple), more"
        )
    if unknown := set(keys) - set(Settings._fields):
        raise ValueError(f"solver.truth: {min(unknown)} must be one of {', '.join(Settings._fields)}")
    depth = 1e-13 if bits == DOUBLE else 1e-24  # above the rounding of a gap
    result = Settings(**{"bits": bits, "tolerance": TOLERANCE, "starting_depth": depth, **keys})
    for name, low, high in (("tolerance", 1e-99, 1e-6), ("starting_depth", 1e-40, 1e-9)):
        value = getattr(result, name)
        if not (isinstance(value, float) and low <= value <= high):
            raise ValueError(f"solver.truth.{name} = {value!r} must be real, {low:g} to {high:g}")
    return result._replace(tolerance=max(result.tolerance, 2.0 ** (3 - bits)))


def check(scene: Mapping[str, Any]) -> None:
    """Refuse a scene outside the model, or that cannot be assembled: a `ValueError` with one line."""
    joints, law = scene["joints"], scene["contact"]["law"]
    if joints["crank_pin"] != "ideal":
        raise ValueError(f"joints.crank_pin = {joints['crank_pin']!r} must be 'ideal': the slider is loose")
    if joints["slider"] != "clearance":
        raise ValueError(f"joints.slider = {joints['slider']!r} must be 'clearance': else nothing is free")
    if law not in LAWS:
        raise ValueError(f"contact.law = {law!r} must be one of {', '.join(LAWS)}")
    if "joints" in scene["output"]["groups"]:
        raise ValueError("output.groups: 'joints' is refused: this model has no forces of joints")
    settings(scene)
    double, mechanism = Arithmetic.of(DOUBLE), scene["mechanism"]
    tip = hy.cfunc([Press(scene, double, 0.0).tip[0].x], [hy.make_vars("none")])
    times = np.linspace(0.0, 60.0 / abs(scene["drive"]["speed_rpm"]), 3601)
    x = evaluate(tip, np.zeros((len(times), 1)), np.zeros(0), times)[0]
    if not np.isfinite(x).all():
        raise ValueError("mechanism: rod 2 does not reach the rocker at every crank angle")
    offset, line = mechanism["guide_x"] - x, mechanism["reference_offset"]
    reach = max(abs(offset[0] + scene["initial"]["slider_offset"]), *abs(offset), *abs(offset + line))
    if reach >= mechanism["rod4"]["length"]:
        raise ValueError(f"mechanism: rod 4 does not reach the slider, which is up to {reach:g} m aside")


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> SimpleNamespace:
    """Simulate the press with clearance at its slider, as ``docs/engine.md`` requires.

    Of ``[solver.truth]`` the keys of `Settings` count; ``progress`` is called with the share, 0 to 1.
    A scene outside the model is a `ValueError`. Status "integration-failed": the state is no longer finite,
    or the run takes too many steps.
    """
    check(scene)
    config, drive, per_cycle = settings(scene), scene["drive"], scene["output"]["samples_per_cycle"]
    arithmetic = Arithmetic.of(config.bits)
    motion = Motion(Press(scene, arithmetic, config.starting_depth), arithmetic, config.tolerance)
    samples = range(round(drive["cycles"] * per_cycle) + 1)
    record = Recording(motion, arithmetic.array([motion.cycle * k / per_cycle for k in samples]))
    status, remedy = "success", ""
    try:
        for segment in motion.run(record.times[-1]):
            record.add(segment)
            if progress:
                progress(float(motion.t / record.times[-1]))
        record.sample(segment, record.times[-1:])
    except ArithmeticError as error:
        status, remedy = "integration-failed", f"{error}; set more solver.truth.bits"
    rows = [{"end": motion.t} | contact for contact in motion.contacts]
    events = {name: np.array([float(row[name]) for row in rows]) for name in EVENTS[1:]}
    return SimpleNamespace(
        columns={name: np.concatenate(parts) for name, parts in record.columns.items()},
        events={"corner": np.array([row["corner"] for row in rows], dtype=str)} | events,
        extrema={name: best for name, best in record.extrema.items() if name in record.columns},
        provenance={
            "formulation": "rod 4 and slider (2 coordinates)",
            "integrator": f"Taylor series with located events, {config.bits} bits",
            "settings": config._asdict(),
            "counters": {"steps": motion.steps, "switches": motion.switches, "contacts": len(rows)},
            "versions": {name: version(name) for name in ("heyoka", "numpy")},
        },
        status=status,
        remedy=remedy,
    )


class Recording:
    """Samples, pulses and extrema of a run, fed segment by segment."""

    def __init__(self, motion: Motion, times: Any) -> None:
        self.motion, self.times, self.samples = motion, times, 0
        self.columns: dict[str, list[Any]] = {}
        self.extrema: dict[str, dict[str, Any]] = {}
        self.first: dict[str, Any] = {}
        """Energies at the start."""

    def add(self, segment: Segment) -> None:
        """Record a segment; a sample at its end is the next one's: at a jump the right limit counts."""
        until = int(np.searchsorted(self.times, segment.times[-1]))
        if until > self.samples:
            self.sample(segment, self.times[self.samples : until])
        self.samples = until
        points = [a + (b - a) * k / GRID for a, b in pairwise(segment.times) for k in range(GRID)]
        times = self.motion.arithmetic.array([*points, segment.times[-1]])
        channels = self.channels(segment, times)
        for name, values in channels.items():
            value, time = float(values[0]), float(times[0])
            start = {"min": value, "time_of_min": time, "max": value, "time_of_max": time}
            extreme = self.extrema.setdefault(name, start)
            for end, sign in (("min", -1), ("max", 1)):
                self._extreme(values, (segment, times), name, sign, extreme, end)
        for corner, contact in self.motion.closed.items():
            force, gap = f"corner_{CORNERS[corner]}_normal", f"corner_{CORNERS[corner]}_gap"
            self._extreme(channels[force], (segment, times), force, 1, contact, "peak_force")
            contact["gap"] = -contact["largest_depth"]
            self._extreme(channels[gap], (segment, times), gap, -1, contact, "gap")
            contact["largest_depth"] = -contact["gap"]

    def _extreme(self, values: Any, place: Any, name: str, sign: int, best: dict[str, Any], key: str) -> None:
        """Put the extreme of a channel in a segment, and its time, in the place of one that is less so."""
        segment, times = place
        levels = sign * values.astype(float)
        k, last = int(levels.argmax()), len(times) - 1
        neighbours = (max(k - 1, 0), min(k + 1, last))
        margin = max(abs(levels[k] - levels[j]) for j in neighbours)
        if not levels[k] + margin > sign * best[key]:
            return
        value, time, (low, high) = values[k], times[k], (times[j] for j in neighbours)
        side = 1 if k == 0 else -1
        turns = 0 < k < last or 2 * (levels[k] - levels[k + side]) < levels[k + side] - levels[k + 2 * side]
        for _ in range(ZOOMS if turns else 0):
            grid = self.motion.arithmetic.array([low + (high - low) * j / 8 for j in range(9)])
            row = self.channels(segment, grid)[name]
            top = max(range(9), key=lambda j: sign * row[j])
            value, time, low, high = row[top], grid[top], grid[max(top - 1, 0)], grid[min(top + 1, 8)]
        if sign * float(value) > sign * best[key]:
            best[key], best[f"time_of_{key}"] = float(value), float(time)

    def sample(self, segment: Segment, times: Any) -> None:
        """Record the channels at times within a segment."""
        groups = self.motion.press.scene["output"]["groups"]
        for name, values in ({"time": times} | self.channels(segment, times)).items():
            group = "accelerations" if name in ACCELERATIONS else name.split("_")[0] + "s"
            if group in groups or group not in ("accelerations", "corners"):
                self.columns.setdefault(name, []).append(values.astype(float))

    def channels(self, segment: Segment, times: Any) -> dict[str, Any]:
        """Return all channels at times within a segment."""
        phase, states = segment.phase, segment.solution(times)
        values = dict(zip(phase.rows, evaluate(phase.outputs, states, segment.pars, times), strict=True))
        result = {name: values[name] for name in (*MOTION, *ACCELERATIONS)}
        for corner, name in enumerate(CORNERS):
            slot = segment.slots.index(corner)
            result |= {f"corner_{name}_{p}": values[f"{p}{slot}"] for p in ("gap", "normal", "friction")}
        if not self.motion.press.energies:
            return result
        energies = {name: values[name] for name in ("energy_kinetic", "energy_contact", "energy_load")}
        self.first = self.first or {name: values[name][0] for name in (*energies, "height")}
        result["energy_gravity"] = self.first["height"] - values["height"]
        drive, damping, friction = (states.T[phase.states.index(name)] for name in INTEGRALS)
        result |= zip(INTEGRALS, (drive, damping, friction), strict=True)
        gain = sum((values[name] - self.first[name] for name in energies), 0 * drive)
        result["energy_residual"] = drive + result["energy_gravity"] - gain - damping - friction
        if not self.motion.press.loaded:
            del energies["energy_load"]
        return result | energies


simulate.settings = {"tolerance": TOLERANCE}  # type: ignore[attr-defined]
simulate.check = check  # type: ignore[attr-defined]
