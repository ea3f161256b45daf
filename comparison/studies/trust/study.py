"""The verdict under test: runs of the study, their one table, and its page and figures."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.accuracy.levels import TIERS, thresholds, thresholds_record
from comparison.accuracy.uncertainty import movable
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.models import machine_and_versions, platform_name, versions
from comparison.report import svg
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import (
    Study,
    cross_table,
    interval,
    markdown,
    part,
    plain_ticks,
    rows_table,
    share,
    upper_limit,
    write_csv,
)
from comparison.studies.trust import adjudication, distributions, population
from comparison.studies.trust.faults import KINDS, Fault, catalogue, install_copies, scenes
from comparison.studies.trust.judge import Comparison, measure_tasks, shows_fault, trials

SCENES = 200  # half of them at both tiers: 1.3 h of processor time; no alarm of 270 is at most 1.1 %
MEMBERS = 64  # runs in an ensemble
RANDOM, CONTROL, FAULT, ENSEMBLES = "random scene", "no fault", "fault", "ensembles"
LINKAGE, LINKAGE_FAULT = "linkage", "fault in a linkage"
"""Groups of rows of the table."""
COLUMNS = {
    "group": "", "name": "", "kind": "", "scene": "", "model": "", "tier": "", "verdict": "",
    "confirmation": "", "detected": None, "predictable": None, "failed": "", "errs": "",
    "tests": None, "differing": None, "speed_rpm": None, "clearance_m": None, "reason": "",
}  # fmt: skip
"""Columns of the table, and the value where a row has none."""
# The rare ones last, so that they lie on top.
_MARKS: dict[str, dict[str, Any]] = {
    "agree": {"marker": ".", "color": svg.SERIES[0], "ms": 3},
    "indeterminate": {"marker": "o", "color": svg.THRESHOLD, "mfc": "none", "ms": 4},
    "cannot compare": {"marker": "x", "color": svg.INK, "ms": 4},
    "differ": {"marker": "D", "color": svg.OUTSIDE, "ms": 5},
}


def measure(full: bool, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Judge random scenes and seeded faults, compare ensembles: the table."""
    faults = catalogue() if full else [catalogue("number")[0], *catalogue("table")[-3:]]
    tasks = [*_random(SCENES if full else 2), *_faults(faults), *_linkages(100 if full else 1)]
    with install_copies([fault for fault in faults if fault.engine]):
        rows = measure_tasks([task for _, task in tasks], n_jobs, part(on_progress, 0.0, 0.95))
    lines = []
    for (head, task), row in zip(tasks, rows, strict=True):
        line = head | {name: row[name] for name in COLUMNS if name in row}
        if task.fault and row.get("worth", float("inf")) >= population.LINKAGES["worth"]:
            line["detected"] = shows_fault(task.fault, row)
        lines.append(line)
    ensembles = distributions.compare_ensembles(MEMBERS if full else 3, n_jobs, part(on_progress, 0.95, 1.0))
    return as_table(lines + [{"group": ENSEMBLES} | row for row in ensembles])


def as_table(lines: Sequence[Row]) -> pd.DataFrame:
    """Return the table of its rows, each of which has some of the `COLUMNS`."""
    return pd.DataFrame([COLUMNS | line for line in lines])[list(COLUMNS)]


def _random(count: int) -> Iterator[tuple[Row, Comparison]]:
    for n in range(count):
        scene, users = population.random_scene(n), population.of_users(n)
        line = {"group": RANDOM, "name": str(n), "kind": "users" if users else "extremes"}
        line |= {"scene": scene.source, "speed_rpm": scene.data["drive"]["speed_rpm"]}
        line |= {"clearance_m": scene.data["clearance"][movable(scene)]}
        for tier in TIERS if users else ("tight",):
            yield line | {"tier": tier}, Comparison(at_tier(scene, tier), tier)


def _faults(faults: Sequence[Fault]) -> Iterator[tuple[Row, Comparison]]:
    pairs = trials(faults)
    for task, fault in pairs:
        head = {"group": FAULT, "name": fault.name, "kind": KINDS[fault.kind], "scene": fault.scene}
        yield head | {"model": task.faulty, "tier": task.tier}, task
    for name, tier in dict.fromkeys((fault.scene, task.tier) for task, fault in pairs):
        yield {"group": CONTROL, "name": name, "tier": tier}, Comparison(scenes(tier)[name], tier)


def _linkages(count: int) -> Iterator[tuple[Row, Comparison]]:
    for n in range(count):
        scene, fault, model = population.random_linkage(n)
        line = {"name": str(n), "kind": scene.source, "scene": scene.name, "tier": "standard"}
        yield line | {"group": LINKAGE}, Comparison(scene, "standard")
        line |= {"group": LINKAGE_FAULT, "name": f"{n}: {fault.name}", "model": model}
        yield line, Comparison(scene, "standard", fault, model)


# ---- numbers


def count(rows: pd.DataFrame) -> dict[str, Any]:
    """Count the verdicts without a fault; the upper limit of the rate of alarms is one-sided."""
    verdicts = rows["verdict"]
    # Tables that cannot be compared though both models ran are an alarm as well.
    alarm = (verdicts == "differ") | ((verdicts == "cannot compare") & (rows["failed"] == ""))
    alarms = int(alarm.sum())
    decisions = alarms + int((verdicts == "agree").sum())
    corrections = (verdicts == "agree") & (rows["confirmation"] == "underestimated")
    return {
        "draws": int((verdicts != "").sum()),
        "decided": decisions,
        "underestimated": int(corrections.sum()),
        "alarms": alarms,
        "upper_limit_95": round(upper_limit(alarms, decisions), 5),
    }


def record(table: pd.DataFrame) -> dict[str, Any]:
    """Return the rates, which `comparison.regression.record` reads."""
    random, faults = (table[table["group"] == group] for group in (RANDOM, FAULT))
    hits = {tier: faults.loc[faults["tier"] == tier, "detected"].astype(bool) for tier in reversed(TIERS)}
    return {
        "machine": platform_name(),
        "versions": versions(),
        "thresholds": thresholds_record(),
        "false_alarms": {
            f"both models, {tier}": count(random[random["tier"] == tier]) for tier in reversed(TIERS)
        },
        "detected": {
            tier: {
                "faults": len(group),
                "detected": int(group.sum()),
                "interval_95": [round(end, 4) for end in interval(int(group.sum()), len(group))],
            }
            for tier, group in hits.items()
        },
    }


# ---- page


def page(table: pd.DataFrame) -> dict[str, object]:
    """Return the variables of the template."""
    groups = {group: table[table["group"] == group] for group in {*table["group"], LINKAGE, LINKAGE_FAULT}}
    random, faults, linkages, defects = (groups[name] for name in (RANDOM, FAULT, LINKAGE, LINKAGE_FAULT))
    large, small = defects.dropna(subset="detected"), defects[defects["detected"].isna()]
    hit = large["detected"].astype(bool)
    tight, failures = random[random["tier"] == "tight"], random[random["verdict"] == "cannot compare"]
    rates, numbers = record(table), count(random)
    hits = faults.groupby(["kind", "model", "tier"], sort=False)["detected"].agg(["sum", "count"])
    reasons = {fault.name: fault.missed or "not expected" for fault in catalogue()}
    notes = (random["verdict"] == "differ") | (random["confirmation"] != "") | (random["errs"] != "")
    tally = failures.groupby(["tier", "failed", "errs", "reason"], sort=False)["name"].agg(["count", _names])
    return {
        "alarms": numbers["alarms"],
        "decided": numbers["decided"],
        "tried": len(faults),
        "found": int(faults["detected"].sum()),
        "ran": share(1.0 - float((tight["verdict"] == "cannot compare").mean())),
        "detected": "; ".join(
            f"{one['detected']} of {one['faults']} at the {tier} tier "
            f"({' to '.join(map(share, one['interval_95']))} at 95 %)"
            for tier, one in rates["detected"].items()
        ),
        "overview": rows_table(
            _count_row(f"{tier}, {kind or 'all'}", random, tier, kind)
            for tier, labels in (("tight", ("", "users", "extremes")), ("standard", ("",)))
            for kind in labels
        ),
        "machine": machine_and_versions(),
        "seed": population.DATA["seed"],
        "scenes": population.scenes_with_clearance(),
        "keys": population.DATA["most_keys"],
        "moved": share(population.DATA["moved"]),
        "floors": {tier: share(thresholds(tier).coverage) for tier in TIERS},
        "listed": random[notes].to_dict("records"),
        "failures": markdown(
            tally.reset_index().set_axis(["tier", "status", "errs", "run", "runs", "scenes"], axis=1)
        ),
        "failed": len(failures),
        "linkages": rows_table(
            _count_row(kind or "all", linkages, "standard", kind) for kind in ("", *linkages["kind"].unique())
        ),
        "odd": pd.concat([linkages[linkages["verdict"] != "agree"], large[~hit]]).to_dict("records"),
        "rule": population.LINKAGES,
        "wrong": len(defects),
        "large": f"{hit.sum()} of {len(hit)} (at least {share(interval(hit.sum(), len(hit))[0])} at 95 %)",
        "small": f"{(small['verdict'] == 'differ').sum()} of {len(small)}",
        "controls": ", ".join(
            f"{times} times {verdict}" for verdict, times in groups[CONTROL]["verdict"].value_counts().items()
        ),
        "faults": cross_table(
            "fault in the",
            [kind for kind, *_ in hits.index],
            [_place(model, tier) for _, model, tier in hits.index],
            [f"{count} of {size}" for count, size in hits.to_numpy()],
        ),
        "missed": [
            row | {"why": reasons[row["name"]]}
            for row in faults[~faults["detected"].astype(bool)].to_dict("records")
        ],
        "ensembles": groups[ENSEMBLES].to_dict("records"),
        "members": MEMBERS,
        "cycles": distributions.CYCLES,
        "spread": share(distributions.SPREAD),
        "instants": distributions.INSTANTS,
        "rate": share(distributions.RATE),
        "step": adjudication.SMALL_STEP,
    }


def _count_row(label: str, rows: pd.DataFrame, tier: str, kind: str) -> dict[str, str]:
    group = rows[(rows["tier"] == tier) & (rows["kind"].isin([kind] if kind else list(rows["kind"])))]
    counts = count(group)
    return {
        "random scenes": label,
        "comparisons": str(counts["draws"]),
        "decided": str(counts["decided"]),
        "false alarms": str(counts["alarms"]),
        "rate at most, 95 %": share(upper_limit(counts["alarms"], counts["decided"])),
        "indeterminate": str((group["verdict"] == "indeterminate").sum()),
        "cannot compare": str((group["verdict"] == "cannot compare").sum()),
        "agree with a corrected uncertainty": str(counts["underestimated"]),
    }


def _names(names: pd.Series) -> str:
    return ", ".join(names[:12]) + (" ..." if len(names) > 12 else "")


def _place(model: str, tier: str) -> str:
    return f"{'Exudyn' if model == 'exudyn' else model}, {tier}"


def draw(table: pd.DataFrame, folder: Path) -> None:
    """Draw the random scenes by speed and clearance; write the table."""
    write_csv({"trust": table}, folder, "%.6g")
    random = table[(table["group"] == RANDOM) & (table["tier"] == "tight")]
    with svg.panels(folder / "scenes.svg") as (axes,):
        for verdict, mark in _MARKS.items():
            rows = random[random["verdict"] == verdict]
            if len(rows):
                label = f"{verdict} ({len(rows)})"
                axes.plot(rows["speed_rpm"].abs(), 1e3 * rows["clearance_m"], ls="", label=label, **mark)
        axes.set(xscale="log", xlabel="speed of the crank (rpm)", yscale="log", ylabel="clearance (mm)")
        plain_ticks(axes.xaxis, (10, 30, 100, 300, 1000))
        plain_ticks(axes.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0))
        svg.legend_above(axes)


STUDY = Study("trust", small=False, full=True, measure=measure, page=page, draw=draw, data=record)
