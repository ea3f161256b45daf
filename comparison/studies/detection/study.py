"""The verdicts themselves under test: false alarms, missed faults, the smallest detectable change."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.accuracy.levels import TIERS, thresholds_record
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.formatting import MISSING, number, table
from comparison.models import made_on, platform_name, versions
from comparison.report import svg
from comparison.studies.detection import draws
from comparison.studies.detection.draws import Draw, Kind, Rounding, Trial
from comparison.studies.detection.faults import KINDS, catalogue, installed, records
from comparison.studies.detection.pairs import HALVINGS, LEAST, MOST, Measured, find_all
from comparison.studies.shared.frames import crossed, rows_table
from comparison.studies.shared.rates import interval, share, upper_limit
from comparison.studies.shared.study import Study, part

_RECORDED = ["fault", "kind", "model", "tier", "verdict", "detected", "confirmation", "first"]
_KINDS = dict(zip(KINDS, ("parameters", "code", "tables"), strict=True))


@dataclass(frozen=True)
class Results:
    """Rows of all comparisons."""

    both: Sequence[tuple[Kind, Mapping[Rounding, Sequence[Row]]]]
    own: Sequence[tuple[Kind, Sequence[Row]]]
    bits: Mapping[Rounding, tuple[str, ...]]  # hashes of tables, see `draws.hashes`
    healthy: Sequence[Row]  # of the catalogue's scenes without a fault
    faults: Sequence[tuple[Trial, Row]]
    smallest: Mapping[str, Sequence[Row]]  # of the searches for each number, by `draws.PLACES`

    @property
    def without_fault(self) -> list[tuple[str, list[Row]]]:
        """The rows of each kind of comparison without a fault by its label."""
        both = [(kind.label, [row for rows in drawn.values() for row in rows]) for kind, drawn in self.both]
        return both + [(kind.label, list(rows)) for kind, rows in self.own]

    @property
    def detections(self) -> dict[str, list[bool]]:
        """Tier -> whether each fault was detected, the tight tier first."""
        return {
            tier: [trial.detected(row) for trial, row in self.faults if trial.tier == tier]
            for tier in sorted({trial.tier for trial, _ in self.faults}, reverse=True)
        }


def measure(full: bool, n_jobs: int, on_progress: Progress | None) -> Results:
    """Make all comparisons, or few and none by copies of a model; those made before are not repeated."""
    kinds, own_kinds = (
        [kind if full else replace(kind, draws=2) for kind in all_of] for all_of in (draws.BOTH, draws.OWN)
    )
    roundings = draws.ROUNDINGS if full else draws.ROUNDINGS[:2]
    faults = draws.trials(catalogue() if full else [catalogue(["number"])[0], *catalogue(["table"])[-3:]])
    names = list(records()["smallest"])[: None if full else 1]
    pairs, healthy = [draws.own_pairs(kind) for kind in own_kinds], draws.controls()
    tasks: list[Measured] = [pair for drawn in pairs for pair in drawn]
    tasks += [*healthy, *(trial.pair for trial in faults)]
    tasks += draws.searches(names, HALVINGS if full else 1)
    # The first round of a kind is nearly all of it: later ones replace what was indeterminate.
    ends = np.linspace(0.4, 1.0, len(kinds) + 1).tolist()
    reports = {kind.label: part(on_progress, *ends[n : n + 2]) for n, kind in enumerate(kinds)}

    def find(drawn: Sequence[Draw]) -> list[Row]:
        return find_all([draw.pair for draw in drawn], n_jobs, reports.pop(drawn[0].kind.label, None))

    with installed(catalogue(["code", "rearranged"]) if full else []):
        hashed = find_all(draws.bits(roundings), n_jobs, part(on_progress, 0.0, 0.01))
        bits = draws.hashes(roundings, hashed)
        rows = iter(find_all(tasks, n_jobs, part(on_progress, 0.01, 0.4)))
        both = [(kind, draws.sample(kind, draws.effective(bits, kind.tier), find)) for kind in kinds]
    return Results(
        both=both,
        own=[(kind, list(islice(rows, len(drawn)))) for kind, drawn in zip(own_kinds, pairs, strict=True)],
        bits=bits,
        healthy=list(islice(rows, len(healthy))),
        faults=list(zip(faults, islice(rows, len(faults)), strict=True)),
        smallest={name: list(islice(rows, len(draws.PLACES))) for name in names},
    )


# ---- numbers


def count(rows: Sequence[Row]) -> dict[str, Any]:
    """Count how comparisons without a fault ended; the upper limit of the rate of alarms is one-sided."""
    decided, agree = draws.decided(rows), [row for row in rows if row["verdict"] == "agree"]
    alarms = decided - len(agree)
    return {
        "draws": len(rows),
        "decided": decided,
        "underestimated": sum(_confirmed(row) == "underestimated" for row in agree),
        "alarms": alarms,
        "upper_limit_95": round(upper_limit(alarms, decided), 5),
    }


def _confirmed(row: Row) -> str:
    return str((row.get("confirmation") or {}).get("outcome", ""))


def record(results: Results) -> dict[str, Any]:
    """Return the rates, which `comparison.regression.record` reads, verdicts and changes with two digits."""
    places = [", ".join(place) for place in draws.PLACES]
    return {
        "machine": platform_name(),
        "versions": versions(),
        "thresholds": thresholds_record(),
        "false_alarms": {label: count(rows) for label, rows in results.without_fault},
        "detected": {
            tier: {
                "faults": len(detected),
                "detected": sum(detected),
                "interval_95": [round(bound, 4) for bound in interval(sum(detected), len(detected))],
            }
            for tier, detected in results.detections.items()
        },
        "rounding": {
            variant.name: {
                "environment": dict(variant.environment),
                "tables": dict(zip(map(", ".join, draws.HASHED), texts, strict=True)),
            }
            | {kind.label: count(drawn[variant]) for kind, drawn in results.both if variant in drawn}
            for variant, texts in results.bits.items()
        },
        "faults": fault_rows(results)[_RECORDED].replace("", None).to_dict("records"),
        "smallest_change": {
            name: {
                place: row["found"] and float(f"{row['found']:.2g}")
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
            sentence = (row.get("confirmation") or {}).get("sentence")
            lines.append(
                {
                    "comparison": kind.label,
                    "rounding": variant,
                    "draw": draw,
                    "scene": row.get("scene", ""),
                    "verdict": row["verdict"],
                    "ensembles": _confirmed(row),
                    "predictable": round(float(np.mean(excited)), 4) if excited else None,
                    "reason": sentence or ("" if row["verdict"] == "agree" else row["reason"]),
                }
                | {name: verdict for name, (verdict, _) in row["channels"].items()}
            )
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
            "confirmation": _confirmed(row),
            "first": (row["first"] or {}).get("channel", ""),
            **{key: (row["first"] or {}).get(key) for key in ("time", "difference", "threshold", "unit")},
            "reason": (row.get("confirmation") or {}).get("sentence") or row["reason"],
        }
        for trial, row in results.faults
    )


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    counts = [count(rows) for _, rows in results.without_fault]
    tried = fault_rows(results)
    alarms, decided = (sum(one[key] for one in counts) for key in ("alarms", "decided"))
    healthy = Counter(row["verdict"] for row in results.healthy)
    return {
        "finding": f"{alarms} false alarms in {decided} decided comparisons; "
        f"{tried['detected'].sum()} of {len(tried)} faults detected.",
        "detected": "; ".join(
            f"{sum(hits)} of {len(hits)} at the {tier} tier "
            f"({' to '.join(map(share, interval(sum(hits), len(hits))))} at 95 %)"
            for tier, hits in results.detections.items()
        ),
        "overview": rows_table(
            {"comparison": label} | _counted(rows) for label, rows in results.without_fault
        ),
        "machine": made_on(),
        "scenes": ", ".join(f"`{name}`" for name in draws.scenes_with_clearance()),
        "moved": share(draws.SHARE),
        "wanted": " and ".join(f"{kind.draws} at the {kind.tier} tier" for kind, _ in results.both),
        "most": f"{draws.MOST:g}",
        "seed": draws.SEED,
        "rounding": rows_table(
            {"comparison": kind.label, "rounding": variant.name} | _counted(rows)
            for kind, drawn in results.both
            for variant, rows in drawn.items()
        ),
        "unused": "; ".join(
            f"{variant.name} ({', '.join(same)})"
            for variant in results.bits
            if (same := [tier for tier in TIERS if variant not in draws.effective(results.bits, tier)])
        )
        or "none",
        "listed": _listed(comparisons(results)),
        "controls": ", ".join(f"{times} times {verdict}" for verdict, times in healthy.items()),
        "faults": _by_place(tried),
        "missed": _missed(results.faults),
        "least": number(LEAST, 1),
        "largest": number(MOST, 1),
        "smallest": table(
            ("number", *map(_place, draws.PLACES)),
            [[name, *map(_change, rows)] for name, rows in results.smallest.items()],
        ),
        **{name: f"{low:g} to {high:g}" for name, (low, high) in records()["own_ranges"].items()},
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


def _listed(lines: pd.DataFrame) -> str:
    plain = lines["verdict"].isin(["agree", "indeterminate"]) & (lines["ensembles"] == "")
    shown = [
        f"- {row['comparison']}{row['rounding'] and ', '}{row['rounding']}, draw {row['draw']} "
        f"({row['scene']}): {row['verdict']}: {row['reason']}."
        for row in lines[~plain].to_dict("records")
    ]
    return "\n".join(shown) or "There was none."


def _by_place(tried: pd.DataFrame) -> str:
    groups = tried.groupby(["kind", "model", "tier"], sort=False)["detected"].agg(["sum", "count"])
    return crossed(
        "fault in the",
        [_KINDS[kind] for kind, *_ in groups.index],
        [_place((model, tier)) for _, model, tier in groups.index],
        [f"{hits} of {count}" for hits, count in groups.to_numpy()],
    )


def _missed(faults: Sequence[tuple[Trial, Row]]) -> str:
    lines = [
        f"- {trial.fault.name} ({trial.model}): {trial.fault.missed or 'not expected'}."
        for trial, row in faults
        if trial.tier == "tight" and not trial.detected(row)
    ]
    return "\n".join(["Missed at the tight tier:", "", *lines]) if lines else "None is missed."


def _change(row: Row) -> str:
    """Return the smallest change that is detected; in brackets the one that is shown, if that is smaller."""
    detected, shown = (MISSING if row[key] is None else number(row[key], 2) for key in ("found", "shown"))
    return detected if detected == shown else f"{detected} ({shown})"


def _place(place: tuple[str, str]) -> str:
    return f"{'Exudyn' if place[0] == 'exudyn' else place[0]}, {place[1]}"


def write(results: Results, folder: Path) -> None:
    """Draw the smallest detectable change of each number; write the long tables."""
    comparisons(results).to_csv(folder / "comparisons.csv", index=False)
    fault_rows(results).to_csv(folder / "faults.csv", index=False)
    names = list(results.smallest)
    found = [[row["found"] for row in rows] for rows in results.smallest.values()]
    marks = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.FIRST))  # of the `draws.PLACES`
    with svg.panels(folder / "smallest.svg", height=1.2 + 0.26 * len(names)) as (axes,):
        axes.set(xscale="log", xlim=(LEAST, 2.0 * MOST), ylim=(len(names) - 0.5, -0.5))
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("smallest detectable relative change (-)")
        changes = np.array(found, dtype=np.float64).T
        for place, (mark, colour), x in zip(draws.PLACES, marks, changes, strict=True):
            axes.plot(x, range(x.size), mark, color=colour, mfc="none", ms=5, label=_place(place))
        svg.legend_above(axes)


STUDY = Study("detection", small=False, full=True, measure=measure, page=page, draw=write, data=record)
