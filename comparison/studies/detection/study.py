"""The gate itself under test: its false alarms, the faults it misses, the smallest change it tells."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from comparison.channels import channels
from comparison.files import replacing, write_json
from comparison.report.markdown import table
from comparison.report.quantity import MISSING, number, quantity
from comparison.run import Progress
from comparison.studies.detection import alarms, limits
from comparison.studies.detection.copies import installed
from comparison.studies.detection.faults import Fault, Trial, catalogue, controls, trials
from comparison.studies.detection.figures import draw
from comparison.studies.detection.rates import interval, share, upper_limit
from comparison.studies.detection.tasks import Found, Task, find_all
from comparison.thresholds import thresholds_record

Judged = Sequence[tuple[alarms.Kind, Sequence[Found]]]
Tried = Sequence[tuple[Trial, Found]]
WORDS = {"differ": "**differs**", "cannot compare": "**refused**", "agree": "agrees"}


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Judge all pairs, and write README.md, detection.json and the figure."""
    pairs = [alarms.pairs(kind) for kind in alarms.KINDS]
    tried, healthy, sought = trials(catalogue()), controls(), limits.searches()
    tasks: list[Task] = [
        *(pair for drawn in pairs for pair in drawn),
        *healthy,
        *(t.pair for t in tried),
        *sought,
    ]
    with installed([fault for fault in catalogue() if fault.kind == "code"]):
        found = iter(find_all(tasks, n_jobs, on_progress))
    judged = [(kind, _next(found, drawn)) for kind, drawn in zip(alarms.KINDS, pairs, strict=True)]
    checked = _next(found, healthy)
    faults = list(zip(tried, _next(found, tried), strict=True))
    smallest = _by_place(_next(found, sought))
    draw(
        [name for name, _, _ in limits.PARAMETERS],
        [f"{model}, {tier}" for model, tier in limits.PLACES],
        smallest,
        folder / "smallest.svg",
    )
    write_json(record(judged, faults, smallest), folder / "detection.json")
    with replacing(folder / "README.md") as part:
        part.write_text(text(judged, checked, faults, smallest), "utf-8")


def _next(found: Iterator[Found], of: Sequence[object]) -> list[Found]:
    return list(islice(found, len(of)))


def _by_place(found: Sequence[Found]) -> list[list[float | None]]:
    """Return the smallest detected changes, one row a parameter, one column a place."""
    columns = len(limits.PLACES)
    values = [result.get("found") for result in found]
    return [values[at : at + columns] for at in range(0, len(values), columns)]


def record(judged: Judged, faults: Tried, smallest: Sequence[Sequence[float | None]]) -> dict[str, Any]:
    """Return counts, verdicts, and changes with two digits, with the thresholds that they were measured with.

    The gate's baseline takes over the rates: see `comparison.gate.renewal`.
    """
    return {
        "thresholds": thresholds_record(),
        "false_alarms": {
            kind.label: {
                "draws": len(found),
                "decided": _decided(found),
                "alarms": _alarms(found),
                "upper_limit_95": round(upper_limit(_alarms(found), _decided(found)), 5),
            }
            for kind, found in judged
        },
        "detected": {
            tier: {"faults": len(told), "detected": sum(told), "interval_95": _rounded(told)}
            for tier, told in _detections(faults).items()
        },
        "faults": [
            {
                "fault": trial.fault.name,
                "kind": trial.fault.kind,
                "model": trial.model,
                "tier": trial.tier,
                "verdict": found["verdict"],
                "detected": trial.detected(found),
                "first": None if found["first"] is None else found["first"]["channel"],
            }
            for trial, found in faults
        ],
        "smallest_change": {
            name: {
                f"{model}, {tier}": None if value is None else float(f"{value:.2g}")
                for (model, tier), value in zip(limits.PLACES, row, strict=True)
            }
            for (name, _, _), row in zip(limits.PARAMETERS, smallest, strict=True)
        },
    }


def text(
    judged: Judged, checked: Sequence[Found], faults: Tried, smallest: Sequence[Sequence[float | None]]
) -> str:
    """Return the study's README."""
    template = files("comparison.studies.detection").joinpath("detection.md").read_text("utf-8")
    columns = [f"in the {_short(model)}, {tier} tier" for model, tier in limits.PLACES]
    rows = [
        [name, *(MISSING if value is None else number(value, 2) for value in row)]
        for (name, _, _), row in zip(limits.PARAMETERS, smallest, strict=True)
    ]
    return template.format(
        overview=overview(judged, faults),
        speed=_span(alarms.SPEED_RPM),
        clearance=_span(alarms.CLEARANCE, 1e3),
        modulus=_span(alarms.MODULUS, 1e-9),
        restitution=_span(alarms.RESTITUTION),
        friction=_span(alarms.FRICTION),
        factors=_span(alarms.FACTORS),
        alarms=table(ALARM_HEADINGS, [alarm_row(kind, found) for kind, found in judged]),
        listed=alarm_list(judged),
        channels=channel_table(judged),
        controls=", ".join(f"{count} times {verdict}" for verdict, count in _verdicts(checked).items()),
        numbers=fault_table(faults, "number"),
        codes=fault_table(faults, "code"),
        tables=fault_table(faults, "table"),
        missed=misses(faults),
        least=number(limits.LEAST, 1),
        most=number(limits.MOST, 1),
        smallest=table(("number", *columns), rows),
    )


def overview(judged: Judged, faults: Tried) -> str:
    """Return the figures that matter, in two tables' worth of lines."""
    lines = [
        f"- {kind.label}: {_alarms(found)} false alarms in {_decided(found)} decided comparisons "
        f"(upper limit {share(upper_limit(_alarms(found), _decided(found)))} at 95 %)."
        for kind, found in judged
    ]
    lines += [
        f"- {tier} tier: {sum(told)} of {len(told)} faults detected "
        f"({_between(interval(sum(told), len(told)))} at 95 %)."
        for tier, told in _detections(faults).items()
    ]
    return "\n".join(lines)


ALARM_HEADINGS = (
    "model against itself",
    "turns of the crank",
    "draws",
    "indeterminate",
    "decided",
    "false alarms",
    "rate, 95 % interval",
    "upper limit, 95 %",
    "samples predictable: least, tenth, median draw",
)


def alarm_row(kind: alarms.Kind, found: Sequence[Found]) -> list[str]:
    """Return the cells of one model at one tier."""
    decided, count = _decided(found), _alarms(found)
    coverage = [np.mean([c[1] for c in f["channels"].values() if c[0] != "unexcited"]) for f in found]
    return [
        kind.label,
        _span(kind.turns),
        str(len(found)),
        str(len(found) - decided),
        str(decided),
        str(count),
        _between(interval(count, decided)),
        share(upper_limit(count, decided)),
        ", ".join(f"{value:.0%}" for value in np.quantile(coverage, (0.0, 0.1, 0.5))),
    ]


def alarm_list(judged: Judged) -> str:
    """Return one line a false alarm."""
    lines = [
        f"- {kind.label}, draw {draw}: {found['reason']}."
        for kind, all_found in judged
        for draw, found in enumerate(all_found)
        if found["verdict"] not in ("agree", "indeterminate")
    ]
    return "\n".join(lines) if lines else "There was none."


def channel_table(judged: Judged) -> str:
    """Return the alarms by channel."""
    rows = []
    for name in channels():
        verdicts = [
            Counter(f["channels"][name][0] for f in found if name in f["channels"]) for _, found in judged
        ]
        if any(verdicts):
            rows.append([name, *(f"{v['differ']} of {v['differ'] + v['agree']}" for v in verdicts)])
    return table(("channel", *(kind.label for kind, _ in judged)), rows)


def fault_table(faults: Tried, kind: str) -> str:
    """Return one row a fault of a kind, in the order of the catalogue."""
    rows: dict[Fault, dict[tuple[str, str], str]] = {}
    for trial, found in faults:
        if trial.fault.kind == kind:
            rows.setdefault(trial.fault, {})[trial.model, trial.tier] = verdict_cell(trial, found)
    places = [
        place
        for place in (*limits.PLACES, ("exudyn", "standard"))
        if any(place in cells for cells in rows.values())
    ]
    headings = ("fault", "scene", *(f"in the {_short(model)}, {tier} tier" for model, tier in places))
    return table(
        headings,
        [[f.name, f.scene, *(cells.get(place, "") for place in places)] for f, cells in rows.items()],
    )


def verdict_cell(trial: Trial, found: Found) -> str:
    """Return what the gate said of a fault, and by what."""
    if trial.fault.unexcited and trial.detected(found):
        return f"**{trial.fault.unexcited} unexcited**"
    verdict, first = str(found["verdict"]), found["first"]
    word = WORDS.get(verdict, verdict)
    if first is None:
        reason = found["reason"].partition(": ")[2] or found["reason"]
        return f"{word}: {reason}" if verdict == "cannot compare" else word
    difference, threshold = (quantity(first[key], first["unit"], 2) for key in ("difference", "threshold"))
    return f"{word}: {first['channel']}, {quantity(first['time'], 's')}: {difference}, threshold {threshold}"


def misses(faults: Tried) -> str:
    """Return what was not detected at the tight tier, with the reason where the catalogue knows one."""
    lines = [
        f"- {trial.fault.name} ({trial.model}): {trial.fault.missed or 'not expected'}."
        for trial, found in faults
        if trial.tier == "tight" and not trial.detected(found)
    ]
    return "\n".join(["Missed at the tight tier:", "", *lines]) if lines else "None is missed."


def _detections(faults: Tried) -> dict[str, list[bool]]:
    told: dict[str, list[bool]] = {}
    for trial, found in faults:
        told.setdefault(trial.tier, []).append(trial.detected(found))
    return dict(sorted(told.items(), reverse=True))


def _rounded(told: Sequence[bool]) -> list[float]:
    return [round(bound, 4) for bound in interval(sum(told), len(told))]


def _decided(found: Sequence[Found]) -> int:
    return sum(result["verdict"] != "indeterminate" for result in found)


def _alarms(found: Sequence[Found]) -> int:
    """Count what is neither agreement nor undecided; a run that fails is an alarm as well."""
    return sum(result["verdict"] not in ("agree", "indeterminate") for result in found)


def _verdicts(found: Iterable[Found]) -> Counter[str]:
    return Counter(result["verdict"] for result in found)


def _between(bounds: tuple[float, float]) -> str:
    return " to ".join(share(bound) for bound in bounds)


def _span(bounds: tuple[float, float], factor: float = 1.0) -> str:
    low, high = (f"{bound * factor:g}" for bound in bounds)
    return low if low == high else f"{low} to {high}"


def _short(model: str) -> str:
    return {"exudyn": "Exudyn model"}.get(model, model)
