"""The paper's clearance at the crank pin A, beside its published peaks (Figs. 7 and 8)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study, crossed, plain_ticks, rows_table
from comparison.tables.table import Table

RADIUS, MODULUS, FRICTION = "clearance.journal_radius", "contact.youngs_modulus", "friction.coefficient"
TOLERANCE, SAMPLES = "solver.reference.tolerance", "output.samples_per_cycle"
SHOWN = 10e-3  # m; the journal radius of the first table
NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider in all of them."""
PRINTED = {name: published(f"F7-R-{name[0]}") for name in QUANTITIES}
REACH = 0.01
"""s; a peak this close to the published instant (2.5 % of a crank cycle) counts as the same passage."""
CYCLE, PASSAGE = "second cycle", "passage"  # where a peak is taken
CASE = ["key", "value", "model", "quantity", "where"]
"""What names an ensemble's peak: the key that is varied, its value, ..."""


class Config(NamedTuple):
    """What is varied and how often it runs."""

    varied: Mapping[str, Sequence[float]]  # key -> its values; each is run as an ensemble
    members: int  # runs in an ensemble
    samples: int  # a cycle, of all runs but those of `samplings`
    samplings: tuple[int, ...]  # samples a cycle of one run each


def scene(values: Mapping[str, object], member: int = 0) -> Scene:
    """Return two cycles with clearance at A only."""
    base = load_scene("150rpm-0.2mm")
    fixed: dict[str, object] = {
        "joints.slider": "ideal",
        "joints.crank_pin": "clearance",
        "mechanism.crank_angle_deg": base.data["mechanism"]["crank_angle_deg"] + member * NUDGE,
        "output.groups": ["accelerations"],
    }
    return base.with_values(fixed | dict(values))


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run the ensembles, the ideal mechanism and Exudyn in one go.

    Returns a row a run and peak, with the columns of `CASE`, ``size`` and ``time`` (s); of a run that failed
    one with ``message``.
    """
    radii, usual = config.varied[RADIUS], {SAMPLES: config.samples}
    varied = [(key, value) for key, values in config.varied.items() for value in values]
    runs = [
        ((*one, "reference"), scene(usual | dict([one]), k)) for one in varied for k in range(config.members)
    ]
    runs += [((SAMPLES, each, "reference"), scene({SAMPLES: each})) for each in config.samplings]
    runs += [((RADIUS, radius, "exudyn"), scene(usual | {RADIUS: radius})) for radius in radii]
    runs.append(((FRICTION, 0.0, "reference"), scene(usual | {RADIUS: radii[-1], FRICTION: 0.0})))
    jobs = [Job(press, model) for (*_, model), press in runs]
    counts = dict.fromkeys((config.samples, *config.samplings))
    still = [Job(scene({SAMPLES: n, "joints.crank_pin": "ideal"}), "reference") for n in counts]
    outcomes = run_all([*jobs, *still], n_jobs, on_progress)
    ideals = dict(zip(counts, map(successful, outcomes[len(jobs) :], still), strict=True))
    return pd.DataFrame(
        dict(zip(CASE, case, strict=False)) | row
        for (case, press), outcome in zip(runs, outcomes, strict=False)
        for row in peak_rows(outcome, ideals[press.data["output"]["samples_per_cycle"]], press.period)
    )


def peak_rows(outcome: Outcome, still: Table, period: float) -> list[dict[str, object]]:
    """Return the peaks of a run against the ideal mechanism's; of one that failed its reason."""
    if outcome.table is None:
        kind = "not simulated" if outcome.status == "bad input" else outcome.status
        return [{"message": f"{kind}: {outcome.message}"}]
    errors, rows = slider_errors(outcome.table, still, period), []
    for name, channel in QUANTITIES.items():
        instant = PRINTED[name].time
        spans = {PASSAGE: (instant - REACH, instant + REACH), CYCLE: (period, 2 * period)}
        for where, span in spans.items():
            peak = errors.peak(channel, *span)
            rows.append({"quantity": name, "where": where, "size": abs(peak.value), "time": peak.time})
    return rows


def cases(peaks: pd.DataFrame) -> pd.DataFrame:
    """Return median, least and largest peak of each ensemble, by `CASE`, and over the published one."""
    groups = peaks.dropna(subset=["size"]).groupby(CASE, sort=False)
    frame = groups["size"].agg(["median", "min", "max", "count"])
    frame[["first", "last"]] = groups["time"].agg(["min", "max"])
    frame["published"] = [abs(PRINTED[case[3]].value) for case in frame.index]
    return frame.assign(ratio=frame["median"] / frame["published"])


def over_modulus(frame: pd.DataFrame, name: str, where: str) -> pd.DataFrame:
    """Return the reference's peaks of a quantity at a place by Young's modulus."""
    rows = frame.reset_index().set_index("value").sort_index()
    at = {"key": MODULUS, "model": MODELS[0], "quantity": name, "where": where}
    return rows[(rows[list(at)] == pd.Series(at)).all(axis=1)]


def met_at(sizes: pd.Series, size: float) -> list[float]:
    """Return the moduli, GPa, at which median peaks pass a size, by logs."""
    above, logs = np.log(sizes.to_numpy() / size), np.log(sizes.index.to_numpy(float) / 1e9)
    return [
        float(np.exp(logs[n] + (logs[n + 1] - logs[n]) * above[n] / (above[n] - above[n + 1])))
        for n in np.flatnonzero(above[:-1] * above[1:] <= 0)
    ]


def page(peaks: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the page."""
    frame = cases(peaks)
    ratios = frame.reset_index()
    ratios = ratios[ratios["key"].isin([RADIUS, MODULUS, FRICTION])]
    return {
        "met": {
            where: {
                name: met_at(over_modulus(frame, name, where)["median"], abs(PRINTED[name].value))
                for name in QUANTITIES
            }
            for where in (PASSAGE, CYCLE)
        },
        "members": frame["count"].max(),
        "peaks": rows_table(shown_peak(frame, name, at) for at in (PASSAGE, CYCLE) for name in QUANTITIES),
        "failed": peaks.reindex(columns=["model", "message"]).dropna().value_counts(sort=False),
        "ratios": crossed(
            "run",
            [f"{row.key} = {row.value:g}, {row.model}" for row in ratios.itertuples()],
            [f"{row.quantity}, {row.where}" for row in ratios.itertuples()],
            ratios["ratio"].map(number).tolist(),
        ),
    }


def shown_peak(frame: pd.DataFrame, name: str, where: str) -> dict[str, str]:
    """Return a line of the first table: a peak of both models at the journal radius `SHOWN`."""
    printed = PRINTED[name]
    line = {"largest error": f"{name}, {where}", "published": quantity(abs(printed.value), printed.unit, 4)}
    for model in MODELS:
        case = pd.MultiIndex.from_tuples([(RADIUS, SHOWN, model, name, where)])
        statistics = frame.reindex(case).iloc[0]
        low, middle, high = (quantity(statistics[part], printed.unit, 4) for part in ("min", "median", "max"))
        line[model] = f"{middle} ({low} … {high})" if statistics["count"] > 1 else middle
        line[f"{model} / published"] = number(statistics["ratio"])
    return line


def draw(peaks: pd.DataFrame, folder: Path) -> None:
    """Draw the peaks over the modulus; write all ensembles as a table."""
    frame = cases(peaks)
    frame.to_csv(folder / "peaks.csv", float_format="%.6g")
    statistics = over_modulus(frame, "acceleration", PASSAGE)
    moduli = statistics.index.to_numpy(float) / 1e9
    with svg.panels(folder / "stiffness.svg") as (axes,):
        axes.set(xscale="log", yscale="log", xlabel="Young's modulus (GPa)")
        axes.set_ylabel("peak of the acceleration's\nerror (m/s²)")
        axes.vlines(moduli, statistics["min"], statistics["max"], color=svg.FIRST, lw=0.9)
        axes.plot(
            moduli, statistics["median"], "o-", ms=4, color=svg.FIRST, label="reference: median and range"
        )
        slope = statistics["median"].iloc[0] * (moduli / moduli[0]) ** 0.4
        axes.plot(moduli, slope, color=svg.LIMIT, dashes=(1, 2), label="modulus to the power 0.4")
        size = abs(PRINTED["acceleration"].value)
        axes.axhline(size, color=svg.OUTSIDE, lw=1.2, dashes=(3.5, 1.8), label="published")
        axes.margins(x=0.03)
        plain_ticks(axes.yaxis, [100, 200, 500, 1000, 2000])
        svg.legend_above(axes)


STUDY = Study(
    "crank-pin",
    small=Config(
        varied={RADIUS: (2e-3, 10e-3, 50e-3), MODULUS: (10e9, 30e9, 70e9, 210e9), TOLERANCE: (1e-9, 1e-10)},
        members=2,
        samples=100,
        samplings=(50, 100),
    ),
    full=Config(
        varied={
            RADIUS: (2e-3, 5e-3, 10e-3, 20e-3, 50e-3),
            MODULUS: (1e9, 3e9, 10e9, 30e9, 100e9, 210e9, 1000e9),
            TOLERANCE: (1e-9, 1e-10, 1e-11),
        },
        members=8,
        samples=10_000,
        samplings=(1000, 5000, 10_000, 20_000, 100_000),
    ),
    measure=measure,
    page=page,
    draw=draw,
)
