"""What the page says of the runs: radius, gravity, reference line, and the check of the closed form."""

from __future__ import annotations

from math import exp, radians, sqrt

import numpy as np

from comparison.formatting import number, percent, quantity, table
from comparison.scene import load_scene
from comparison.studies.identification.facts import shipped_geometry, shown
from comparison.studies.identification.fitting import Fit
from comparison.studies.identification.kinematics import TOPOLOGIES, Lengths, motion
from comparison.studies.identification.runs import (
    CASES,
    CHANNELS,
    CYCLES,
    GRAVITIES,
    GRAVITY,
    MEMBERS,
    POWER,
    PRINTED_RANGES,
    RADII,
    RADIUS,
    RUNNER_UP,
    Runs,
    Setting,
    ratios,
)
from comparison.tables.arrays import Array


def of_runs(second: Fit, runs: Runs, lengths: Lengths, speed: float) -> dict[str, str]:
    """Return what the page says of the runs, by the names in its template."""
    radius = np.array([ratios(runs, (RADIUS, value), ["slider_ay"]) for value in RADII])
    power, found = radius_met(radius)
    gravity: list[tuple[str, Setting]] = [
        (f"{which}, {value:g} m/s²", (key, value))
        for key, which in ((GRAVITY, "first"), (RUNNER_UP, "second"))
        for value in GRAVITIES
    ]
    return {
        "members": str(MEMBERS),
        "cycles": str(CYCLES),
        "check": table(
            ("largest difference to the closed form", "y", "velocity", "acceleration"),
            [[model, *_differences(runs, model, lengths, speed)] for model in runs.ideal],
        ),
        "radius": table(
            ("corner radius", *CASES, "geometric mean"),
            [
                [quantity(value, "m"), *(number(r, 2) for r in row), number(_mean(row))]
                for value, row in zip(RADII, radius, strict=True)
            ],
        ),
        "exponent": power,
        "radius_found": found,
        "up": _of_gravity(runs, (GRAVITY, GRAVITIES[0])),
        "none": _of_gravity(runs, (GRAVITY, 0.0)),
        "down": _of_gravity(runs, (GRAVITY, GRAVITIES[-1])),
        "runner_up": _of_gravity(runs, (RUNNER_UP, GRAVITIES[-1])),
        "runner_up_none": _of_gravity(runs, (RUNNER_UP, 0.0)),
        "runner_up_turned": _of_gravity(runs, (RUNNER_UP, GRAVITIES[0])),
        "gravity": table(
            (
                "press and gravity",
                *(f"{scene}, {letter}" for scene in CASES for letter in CHANNELS.values()),
                "misfit",
            ),
            [
                [label, *(number(r, 2) for r in row), number(_misfit(row), 2)]
                for label, row in (
                    (label, ratios(runs, setting, list(CHANNELS))) for label, setting in gravity
                )
            ],
        ),
        "second_press": str(second.topology),
        "offset": table(
            ("reference offset", "x, lowest", "x, highest", "y error, lowest", "y error, highest"),
            [
                ["published", *(quantity(end, "m", 4) for name in "xy" for end in PRINTED_RANGES[name])],
                *(
                    [quantity(offset, "m"), *(quantity(end, "m", 4) for end in (*ends.x, *ends.y))]
                    for offset, ends in runs.ranges.items()
                ),
            ],
        ),
        **_offset(runs, lengths, speed),
    }


def _differences(runs: Runs, model: str, lengths: Lengths, speed: float) -> list[str]:
    """Compare a model's run of the ideal press with the closed form of this study at the shipped geometry."""
    run = runs.ideal[model]
    data = run.provenance["scene"]
    crank = radians(data["mechanism"]["crank_angle_deg"]) + speed * run.time
    here = motion(shipped_geometry(), TOPOLOGIES[0], lengths, crank)
    return [
        quantity(float(np.abs(run.values(channel) - expected).max()), unit, 2)
        for channel, expected, unit in (
            ("slider_y", here.F.imag, "m"),
            ("slider_vy", speed * here.velocity, "m/s"),
            ("slider_ay", speed**2 * here.acceleration, "m/s^2"),
        )
    ]


def radius_met(radius: Array) -> tuple[str, str]:
    """Return the exponent of the peaks in the radius, and the radius that meets the published ones, in words.

    Parameters
    ----------
    radius
        Peaks over the published ones, one row a radius of `RADII`, one column a scene.
    """
    logs, scale = np.log(radius), np.log(RADII)
    power = float(np.polyfit(scale, logs.mean(axis=1), 1)[0])
    # What is left of each scene's ratio where the mean of all is taken away says how sure a mean of five is.
    scatter = sqrt(float(np.mean(np.var(logs, axis=1, ddof=1))))
    error = scatter / sqrt(logs.shape[1])
    if power <= 0:
        return number(power, 2), "no radius, since the peaks do not grow with it"
    best = float(scale.mean() - logs.mean() / power)
    low, high = (exp(best + sign * error / POWER) for sign in (-1, 1))
    return number(power, 2), (
        f"{number(exp(best), 2)} m; the scenes scatter about their mean by a factor of "
        f"{number(exp(scatter), 2)}, which through the power of {POWER:g} leaves "
        f"{number(low, 1)} … {number(high, 1)} m (one standard "
        "deviation)"
    )


def _of_gravity(runs: Runs, setting: Setting) -> str:
    return number(_misfit(ratios(runs, setting, list(CHANNELS))), 2)


def _mean(values: Array) -> float:
    return exp(float(np.mean(np.log(values))))


def _misfit(values: Array) -> float:
    """Return the typical factor by which ratios miss 1."""
    return exp(sqrt(float(np.mean(np.log(values) ** 2))))


def _offset(runs: Runs, lengths: Lengths, speed: float) -> dict[str, str]:
    """Return the offset from the x range, and those at which the y errors' ends would meet the print."""
    low, high = PRINTED_RANGES["x"]
    used = load_scene("paper").data["mechanism"]["reference_offset"]
    tangent = shown(shipped_geometry(), TOPOLOGIES[0], lengths, speed)[1][-1]
    offsets = np.array(list(runs.ranges))
    met = []
    for side, word in ((1, "highest"), (0, "lowest")):
        ends = np.array([found.y[side] for found in runs.ranges.values()])
        wanted = PRINTED_RANGES["y"][side]
        slope, at_zero = np.polyfit(offsets, ends, 1)
        found = quantity((wanted - at_zero) / slope, "m", 2) if slope else "none"
        met.append(f"the {word} y error at {found}")
    return {
        "quotient": percent(1 - runs.ranges[used].y[1] / -runs.ranges[used].x[0] / tangent),
        "centre": quantity(-0.5 * (low + high), "m"),
        "width": quantity(high - low, "m", 4),
        "met": ", ".join(met),
    }
