"""The verdicts themselves under test: false alarms, missed faults, the smallest detectable change."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.accuracy.levels import TIERS, thresholds_record
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.formatting import number, table
from comparison.models import made_on, platform_name, versions
from comparison.report import svg
from comparison.studies.detection import pairs
from comparison.studies.detection.faults import KINDS, RECORDS, catalogue, installed
from comparison.studies.detection.pairs import Kind, Measured, Rounding, Trial, find_all
from comparison.studies.shared.study import (
    Study,
    crossed,
    interval,
    part,
    rows_table,
    share,
    upper_limit,
    write_csv,
)

_RECORDED = ["fault", "kind", "model", "tier", "verdict", "detected", "confirmation", "first"]
_KINDS = dict(zip(KINDS, ("parameters", "code", "tables"), strict=True))
_MARKS = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.FIRST))  # of the `pairs.PLACES`


class Results(NamedTuple):
    """Rows of all comparisons."""

    both: Sequence[tuple[Kind, Mapping[Rounding, Sequence[Row]]]]
    own: Sequence[tuple[Kind, Sequence[Row]]]
    bits: Mapping[Rounding, tuple[str, ...]]  # hashes of tables, see `pairs.hashes`
    healthy: Sequence[Row]  # of the catalogue's scenes without a fault
    faults: Sequence[tuple[Trial, Row]]
    smallest: Mapping[str, Sequence[Row]]  # of the searches for each number, by `pairs.PLACES`

    @property
    def without_fault(self) -> dict[str, list[Row]]:
        """The rows of each kind of comparison without a fault by its label."""
        both = {kind.label: [row for rows in drawn.values() for row in rows] for kind, drawn in self.both}
        return both | {kind.label: list(rows) for kind, rows in self.own}

    @property
    def detections(self) -> dict[str, list[bool]]:
        """Tier -> whether each fault was detected, the tight tier first."""
        return {
            tier: [trial.detected(row) for trial, row in self.faults if trial.tier == tier]
            for tier in sorted({trial.tier for trial, _ in self.faults}, reverse=True)
        }


def measure(full: bool, n_jobs: int, on_progress: Progress | None) -> Results:
    """Make all comparisons, or few and none by copies of a model; those made before are not repeated."""
    both_kinds, own_kinds = (
        [kind if full else replace(kind, draws=2) for kind in all_of] for all_of in (pairs.BOTH, pairs.OWN)
    )
    roundings = pairs.ROUNDINGS if full else pairs.ROUNDINGS[:2]
    faults = pairs.trials(catalogue() if full else [catalogue(["number"])[0], *catalogue(["table"])[-3:]])
    names = list(RECORDS["smallest"])[: None if full else 1]
    alone, healthy = [pairs.own_pairs(kind) for kind in own_kinds], pairs.controls()
    tasks: list[Measured] = [pair for drawn in alone for pair in drawn]
    tasks += [*healthy, *(trial.pair for trial in faults)]
    tasks += pairs.searches(pairs.HALVINGS if full else 1)[: len(names) * len(pairs.PLACES)]
    with installed(catalogue(["code", "rearranged"]) if full else []):
        hashed = find_all(pairs.bits(roundings), n_jobs, part(on_progress, 0.0, 0.01))
        bits = pairs.hashes(roundings, hashed)
        rows = iter(find_all(tasks, n_jobs, part(on_progress, 0.01, 0.4)))

        def sample(kind: Kind, start: float, end: float) -> dict[Rounding, list[Row]]:
            # The first round is nearly all: later ones replace what was indeterminate.
            rounds = iter([part(on_progress, start, end)])

            def find(drawn: Sequence[tuple[Rounding, int]]) -> list[Row]:
                return find_all([pairs.both_pair(kind, *one) for one in drawn], n_jobs, next(rounds, None))

            return pairs.sample(kind, pairs.effective(bits, kind.tier), find)

        ends = pairwise(np.linspace(0.4, 1.0, len(both_kinds) + 1).tolist())
        both = [(kind, sample(kind, *span)) for kind, span in zip(both_kinds, ends, strict=True)]
    return Results(
        both=both,
        own=[(kind, list(islice(rows, len(drawn)))) for kind, drawn in zip(own_kinds, alone, strict=True)],
        bits=bits,
        healthy=list(islice(rows, len(healthy))),
        faults=list(zip(faults, islice(rows, len(faults)), strict=True)),
        smallest={name: list(islice(rows, len(pairs.PLACES))) for name in names},
    )


# ---- numbers


def count(rows: Sequence[Row]) -> dict[str, Any]:
    """Count how comparisons without a fault ended; the upper limit of the rate of alarms is one-sided."""
    decided, agree = pairs.decided(rows), [row for row in rows if row["verdict"] == "agree"]
    alarms = decided - len(agree)
    return {
        "draws": len(rows),
        "decided": decided,
        "underestimated": sum(_said(row, "outcome") == "underestimated" for row in agree),
        "alarms": alarms,
        "upper_limit_95": round(upper_limit(alarms, decided), 5),
    }


def _said(row: Row, what: str) -> str:
    """Return outcome or sentence of a confirmation, nothing without one."""
    return str((row.get("confirmation") or {}).get(what, ""))


def record(results: Results) -> dict[str, Any]:
    """Return the rates, which `comparison.regression.record` reads, verdicts and changes with two digits."""
    places = [", ".join(place) for place in pairs.PLACES]
    return {
        "machine": platform_name(),
        "versions": versions(),
        "thresholds": thresholds_record(),
        "false_alarms": {label: count(rows) for label, rows in results.without_fault.items()},
        "detected": {
            tier: {
                "faults": len(hits),
                "detected": sum(hits),
                "interval_95": [round(bound, 4) for bound in interval(sum(hits), len(hits))],
            }
            for tier, hits in results.detections.items()
        },
        "rounding": {
            variant.name: {
                "environment": dict(variant.environment),
                "tables": dict(zip(map(", ".join, pairs.HASHED), texts, strict=True)),
            }
            | {kind.label: count(drawn[variant]) for kind, drawn in results.both if variant in drawn}
            for variant, texts in results.bits.items()
        },
        "faults": fault_rows(results)[_RECORDED].replace("", None).to_dict("records"),
        "smallest_change": {
            name: {
                place: row.get("found") and float(f"{row['found']:.2g}")
                for place, row in zip(places, rows, strict=True)
            }
            for name, rows in results.smallest.items()
        },
    }


def comparisons(results: Results) -> pd.DataFrame:
    """Return a line for each comparison without a fault; reasons of those that are not plain agreement."""
    groups = [(kind, variant.name, rows) for kind, drawn in results.both for variant, rows in drawn.items()]
    groups += [(kind, "", rows) for kind, rows in results.own]
    lines = []
    for kind, variant, rows in groups:
        for draw, row in enumerate(rows):
            excited = [coverage for verdict, coverage in row["channels"].values() if verdict != "unexcited"]
            numbers = {
                "comparison": kind.label,
                "rounding": variant,
                "draw": draw,
                "scene": row.get("scene", ""),
                "verdict": row["verdict"],
                "ensembles": _said(row, "outcome"),
                "predictable": round(float(np.mean(excited)), 4) if excited else None,
                "reason": _said(row, "sentence") or ("" if row["verdict"] == "agree" else row["reason"]),
            }
            lines.append(numbers | {name: verdict for name, (verdict, _) in row["channels"].items()})
    return pd.DataFrame(lines)


def fault_rows(results: Results) -> pd.DataFrame:
    """Return a line for each fault and place: the verdict, and the first sample outside its threshold."""
    return pd.DataFrame(
        {
            "fault": trial.fault.name,
            "kind": trial.fault.kind,
            "scene": trial.fault.scene,
            "model": trial.model,
            "tier": trial.tier,
            "verdict": row["verdict"],
            "detected": trial.detected(row),
            "confirmation": _said(row, "outcome"),
            "first": (row["first"] or {}).get("channel", ""),
            **{key: (row["first"] or {}).get(key) for key in ("time", "difference", "threshold", "unit")},
            "reason": _said(row, "sentence") or row["reason"],
        }
        for trial, row in results.faults
    )


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    counts = pd.DataFrame([count(rows) for rows in results.without_fault.values()])
    tried, lines = fault_rows(results), comparisons(results)
    plain = lines["verdict"].isin(["agree", "indeterminate"]) & (lines["ensembles"] == "")
    groups = tried.groupby(["kind", "model", "tier"], sort=False)["detected"].agg(["sum", "count"])
    healthy = Counter(row["verdict"] for row in results.healthy)
    used = {tier: pairs.effective(results.bits, tier) for tier in TIERS}
    unused = {variant.name: [t for t in TIERS if variant not in used[t]] for variant in results.bits}
    return {
        "alarms": counts["alarms"].sum(),
        "decided": counts["decided"].sum(),
        "tried": tried,
        "detected": "; ".join(
            f"{sum(hits)} of {len(hits)} at the {tier} tier "
            f"({' to '.join(map(share, interval(sum(hits), len(hits))))} at 95 %)"
            for tier, hits in results.detections.items()
        ),
        "overview": rows_table(
            {"comparison": label} | _counted(rows) for label, rows in results.without_fault.items()
        ),
        "machine": made_on(),
        "scenes": pairs.scenes_with_clearance(),
        "moved": share(pairs.SHARE),
        "wanted": " and ".join(f"{kind.draws} at the {kind.tier} tier" for kind, _ in results.both),
        "most": pairs.MOST_DRAWS,
        "seed": pairs.SEED,
        "rounding": rows_table(
            {"comparison": kind.label, "rounding": variant.name} | _counted(rows)
            for kind, drawn in results.both
            for variant, rows in drawn.items()
        ),
        "unused": "; ".join(f"{name} ({', '.join(tiers)})" for name, tiers in unused.items() if tiers),
        "listed": lines[~plain].to_dict("records"),
        "controls": ", ".join(f"{times} times {verdict}" for verdict, times in healthy.items()),
        "faults": crossed(
            "fault in the",
            [_KINDS[kind] for kind, *_ in groups.index],
            [_place(place) for _, *place in groups.index],
            [f"{hits} of {size}" for hits, size in groups.to_numpy()],
        ),
        "missed": [
            trial for trial, row in results.faults if trial.tier == "tight" and not trial.detected(row)
        ],
        "least": pairs.LEAST,
        "largest": pairs.MOST,
        "smallest": table(
            ("number", *map(_place, pairs.PLACES)),
            [[name, *map(_change, rows)] for name, rows in results.smallest.items()],
        ),
        **{name: f"{low:g} to {high:g}" for name, (low, high) in RECORDS["own_ranges"].items()},
    }


def _counted(rows: Sequence[Row]) -> dict[str, str]:
    counts = count(rows)
    return {
        "false alarms": str(counts["alarms"]),
        "decided": str(counts["decided"]),
        "rate at most, 95 %": share(upper_limit(counts["alarms"], counts["decided"])),
        "indeterminate": str(counts["draws"] - counts["decided"]),
        "agree with a corrected uncertainty": str(counts["underestimated"]),
    }


def _change(row: Row) -> str:
    """Return the smallest change that is detected; in brackets the one that is shown, if that is smaller."""
    detected, shown = (number(row.get(key) or nan, 2) for key in ("found", "shown"))
    return detected if detected == shown else f"{detected} ({shown})"


def _place(place: Sequence[str]) -> str:
    model, tier = place
    return f"{'Exudyn' if model == 'exudyn' else model}, {tier}"


def write(results: Results, folder: Path) -> None:
    """Draw the smallest detectable change of each number; write the long tables."""
    write_csv({"comparisons": comparisons(results), "faults": fault_rows(results)}, folder)
    names = list(results.smallest)
    smallest = [[row.get("found") for row in rows] for rows in results.smallest.values()]
    with svg.panels(folder / "smallest.svg", height=1.2 + 0.26 * len(names)) as (axes,):
        axes.set(xscale="log", xlim=(pairs.LEAST, 2.0 * pairs.MOST), ylim=(len(names) - 0.5, -0.5))
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("smallest detectable relative change (-)")
        changes = np.array(smallest, dtype=np.float64).T
        for place, (mark, colour), x in zip(pairs.PLACES, _MARKS, changes, strict=True):
            axes.plot(x, range(x.size), mark, color=colour, mfc="none", ms=5, label=_place(place))
        svg.legend_above(axes)


STUDY = Study("detection", small=False, full=True, measure=measure, page=page, draw=write, data=record)
