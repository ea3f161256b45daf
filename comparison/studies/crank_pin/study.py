"""The paper's clearance at the crank pin A, beside its published peaks (Figs. 7 and 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, nan
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import slider_errors
from comparison.report import svg
from comparison.report.svg import envelope
from comparison.scene import Scene, load_scene
from comparison.studies.shared.errors import error, second_cycle, shift_bound
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.published import published
from comparison.studies.shared.rates import rate
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.table import Table

Values = dict[str, object]

BASE = "150rpm-0.2mm"
RADIUS, MODULUS = "clearance.journal_radius", "contact.youngs_modulus"
TOLERANCE, SAMPLES = "solver.reference.tolerance", "output.samples_per_cycle"
FRICTION = "friction.coefficient"
SHOWN = 10e-3
"""m; the journal radius of the figures and of the first table."""
BUILT = 20e-3
"""m; a larger journal would reach beyond the pivot of a 45 mm crank."""
SOFT = 50e9
"""Pa; between the moduli that the exponents of soft and of hard contacts are fitted to."""
NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider in all of them."""
QUANTITIES = {"displacement": "slider_y", "velocity": "slider_vy", "acceleration": "slider_ay"}
PRINTED = {name: published(f"F7-R-{name[0]}") for name in QUANTITIES}
REACH = 0.01
"""s; a peak this close to the published instant (2.5 % of a crank cycle) counts as the same passage."""
CYCLE, PASSAGE = "second cycle", "passage"
"""Where a peak is taken."""
CASE = ["key", "value", "model", "quantity", "where"]
"""What names an ensemble's peak: the key that is varied, its value, ..."""


@dataclass(frozen=True)
class Config:
    """What is varied and how often it runs."""

    varied: Mapping[str, Sequence[float]]
    """Key -> its values; each is run as an ensemble."""
    members: int
    """Runs in an ensemble."""
    samples: int
    """A cycle, of all runs but those of `samplings`."""
    samplings: tuple[int, ...]
    """Samples a cycle of one run each."""


@dataclass(frozen=True)
class Results:
    """Peaks of all runs, and what is drawn."""

    config: Config
    peaks: pd.DataFrame
    """A row a run and peak, with the columns of `CASE`, ``size`` and ``time`` (s); of a run that failed one
    with ``message``."""
    shown: Table
    """A run of the reference with the journal radius `SHOWN`."""
    still: Table
    """The ideal mechanism's run with the same samples."""
    bound: Array
    """What a rigid shift of the pin by its clearance moves the slider by, m."""


def scene(values: Values, samples: int = 1000, member: int = 0) -> Scene:
    """Return two cycles with clearance at A only."""
    fixed: Values = {
        "joints.slider": "ideal",
        "joints.crank_pin": "clearance",
        "mechanism.crank_angle_deg": load_scene(BASE).data["mechanism"]["crank_angle_deg"] + member * NUDGE,
        "output.groups": ["accelerations"],
        SAMPLES: samples,
    }
    return load_scene(BASE, fixed | values)


def shifts() -> list[Values]:
    """Return the crank longer and shorter, ahead and behind, by a tenth of the clearance."""
    data = scene({}).data
    crank, angle = data["mechanism"]["crank"]["length"], data["mechanism"]["crank_angle_deg"]
    step = data["clearance"]["crank_pin"] / 10
    return [{"mechanism.crank.length": crank + sign * step} for sign in (1, -1)] + [
        {"mechanism.crank_angle_deg": angle + sign * degrees(step / crank)} for sign in (1, -1)
    ]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the ensembles, the ideal mechanism and Exudyn in one go.

    Raises
    ------
    RunError
        If the ideal mechanism, of which nothing can fail, does.
    """
    samples, radii = config.samples, config.varied[RADIUS]
    runs: list[tuple[str, float, str, Values, int]] = [
        (key, value, "reference", {key: value}, member)
        for key, values in config.varied.items()
        for value in values
        for member in range(config.members)
    ]
    runs += [(SAMPLES, each, "reference", {SAMPLES: each}, 0) for each in config.samplings]
    runs += [(RADIUS, radius, "exudyn", {RADIUS: radius}, 0) for radius in radii]
    runs += [(FRICTION, 0.0, "reference", {RADIUS: radii[-1], FRICTION: 0.0}, 0)]
    jobs = [Job(scene(values, samples, member), model) for _, _, model, values, member in runs]
    ideal: Values = {"joints.crank_pin": "ideal"}
    counts = dict.fromkeys((samples, *config.samplings))
    still = [Job(scene(ideal, each), "reference") for each in counts]
    still += [Job(scene(ideal | values, samples), "reference") for values in shifts()]
    outcomes = run_all([*jobs, *still], n_jobs, on_progress)
    tables = list(map(successful, outcomes[len(jobs) :], still))
    ideals = dict(zip(counts, tables, strict=False))
    longer, shorter, ahead, behind = (run.values("slider_y") for run in tables[-4:])
    clearance = float(scene({}).data["clearance"]["crank_pin"])
    rows = [
        dict(zip(CASE, run, strict=False)) | row
        for run, outcome in zip(runs, outcomes, strict=False)
        for row in peak_rows(outcome, ideals[int(run[1]) if run[0] == SAMPLES else samples], scene({}).period)
    ]
    shown = (
        o.table for run, o in zip(runs, outcomes, strict=False) if run[:3] == (RADIUS, SHOWN, "reference")
    )
    return Results(
        config,
        pd.DataFrame(rows),
        next(table for table in shown if table is not None),
        ideals[samples],
        shift_bound((longer, shorter), (ahead, behind), clearance / 10, clearance),
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


def passage(frame: pd.DataFrame, varied: str, name: str) -> pd.DataFrame:
    """Return the reference's peaks of a quantity near the published instant by the value of a key."""
    rows = frame.reset_index()
    which = {"key": varied, "model": MODELS[0], "quantity": name, "where": PASSAGE}
    kept = (rows[list(which)] == pd.Series(which)).all(axis=1)
    return rows[kept].set_index("value").sort_index()


def powers(frame: pd.DataFrame, varied: str, low: float, high: float) -> str:
    """Return the exponents of the median peaks in a key between two values, from a line in logs."""
    sizes = {name: passage(frame, varied, name)["median"].loc[low:high] for name in QUANTITIES}
    return ", ".join(f"{name} {number(rate(list(s.index), list(s)), 2)}" for name, s in sizes.items())


def met_at(sizes: pd.Series, size: float) -> float:
    """Return the value at which median peaks pass a size, by logs; nan where they do not."""
    above, logs = np.log(sizes.to_numpy() / size), np.log(sizes.index.to_numpy(float))
    crossings = np.flatnonzero(above[:-1] * above[1:] <= 0)
    if not crossings.size:
        return nan
    n = crossings[0]
    return float(np.exp(logs[n] + (logs[n + 1] - logs[n]) * above[n] / (above[n] - above[n + 1])))


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, still, frame = results.config, results.still, cases(results.peaks)
    at, v = PRINTED["displacement"].time, PRINTED["velocity"]
    velocity = np.interp(v.time, still.time, error(results.shown, still, "slider_vy"))
    inside = second_cycle(still.time, scene({}).period)
    lines = [(RADIUS, r, model, f"R_j = {1e3 * r:g} mm") for model in MODELS for r in config.varied[RADIUS]]
    lines += [(MODULUS, E, MODELS[0], f"E = {E / 1e9:g} GPa") for E in config.varied[MODULUS]]
    return {
        "met": ", ".join(f"{name} at {modulus(frame, name)}" for name in ("displacement", "acceleration")),
        "members": config.members,
        "nudge": f"{NUDGE:g}",
        "reach": f"{1e3 * REACH:g}",
        "peaks": rows_table(
            shown_peak(frame, name, where) for where in (PASSAGE, CYCLE) for name in QUANTITIES
        ),
        "ratios": rows_table(shown_ratios(frame, *line) for line in lines),
        "failures": failures(results.peaks),
        "radius_powers": powers(frame, RADIUS, 0.0, BUILT),
        "soft_powers": powers(frame, MODULUS, 0.0, SOFT),
        "hard_powers": powers(frame, MODULUS, SOFT, np.inf),
        "smooth": _ratio(frame, FRICTION, 0.0, MODELS[0], "velocity", PASSAGE),
        "tolerances": spread(frame, TOLERANCE),
        "samplings": spread(frame, SAMPLES),
        "bound": quantity(float(results.bound[inside].max()), "m"),
        "bound_there": quantity(float(np.interp(at, still.time, results.bound)), "m"),
        "instant": at,
        "velocity": quantity(v.value, "m/s"),
        "velocity_instant": v.time,
        "velocity_there": quantity(float(velocity), "m/s"),
        "contact": contact_at(results.shown, PRINTED["acceleration"].time),
    }


def modulus(frame: pd.DataFrame, name: str) -> str:
    """Return Young's modulus at which the median peak near the instant passes the published one."""
    met = met_at(passage(frame, MODULUS, name)["median"], abs(PRINTED[name].value))
    return "no modulus" if np.isnan(met) else f"{number(met / 1e9, 2)} GPa"


def shown_peak(frame: pd.DataFrame, name: str, where: str) -> dict[str, str]:
    """Return a line of the first table: a peak of both models at the journal radius `SHOWN`."""
    printed = PRINTED[name]
    line = {"largest error": f"{name}, {where}", "published": quantity(abs(printed.value), printed.unit, 4)}
    for model in MODELS:
        case = RADIUS, SHOWN, model, name, where
        sizes = {
            column: frame[column].get(case, nan) for column in ("min", "median", "max", "count", "ratio")
        }
        low, middle, high = (quantity(sizes[part], printed.unit, 4) for part in ("min", "median", "max"))
        line[model] = f"{middle} ({low} … {high})" if sizes["count"] > 1 else middle
        line[f"{model} / published"] = number(sizes["ratio"])
    return line


def shown_ratios(frame: pd.DataFrame, varied: str, value: float, model: str, label: str) -> dict[str, str]:
    """Return a line of an ensemble: its median peaks over the published ones."""
    ratios = {
        f"{name}, {where}": _ratio(frame, varied, value, model, name, where)
        for where in (PASSAGE, CYCLE)
        for name in QUANTITIES
    }
    return {"run": f"{label}, {model}"} | ratios


def _ratio(frame: pd.DataFrame, *case: object) -> str:
    return number(float(frame["ratio"].get(case, nan)))


def spread(frame: pd.DataFrame, varied: str) -> str:
    """Return between what the ratios to the published peaks in the passage are, over the values of a key."""
    ratios = {name: passage(frame, varied, name)["ratio"] for name in QUANTITIES}
    return ", ".join(f"{name} {number(r.min())} to {number(r.max())}" for name, r in ratios.items())


def failures(peaks: pd.DataFrame) -> str:
    """Return how many runs failed, and why."""
    if "message" not in peaks:
        return "Every run reached its end."
    failed = peaks.groupby(["message", "model"], sort=False).size().reset_index(name="count")
    return " ".join(f"{count} {model} runs: {message}." for message, model, count in failed.to_numpy())


def contact_at(run: Table, instant: float) -> str:
    """Say whether the journal touches its bearing at an instant (s), and since when."""
    if run.events is None:
        return "not known"
    closed = run.events[(run.events["start"] <= instant) & (run.events["end"] >= instant)]
    if closed.empty:
        return "open"
    return f"closed, from {closed['start'].iloc[0]:.4f} to {closed['end'].iloc[0]:.4f} s"


# ---- figures

WINDOW = (0.735, 0.765)
"""s; around the published instants."""


def draw(results: Results, folder: Path) -> None:
    """Draw the errors of the shown run and the peaks over the modulus; write all ensembles as a table."""
    frame = cases(results.peaks)
    frame.to_csv(folder / "peaks.csv", float_format="%.6g")
    time, bound = results.still.time, results.bound
    errors = {name: error(results.shown, results.still, channel) for name, channel in QUANTITIES.items()}
    with svg.panels(folder / "stiffness.svg") as (axes,):
        _stiffness(axes, frame)
    with svg.panels(folder / "displacement.svg") as (axes,):
        kept = envelope(errors["displacement"])
        for sign, label in ((1, "a rigid shift of the pin"), (-1, None)):
            axes.plot(time[::40], sign * 1e3 * bound[::40], color=svg.LIMIT, dashes=(1, 2), label=label)
        axes.plot(time[kept], 1e3 * errors["displacement"][kept], color=svg.FIRST, label="reference")
        _mark(axes, "displacement", 1e3)
        axes.set(xlabel="time (s)", ylabel="error of slider y (mm)")
        svg.legend_above(axes)
    with svg.panels(folder / "passage.svg", 2, height=4.4, sharex=True) as both:
        inside = (time >= WINDOW[0]) & (time <= WINDOW[1])
        for axes, (name, unit) in zip(both, {"velocity": "m/s", "acceleration": "m/s²"}.items(), strict=True):
            axes.plot(time[inside], errors[name][inside], color=svg.FIRST, label="reference")
            _mark(axes, name, 1.0)
            axes.set_ylabel(f"error of {name} ({unit})")
        both[1].set_xlabel("time (s)")
        svg.legend_above(both[0])


def _stiffness(axes: Axes, frame: pd.DataFrame) -> None:
    name = "acceleration"
    peaks = passage(frame, MODULUS, name)
    moduli, middle = peaks.index.to_numpy(float), peaks["median"]
    axes.set(xscale="log", yscale="log", xlabel="Young's modulus (GPa)")
    axes.set_ylabel("peak of the acceleration's\nerror (m/s²)")
    axes.vlines(moduli / 1e9, peaks["min"], peaks["max"], color=svg.FIRST, lw=0.9)
    axes.plot(moduli / 1e9, middle, "o-", ms=4, color=svg.FIRST, label="reference: median and range")
    slope = middle.iloc[0] * (moduli / moduli[0]) ** 0.4
    axes.plot(moduli / 1e9, slope, color=svg.LIMIT, dashes=(1, 2), label="modulus to the power 0.4")
    axes.axhline(abs(PRINTED[name].value), color=svg.OUTSIDE, lw=1.2, dashes=(3.5, 1.8), label="published")
    axes.margins(x=0.03)
    axes.yaxis.set_major_locator(FixedLocator([100, 200, 500, 1000, 2000]))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_locator(NullLocator())
    svg.legend_above(axes)


def _mark(axes: Axes, name: str, factor: float) -> None:
    printed = PRINTED[name]
    axes.plot(printed.time, factor * printed.value, "o", color=svg.OUTSIDE, ms=5, label="published peak")


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
