"""The campaign: what it runs, and its page, figures and tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axis import Axis

from comparison.accuracy.levels import thresholds
from comparison.execution.run import VIOLATED, Progress
from comparison.execution.store import Row
from comparison.formatting import percent, quantity
from comparison.models import MODELS, made_on, platform_name, versions
from comparison.report import svg
from comparison.studies.campaign import population, stages
from comparison.studies.campaign.adjudication import FINE_SAMPLES, OPEN, SMALL_STEP, with_third_opinions
from comparison.studies.campaign.population import Case
from comparison.studies.shared.frames import markdown, rows_table
from comparison.studies.shared.rates import share, upper_limit
from comparison.studies.shared.study import Study
from comparison.tables.channels import CONTACTS, channels

Cases = Sequence[tuple[Case, Row]]  # scenes with their rows
NAMES = {"reference": "the reference errs", "exudyn": "Exudyn's tree errs", OPEN: "open"}
# The rare ones last, so that they lie on top.
_MARKS: dict[str, dict[str, Any]] = {
    stages.AGREE: {"marker": ".", "color": svg.SERIES[0], "ms": 3},
    stages.NOT_DECIDED: {"marker": "o", "color": svg.THRESHOLD, "mfc": "none", "ms": 4},
    stages.FAILED: {"marker": "x", "color": svg.INK, "ms": 4},
    stages.UNDERESTIMATED: {"marker": "s", "color": svg.DIFFERENCE, "mfc": "none", "ms": 5},
    stages.BROKEN: {"marker": "^", "color": svg.OUTSIDE, "ms": 5},
    stages.DIFFER: {"marker": "D", "color": svg.SERIES[3], "ms": 5},
}


def measure(count: int, n_jobs: int, on_progress: Progress | None) -> Cases:
    """Examine so many scenes of the population."""
    cases = population.cases(count, population.SEED)
    rows = stages.run_cases(cases, n_jobs, on_progress)
    return with_third_opinions(list(zip(cases, rows, strict=True)), n_jobs)


def record(rows: Cases) -> dict[str, Any]:
    """Return all rows, scene by scene."""
    return {
        "seed": population.SEED,
        "machine": platform_name(),
        "versions": versions(),
        "scenes": [{"scene": case.number, "drawn": case.family, **row} for case, row in rows],
    }


def scenes(rows: Cases) -> pd.DataFrame:
    """Return a line for each scene."""
    return pd.DataFrame(
        {
            "scene": case.number,
            "clearance at": population.joints(case.scene),
            "speed_rpm": case.scene.data["drive"]["speed_rpm"],
            "clearance_m": population.clearance(case.scene),
            "restitution": case.scene.data["contact"]["restitution"],
            "outcome": row["outcome"],
            "stage": row["stage"],
            "distance_m": (row["screening"] or {}).get("distance"),
            "coverage": row["coverage"],
            "errs": (row["adjudication"] or {}).get("errs"),
            "reason": "" if row["outcome"] == stages.AGREE else row["reason"],
        }
        for case, row in rows
    )


def page(rows: Cases) -> dict[str, object]:
    """Return what stands in the page."""
    lines = scenes(rows)
    counts = pd.crosstab(lines["clearance at"], lines["outcome"], margins=True, margins_name="all")
    counts = counts.reindex(columns=["all", *stages.OUTCOMES], fill_value=0).rename(columns={"all": "scenes"})
    # Of the drawn scenes those that would have stopped after single runs.
    drawn = [row for case, row in rows if case.family and row["stage"] == stages.COMPARED]
    only = [row for row in drawn if not row["screening"]["parted"] and not any(row["breaches"].values())]
    differing = sum(row["outcome"] == stages.DIFFER for row in only)
    spent = pd.DataFrame([row["seconds"] for _, row in rows]).sum()
    return {
        "outcome": outcome([row for _, row in rows]),
        "seed": population.SEED,
        "machine": made_on(),
        "counts": markdown(counts.sort_values("scenes", ascending=False).reset_index()),
        "compared": (lines["stage"] == stages.COMPARED).sum(),
        "floor": percent(thresholds(stages.TIER).coverage),
        "differences": differences(rows),
        "underestimated": "\n".join(
            f"- scene {case.number}: {row['confirmation']['sentence']}."
            for case, row in rows
            if row["outcome"] == stages.UNDERESTIMATED
        )
        or "There was none.",
        "breaches": markdown(breaches(rows).groupby(["model", "name"]).head(1)),
        "failures": markdown(
            failures(rows).groupby(["model", "status", "run"])["scene"].agg(["count", _some]).reset_index()
        ),
        "limit": quantity(stages.DISTANCE, "m"),
        "drawn": len(only),
        "differing": differing,
        "overlooked": share(upper_limit(differing, len(only))),
        "fine": FINE_SAMPLES,
        "step": quantity(SMALL_STEP, "s"),
        "seconds": ", ".join(
            f"{stage} {spent[stage] / 60.0:.1f} min" for stage in stages.STAGES if stage in spent
        ),
        "ranges": "; ".join(
            f"{name} {quantity(low, unit)} to {quantity(high, unit)}"
            for name, (low, high, unit) in population.RANGES.items()
        ),
        "joints": ", ".join(f"{joint} {part:.0%}" for joint, part in population.JOINTS.items()),
        "foundation": f"{population.FOUNDATION_SHARE:.0%}",
        "shipped": ", ".join(population.SHIPPED),
        "moved": f"{population.MOVED:.0%}",
    }


def outcome(rows: Sequence[Row]) -> str:
    """Return what came of it in one paragraph."""
    count = Counter(row["outcome"] for row in rows)
    decided = count[stages.AGREE] + count[stages.UNDERESTIMATED] + count[stages.DIFFER]
    errs = Counter(NAMES[row["adjudication"]["errs"]] for row in rows if row["outcome"] == stages.DIFFER)
    broken = Counter(
        model
        for row in rows
        for model in MODELS
        if row["breaches"].get(model)
        or any(one["model"] == model and one["status"] == VIOLATED for one in row["failures"])
    )
    runs = Counter(one["model"] for row in rows for one in row["failures"])
    broke, failed = (
        " and ".join(f"{counted[model]} of the {model} model" for model in MODELS)
        for counted in (broken, runs)
    )
    return (
        f"**Of {len(rows)} random scenes of {population.CYCLES:g} cycles {decided} are decided: "
        f"{count[stages.AGREE]} agree, in {count[stages.UNDERESTIMATED]} the uncertainty had been "
        f"underestimated, {count[stages.DIFFER]} differ "
        f"({', '.join(f'{errs[words]} {words}' for words in NAMES.values())}).** "
        f"In {count[stages.BROKEN]} others a run breaks an invariant (of all scenes: {broke}). "
        f"{count[stages.NOT_DECIDED]} are not decided for want of predictable samples, "
        f"{count[stages.FAILED]} cannot be compared; runs that did not succeed: {failed}."
    )


def _some(scenes: pd.Series) -> str:
    return ", ".join(map(str, scenes[:12])) + (" ..." if len(scenes) > 12 else "")


def differences(rows: Cases) -> str:
    """Return a line for each scene that differs: who errs and why, and the contacts that one model lacks."""

    def line(scene: int, one: Row, claim: str) -> dict[str, str]:
        missing = "; ".join(
            f"{CONTACTS[each['corner']]}, {each['start']:.6g} to {each['end']:.6g} s, not in the "
            f"{each['lacks']} run"
            for each in sorted(one["missing"], key=lambda each: each["start"])[:2]
        )
        return {
            "scene": str(scene),
            "seen from": f"{one['time']:.6g} s",
            "contact": missing or "the same in both",
            "apart by": f"{one['channel']}: {quantity(one['apart'], channels()[one['channel']].unit, 2)}",
            "claim": claim,
            "errs": f"**{one['errs']}**",
            "why": one["why"],
        }

    lines = [
        line(case.number, row["adjudication"], (row["confirmation"] or {}).get("outcome", ""))
        for case, row in rows
        if row["outcome"] == stages.DIFFER
    ]
    return rows_table(lines) or "There was none."


def opinions(rows: Cases) -> pd.DataFrame:
    """Return a line for each opinion, with its distances from the run of either model."""
    apart = [f"from {model}" for model in MODELS]
    lines = [
        {"scene": case.number, "channel": row["adjudication"]["channel"]}
        | one
        | dict(zip(apart, one["distances"], strict=False))
        for case, row in rows
        if row["adjudication"]
        for one in row["adjudication"]["evidence"]
    ]
    return pd.DataFrame(lines, columns=["scene", "channel", "name", "model", "status", *apart, "stands"])


def failures(rows: Cases) -> pd.DataFrame:
    """Return a line for each run that did not succeed."""
    lines = [
        one
        | {"status": ", ".join((one["status"], *one["invariants"])), "run": one["kind"], "scene": case.number}
        for case, row in rows
        for one in row["failures"]
    ]
    return pd.DataFrame(lines, columns=["model", "status", "run", "scene", "message"])


def breaches(rows: Cases) -> pd.DataFrame:
    """Return a line for each table that contradicts itself, the worst first; in m, overlaps in s."""
    lines = [
        {"model": model, "scene": case.number} | one
        for case, row in rows
        for model, shown in row["breaches"].items()
        for one in shown
    ]
    columns = ["model", "name", "scene", "corner", "value", "bound", "time", "since", "until"]
    return pd.DataFrame(lines, columns=columns).sort_values("value", ascending=False, kind="stable")


def write(rows: Cases, folder: Path) -> None:
    """Draw distances between the models, and where the scenes lie; write the long tables."""
    lines = scenes(rows)
    tables = {"scenes": lines, "opinions": opinions(rows), "failures": failures(rows)}
    for name, frame in tables.items():
        frame.to_csv(folder / f"{name}.csv", index=False)
    _draw_distances(lines, folder / "distances.svg")
    _draw_places(lines, folder / "places.svg")


def _draw_distances(lines: pd.DataFrame, path: Path) -> None:
    groups = (
        ("agree", svg.SERIES[0], (stages.AGREE, stages.UNDERESTIMATED)),
        ("differ or broken", svg.SERIES[3], (stages.DIFFER, stages.BROKEN)),
        ("not decided", svg.THRESHOLD, (stages.NOT_DECIDED,)),
    )
    screened, ticks = lines.dropna(subset=["distance_m"]), range(-15, -2, 3)
    decades, shares = np.arange(-15.0, -2.9, 0.5).tolist(), np.linspace(0.0, 1.0, 21).tolist()
    with svg.panels(path, 1, 2, sharey=True) as (left, right):
        for label, colour, outcomes in groups:
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
        _plain(left.yaxis, (1, 10, 100, 1000))
        svg.legend_above(left)


def _draw_places(lines: pd.DataFrame, path: Path) -> None:
    with svg.panels(path, 1, 2, sharex=True) as (left, right):
        for outcome, mark in _MARKS.items():
            own = lines[lines["outcome"] == outcome]
            if len(own):
                label = f"{outcome} ({len(own)})"
                left.plot(own["speed_rpm"].abs(), 1e3 * own["clearance_m"], linestyle="", label=label, **mark)
                right.plot(own["speed_rpm"].abs(), own["restitution"], linestyle="", **mark)
        low, high = (1e3 * end for end in population.RANGES["clearances"][:2])
        left.set(yscale="log", ylim=(0.8 * low, 1.2 * high), ylabel="clearance (mm)")
        _plain(left.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0))
        right.set(ylim=(-0.03, 1.03), ylabel="coefficient of restitution (-)")
        for axes in (left, right):
            axes.set(xscale="log", xlim=(9.0, 1100.0))
            axes.set_xlabel("speed of the crank (rpm)")
            _plain(axes.xaxis, (10, 30, 100, 300, 1000))
        svg.legend_above(left, columns=3)


def _plain(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis with plain numbers, those within its limits."""
    low, high = axis.get_view_interval()
    shown = [tick for tick in ticks if low <= tick <= high]
    axis.set_ticks(shown, [f"{tick:g}" for tick in shown])
    axis.set_ticks([], minor=True)


STUDY = Study("campaign", small=5, full=1280, measure=measure, page=page, draw=write, data=record)
