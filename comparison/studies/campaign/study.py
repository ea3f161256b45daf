"""The campaign: what it runs, and its page, figures and tables."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.accuracy.levels import thresholds
from comparison.execution.run import VIOLATED, Progress
from comparison.execution.store import Row
from comparison.models import MODELS, made_on, platform_name, versions
from comparison.report import svg
from comparison.studies.campaign import population, stages
from comparison.studies.campaign.population import Case
from comparison.studies.shared.study import Study, markdown, plain_ticks, share, upper_limit, write_csv
from comparison.tables.channels import CONTACTS, channels, has_load

Cases = Sequence[tuple[Case, Row]]  # scenes with their rows
NAMES = {"reference": "the reference errs", "exudyn": "Exudyn's tree errs", stages.OPEN: "open"}
# The rare ones last, so that they lie on top.
_MARKS: dict[str, dict[str, Any]] = {
    stages.AGREE: {"marker": ".", "color": svg.SERIES[0], "ms": 3},
    stages.NOT_DECIDED: {"marker": "o", "color": svg.THRESHOLD, "mfc": "none", "ms": 4},
    stages.FAILED: {"marker": "x", "color": svg.INK, "ms": 4},
    stages.UNDERESTIMATED: {"marker": "s", "color": svg.DIFFERENCE, "mfc": "none", "ms": 5},
    stages.BROKEN: {"marker": "^", "color": svg.OUTSIDE, "ms": 5},
    stages.DIFFER: {"marker": "D", "color": svg.SERIES[3], "ms": 5},
}
_GROUPS = (
    ("agree", svg.SERIES[0], (stages.AGREE, stages.UNDERESTIMATED)),
    ("differ or broken", svg.SERIES[3], (stages.DIFFER, stages.BROKEN)),
    ("not decided", svg.THRESHOLD, (stages.NOT_DECIDED,)),
)


def measure(count: int, n_jobs: int, on_progress: Progress | None) -> Cases:
    """Examine so many scenes of the population."""
    cases = population.cases(count, population.SEED)
    rows = stages.run_cases(cases, n_jobs, on_progress)
    return stages.with_third_opinions(list(zip(cases, rows, strict=True)), n_jobs)


def record(rows: Cases) -> dict[str, Any]:
    """Return all rows, scene by scene."""
    return {
        "seed": population.SEED,
        "machine": platform_name(),
        "versions": versions(),
        "scenes": [{"scene": case.number, "drawn": case.family, **row} for case, row in rows],
    }


def _frame(lines: Iterable[dict[str, Any]], *columns: str) -> pd.DataFrame:
    return pd.DataFrame(list(lines), columns=list(columns))


def tables(rows: Cases) -> dict[str, pd.DataFrame]:
    """Return scenes, opinions, runs without success, and breaches (in m, overlaps in s; the worst first)."""
    apart = [f"from {model}" for model in MODELS]
    scenes = []
    for case, row in rows:
        data, loose = case.scene.data, population.loose_joints(case.scene)
        scenes.append(
            {
                "scene": case.number,
                "clearance at": " and ".join(loose).replace("_", " "),
                "speed_rpm": data["drive"]["speed_rpm"],
                "clearance_m": data["clearance"][loose[0]],
                "restitution": data["contact"]["restitution"],
                "law": data["contact"]["law"],
                "workpiece": has_load(data),
                "outcome": row["outcome"],
                "stage": row["stage"],
                "distance_m": (row["screening"] or {}).get("distance"),
                "coverage": row["coverage"],
                "errs": (row["adjudication"] or {}).get("errs"),
                "reason": "" if row["outcome"] == stages.AGREE else row["reason"],
            }
        )
    opinions = (
        {"scene": case.number, "channel": row["adjudication"]["channel"]}
        | one
        | dict(zip(apart, one["distances"], strict=False))
        for case, row in rows
        if row["adjudication"]
        for one in row["adjudication"]["evidence"]
    )
    failures = (
        {**one, "status": ", ".join((one["status"], *one["invariants"])), "run": one["kind"]}
        | {"scene": case.number}
        for case, row in rows
        for one in row["failures"]
    )
    breaches = (
        {"model": model, "scene": case.number} | one
        for case, row in rows
        for model, shown in row["breaches"].items()
        for one in shown
    )
    broken = ("model", "name", "scene", "corner", "value", "bound", "time", "since", "until")
    return {
        "scenes": pd.DataFrame(scenes),
        "opinions": _frame(opinions, "scene", "channel", "name", "model", "status", *apart, "stands"),
        "failures": _frame(failures, "model", "status", "run", "scene", "message"),
        "breaches": _frame(breaches, *broken).sort_values("value", ascending=False, kind="stable"),
    }


def page(rows: Cases) -> dict[str, object]:
    """Return what stands in the page."""
    frames = tables(rows)
    lines = frames["scenes"]
    counts = pd.crosstab(lines["clearance at"], lines["outcome"], margins=True, margins_name="all")
    at_work = lines[lines["workpiece"] | (lines["law"] == "adams-impact")]
    counts.loc["of all with a workpiece or the law of ADAMS"] = at_work["outcome"].value_counts()
    counts["all"] = counts["all"].fillna(len(at_work))
    counts = counts.fillna(0).astype(int)
    counts = counts.reindex(columns=["all", *stages.OUTCOMES], fill_value=0).rename(columns={"all": "scenes"})
    # Of the drawn scenes those that would have stopped after single runs.
    drawn = [row for case, row in rows if case.family and row["stage"] == stages.COMPARED]
    only = [row for row in drawn if not row["screening"]["parted"] and not any(row["breaches"].values())]
    differing = sum(row["outcome"] == stages.DIFFER for row in only)
    broken = Counter(
        model
        for _, row in rows
        for model in MODELS
        if row["breaches"].get(model)
        or any(one["model"] == model and one["status"] == VIOLATED for one in row["failures"])
    )
    worst = frames["breaches"].groupby(["model", "name"]).head(1)
    failures = frames["failures"].groupby(["model", "status", "run"])["scene"].agg(runs="count", scenes=_some)
    spent = pd.DataFrame([row["seconds"] for _, row in rows]).sum()
    errs = lines.loc[lines["outcome"] == stages.DIFFER, "errs"].value_counts()
    return {
        "rows": rows,
        "count": {outcome: (lines["outcome"] == outcome).sum() for outcome in stages.OUTCOMES},
        "errs": ", ".join(f"{errs.get(who, 0)} {words}" for who, words in NAMES.items()),
        "broke": _by_model(broken),
        "failed": _by_model(frames["failures"]["model"].value_counts()),
        "machine": made_on(),
        "counts": counts.sort_values("scenes", ascending=False).reset_index(),
        "compared": (lines["stage"] == stages.COMPARED).sum(),
        "floor": thresholds(stages.TIER).coverage,
        "differences": [
            (case, row["adjudication"], row) for case, row in rows if row["outcome"] == stages.DIFFER
        ],
        "corners": CONTACTS,
        "channels": channels(),
        "breaches": markdown(worst) if len(worst) else "",
        "failures": markdown(failures.reset_index()),
        "drawn": len(only),
        "differing": differing,
        "overlooked": share(upper_limit(differing, len(only))),
        "seconds": ", ".join(
            f"{stage} {spent[stage] / 60.0:.1f} min" for stage in stages.STAGES if stage in spent
        ),
        "population": population.DATA,
        "limit": stages.DISTANCE,
        "fine": stages.FINE_SAMPLES,
        "step": stages.SMALL_STEP,
    }


def _by_model(counted: Any) -> str:
    return " and ".join(f"{counted.get(model, 0)} of the {model} model" for model in MODELS)


def _some(scenes: pd.Series) -> str:
    return ", ".join(map(str, scenes[:12])) + (" ..." if len(scenes) > 12 else "")


def write(rows: Cases, folder: Path) -> None:
    """Draw distances between the models, and where the scenes lie; write the long tables."""
    frames = tables(rows)
    write_csv({name: frames[name] for name in ("scenes", "opinions", "failures")}, folder)
    lines = frames["scenes"]
    screened, ticks = lines.dropna(subset=["distance_m"]), range(-15, -2, 3)
    decades, shares = np.arange(-15.0, -2.9, 0.5).tolist(), np.linspace(0.0, 1.0, 21).tolist()
    with svg.panels(folder / "distances.svg", 1, 2, sharey=True) as (left, right):
        for label, colour, outcomes in _GROUPS:
            own = screened[screened["outcome"].isin(outcomes)]
            if len(own):
                distances = np.log10(own["distance_m"].clip(10.0 ** decades[0], 10.0 ** decades[-1]))
                left.hist(distances, decades, label=label, histtype="step", color=colour)
                right.hist(own["coverage"], shares, histtype="step", color=colour)
        limit: dict[str, Any] = {"color": svg.LIMIT, "dashes": (4, 2)}
        left.axvline(np.log10(stages.DISTANCE), label="limits, see the text", **limit)
        right.axvline(thresholds(stages.TIER).coverage, **limit)
        left.set_xticks(ticks, [f"$10^{{{tick}}}$" for tick in ticks])
        left.set(xlabel="largest distance, scaled to x (m)", ylabel="number of scenes (-)")
        left.set(yscale="log", ylim=(0.7, 1.2 * len(lines)))
        right.set_xlabel("share of samples predictable (-)")
        plain_ticks(left.yaxis, (1, 10, 100, 1000))
        svg.legend_above(left)
    with svg.panels(folder / "places.svg", 1, 2, sharex=True) as (left, right):
        for outcome, mark in _MARKS.items():
            own = lines[lines["outcome"] == outcome]
            if len(own):
                label = f"{outcome} ({len(own)})"
                left.plot(own["speed_rpm"].abs(), 1e3 * own["clearance_m"], linestyle="", label=label, **mark)
                right.plot(own["speed_rpm"].abs(), own["restitution"], linestyle="", **mark)
        low, high = (1e3 * end for end in population.RANGES["clearances"][:2])
        left.set(yscale="log", ylim=(0.8 * low, 1.2 * high), ylabel="clearance (mm)")
        plain_ticks(left.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0))
        right.set(ylim=(-0.03, 1.03), ylabel="coefficient of restitution (-)")
        for axes in (left, right):
            axes.set(xscale="log", xlim=(9.0, 1100.0))
            axes.set_xlabel("speed of the crank (rpm)")
            plain_ticks(axes.xaxis, (10, 30, 100, 300, 1000))
        svg.legend_above(left, columns=3)


STUDY = Study("campaign", small=5, full=1280, measure=measure, page=page, draw=write, data=record)
