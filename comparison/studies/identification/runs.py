"""What kinematics leave open, from runs of the reference: corner radius, gravity, reference line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import exp, sqrt
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.models import MODELS
from comparison.reliability.errors import slider_errors
from comparison.scene import load_scene
from comparison.studies.identification.fitting import BASE, Fit
from comparison.studies.identification.kinematics import Topology
from comparison.studies.shared.published import published
from comparison.tables.table import Table

Values = dict[str, object]

CASES = {
    BASE: "F9-210",
    "69GPa": "F9-69",
    "90rpm-0.1mm": "F11-01",
    "90rpm-0.5mm": "F11-05",
    "300rpm-0.2mm": "F12-300",
}
"""Scene -> how its rows begin in the table of published results; Poisson's ratio 0.33 repeats the first."""
CHANNELS = {"slider_y": "d", "slider_vy": "v", "slider_ay": "a"}
RADIUS, GRAVITY = "contact.corner_radius", "environment.gravity"
RUNNER_UP = "runner-up"
PRINTED_RANGES = {
    "x, lowest": published("F14a-x").value,
    "x, highest": published("F14a-x2").value,
    "y error, lowest": published("F14e-y").value,
    "y error, highest": published("F14e-y2").value,
}
"""Of 100 cycles, relative to the ideal slider, m."""
RADII = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
GRAVITIES = (-9.81, 0.0, 9.81)
OFFSETS = (-50e-6, 0.0, 25e-6, 50e-6, 75e-6)
POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""
NUDGE = 1e-9
"""m, of the start from one member to the next: which impact is the hardest can depend on less than that."""


@dataclass(frozen=True)
class Config:
    """What is fitted and how much is run."""

    topologies: Sequence[Topology]
    members: int
    """Runs in an ensemble."""
    samples: int
    """A cycle, of the runs whose peaks are taken."""
    cycles: int
    long_samples: int
    """A cycle, of the runs whose ranges are taken."""


@dataclass(frozen=True)
class Runs:
    """What was run."""

    ratios: pd.DataFrame
    """Median of the largest errors in the second cycle over the published one: a row for each key that is
    varied and its value, a column for each scene and channel."""
    ranges: pd.DataFrame
    """A row for each reference offset (m) with the columns of `PRINTED_RANGES`."""
    ideal: dict[str, Table]
    """Model -> one cycle of the scene ``ideal``."""

    @property
    def by_radius(self) -> pd.DataFrame:
        """Ratios of the acceleration: a row a radius (m), a column a scene."""
        return self.ratios.loc[[RADIUS], (slice(None), "slider_ay")].droplevel(0).droplevel(1, axis=1)


def press(fit: Fit) -> Values:
    """Return the scene keys of a press whose rod 2 is attached at the rocker's centroid."""
    topology, geometry = fit.topology, fit.geometry
    mechanism = load_scene(BASE).data["mechanism"]
    return {
        "mechanism.rocker_pivot": [geometry.pivot_x, geometry.pivot_y],
        "mechanism.guide_x": geometry.guide - mechanism["reference_offset"],
        "mechanism.crank_angle_deg": float(fit.shown[0]),
        "mechanism.rocker_branch": topology.rocker,
        "mechanism.slider_branch": topology.slider,
    }


def simulate(runner_up: Fit, config: Config, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run everything in one go, the shipped press and the runner-up.

    The runner-up's crank must rotate counter-clockwise and its rod 2 be attached at the rocker's centroid.

    Raises
    ------
    RunError
        If one of them does not succeed.
    """
    settings: dict[tuple[str, float], Values] = {(RADIUS, value): {RADIUS: value} for value in RADII}
    settings |= {(GRAVITY, value): {GRAVITY: value} for value in GRAVITIES}
    settings |= {(RUNNER_UP, value): press(runner_up) | {GRAVITY: value} for value in GRAVITIES}
    jobs: dict[tuple[object, ...], Job] = {}
    for setting, values in settings.items():
        # Gravity and contact move nothing in the ideal mechanism.
        still = {key: value for key, value in values.items() if key.startswith("mechanism.")}
        for name in CASES:
            jobs[setting, name] = _job(name, still | {"joints.slider": "ideal"}, config)
            for k in range(config.members):
                jobs[setting, name, k] = _job(name, values, config, k)
    for offset, (joint, cycles) in product(OFFSETS, (("clearance", config.cycles), ("ideal", 1))):
        jobs[offset, joint] = _long(offset, joint, cycles, config.long_samples)
    for model in MODELS:
        jobs["ideal", model] = Job(load_scene("ideal", {"drive.cycles": 1.0}), model)
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    tables = dict(zip(jobs, map(successful, outcomes, jobs.values()), strict=True))

    def ratio(setting: tuple[str, float], name: str, channel: str) -> float:
        still, members = tables[setting, name], [tables[setting, name, k] for k in range(config.members)]
        period = float(still.time[-1]) / 2
        peaks = [slider_errors(run, still, period).peak(channel, period, 2 * period) for run in members]
        sizes = [abs(peak.value) for peak in peaks]
        return float(np.median(sizes)) / abs(published(f"{CASES[name]}-{CHANNELS[channel]}").value)

    columns = pd.MultiIndex.from_product([CASES, CHANNELS])
    ratios = [[ratio(setting, *column) for column in columns] for setting in settings]
    ranges = {offset: _ranges(tables[offset, "clearance"], tables[offset, "ideal"]) for offset in OFFSETS}
    return Runs(
        pd.DataFrame(ratios, pd.MultiIndex.from_tuples(settings), columns),
        pd.DataFrame.from_dict(ranges, orient="index", columns=list(PRINTED_RANGES)),
        {model: tables["ideal", model] for model in MODELS},
    )


def _job(name: str, values: Values, config: Config, member: int = 0) -> Job:
    fixed: Values = {"output.groups": ["accelerations"], "output.samples_per_cycle": config.samples}
    scene = load_scene(name, fixed | values)
    start = scene.data["mechanism"]["reference_offset"] + member * NUDGE
    return Job(scene.with_values({"initial.slider_offset": start}), "reference")


def _long(offset: float, joint: str, cycles: int, samples: int) -> Job:
    values: Values = {
        "mechanism.reference_offset": offset,
        "joints.slider": joint,
        "drive.cycles": float(cycles),
        "output.groups": [],
        "output.samples_per_cycle": samples,
    }
    return Job(load_scene(BASE, values), "reference")


def _ranges(run: Table, ideal: Table) -> list[float]:
    # Both start at zero, and the ideal motion repeats in every cycle.
    cycle = np.arange(run.time.size) % (ideal.time.size - 1)
    off = run.values("slider_y") - ideal.values("slider_y")[cycle]
    line, x = float(ideal.values("slider_x")[0]), run.extrema["slider_x"]
    return [x["min"] - line, x["max"] - line, float(off.min()), float(off.max())]


class RadiusFit(NamedTuple):
    """A straight line through the logarithms of radii and peaks."""

    power: float
    """Of the radius in the peaks."""
    radius: float
    """At which the mean of the peaks is the published one, m; nan where they do not grow with it."""
    low: float
    high: float
    """One standard deviation to either side, from the scatter of the scenes through `POWER`, m."""
    scatter: float
    """Factor by which the scenes scatter about their mean."""


def fit_radius(peaks: pd.DataFrame) -> RadiusFit:
    """Return how peaks over the published ones, a row a radius (m), a column a scene, depend on it."""
    logs, scale = np.log(peaks.to_numpy()), np.log(peaks.index.to_numpy(np.float64))
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # The residual of each scene's ratio about the mean of all gives the uncertainty of a mean of five.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    factor = exp(scatter / sqrt(logs.shape[1]) / POWER)
    best = exp(float(scale.mean() - logs.mean() / power)) if power > 0 else float("nan")
    return RadiusFit(power, best, best / factor, best * factor, exp(scatter))
