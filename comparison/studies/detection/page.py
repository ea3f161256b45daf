"""The study's page: its template filled, the tables of the faults, and the figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import starmap
from pathlib import Path

import numpy as np

from comparison.formatting import MISSING, number, quantity, table
from comparison.models import made_on
from comparison.report import svg
from comparison.studies.detection import alarm_tables, alarms, cross_model, limits
from comparison.studies.detection.faults import Fault, Trial
from comparison.studies.detection.rates import confirmation_of, count, interval, share
from comparison.studies.detection.results import Results
from comparison.studies.detection.tasks import Found

Tried = Sequence[tuple[Trial, Found]]
WORDS = {"differ": "**differs**", "cannot compare": "**refused**", "agree": "agrees"}


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    smallest = [[name, *map(_change, row)] for name, row in results.smallest.items()]
    healthy = Counter(result["verdict"] for result in results.healthy)
    return {
        "finding": finding(results),
        "overview": overview(results),
        "machine": made_on(),
        "scenes": ", ".join(f"`{name}`" for name in cross_model.scenes_with_clearance()),
        "moved": share(cross_model.SHARE),
        "wanted": " and ".join(f"{kind.wanted} at the {kind.tier} tier" for kind, _ in results.both),
        "most": f"{cross_model.MOST:g}",
        "seed": cross_model.SEED,
        "rounding": alarm_tables.rounding_table(results),
        "both": alarm_tables.both_table(results),
        "speed": alarm_tables.span(alarms.SPEED_RPM),
        "clearance": alarm_tables.span(alarms.CLEARANCE, 1e3),
        "modulus": alarm_tables.span(alarms.MODULUS, 1e-9),
        "restitution": alarm_tables.span(alarms.RESTITUTION),
        "friction": alarm_tables.span(alarms.FRICTION),
        "factors": alarm_tables.span(alarms.FACTORS),
        "own": alarm_tables.own_table(results),
        "listed": alarm_tables.alarm_list(results),
        "channels": alarm_tables.channel_table(results),
        "controls": ", ".join(f"{times} times {verdict}" for verdict, times in healthy.items()),
        "numbers": fault_table(results.faults, "number"),
        "codes": fault_table(results.faults, "code"),
        "tables": fault_table(results.faults, "table"),
        "missed": misses(results.faults),
        "least": number(limits.LEAST, 1),
        "largest": number(limits.MOST, 1),
        "smallest": table(("number", *starmap(_place, limits.PLACES)), smallest),
    }


def finding(results: Results) -> str:
    """Return the false alarms and the detected faults of all kinds together."""
    counts = [count(found) for _, found in results.without_fault]
    tried = [found for detected in results.detections.values() for found in detected]
    alarms, decided = (sum(numbers) for numbers in zip(*((c.alarms, c.decided) for c in counts), strict=True))
    return (
        f"{alarms} false alarms in {decided} decided comparisons; "
        f"{sum(tried)} of {len(tried)} faults detected."
    )


def overview(results: Results) -> str:
    """Return the figures that matter, one line each."""
    lines = []
    for label, found in results.without_fault:
        counts = count(found)
        lines.append(
            f"- {label}: {counts.alarms} false alarms in {counts.decided} decided comparisons "
            f"(upper limit {share(counts.upper_limit)} at 95 %); {counts.indeterminate} of {counts.draws} "
            f"draws indeterminate, {counts.underestimated} agree with a corrected uncertainty."
        )
    lines += [
        f"- {tier} tier: {sum(detected)} of {len(detected)} faults detected "
        f"({alarm_tables.between(interval(sum(detected), len(detected)))} at 95 %)."
        for tier, detected in results.detections.items()
    ]
    return "\n".join(lines)


def fault_table(faults: Tried, kind: str) -> str:
    """Return one row a fault of a kind, in the order of the catalogue."""
    rows: dict[Fault, dict[str, str]] = {}
    for trial, found in faults:
        if trial.fault.kind == kind:
            rows.setdefault(trial.fault, {})[_place(trial.model, trial.tier)] = verdict_cell(trial, found)
    tried = {place for cells in rows.values() for place in cells}
    known = starmap(_place, (*limits.PLACES, ("exudyn", "standard")))
    places = [place for place in known if place in tried]
    lines = [[f.name, f.scene, *(cells.get(place, "") for place in places)] for f, cells in rows.items()]
    return table(("fault", "scene", *places), lines)


def verdict_cell(trial: Trial, found: Found) -> str:
    """Return the verdict on a fault, and where it shows."""
    if trial.fault.unexcited and trial.detected(found):
        return f"**{trial.fault.unexcited} unexcited**"
    verdict, first = str(found["verdict"]), found["first"]
    word = WORDS.get(verdict, verdict)
    confirmation = confirmation_of(found)
    if confirmation.get("outcome") == "underestimated":
        return f"{word}: {confirmation['sentence']}"
    if first is None:
        reason = found["reason"].partition(": ")[2] or found["reason"]
        return f"{word}: {reason}" if verdict == "cannot compare" else word
    difference, threshold = (quantity(first[key], first["unit"], 2) for key in ("difference", "threshold"))
    cell = f"{word}: {first['channel']}, {quantity(first['time'], 's')}: {difference}, threshold {threshold}"
    runs = " + ".join(str(members) for members in confirmation.get("members", ()) if members)
    return f"{cell}; confirmed by {runs} runs" if confirmation.get("outcome") == "confirmed" else cell


def misses(faults: Tried) -> str:
    """Return what was not detected at the tight tier, with the reason where the catalogue knows one."""
    lines = [
        f"- {trial.fault.name} ({trial.model}): {trial.fault.missed or 'not expected'}."
        for trial, found in faults
        if trial.tier == "tight" and not trial.detected(found)
    ]
    return "\n".join(["Missed at the tight tier:", "", *lines]) if lines else "None is missed."


def draw(results: Results, folder: Path) -> None:
    """Draw the smallest detectable change of each number, from the top; none where nothing was detected."""
    names = list(results.smallest)
    rows = [[found["found"] for found in row] for row in results.smallest.values()]
    changes = np.array(rows, dtype=np.float64).T
    marks = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.DIFFERENCE))
    with svg.panels(folder / "smallest.svg", height=0.9 + 0.26 * len(names)) as (axes,):
        axes.set(xscale="log", xlim=(limits.LEAST, 2.0 * limits.MOST), ylim=(len(names) - 0.5, -0.5))
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("smallest detectable relative change")
        for place, (mark, colour), x in zip(limits.PLACES, marks, changes, strict=True):
            label = ", ".join(place)
            axes.plot(x, range(x.size), mark, color=colour, mfc="none", ms=5, label=label)
        svg.legend_above(axes)


def _change(found: Found) -> str:
    """Return the smallest change that is detected; in brackets the one that is shown, if that is smaller."""
    detected, shown = (MISSING if found[key] is None else number(found[key], 2) for key in ("found", "shown"))
    return detected if detected == shown else f"{detected} ({shown})"


def _place(model: str, tier: str) -> str:
    return f"in the {'Exudyn model' if model == 'exudyn' else model}, {tier} tier"
