"""Both models at both tiers against a true trajectory of each scene, and the uncertainties that they state.

A verdict is sure where the error of each run is at most `LIMIT` u: then |a - b| <= 2 hypot(u_a, u_b). Samples
are correlated, so each interval between two touches of the truth is one outcome: outside if any of
its predictable samples has a larger error.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count, islice, product
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from comparison.accuracy.levels import NAMES, TIERS, forecast, solver_values, thresholds
from comparison.accuracy.refine import CHANNEL, families, runs_by_model
from comparison.accuracy.uncertainty import ROUND_OFF, Runs, RunValues, round_off, uncertainty, window_samples
from comparison.execution.run import (
    Job,
    Progress,
    at_own_samples,
    check_forces,
    dense_scene,
    run_all,
    table_of,
)
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.formatting import number
from comparison.metrics import WINDOW, begin_where, match
from comparison.models import MODELS, find, formulations, machine_and_versions
from comparison.reliability.assessment import compare_reliability, ideal_scenes
from comparison.report import svg
from comparison.scene import Scene, SceneError, load_scene, shipped_scenes
from comparison.studies.shared.study import Study, rows_table, share, upper_limit, write_csv
from comparison.studies.trust.population import random_scene
from comparison.tables.channels import Array, BoolArray
from comparison.tables.table import Table
from comparison.verdict.results import SceneComparison
from comparison.verdict.validate import validate

TRUTH = "truth"
"""Model of examples/truth_engine."""
LIMIT = sqrt(2)
SEED = 29112026  # of the random scenes; fixed before any of them was run
ORIGINS = ("shipped", "random")
TRAINING = 20  # random scenes that a rule of u was mended on; the study takes the next ones
DRAWS = 10_000  # of scenes, for the bootstrap
_COLOURS = {"reference": svg.FIRST, "exudyn": svg.SECOND}


@dataclass(frozen=True)
class TruthRun(Task):
    """A scene to be run by the truth engine, and by both models at both tiers; "shipped" or "random"."""

    scene: Scene
    origin: str
    models = (*MODELS, TRUTH)


class Results(NamedTuple):
    """Rows of all scenes, with ``scene``, ``origin``, ``tier``, ``model``; reasons of scenes without."""

    rows: pd.DataFrame  # as `summary` returns them
    intervals: pd.DataFrame
    """As `sample_rows` returns them."""
    failures: list[str]  # scene and message


def measure(extent: tuple[Sequence[str], int], n_jobs: int, on_progress: Progress | None) -> Results:
    """Run and compare shipped scenes by name, of those that the truth engine covers, and so many random ones.

    `EngineError` where it is not installed.
    """
    find(TRUTH)
    names, draws = extent
    shipped, randoms = truth_runs(map(load_scene, names), "shipped"), truth_runs(random_scenes(), "random")
    tasks = [*shipped, *islice(randoms, TRAINING, TRAINING + draws)]
    results = measure_all(measure_scene, tasks, on_processes(n_jobs), on_progress)
    valid = [row for row in results if row["status"] == SUCCESS]
    rows, intervals = (pd.DataFrame([*chain(*(row[name] for row in valid))]) for name in Results._fields[:2])
    pairs = zip(tasks, results, strict=True)
    failures = [f"{task.scene.name}: {row['message']}" for task, row in pairs if row["status"] != SUCCESS]
    return Results(rows, intervals, failures)


def random_scenes() -> Iterator[Scene]:
    """Yield scenes of one cycle as users change them: those of the study trust, from another seed."""
    for each in count():
        values = {"scene.name": f"random-{each}", "drive.cycles": 1.0}
        yield random_scene(2 * each, SEED).with_values(values)


def truth_runs(scenes: Iterable[Scene], origin: str) -> Iterator[TruthRun]:
    """Yield the scenes that the truth engine does not refuse."""
    for scene in scenes:
        with suppress(SceneError):
            check_forces(scene, TRUTH)
            yield TruthRun(scene, origin)


def measure_scene(task: TruthRun, progress: Progress) -> Row:
    """Run a scene by all three models, ours as ``sixbar validate`` does; return its part of `Results`."""
    progress(0.0)
    scene, rows, intervals = task.scene, list[Row](), list[Row]()
    dense_table = run(dense_scene(scene), TRUTH)
    truth = at_own_samples(dense_table, scene)
    (validation,) = validate(scene, n_jobs=0)
    for tier, comparison in zip(TIERS, validation.comparison.tiers, strict=True):
        base, alpha = comparison.run_scene or scene, thresholds(tier).alpha
        ideal = {(m, kind): Job(level, m) for m in MODELS for kind, level in ideal_scenes(base, m).items()}
        jobs = (base, families(dense_scene(base), MODELS)), (next(iter(ideal.values())).scene, ideal)
        pair, ideals = (
            runs_by_model(refined, MODELS, dict(zip(each, run_all(list(each.values()), 0), strict=True)))
            for refined, each in jobs
        )
        for index, (model, runs) in enumerate(zip(MODELS, pair, strict=True)):
            samples = samples_of(comparison, index, truth, alpha)
            lines, interval_rows = sample_rows(samples, truth, scene.period, alpha)
            lines += [
                *extremum_rows(samples, runs, truth, alpha),
                *contact_rows(samples, runs, truth, scene.period),
            ]
            pairs = (runs, Runs(dense_table, finer=dense_table)), (ideals[index], ideals[0])
            for name, one in compare_reliability(*pairs, scene.period, scene.reliability, 1.0).items():
                lines.append(summary("reliability", name, np.abs([one.minimum]), np.array([one.numerical])))
            labels = {"scene": scene.name, "origin": task.origin, "tier": tier, "model": model}
            rows += [labels | row for row in lines]
            intervals += [labels | row for row in interval_rows]
    if task.origin == "shipped":  # for which alone the names of settings state a bound
        labels = {"scene": scene.name, "origin": task.origin, "tier": ""}
        rows += [labels | row for row in setting_rows(scene, truth)]
    return {"rows": rows, "intervals": intervals}


def run(scene: Scene, model: str) -> Table:
    """Run a scene in this process; a stored run is used."""
    job = Job(scene, model)
    return table_of(run_all([job], 0)[0], job)


def setting_rows(scene: Scene, truth: Table) -> Iterator[Row]:
    """Yield a row for each named setting of each formulation: the largest error of x and its bound, m."""
    for model in MODELS:
        for formulation, name in product(formulations(model, scene.data), NAMES):
            variant = scene.variant({f"solver.{model}.formulation": formulation})
            variant = variant.variant(solver_values(model, name, variant))
            bound, error = (
                forecast(variant, model),
                np.abs(run(variant, model).values(CHANNEL) - truth.values(CHANNEL)),
            )
            largest = error[truth.time <= bound.cycles * scene.period].max(keepdims=True)
            row = summary(f"--accuracy {name}", formulation, largest, np.array([bound.error]))
            yield row | {"outside": int(largest[0] > bound.error), "model": model}


# ---- rows: errors over uncertainties


class Samples(NamedTuple):
    """A channel of a run against the truth; arrays of shape (n,)."""

    name: str
    scale: float
    error: Array  # |run - truth|
    u: Array
    judged: BoolArray  # predictable by the u of this run alone, and not zero in both
    until: float  # s, of the channel in the comparison


def samples_of(comparison: SceneComparison, index: int, truth: Table, alpha: float) -> list[Samples]:
    """Return the excited channels of the first (0) or second (1) model of a comparison."""
    samples: dict[str, Samples] = {}
    for name, channel in comparison.excited.items():  # positions come before what follows from them
        values, u = ((channel.a, channel.u_a), (channel.b, channel.u_b))[index]
        assert u is not None
        position = samples.get(channel.definition.follows or "")
        judged = (u <= alpha * channel.scale) & ((values != 0.0) | (truth.values(name) != 0.0))
        judged &= position is None or position.judged
        error = np.abs(values - truth.values(name))
        samples[name] = Samples(name, channel.scale, error, u, judged, channel.until)
    return list(samples.values())


def summary(kind: str, name: str, error: Array, u: Array, group: NDArray[np.intp] | None = None) -> Row:
    """Return the row of a quantity with an error and a u, in the same unit, for each of n samples.

    ``outcomes`` are the groups, by default each sample is one; ``outside`` those with an error above `LIMIT`
    u anywhere; ``largest`` error over u; ``width`` the median of u over error, below ``width_90`` are 90 %.
    """
    ratio = pd.Series(error / u).groupby(np.arange(error.size) if group is None else group).max()
    row: Row = {"kind": kind, "name": name, "samples": error.size, "outcomes": ratio.size}
    row |= {"outside": int((ratio > LIMIT).sum()), "largest": float(ratio.max())}
    widths = np.quantile(u / np.maximum(error, 1e-6 * u), (0.5, 0.9)).tolist()
    return row | dict(zip(("width", "width_90"), widths, strict=True))


def sample_rows(samples: Sequence[Samples], truth: Table, period: float, alpha: float) -> list[list[Row]]:
    """Return rows of each channel and of all, and one for each interval between touches that is judged.

    An interval has its ``largest`` error over u, the ``name`` of that channel, and as ``part`` the largest of
    error over alpha times the scale of all channels; ``before`` and ``after`` are its largest error over u
    up to the ``until`` of each channel and after it, nan without a sample.
    ``beyond`` counts predictable samples with an error above alpha times the scale; from ``until`` (s) on the
    error, the largest within the window of u(t), stays above that; None: it does not.
    """
    time, rows, ratios = truth.time, list[Row](), dict[str, Array]()
    others: dict[str, dict[str, Array]] = {"part": {}, "before": {}, "after": {}}
    starts = np.unique([time[0], *pd.DataFrame(truth.events)["start"]])
    interval = np.searchsorted(starts, time, side="right") - 1
    half_width = window_samples(period, float(time[-1] - time[0]) / (time.size - 1))
    for one in (one for one in samples if one.judged.any()):
        bound, judged = alpha * one.scale, one.judged
        envelope = maximum_filter1d(one.error, 2 * half_width + 1, mode="nearest")
        loss = np.flatnonzero(envelope <= bound).max(initial=-1) + 1
        row = summary("samples", one.name, one.error[judged], one.u[judged], interval[judged])
        row["beyond"] = int((one.error[judged] > bound).sum())
        rows.append(row | {"until": float(time[loss]) if loss < time.size else None})
        ratios[one.name] = np.where(judged, one.error / one.u, np.nan)
        others["part"][one.name] = np.where(judged, one.error / bound, np.nan)
        for side, at in (("before", time <= one.until), ("after", time > one.until)):
            others[side][one.name] = np.where(at, ratios[one.name], np.nan)
    table = pd.DataFrame(ratios).groupby(interval).max().dropna(how="all")
    largest = table.max(axis=1)
    total: Row = {"kind": "intervals", "name": "", "outcomes": len(table), "largest": float(largest.max())}
    total |= {width: float(np.median([row[width] for row in rows])) for width in ("width", "width_90")}
    total["outside"] = int((largest > LIMIT).sum())
    begins, ends = starts[table.index], np.append(starts, time[-1])[table.index + 1]
    maxima = [pd.DataFrame(each).groupby(interval).max().max(axis=1)[table.index] for each in others.values()]
    columns = zip(begins.tolist(), ends.tolist(), largest, table.idxmax(axis=1), *maxima, strict=True)
    names = ("start", "end", "largest", "name", *others)
    return [[*rows, total], [dict(zip(names, one, strict=True)) for one in columns]]


def error_and_u(levels: dict[str, Array], truth: Array, runs: Runs, floor: float) -> tuple[Array, Array]:
    """Return error and u, shape (n,), of numbers of each run, by the rule for samples without a window."""
    perturbed = tuple(values for kind, values in levels.items() if kind.endswith("perturbed"))
    values = RunValues(levels["base"], levels["finer"], levels.get("coarser"), perturbed, *runs.refinement)
    return np.abs(levels["base"] - truth), uncertainty(values, 0, floor)


def extremum_rows(samples: Sequence[Samples], runs: Runs, truth: Table, alpha: float) -> Iterator[Row]:
    """Yield a row for the predictable ones of the smallest and the largest value of each channel."""
    base, tables = runs.base, runs.tables | {"true": truth}
    for one in samples:
        floor = float(round_off(base.values(one.name), base.time, base.definitions[one.name])[-1])
        extrema = {kind: table.extrema[one.name] for kind, table in tables.items()}
        levels = {kind: np.array([each["min"], each["max"]]) for kind, each in extrema.items()}
        error, u = error_and_u(levels, levels.pop("true"), runs, floor)
        if (predictable := u <= alpha * one.scale).any():
            yield summary("extrema", one.name, error[predictable], u[predictable])


def contact_rows(samples: Sequence[Samples], runs: Runs, truth: Table, period: float) -> Iterator[Row]:
    """Yield the count of predictable contacts without a partner, and the errors of those in all runs.

    A contact is predictable where its corner's gap is at the samples on either side.
    """
    gaps = {one.name[7:9]: one.judged for one in samples if one.name.endswith("_gap")}
    events = {kind: pd.DataFrame(table.events) for kind, table in (runs.tables | {"true": truth}).items()}
    rows = {kind: same_contacts(events["true"], each, WINDOW * period) for kind, each in events.items()}
    predictable = begin_where(events["true"], truth.time, gaps)
    counts = {"outcomes": int(predictable.sum()), "outside": int((predictable & (rows["base"] < 0)).sum())}
    yield {"kind": "contacts without a partner", "name": "", **counts}
    common = predictable & np.all([each >= 0 for each in rows.values()], axis=0)
    for name in ("start", "impulse") if common.any() else ():
        levels = {kind: each[name].to_numpy(float)[rows[kind][common]] for kind, each in events.items()}
        floor = ROUND_OFF * float(levels["true"].max())
        yield summary(f"{name} of contacts", "", *error_and_u(levels, levels.pop("true"), runs, floor))


def same_contacts(contacts: pd.DataFrame, others: pd.DataFrame, window: float) -> NDArray[np.intp]:
    """Return the row of each contact in another table, by corner and time, else -1; shape (n,)."""
    rows, pairs = np.full(len(contacts), -1), match(contacts, others, window)
    rows[pairs[:, 0]] = pairs[:, 1]
    return rows


# ---- page and figures


def limit_by_scene(rows: pd.DataFrame) -> float:
    """Return the 95 % limit of the share of outcomes outside, by a bootstrap that draws scenes."""
    counts = rows.groupby("scene")[["outside", "outcomes"]].sum().to_numpy()
    totals = counts[np.random.default_rng(1).integers(len(counts), size=(DRAWS, len(counts)))].sum(axis=1)
    return float(np.quantile(totals[:, 0] / totals[:, 1], 0.95))


def count_lines(rows: pd.DataFrame, by: list[str]) -> Iterator[dict[str, str]]:
    """Yield the line of each group of rows in a table."""
    for keys, group in rows.groupby(by, sort=False):
        outcomes, outside = group[["outcomes", "outside"]].sum().astype(int)
        yield {
            **dict(zip(by, map(str, keys), strict=True)),
            "outcomes": str(outcomes),
            "outside": str(outside),
            "at most, 95 %": share(upper_limit(outside, outcomes)),
            "by scene": share(limit_by_scene(group)),
            "largest error over u": number(group["largest"].max(), 2),
            "u over error, median": number(group["width"].median(), 2),
            "90 % below": number(group["width_90"].median(), 2),
        }


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    groups = dict(list(results.rows.groupby("kind", sort=False)))
    intervals, samples = groups.pop("intervals"), groups.pop("samples")
    losses = samples[(samples["name"] == CHANNEL) & samples["until"].notna()]
    run, outside = ["scene", "model", "tier"], results.intervals[results.intervals["largest"] > LIMIT]
    worst = outside.loc[outside.groupby(run, sort=False)["largest"].idxmax()]
    counts = outside.groupby(run).agg(outside=("largest", "size"), most=("part", "max"))
    return {
        "scenes": {each: list(intervals["scene"][intervals["origin"] == each].unique()) for each in ORIGINS},
        "beyond": [
            f"{group['beyond'].sum():.0f} of {group['samples'].sum():.0f} ({origin})"
            for origin, group in samples.groupby("origin", sort=False)
        ],
        "parts": by_until(results.intervals),
        "median": {tier: number(group["width"].median(), 2) for tier, group in intervals.groupby("tier")},
        "misses": worst.merge(counts, on=run).to_dict("records"),
        "overview": rows_table(count_lines(intervals, ["origin", "model", "tier"])),
        "channels": rows_table(count_lines(samples, ["name", "tier"])),
        "others": rows_table(count_lines(pd.concat(groups.values()), ["kind", "model", "tier"])),
        "losses": losses.to_dict("records"),
        "failures": results.failures,
        "limit": LIMIT,
        "machine": machine_and_versions(),
    }


def by_until(intervals: pd.DataFrame) -> dict[str, dict[str, str]]:
    """Return the counts of intervals outside, up to `until` of each channel and after it, by origin.

    ``limit`` is that of the random scenes.
    """
    parts: dict[str, dict[str, str]] = {}
    for side in ("before", "after"):
        values = [intervals.loc[intervals["origin"] == origin, side].dropna() for origin in ORIGINS]
        counts = [(int((each > LIMIT).sum()), each.size) for each in values]
        parts[side] = {origin: f"{n} of {of}" for origin, (n, of) in zip(ORIGINS, counts, strict=True)}
        parts[side]["limit"] = share(upper_limit(*counts[-1]))
    return parts


def draw(results: Results, folder: Path) -> None:
    """Draw the errors of the intervals as a distribution, and the width of u by scene; write the table."""
    write_csv({"truth": results.rows}, folder, "%.4g")
    totals, intervals = results.rows[results.rows["kind"] == "intervals"], results.intervals
    shares = intervals.groupby(["model", "tier"])["largest"].rank(ascending=False, pct=True)
    curves = intervals.assign(share=shares).sort_values("largest")
    for name, frame, x, y, marks, label in (
        ("intervals", curves, "largest", "share", ("-", "--"), "largest error over u in an interval"),
        ("widths", totals, "width", "scene", ("o", "s"), "median of u over error"),
    ):
        height = 3.0 if name == "intervals" else 1.4 + 0.22 * totals["scene"].nunique()
        with svg.panels(folder / f"{name}.svg", height=height) as (axes,):
            for (model, tier), rows in frame.groupby(["model", "tier"]):
                (line,) = axes.plot(rows[x], rows[y], marks[TIERS.index(str(tier))], label=f"{model}, {tier}")
                line.set_color(_COLOURS[str(model)])
            axes.margins(x=0.03)
            axes.axvline(LIMIT if name == "intervals" else 1.0, color=svg.LIMIT)
            axes.set(xscale="log", xlabel=label, ylabel=y)
            svg.legend_above(axes, 2)


STUDY = Study(
    "truth",
    small=(["wedge"], 1),
    full=(shipped_scenes(), 20),
    measure=measure,
    page=page,
    draw=draw,
)
