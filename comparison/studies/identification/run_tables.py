"""What stands in the page of the runs: radius, gravity, reference line, and the check of the closed form."""

from __future__ import annotations

from math import exp, radians, sqrt
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.formatting import number, percent, quantity
from comparison.scene import load_scene
from comparison.studies.identification.facts import shipped_geometry, shown, table_1
from comparison.studies.identification.kinematics import TOPOLOGIES, motion
from comparison.studies.identification.runs import (
    CASES,
    CHANNELS,
    GRAVITIES,
    GRAVITY,
    OFFSETS,
    PRINTED_RANGES,
    RADII,
    RUNNER_UP,
    Runs,
)
from comparison.studies.shared.frames import rows_table
from comparison.tables.table import Table

POWER = 0.2
"""Of the radius in an impact's peak force: the stiffness K goes with its root, the force with K^0.4."""


class RadiusFit(NamedTuple):
    """A straight line through the logarithms of radii and peaks.

    Attributes
    ----------
    power
        Of the radius in the peaks.
    radius
        At which the mean of the peaks is the published one, m; nan where they do not grow with it.
    low, high
        One standard deviation to either side, from the scatter of the scenes through `POWER`, m.
    scatter
        Factor by which the scenes scatter about their mean.
    """

    power: float
    radius: float
    low: float
    high: float
    scatter: float


def of_runs(runs: Runs) -> dict[str, object]:
    """Return what the page says of the runs, by the names in its template."""
    peaks = runs.by_radius
    fitted = fit_radius(peaks)
    misfits = np.exp(np.sqrt((np.log(runs.ratios) ** 2).mean(axis=1)))
    up, none, down = (number(misfits[GRAVITY, value], 2) for value in GRAVITIES)
    runner_up_turned, runner_up_none, runner_up = (
        number(misfits[RUNNER_UP, value], 2) for value in GRAVITIES
    )
    means = np.exp(np.log(peaks).mean(axis=1))
    shown_as = [f"{name}, {letter}" for name in CASES for letter in CHANNELS.values()]
    settings = [(key, value) for key in (GRAVITY, RUNNER_UP) for value in GRAVITIES]
    offsets = [quantity(offset, "m") for offset in OFFSETS]
    ranges = [list(PRINTED_RANGES.values()), *runs.ranges.to_numpy().tolist()]
    return {
        "check": rows_table(
            {"largest difference to the closed form": model} | _differences(run)
            for model, run in runs.ideal.items()
        ),
        "radius": rows_table(
            {"corner radius": quantity(radius, "m")}
            | {name: number(ratio, 2) for name, ratio in zip(CASES, row, strict=True)}
            | {"geometric mean": number(means[radius])}
            for radius, row in zip(RADII, peaks.to_numpy(), strict=True)
        ),
        "exponent": number(fitted.power, 2),
        "radius_found": "no radius, since the peaks do not grow with it"
        if np.isnan(fitted.radius)
        else f"{number(fitted.radius, 2)} m",
        "radius_scatter": number(fitted.scatter, 2),
        "radius_low": number(fitted.low, 1),
        "radius_high": number(fitted.high, 1),
        "power": POWER,
        "up": up,
        "none": none,
        "down": down,
        "runner_up": runner_up,
        "runner_up_none": runner_up_none,
        "runner_up_turned": runner_up_turned,
        "gravity": rows_table(
            {"press and gravity": f"{'first' if key == GRAVITY else 'second'}, {value:g} m/s²"}
            | {column: number(ratio, 2) for column, ratio in zip(shown_as, row, strict=True)}
            | {"misfit": number(misfits[key, value], 2)}
            for (key, value), row in zip(settings, runs.ratios.loc[settings].to_numpy(), strict=True)
        ),
        "offset": rows_table(
            {"reference offset": label}
            | {name: quantity(end, "m", 4) for name, end in zip(PRINTED_RANGES, row, strict=True)}
            for label, row in zip(("published", *offsets), ranges, strict=True)
        ),
    } | _offset(runs.ranges)


def _differences(run: Table) -> dict[str, str]:
    """Compare a model's run of the ideal press with the closed form of this study at the shipped geometry."""
    lengths, speed = table_1()
    crank = radians(run.provenance["scene"]["mechanism"]["crank_angle_deg"]) + speed * run.time
    here = motion(shipped_geometry(), TOPOLOGIES[0], lengths, crank)
    return {
        word: quantity(float(np.abs(run.values(channel) - expected).max()), unit, 2)
        for word, channel, expected, unit in (
            ("y", "slider_y", here.F.imag, "m"),
            ("velocity", "slider_vy", speed * here.velocity, "m/s"),
            ("acceleration", "slider_ay", speed**2 * here.acceleration, "m/s^2"),
        )
    }


def fit_radius(peaks: pd.DataFrame) -> RadiusFit:
    """Return how peaks depend on the radius, and where they meet the published ones.

    Parameters
    ----------
    peaks
        Over the published ones: a row a radius (m), a column a scene.
    """
    logs, scale = np.log(peaks.to_numpy()), np.log(peaks.index.to_numpy(np.float64))
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # The residual of each scene's ratio about the mean of all gives the uncertainty of a mean of five.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    factor = exp(scatter / sqrt(logs.shape[1]) / POWER)
    best = exp(float(scale.mean() - logs.mean() / power)) if power > 0 else float("nan")
    return RadiusFit(power, best, best / factor, best * factor, exp(scatter))


def _offset(ranges: pd.DataFrame) -> dict[str, str]:
    """Return the offset from the x range, and those at which the y errors' ends would meet the print."""
    low, high = PRINTED_RANGES["x, lowest"], PRINTED_RANGES["x, highest"]
    used = ranges.loc[load_scene("paper").data["mechanism"]["reference_offset"]]
    tangent = shown(shipped_geometry(), TOPOLOGIES[0])[1][-1]
    met = {}
    for side in ("highest", "lowest"):
        slope, at_zero = np.polyfit(ranges.index.to_numpy(np.float64), ranges[f"y error, {side}"], 1)
        offset = (PRINTED_RANGES[f"y error, {side}"] - at_zero) / slope if slope else np.nan
        met[f"offset_{side}"] = quantity(offset, "m", 2)
    return {
        "quotient": percent(1 - used["y error, highest"] / -used["x, lowest"] / tangent),
        "centre": quantity(-0.5 * (low + high), "m"),
        "width": quantity(high - low, "m", 4),
    } | met
