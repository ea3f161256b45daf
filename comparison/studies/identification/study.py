"""The geometry from the published facts, and what runs say about radius, gravity and reference line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import exp, isnan, radians, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.formatting import number, percent, quantity
from comparison.scene import load_scene
from comparison.studies.identification import figures
from comparison.studies.identification.figures import UNKNOWNS
from comparison.studies.identification.fitting import (
    BASE,
    Fit,
    Profile,
    fit,
    printed_facts,
    profile,
    residuals,
    shipped_geometry,
    shown,
    table_1,
    vibration,
)
from comparison.studies.identification.kinematics import TOPOLOGIES, motion
from comparison.studies.identification.runs import (
    GRAVITIES,
    GRAVITY,
    PRINTED_RANGES,
    RUNNER_UP,
    Config,
    Runs,
    fit_radius,
    simulate,
)
from comparison.studies.shared.frames import Columns, markdown, rows_table
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study, part
from comparison.tables.table import Table

FITTING = 0.1
"""Share of the progress that the fits take."""
HELD = np.linspace(-3.0, 3.0, 13)
"""Values of a profile, standard deviations from the best."""
FINE = 7201
"""Crank angles of the closed form where instants are read from it, 0.05 degrees apart."""
DECISIVE = 3.0
"""Factor between two misfits from which on the peaks decide; scenes scatter by 2 about their mean."""
VELOCITIES = {"lowest": (2, "F14c-vy"), "highest": (3, "F14c-vy2")}
"""Place among the facts, and row of the published one."""
_metres, _two = partial(quantity, unit="m"), partial(number, digits=2)


@dataclass(frozen=True)
class Results:
    """Fits of all arrangements, the best first, its profiles, one an unknown, and what was run."""

    config: Config
    facts: pd.DataFrame
    fits: list[Fit]
    profiles: list[Profile]
    runs: Runs


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Fit every arrangement and run what kinematics leave open."""
    facts, tried = printed_facts(), []
    for n, topology in enumerate(config.topologies):
        tried.append(fit(topology, facts))
        if on_progress:
            on_progress(FITTING * (n + 1) / len(config.topologies))
    fits = sorted((each for each in tried if each is not None), key=lambda each: each.misfit)
    runs = simulate(fits[1], config, n_jobs, part(on_progress, FITTING, 1.0))
    best = fits[0]
    spread = np.sqrt(np.diag(best.covariance))
    profiles = [profile(best, n, best.geometry[n] + spread[n] * HELD, facts) for n in range(3)]
    return Results(config, facts, fits, profiles, runs)


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config = results.config
    return (
        {"members": config.members, "cycles": config.cycles, "tried": len(config.topologies)}
        | of_fits(results.fits, results.facts, results.profiles)
        | of_runs(results.runs)
        | of_radius(results.runs.by_radius)
    )


# ---- the fits


def of_fits(fits: Sequence[Fit], facts: pd.DataFrame, profiles: Sequence[Profile]) -> dict[str, object]:
    """Return what the page says of the fits, by the names in its template."""
    best, second = fits[:2]
    shipped = shipped_geometry()
    off = np.array(shipped) - np.array(best.geometry)
    misses = residuals(shipped, best.topology, facts, facts["allowance"].to_numpy())
    compared = facts.assign(best=best.shown, second=second.shown, shipped=shown(shipped, best.topology)[1])
    six = "{:.6g}".format
    columns: Columns = {"": str, "print": six, "allowance": _two, "best": six, "second": six, "shipped": six}
    ranked = ranking(fits, facts)
    return {
        "finding": f"Of {len(fits)} arrangements the best fits the printed figures with a misfit of "
        f"{number(best.misfit, 2)} allowances, the second with {number(second.misfit, 2)}.",
        "count": len(fits),
        "best": best.topology,
        "second": second.topology,
        "facts": markdown(
            compared.set_axis([f"{name} ({unit})".replace(" ()", "") for name, unit in facts["unit"].items()])
            .rename(columns={"value": "print"})
            .rename_axis("")
            .reset_index(),
            columns,
        ),
        "unknowns": rows_table(
            {
                "": name,
                "best": _mm(best.geometry[n]),
                "standard deviation": _mm(sqrt(best.covariance[n, n])),
                "two deviations by the profile": " … ".join(map(_mm, profiles[n].two_sigma)),
                "shipped": _mm(shipped[n]),
            }
            for n, name in enumerate(UNKNOWNS)
        ),
        "certainty": ", ".join(_mm(sqrt(best.covariance[n, n])) for n in range(3)),
        "vibration": f"{1e3 * vibration():.1f}",
        "second_chance": percent(exp(-0.5 * float(np.sum(second.residuals**2)))),
        "distance": number(sqrt(float(off @ np.linalg.pinv(best.covariance) @ off)), 2),
        "shipped_misfit": number(sqrt(float(np.sum(misses**2)) / 2), 2),
        "possible": int(((ranked["lowest_off"] == 0) & (ranked["highest_off"] == 0)).sum()),
    } | _bottom(best)


def ranking(fits: Sequence[Fit], facts: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each arrangement, the best first.

    Its geometry (mm), misfit, misses of the five facts in roundings of the print, its ideal velocities,
    and by how much they are too large for the published range, m/s; 0 where they are possible.
    """
    rows = []
    for each in fits:
        misses = each.residuals * facts["allowance"] / facts["rounding"]
        row: dict[str, Any] = {"arrangement": str(each.topology), "misfit": each.misfit}
        row |= {f"{name}_mm": 1e3 * value for name, value in zip(UNKNOWNS, each.geometry, strict=True)}
        row |= {f"miss of {name}": miss for name, miss in misses.items()}
        for end, (place, name) in VELOCITIES.items():
            row |= {f"{end}_velocity": each.shown[place], f"{end}_off": _excess(each.shown[place], name)}
        rows.append(row)
    return pd.DataFrame(rows)


def _excess(value: float, row: str) -> float:
    """Return by how much an ideal velocity is larger than the published one, m/s; 0 where it is possible."""
    printed = published(row)
    excess = abs(value) - abs(printed.value)
    return 0.0 if -vibration() - printed.rounding <= excess <= printed.rounding else excess


def _bottom(best: Fit) -> dict[str, str]:
    """Return when the slider is at its lowest, and for how long the print cannot distinguish it."""
    printed = published("S4.2-stroke")
    lengths, speed = table_1()
    angle = np.linspace(0.0, 2 * np.pi, FINE)
    crank = radians(best.shown[0]) + best.topology.crank * angle
    y = motion(best.geometry, best.topology, lengths, crank).F.imag
    fall, time = y - y[0], (angle + angle[-1]) / speed
    low = time[np.abs(fall - printed.value) <= printed.rounding]
    return {
        "lowest_at": f"{time[y.argmin()]:.4f}",
        "low_from": f"{low[0]:.4f}",
        "low_to": f"{low[-1]:.4f}",
        "printed_fall": f"{printed.value}",
        "printed_at": f"{printed.time}",
        "fall_there": f"{np.interp(printed.time, time, fall):.5f}",
    }


def _mm(value: float) -> str:
    return f"{1e3 * value:.2f} mm"


# ---- the runs


def of_runs(runs: Runs) -> dict[str, object]:
    """Return what the page says of the runs, by the names in its template."""
    ranges = pd.concat([pd.DataFrame(PRINTED_RANGES, ["published"]), runs.ranges.rename(_metres)])
    names = ("up", "none", "down", "runner_up_turned", "runner_up_none", "runner_up")
    places = [(press, value) for press in (GRAVITY, RUNNER_UP) for value in GRAVITIES]
    misfits = dict(zip(names, misfit(runs.ratios)[places], strict=True))
    central = [", ".join(map(_two, runs.ratios[BASE].loc[(GRAVITY, value)].tolist())) for value in GRAVITIES]
    down, none, up = (misfits[name] for name in ("down", "none", "up"))
    return {
        "check": rows_table(
            {"largest difference to the closed form": model} | _differences(run)
            for model, run in runs.ideal.items()
        ),
        "offset": markdown(
            ranges.rename_axis("reference offset").reset_index(),
            {"reference offset": str, **dict.fromkeys(PRINTED_RANGES, partial(_metres, digits=4))},
        ),
        **{name: number(value, 2) for name, value in misfits.items()},
        "decided_down": decision({"the second": misfits["runner_up"], "the first": down}),
        "decided_none": decision({"the second": misfits["runner_up_none"], "the first": none}),
        "decided_gravity": decision({"gravity downwards": down, "no gravity": none, "gravity upwards": up}),
        "central_none": central[1],
        "central_down": central[2],
        **_offset(runs.ranges),
    }


def misfit(ratios: pd.DataFrame) -> pd.Series[float]:
    """Return the typical factor by which each row's peaks miss the published ones."""
    factors: pd.Series[float] = np.exp(np.sqrt((np.log(ratios) ** 2).mean(axis=1)))
    return factors


def decision(misfits: Mapping[str, float]) -> str:
    """Say which of several the peaks exclude: those that miss them `DECISIVE` times as much as the best."""
    most = DECISIVE * min(misfits.values())
    excluded = [name for name, value in misfits.items() if value >= most]
    return f"the peaks exclude {' and '.join(excluded)}" if excluded else "the peaks do not decide"


def of_radius(peaks: pd.DataFrame) -> dict[str, str]:
    """Return what the page says of the radius, by the names in its template."""
    fitted = fit_radius(peaks)
    means = np.exp(np.log(peaks).mean(axis=1))
    mean = [f"{number(value)} at {_metres(radius)}" for radius, value in means.items()]
    words = {"exponent": number(fitted.power, 2), "means": ", ".join(mean)}
    if isnan(fitted.radius):
        none = "The peaks do not grow with the radius, so that no radius meets the published ones."
        return words | {"radius_found": none, "radius_certainty": "the peaks do not determine it"}
    used = load_scene(BASE).data["contact"]["corner_radius"]
    agrees = "agrees" if fitted.low <= used <= fitted.high else "does not agree"
    factor = number(fitted.high / fitted.radius, 1)
    return words | {
        "radius_found": f"The published peaks are met on the mean at {number(fitted.radius, 2)} m. The "
        f"scenes scatter by a factor of {number(fitted.scatter, 2)}, which leaves {number(fitted.low, 1)} … "
        f"{number(fitted.high, 1)} m (one standard deviation).",
        "radius_certainty": f"{agrees} with the peaks, which determine it to a factor of {factor}",
    }


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


def _offset(ranges: pd.DataFrame) -> dict[str, str]:
    """Return the offset from the x range, and those at which the y errors' ends would meet the print."""
    low, high = PRINTED_RANGES["x, lowest"], PRINTED_RANGES["x, highest"]
    used = ranges.loc[load_scene("paper").data["mechanism"]["reference_offset"]]
    clearance = load_scene(BASE).data["clearance"]["slider"]
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
        "printed_excess": quantity(0.5 * (high - low) - clearance, "m", 2),
        "excess": quantity(0.5 * (used["x, highest"] - used["x, lowest"]) - clearance, "m", 2),
    } | met


def draw(results: Results, folder: Path) -> None:
    """Draw presses, ranking and profiles of the fits, radius and offset of the runs; write CSV."""
    figures.draw_presses(results.fits, folder / "press.svg")
    figures.draw_ranking(results.fits, folder / "ranking.svg")
    figures.draw_profiles(results.profiles, folder / "profiles.svg")
    figures.draw_radius(results.runs, folder / "radius.svg")
    figures.draw_offset(results.runs, folder / "offset.svg")
    ratios = results.runs.ratios
    peaks = ratios.set_axis(ratios.columns.map(", ".join), axis=1).assign(misfit=misfit(ratios))
    frames = {
        "arrangements": ranking(results.fits, results.facts),
        "peaks": peaks.rename_axis(["varied", "value"]).reset_index(),
    }
    for name, frame in frames.items():
        with replacing(folder / f"{name}.csv") as path:
            frame.to_csv(path, index=False)


STUDY = Study(
    "identification",
    small=Config(topologies=TOPOLOGIES[:5], members=2, samples=100, cycles=3, long_samples=100),
    # 10,000 samples a cycle are 40 us apart at 150 rpm, where half of the contacts last more than 200 us.
    full=Config(topologies=TOPOLOGIES, members=4, samples=10_000, cycles=100, long_samples=1000),
    measure=measure,
    page=page,
    draw=draw,
)
