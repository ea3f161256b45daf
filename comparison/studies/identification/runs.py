"""What kinematics do not fix, from runs of the reference: corner radius, gravity, reference line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.scene import Scene, load_scene
from comparison.studies.identification.fitting import Fit
from comparison.studies.shared.errors import largest, second_cycle
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array
from comparison.tables.table import Table

Values = dict[str, object]

BASE = "150rpm-0.2mm"
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
OFFSET = "mechanism.reference_offset"
RUNNER_UP = "runner-up"
POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""
PRINTED_RANGES = {
    "x": (published("F14a-x").value, published("F14a-x2").value),
    "y": (published("F14e-y").value, published("F14e-y2").value),
}
"""Of 100 cycles, m."""
RADII = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
GRAVITIES = (-9.81, 0.0, 9.81)
OFFSETS = (-50e-6, 0.0, 25e-6, 50e-6, 75e-6)
MEMBERS = 4
NUDGE = 1e-9
"""m, of the start from one member to the next: which impact is the hardest can hang on less than that."""
SAMPLES = 10_000
"""A cycle: 40 us apart at 150 rpm, where half of the contacts last more than 200 us."""
CYCLES = 100
LONG_SAMPLES = 1000

Setting = tuple[str, float]
"""The key that is varied, and its value."""


@dataclass(frozen=True)
class Ranges:
    """Of 100 cycles, relative to the ideal slider: (lowest, highest), m."""

    x: tuple[float, float]
    y: tuple[float, float]


@dataclass(frozen=True)
class Runs:
    """What was run.

    Attributes
    ----------
    peaks
        (setting, scene, channel) -> size of the largest error in the second cycle, one a member, shape (m,).
    ranges
        Reference offset, m -> ranges of 100 cycles.
    ideal
        Model -> one cycle of the scene ``ideal``.
    """

    peaks: dict[tuple[Setting, str, str], Array]
    ranges: dict[float, Ranges]
    ideal: dict[str, Table]


def press(fit: Fit) -> Values:
    """Return the scene keys of a press whose rod 2 hangs at the rocker's centroid."""
    topology, geometry = fit.topology, fit.geometry
    mechanism = load_scene(BASE).data["mechanism"]
    return {
        "mechanism.rocker_pivot": [geometry.pivot_x, geometry.pivot_y],
        "mechanism.guide_x": geometry.guide - mechanism["reference_offset"],
        "mechanism.crank_angle_deg": float(fit.shown[0]),
        "mechanism.rocker_branch": topology.rocker,
        "mechanism.slider_branch": topology.slider,
    }


def simulate(runner_up: Fit, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run everything in one go.

    Parameters
    ----------
    runner_up
        The press that comes second, to be run beside the shipped one. Its crank must turn
        counter-clockwise and its rod 2 hang at the rocker's centroid.
    n_jobs, on_progress
        As of `comparison.execution.run.run_all`.

    Raises
    ------
    RunError
        If one of them does not succeed.
    """
    changed: dict[Setting, Values] = {(RADIUS, value): {RADIUS: value} for value in RADII}
    changed |= {(GRAVITY, value): {GRAVITY: value} for value in GRAVITIES}
    changed |= {(RUNNER_UP, value): press(runner_up) | {GRAVITY: value} for value in GRAVITIES}
    jobs: dict[tuple[object, ...], Job] = {}
    for setting, values in changed.items():
        # Gravity and contact move nothing in the ideal mechanism.
        still: Values = {key: value for key, value in values.items() if key.startswith("mechanism.")}
        for name in CASES:
            jobs[setting, name] = Job(_scene(name, still | {"joints.slider": "ideal"}), "reference")
            for k in range(MEMBERS):
                jobs[setting, name, k] = Job(_scene(name, values, k), "reference")
    for offset in OFFSETS:
        for joint in ("clearance", "ideal"):
            jobs[offset, joint] = Job(_long(offset, joint), "reference")
    for model in ("reference", "exudyn"):
        jobs["ideal", model] = Job(load_scene("ideal", {"drive.cycles": 1.0}), model)
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    tables = dict(zip(jobs, map(successful, outcomes, jobs.values()), strict=True))
    return Runs(
        {
            (setting, name, channel): _peaks(
                [tables[setting, name, k] for k in range(MEMBERS)], tables[setting, name], channel
            )
            for setting in changed
            for name in CASES
            for channel in CHANNELS
        },
        {offset: _ranges(tables[offset, "clearance"], tables[offset, "ideal"]) for offset in OFFSETS},
        {model: tables["ideal", model] for model in ("reference", "exudyn")},
    )


def ratios(runs: Runs, setting: Setting, channels: Sequence[str]) -> Array:
    """Return median peak over published peak, one a scene and channel, in the order of `CASES`."""
    return np.array(
        [
            float(np.median(runs.peaks[setting, name, channel]))
            / abs(published(f"{row}-{CHANNELS[channel]}").value)
            for name, row in CASES.items()
            for channel in channels
        ]
    )


def _scene(name: str, values: Values, member: int = 0) -> Scene:
    scene = load_scene(
        name, {"output.groups": ["accelerations"], "output.samples_per_cycle": SAMPLES} | values
    )
    return scene.with_values(
        {"initial.slider_offset": scene.data["mechanism"]["reference_offset"] + member * NUDGE}
    )


def _long(offset: float, joint: str) -> Scene:
    fixed: Values = {
        OFFSET: offset,
        "joints.slider": joint,
        "drive.cycles": float(CYCLES if joint == "clearance" else 1),
        "output.groups": [],
        "output.samples_per_cycle": LONG_SAMPLES,
    }
    return load_scene(BASE, fixed)


def _peaks(runs: Sequence[Table], still: Table, channel: str) -> Array:
    within = second_cycle(still.time, float(still.time[-1]) / 2)
    return np.array([abs(largest(run, still, channel, within).value) for run in runs])


def _ranges(run: Table, ideal: Table) -> Ranges:
    turn = np.arange(run.time.size) % LONG_SAMPLES
    off = run.values("slider_y") - ideal.values("slider_y")[turn]
    line, x = float(ideal.values("slider_x")[0]), run.extrema["slider_x"]
    return Ranges((x["min"] - line, x["max"] - line), (float(off.min()), float(off.max())))
