"""The tables of the campaign's page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from comparison.execution.store import Row
from comparison.formatting import MISSING, number, percent, quantity
from comparison.models import MODELS
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.stages import COMPARED, DIFFER, OUTCOMES, UNDERESTIMATED
from comparison.studies.detection.rates import share, upper_limit
from comparison.studies.shared.frames import largest, rows_table
from comparison.tables.channels import CONTACTS, channels

Found = Sequence[tuple[Case, Row]]
"""The scenes with what was found."""
STAGES = ("single runs", "families", "confirmation", "adjudication")


def counts(found: Found) -> str:
    """Return the outcomes by the joints that have clearance, with how far the scenes came."""
    groups: dict[str, list[Row]] = {"all": [row for _, row in found]}
    for case, row in found:
        groups.setdefault(_joints(case), []).append(row)
    return rows_table(
        {"clearance at": name, "scenes": str(len(own))}
        | {outcome: str(sum(row["outcome"] == outcome for row in own)) for outcome in OUTCOMES}
        | {"families of runs compared": str(sum(row["stage"] == COMPARED for row in own))}
        for name, own in groups.items()
    )


def _joints(case: Case) -> str:
    joints = case.scene.data["joints"]
    loose = [name.replace("_", " ") for name in ("slider", "crank_pin") if joints[name] == "clearance"]
    return " and ".join(loose)


def _listed(rows: Iterable[Mapping[str, str]]) -> str:
    return rows_table(rows) or "There was none."


def differences(found: Found) -> str:
    """Return one row a scene that differs, with who errs and why."""
    rows = []
    for case, row in found:
        if row["outcome"] == DIFFER:
            of, confirmation = row["adjudication"], row["confirmation"]
            apart = quantity(of["apart"], channels()[of["channel"]].unit, 2)
            rows.append(
                {
                    "scene": str(case.number),
                    "seen from": f"{of['time']:.6g} s",
                    "contact": contacts(of["missing"]) or "the same in both",
                    "apart by": f"{of['channel']}: {apart}",
                    "claim": "" if confirmation is None else confirmation["outcome"],
                    "errs": f"**{of['errs']}**",
                    "why": of["why"],
                }
            )
    return _listed(rows)


def contacts(missing: Sequence[dict[str, Any]]) -> str:
    """Name the first contacts that one model has alone, at most two of them."""
    first = sorted(missing, key=lambda one: one["start"])[:2]
    return "; ".join(
        f"{CONTACTS[one['corner']]}, {one['start']:.6g} to {one['end']:.6g} s, not in the {one['lacks']} run"
        for one in first
    )


def opinions(found: Found) -> str:
    """Return on which side the third opinions stand, with their distances, one row a scene and side."""
    rows = []
    for case, row in found:
        of = row["adjudication"] or {"evidence": []}
        for side in (*MODELS, ""):
            own = [one for one in of["evidence"] if one["stands"] == side and one["distances"]]
            if own:
                unit = channels()[of["channel"]].unit
                line = {"scene": str(case.number), "stand with": side or "neither", "how many": str(len(own))}
                line["which"] = "; ".join(one["name"] for one in own)
                for model, *distances in zip(MODELS, *(one["distances"] for one in own), strict=True):
                    ends = (quantity(end, unit, 2) for end in (min(distances), max(distances)))
                    line[f"distance from {model}"] = " to ".join(ends)
                rows.append(line)
    return _listed(rows)


def underestimated(found: Found) -> str:
    """Return one row a scene whose uncertainty had been too small."""
    return _listed(
        {
            "scene": str(case.number),
            "factor": number(confirmation["factor"], 2),
            "what the ensembles say": confirmation["sentence"],
        }
        for case, row in found
        if row["outcome"] == UNDERESTIMATED and (confirmation := row["confirmation"]) is not None
    )


def not_decided(found: Found, outcome: str) -> str:
    """Return the scenes of an outcome in which nothing was decided, with the reason."""
    return _listed(
        {
            "scene": str(case.number),
            "clearance at": _joints(case),
            "samples predictable": MISSING if row["coverage"] is None else percent(row["coverage"]),
            "reason": row["reason"],
        }
        for case, row in found
        if row["outcome"] == outcome
    )


def failures(found: Found) -> str:
    """Return the runs that did not succeed, by model, status and kind of run."""
    where: dict[tuple[str, str, str], list[str]] = {}
    for case, row in found:
        for one in row["failures"]:
            status = ", ".join((one["status"], *one["invariants"]))
            where.setdefault((one["model"], status, one["kind"]), []).append(str(case.number))
    return _listed(
        {"model": model, "status": status, "run": kind, "how many": str(len(scenes)), "scenes": _some(scenes)}
        for (model, status, kind), scenes in sorted(where.items())
    )


def breaches(found: Found) -> str:
    """Return what tables show against their own model, by model and kind."""
    shown = pd.DataFrame(
        [
            {"model": model, "scene": case.number, **one}
            for case, row in found
            for model, of in row["breaches"].items()
            for one in of
        ],
        columns=["model", "scene", "name", "corner", "time", "value", "bound"],
    )
    rows = []
    for (model, name), of in shown.groupby(["model", "name"]):
        worst, unit = largest(of, "value"), "s" if name == "overlap" else "m"
        rows.append(
            {
                "model": str(model),
                "invariant": str(name),
                "scenes": str(of["scene"].nunique()),
                "largest": quantity(worst["value"], unit),
                "bound": quantity(worst["bound"], unit),
                "where": f"scene {worst['scene']}, {CONTACTS[worst['corner']]}, {worst['time']:.6g} s",
            }
        )
    return _listed(rows)


def drawn(found: Found) -> str:
    """Return what the families say where the single runs alone would not have asked for them."""
    only = [row for case, row in found if case.family and _would_stop(row)]
    differing = sum(row["outcome"] == DIFFER for row in only)
    return (
        f"{len(only)} scenes were compared only because they were drawn; {differing} of them differ. So the "
        f"cheap look overlooks a difference in less than {share(upper_limit(differing, len(only)))} of the "
        "scenes that it passes (one-sided exact 95 % limit)."
    )


def _would_stop(row: Row) -> bool:
    return row["stage"] == COMPARED and not row["screening"]["parted"] and not any(row["breaches"].values())


def seconds(found: Found) -> str:
    """Return the processor time by stage."""
    spent = pd.DataFrame([row["seconds"] for _, row in found], columns=list(STAGES)).dropna(axis=1, how="all")
    return rows_table(
        {
            "stage": str(stage),
            "scenes": str(of.count()),
            "processor time a scene": quantity(of.mean(), "s"),
            "altogether": f"{of.sum() / 60.0:.1f} min",
        }
        for stage, of in spent.items()
    )


def _some(numbers: Iterable[str], most: int = 12) -> str:
    listed = list(dict.fromkeys(numbers))
    more = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + more
