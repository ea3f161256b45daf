"""What a run shows in place of each printed figure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.reliability.assessment import Assessment, assess
from comparison.reliability.errors import QUANTITIES, Peak
from comparison.scene import load_scene
from comparison.studies.paper.runs import CENTRAL, PIN, Runs, second
from comparison.studies.shared.published import CONDITION, printed_rows

CONDITIONS = {
    ("translational", "150", "0.2", "210", "0.28"): CENTRAL,
    ("translational", "150", "0.2", "69", "0.28"): "69GPa",
    ("translational", "150", "0.2", "210", "0.33"): "poisson-0.33",
    ("translational", "90", "0.1", "210", "0.28"): "90rpm-0.1mm",
    ("translational", "90", "0.5", "210", "0.28"): "90rpm-0.5mm",
    ("translational", "300", "0.2", "210", "0.28"): "300rpm-0.2mm",
    ("revolute_A", "150", "0.2", "210", "0.28"): PIN,
    ("ideal", "150", "0", "210", "0.28"): "ideal",
}
"""Pair with clearance, speed, clearance, elastic modulus and Poisson's ratio, as printed -> the scene."""
PEAKS = {f"peak_{word}_error": channel for word, channel in QUANTITIES.items()}
RANGES = {
    "range_x_deviation": ("slider_x", "start"),
    "range_x_velocity": ("slider_vx", "nothing"),
    "range_y": ("slider_y", "start"),
    "range_y_velocity": ("slider_vy", "nothing"),
    "range_y_error": ("slider_y", "motion"),
    "range_y_velocity_error": ("slider_vy", "motion"),
}
"""Of Fig. 14: the channel, and what of the ideal slider is taken off: its start, nothing, or its motion."""
REACH = 0.025
"""Of a cycle, 9 degrees of the crank: a peak this close to the printed instant counts as the same passage.
Three times the 0.8 % by which the paper's own instants of one peak differ (0.4110 s and 0.4141 s)."""
_STILL = CENTRAL
"""Whose ideal mechanism stands for the scene ``ideal``: that at 150 rpm."""


@dataclass(frozen=True)
class Measured:
    """What stands in place of a printed figure, in its unit."""

    value: float
    """Of the first run."""
    time: float = float("nan")
    """s; nan where it belongs to no instant."""
    others: tuple[Peak, ...] = ()
    """The same of runs that start a nudge elsewhere."""
    sampled: float = float("nan")
    """The same of the samples alone; nan where there is no such thing."""
    error: float = 0.0
    """By which its size may be larger, as far as the samples tell."""

    @property
    def peaks(self) -> tuple[Peak, ...]:
        """Of all runs, the first one's first."""
        return (Peak(self.value, self.time), *self.others)


def scene_of(identifier: str) -> str:
    """Return the scene of a published row, such as ``F9-69-d``.

    Raises
    ------
    KeyError
        If there is no such row.
    """
    return CONDITIONS[tuple(printed_rows().loc[identifier, CONDITION])]


def measure(identifier: str, quantity: str, runs: Runs, model: str) -> Measured:
    """Return what a model's runs show in place of a published row.

    Raises
    ------
    KeyError
        If the quantity cannot be measured.
    """
    scene = scene_of(identifier)
    if quantity in PEAKS:
        channel = PEAKS[quantity]
        found = [largest_error(runs, scene, model, channel, k) for k in range(len(runs.short[scene, model]))]
        samples = runs.errors(scene, model, channel)[second(runs.short[scene, model][0])]
        of_samples = float(samples[np.abs(samples).argmax()])
        peak, others = found[0], tuple(found[1:])
        return Measured(peak.value, peak.time, others, of_samples, peak.error)
    if quantity == "lowest_displacement":
        y = runs.ideal[_STILL, model].values("slider_y")
        return Measured(float(y.min() - y[0]))
    if quantity == "crank_angle_at_top_dead_centre":
        return Measured(_top_dead_centre(runs, model))
    name, _, end = quantity.rpartition("_")
    channel, origin = RANGES[name]
    return Measured(_range(runs, scene, model, channel, origin)[end == "high"])


def largest_error(runs: Runs, scene: str, model: str, channel: str, member: int = 0) -> Peak:
    """Return the largest error of the second cycle."""
    errors = runs.of_two_cycles(scene, model, member)
    return errors.peak(channel, errors.period, 2 * errors.period)


def near(runs: Runs, scene: str, model: str, channel: str, time: float) -> Peak:
    """Return the largest error within `REACH` of a cycle around an instant (s)."""
    errors = runs.of_two_cycles(scene, model)
    return errors.peak(channel, time - REACH * errors.period, time + REACH * errors.period)


def first_cycle(runs: Runs, scene: str, model: str, channel: str) -> Peak:
    """Return the largest error of the first cycle, which starts at rest on the ideal slider's line."""
    errors = runs.of_two_cycles(scene, model)
    return errors.peak(channel, 0.0, errors.period)


def reliabilities(runs: Runs, scene: str, model: str) -> dict[str, Assessment]:
    """Return the reliabilities of the two cycles at the limits of the scene, by quantity."""
    return assess(runs.of_two_cycles(scene, model), load_scene(scene).reliability)


def _range(runs: Runs, scene: str, model: str, channel: str, origin: str) -> tuple[float, float]:
    if origin == "motion":
        errors = runs.long_errors(scene, model, channel)
        return float(errors.min()), float(errors.max())
    zero = float(runs.ideal[scene, model].values(channel)[0]) if origin == "start" else 0.0
    extremes = runs.long[scene, model].extrema[channel]
    return extremes["min"] - zero, extremes["max"] - zero


def _top_dead_centre(runs: Runs, model: str) -> float:
    """Return the crank angle at which the ideal slider is highest, deg: the zero of its velocity."""
    ideal, samples = runs.ideal[_STILL, model], runs.config.samples
    velocity = ideal.values("slider_vy")
    at = samples // 2 + int(ideal.values("slider_y")[samples // 2 : -samples // 2].argmax())
    rise = (velocity[at + 1] - velocity[at - 1]) / 2
    start = float(load_scene("ideal").data["mechanism"]["crank_angle_deg"])
    return float(start + 360.0 * ((at - velocity[at] / rise) / samples - 1.0))
