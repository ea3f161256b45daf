"""The study's tables: how many of which class, where the models differ, and every run in a CSV."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import isfinite, isnan
from pathlib import Path

import pandas as pd

from comparison.files import replacing
from comparison.formatting import MISSING, number, quantity, table
from comparison.studies.extremes.differences import bases
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Class
from comparison.studies.extremes.reasons import reason
from comparison.studies.extremes.ways import WAYS


def counts(found: Sequence[Found]) -> str:
    """Return how many runs of each formulation ended in each class."""
    kinds = list(Class)
    rows = []
    for way in WAYS:
        total = Counter(of.verdicts[way.name].kind for of in found if way.name in of.verdicts)
        rows.append([f"{way.model}, {way.name}", *(str(total[kind]) for kind in kinds), str(total.total())])
    return table(("formulation", *map(str, kinds), "runs"), rows)


def stops(found: Sequence[Found]) -> str:
    """Return the statuses of what stopped: how often by which formulation, and what they say to try."""
    seen: dict[tuple[str, str, str], int] = {}
    for of in found:
        for way in WAYS:
            if way.name in of.rows and of.verdicts[way.name].kind is Class.STOPPED:
                row = of.rows[way.name]
                message = "" if row["message"].startswith(("broken off", "not started")) else row["message"]
                said = message or "(the study's limit of time)"
                key = (f"{way.model}, {way.name}", row["status"], said)
                seen[key] = seen.get(key, 0) + 1
    return table(
        ("formulation", "status", "what it says to try", "runs"),
        [[*key, str(count)] for key, count in sorted(seen.items())],
    )


def drifts(found: Sequence[Found]) -> str:
    """Return the largest energy from nowhere and violation of a constraint, by formulation and class."""
    rows = []
    for way in WAYS:
        for kind in (Class.CONVERGED, Class.DEGRADED):
            energy, drift = (
                [
                    (value, of)
                    for of in found
                    if way.name in of.verdicts
                    and of.verdicts[way.name].kind is kind
                    and (value := of.rows[way.name].get(key)) is not None
                ]
                for key in ("energy", "drift")
            )
            if energy or drift:
                rows.append(
                    [f"{way.model}, {way.name}", str(kind), *_largest(energy, ""), *_largest(drift, "m")]
                )
    return table(
        (
            "formulation",
            "class",
            "energy from nowhere over the dissipated",
            "where",
            "constraint's violation",
            "where",
        ),
        rows,
    )


def _largest(values: Sequence[tuple[float, Found]], unit: str) -> tuple[str, str]:
    if not values:
        return MISSING, ""
    value, of = max(values, key=lambda pair: pair[0])
    where = f"{of.cell.axis} {of.cell.label}, {of.cell.law}"
    return (quantity(value, unit, 2) if unit else number(value, 2)), where


def turns(found: Sequence[Found]) -> str:
    """Return the long runs: what they cost and what drifts."""
    rows = []
    for of in found:
        if of.cell.axis != "turns":
            continue
        for way in WAYS:
            if way.name in of.rows:
                row = of.rows[way.name]
                rows.append(
                    [
                        of.cell.label,
                        f"{way.model}, {way.name}",
                        row["status"],
                        *(
                            _known(row.get(key), unit)
                            for key, unit in (("steps", ""), ("energy", ""), ("drift", "m"))
                        ),
                        str(row.get("contacts", {}).get("count", MISSING)),
                    ]
                )
    return table(
        (
            "turns",
            "formulation",
            "status",
            "steps",
            "energy from nowhere over the dissipated",
            "constraint's violation",
            "contacts",
        ),
        rows,
    )


def _known(value: float | None, unit: str) -> str:
    if value is None:
        return MISSING
    return quantity(value, unit, 2) if unit else (str(value) if isinstance(value, int) else number(value, 2))


def write_rows(found: Sequence[Found], path: Path) -> None:
    """Write every run as a row of a CSV: what was asked, its class, error, drifts, work and reason."""
    by_law = bases(found)
    rows = []
    for of in found:
        for way in WAYS:
            if way.name not in of.verdicts:
                continue
            verdict, row = of.verdicts[way.name], of.rows[way.name]
            rows.append(
                {
                    "axis": of.cell.axis,
                    "value": of.cell.label,
                    "law": of.cell.law,
                    "model": way.model,
                    "formulation": way.name,
                    "class": str(verdict.kind),
                    "error_m": _rounded(verdict.error),
                    "promise_m": verdict.promise,
                    "lasted_turns": verdict.lasted,
                    "magnification": _rounded(of.magnification),
                    "energy_share": _rounded(row.get("energy")),
                    "constraint_m": _rounded(row.get("drift")),
                    "steps_per_contact": _rounded(row.get("resolution")),
                    "contacts": row.get("contacts", {}).get("count"),
                    "largest_force_N": _rounded(row.get("contacts", {}).get("force")),
                    "steps": row.get("steps"),
                    "work": row.get("work"),
                    "status": row["status"],
                    "reason": reason(of, way.name, by_law[of.cell.law]),
                }
                | ({"scene": " ".join(f"{k}={v}" for k, v in of.cell.changes.items())})
            )
    with replacing(path) as part:
        pd.DataFrame(rows).to_csv(part, index=False)


def _rounded(value: float | None) -> float | None:
    """Return three digits: what the machine's last bits do not change."""
    return None if value is None or isnan(value) else float(f"{value:.3g}") if isfinite(value) else value
