"""Both models at both tiers against a true trajectory of each scene, and the uncertainties that they state.

A verdict is sure where the error of each run is at most `LIMIT` u: then |a - b| <= 2 hypot(u_a, u_b). Samples
are correlated, so each interval between two touches of the truth is one outcome: whether any of its
predictable samples has a larger error.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from math import inf, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from comparison.accuracy.levels import NAMES, TIERS, expected, solver_values, thresholds
from comparison.accuracy.refine import CHANNEL, accurate_run, families, runs_by_model
from comparison.accuracy.uncertainty import ROUND_OFF, Runs, RunValues, round_off, uncertainty, window_samples
from comparison.execution.run import Job, Outcome, Progress, check_forces, run_all, successful
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.formatting import number
from comparison.metrics.contacts import WINDOW, begin_where, match
from comparison.models import MODELS, find, formulations, machine_and_versions
from comparison.reliability.assessment import at_own_samples, compare_reliability, dense_scene, ideal_scenes
from comparison.report import svg
from comparison.scene import Scene, SceneError, load_scene, shipped_scenes
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study, rows_table, share, upper_limit, write_csv
from comparison.tables.channels import Array, BoolArray
from comparison.tables.table import Table
from comparison.verdict.results import SceneComparison
from comparison.verdict.validate import validate

TRUTH = "truth"
"""Model of examples/truth_engine."""
LIMIT = sqrt(2)
WANTED = 1e-8  # m; error of x for which ``--accuracy`` is asked
DRAWS = 10_000  # of scenes, for the bootstrap
IntArray = NDArray[np.intp]
SHARES = np.linspace(0.05, 0.95, 19)  # of samples, at which the quantiles of u over error are taken
WIDEST = 1e6  # u over error at most, which may be zero
_LOOKS: dict[str, str] = {"reference": svg.FIRST, "exudyn": svg.SECOND, "standard": "-", "tight": "--"}


@dataclass(frozen=True)
class AgainstTruth(Task):
    """A scene to be run by the truth engine, and by both models at both tiers."""

    scene: Scene
    models = (*MODELS, TRUTH)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return 100.0 * float(self.scene.data["drive"]["cycles"])


class Results(NamedTuple):
    """Rows of all scenes, with ``scene``, ``tier``, ``model``; why a scene has none."""

    rows: pd.DataFrame  # as `summary` returns them
    intervals: pd.DataFrame  # ``start`` (s), ``largest`` error over u, ``name`` of its channel
    failed: Sequence[str]


def measure(names: Sequence[str], n_jobs: int, on_progress: Progress | None) -> Results:
    """Run and compare the scenes that the truth engine covers; `EngineError` where it is not installed."""
    find(TRUTH)
    tasks = []
    for scene in map(load_scene, names):
        with suppress(SceneError):  # it refuses the others
            check_forces(scene, TRUTH)
            tasks.append(AgainstTruth(scene))
    measured = measure_all(measure_scene, tasks, on_processes(n_jobs), on_progress)
    done = [row for row in measured if row["status"] == SUCCESS]
    rows, intervals = (pd.DataFrame([*chain(*(row[name] for row in done))]) for name in Results._fields[:2])
    pairs = zip(tasks, measured, strict=True)
    failed = [f"{task.scene.name}: {row['message']}" for task, row in pairs if row["status"] != SUCCESS]
    return Results(rows, intervals, failed)


def measure_scene(task: AgainstTruth, progress: Progress) -> Row:
    """Run a scene by all three models, ours as ``sixbar validate`` does; return its part of `Results`."""
    progress(0.0)
    scene, rows, intervals = task.scene, list[Row](), list[Row]()
    dense = run_here(dense_scene(scene), TRUTH)
    true = at_own_samples(dense, scene)
    (validated,) = validate(scene, n_jobs=0)
    for tier, comparison in zip(TIERS, validated.comparison.tiers, strict=True):
        ran, alpha = comparison.ran or scene, thresholds(tier).alpha
        ideal = {(m, kind): Job(level, m) for m in MODELS for kind, level in ideal_scenes(ran, m).items()}
        jobs = families(dense_scene(ran), MODELS), ideal
        outcomes = (dict(zip(each, run_all(list(each.values()), 0), strict=True)) for each in jobs)
        pair, ideals = (runs_by_model(ran, MODELS, each) for each in outcomes)
        for index, model in enumerate(MODELS):
            samples = samples_of(comparison, index, true, alpha)
            tables: dict[str, Any] = {k: at_own_samples(t, ran) for k, t in pair[index].tables.items()}
            runs = replace(pair[index], **tables)
            of_channels, of_intervals = sample_rows(samples, true, scene.period, alpha)
            of_channels += extremum_rows(samples, runs, true, alpha)
            of_channels += contact_rows(samples, runs, true, scene.period)
            both = (pair[index], Runs(dense, finer=dense)), (ideals[index], ideals[0])
            compared = compare_reliability(*both, scene.period, scene.reliability, 1.0)
            of_channels += (
                summary("reliability", name, np.abs([one.minimum]), np.array([one.numerical]))
                for name, one in compared.items()
            )
            labels = {"scene": scene.name, "tier": tier, "model": model}
            rows += [labels | row for row in of_channels]
            intervals += [labels | row for row in of_intervals]
    rows += [{"scene": scene.name, "tier": ""} | row for row in setting_rows(scene, true)]
    return {"rows": rows, "intervals": intervals}


def run_all_here(scenes: Sequence[Scene], model: str) -> list[Outcome]:
    """Run scenes in this process; stored runs are used."""
    return run_all([Job(scene, model) for scene in scenes], 0)


def run_here(scene: Scene, model: str) -> Table:
    """Run a scene in this process."""
    return successful(run_all_here([scene], model)[0], Job(scene, model))


def setting_rows(scene: Scene, true: Table) -> Iterator[Row]:
    """Yield a row for each named setting with its bound, and for a wanted error where it is kept."""
    for model in MODELS:
        for formulation in formulations(model, scene.data):
            for name in NAMES:
                named = scene.variant({f"solver.{model}.formulation": formulation})
                named = named.variant(solver_values(model, name, named))
                bound, error = expected(named, model), of_x(run_here(named, model), true)
                first = true.time <= bound.cycles * scene.period
                row = summary(
                    f"--accuracy {name}", formulation, error[first].max(keepdims=True), bound.error / LIMIT
                )
                yield row | {"model": model}
        result = accurate_run(at_tier(scene, "tight"), model, WANTED, run=partial(run_all_here, model=model))
        if result.kept and result.estimate is not None:
            error = of_x(result.table, true)[result.estimate.u <= WANTED].max(keepdims=True)
            yield summary(f"--accuracy {WANTED:g}", CHANNEL, error, WANTED, limit=1.0) | {"model": model}


def of_x(table: Table, true: Table) -> Array:
    """Return the error of x, m."""
    return np.abs(table.values(CHANNEL) - true.values(CHANNEL))


# ---- rows: errors over uncertainties


@dataclass(frozen=True)
class Samples:
    """A channel of a run against the truth; arrays of shape (n,)."""

    name: str
    scale: float
    error: Array  # |run - truth|
    u: Array
    predictable: BoolArray  # by the u of this run alone
    judged: BoolArray  # of these where run or truth is not zero


def samples_of(comparison: SceneComparison, index: int, true: Table, alpha: float) -> list[Samples]:
    """Return the excited channels of the first (0) or second (1) model of a comparison."""
    known: dict[str, Samples] = {}
    for name, channel in comparison.excited.items():  # positions come before what follows from them
        values, u = ((channel.a, channel.u_a), (channel.b, channel.u_b))[index]
        assert u is not None
        position = known.get(channel.definition.follows or "")
        predictable = (u <= alpha * channel.scale) & (position is None or position.predictable)
        judged = predictable & ((values != 0.0) | (true.values(name) != 0.0))
        error = np.abs(values - true.values(name))
        known[name] = Samples(name, channel.scale, error, u, predictable, judged)
    return list(known.values())


def summary(
    kind: str,
    name: str,
    error: Array,
    u: Array | float,
    group: IntArray | None = None,
    limit: float = LIMIT,
) -> Row:
    """Return the row of a quantity with an error and a u, in the same unit, for each of n samples.

    ``outcomes`` are the groups, by default each sample is one; ``outside`` those with an error above limit
    times u anywhere; ``largest`` error over u; ``widths`` quantiles of u over error, 5 to 95 %.
    """
    ratio = pd.Series(error / u).groupby(np.arange(error.size) if group is None else group).max()
    row: Row = {"kind": kind, "name": name, "samples": error.size, "outcomes": ratio.size}
    row |= {"outside": int((ratio > limit).sum()), "largest": float(ratio.max())}
    return row | {"widths": np.quantile(u / np.maximum(error, u / WIDEST), SHARES).tolist()}


def sample_rows(
    assessed: Sequence[Samples], true: Table, period: float, alpha: float
) -> tuple[list[Row], list[Row]]:
    """Return rows of each channel and of all, and one for each interval between touches that is judged.

    ``beyond`` counts predictable samples with an error above alpha times the scale; from ``until`` (s) on the
    error, the largest within the window of u(t), stays above that; None: it does not.
    """
    time, rows, ratios = true.time, list[Row](), dict[str, Array]()
    starts = np.unique([time[0], *events_of(true)["start"]])
    interval = np.searchsorted(starts, time, side="right") - 1
    half_width = window_samples(period, float(time[-1] - time[0]) / (time.size - 1))
    for one in (one for one in assessed if one.judged.any()):
        allowed, judged = alpha * one.scale, one.judged
        around = maximum_filter1d(one.error, 2 * half_width + 1, mode="nearest")
        lost = np.flatnonzero(around <= allowed).max(initial=-1) + 1
        row = summary("samples", one.name, one.error[judged], one.u[judged], interval[judged])
        row["beyond"] = int((one.error[one.predictable] > allowed).sum())
        rows.append(row | {"until": float(time[lost]) if lost < time.size else None})
        ratios[one.name] = np.where(judged, one.error / one.u, np.nan)
    table = pd.DataFrame(ratios).groupby(interval).max().dropna(how="all")
    largest = table.max(axis=1)
    every: Row = {"kind": "intervals", "name": "", "outcomes": len(table), "largest": float(largest.max())}
    every |= {"outside": int((largest > LIMIT).sum()), "widths": [w for row in rows for w in row["widths"]]}
    columns = zip(starts[table.index].tolist(), largest.tolist(), table.idxmax(axis=1), strict=True)
    return [*rows, every], [{"start": start, "largest": most, "name": name} for start, most, name in columns]


def of_runs(
    what: tuple[str, str],
    of: Callable[[Table], Array],
    runs: Runs,
    true: Table,
    floor: float,
    allowed: float = inf,
) -> list[Row]:
    """Return the row of numbers of each table, with u by the rule for samples, where u is small enough."""
    levels = {which: of(table) for which, table in runs.tables.items()}
    perturbed = tuple(values for which, values in levels.items() if which.endswith("perturbed"))
    values = RunValues(levels["base"], levels["finer"], levels.get("coarser"), perturbed, *runs.refinement)
    u, error = uncertainty(values, 0, floor), np.abs(levels["base"] - of(true))
    kept = u <= allowed
    return [summary(*what, error[kept], u[kept])] if kept.any() else []


def extremum_rows(assessed: Sequence[Samples], runs: Runs, true: Table, alpha: float) -> Iterator[Row]:
    """Yield a row for the predictable ones of the smallest and the largest value of each channel."""
    base = runs.base
    for one in assessed:

        def ends(table: Table, name: str = one.name) -> Array:
            return np.array([table.extrema[name][end] for end in ("min", "max")])

        floor = round_off(base.values(one.name), base.time, base.known[one.name].round_off)
        yield from of_runs(("extrema", one.name), ends, runs, true, floor, alpha * one.scale)


def contact_rows(assessed: Sequence[Samples], runs: Runs, true: Table, period: float) -> Iterator[Row]:
    """Yield how many predictable contacts have no partner, and the errors of those that all runs have.

    A contact is predictable where its corner's gap is at the samples on either side.
    """
    gaps = {one.name[7:9]: one.predictable for one in assessed if one.name.endswith("_gap")}
    predictable = begin_where(events_of(true), true.time, gaps)

    def rows(table: Table) -> IntArray:
        return same_contacts(events_of(true), events_of(table), WINDOW * period)

    counts = {"outcomes": int(predictable.sum()), "outside": int((predictable & (rows(runs.base) < 0)).sum())}
    yield {"kind": "contacts without a partner", "name": "", **counts}
    kept = predictable & np.all([rows(table) >= 0 for table in runs.tables.values()], axis=0)
    for name in ("start", "impulse") if kept.any() else ():

        def column(table: Table, name: str = name) -> Array:
            return events_of(table)[name].to_numpy(np.float64)[rows(table)[kept]].astype(np.float64)

        floor = ROUND_OFF * float(column(true).max())
        yield from of_runs((f"{name} of contacts", ""), column, runs, true, floor)


def events_of(table: Table) -> pd.DataFrame:
    """Return the contacts of a run that lists them."""
    assert table.events is not None
    return table.events


def same_contacts(contacts: pd.DataFrame, others: pd.DataFrame, window: float) -> IntArray:
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


def quantiles(rows: pd.DataFrame) -> tuple[float, float]:
    """Return median and 90 % quantile of u over error, each channel of each scene alike; nan without any."""
    middle, high = np.nanquantile(np.concatenate([[np.nan], *rows["widths"].dropna()]), (0.5, 0.9))
    return float(middle), float(high)


def counted(rows: pd.DataFrame, by: list[str]) -> Iterator[dict[str, str]]:
    """Yield the line of each group of rows in a table."""
    for keys, own in rows.groupby(by, sort=False):
        outcomes, outside = own[["outcomes", "outside"]].sum().astype(int)
        yield {
            **dict(zip(by, map(str, keys), strict=True)),
            "outcomes": str(outcomes),
            "outside": str(outside),
            "at most, 95 %": share(upper_limit(outside, outcomes)),
            "by scene": share(limit_by_scene(own)),
            "largest error over u": number(own["largest"].max(), 2),
            "u over error, median": number(quantiles(own)[0], 2),
            "90 % below": number(quantiles(own)[1], 2),
        }


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    groups = dict(list(results.rows.groupby("kind", sort=False)))
    every, samples = groups.pop("intervals"), groups.pop("samples")
    lost = samples[(samples["name"] == CHANNEL) & samples["until"].notna()]
    return {
        "scenes": list(every["scene"].unique()),
        "total": next(counted(every.assign(all=""), ["all"])),
        "samples": samples,
        "median": {tier: number(quantiles(own)[0], 2) for tier, own in every.groupby("tier")},
        "missed": results.intervals[results.intervals["largest"] > LIMIT].to_dict("records"),
        "overview": rows_table(counted(every, ["model", "tier"])),
        "channels": rows_table(counted(samples, ["name", "tier"])),
        "others": rows_table(counted(pd.concat(groups.values()), ["kind", "model", "tier"])),
        "lost": lost.to_dict("records"),
        "failed": results.failed,
        "machine": machine_and_versions(),
    }


def draw(results: Results, folder: Path) -> None:
    """Draw the errors of the intervals and the widths of u as distributions; write the table."""
    rows = results.rows
    each = [quantiles(rows[k : k + 1]) for k in range(len(rows))]
    table = rows.drop(columns="widths").join(pd.DataFrame(each, columns=["width", "width_90"]))
    write_csv({"truth": table}, folder, "%.4g")
    wide = rows[rows["kind"] == "intervals"].explode("widths")
    _draw(results.intervals, "largest", "largest error over u between two touches", folder / "intervals.svg")
    _draw(wide, "widths", "u over error of a sample", folder / "widths.svg")


def _draw(rows: pd.DataFrame, column: str, label: str, path: Path) -> None:
    """Draw the share of the values of a column above each, by model and tier."""
    with svg.panels(path) as (axes,):
        for (model, tier), own in rows.groupby(["model", "tier"]):
            values, shares = np.sort(own[column].astype(float)), 1.0 - np.arange(len(own)) / len(own)
            colour, line = _LOOKS[str(model)], _LOOKS[str(tier)]
            axes.plot(values, shares, color=colour, ls=line, label=f"{model}, {tier}")
        axes.axvline(LIMIT if column == "largest" else 1.0, color=svg.LIMIT)
        axes.set(xscale="log", xlabel=label, yscale="log", ylabel="share with more")
        svg.legend_above(axes)


STUDY = Study("truth", small=["wedge"], full=shipped_scenes(), measure=measure, page=page, draw=draw)
