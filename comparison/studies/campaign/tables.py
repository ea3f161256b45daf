"""The tables of the campaign's page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from comparison.execution.ledger import Row
from comparison.execution.run import MODELS
from comparison.formatting import MISSING, number, percent, quantity, table
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.stages import COMPARED, DIFFER, OUTCOMES, UNDERESTIMATED
from comparison.studies.detection.rates import share, upper_limit
from comparison.tables.channels import CONTACTS, channels

Found = Sequence[tuple[Case, Row]]
NONE = "There was none."


def counts(found: Found) -> str:
    """Return the outcomes by the joints that have clearance, with how far the scenes came."""
    groups: dict[str, list[Row]] = {"all": [row for _, row in found]}
    for case, row in found:
        groups.setdefault(_joints(case), []).append(row)
    rows = [
        [
            name,
            str(len(own)),
            *(str(sum(row["outcome"] == outcome for row in own)) for outcome in OUTCOMES),
            str(sum(row["stage"] == COMPARED for row in own)),
        ]
        for name, own in groups.items()
    ]
    return table(("clearance at", "scenes", *OUTCOMES, "families of runs compared"), rows)


def _joints(case: Case) -> str:
    joints = case.scene.data["joints"]
    with_clearance = [
        name.replace("_", " ") for name in ("slider", "crank_pin") if joints[name] == "clearance"
    ]
    return " and ".join(with_clearance)


def differences(found: Found) -> str:
    """Return one row a scene that differs, with who errs and why."""
    rows = []
    for case, row in found:
        if row["outcome"] != DIFFER:
            continue
        of, reported = row["adjudication"], row["confirmation"]
        unit = channels()[of["channel"]].unit
        rows.append(
            [
                str(case.number),
                f"{of['time']:.6g} s",
                contacts(of["missing"]) or "the same in both",
                f"{of['channel']}: {quantity(of['apart'], unit, 2)}",
                "" if reported is None else reported["outcome"],
                f"**{of['errs']}**",
                of["why"],
            ]
        )
    headings = ("scene", "seen from", "contact", "apart by", "claim", "errs", "why")
    return table(headings, rows) if rows else NONE


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
        if row["adjudication"] is None:
            continue
        of = row["adjudication"]
        unit = channels()[of["channel"]].unit
        for side in (*MODELS, ""):
            own = [one for one in of["evidence"] if one["stands"] == side and one["distances"]]
            if not own:
                continue
            ends = [
                f"{quantity(min(distances), unit, 2)} to {quantity(max(distances), unit, 2)}"
                for distances in zip(*(one["distances"] for one in own), strict=True)
            ]
            names = "; ".join(one["name"] for one in own)
            rows.append([str(case.number), side or "neither", str(len(own)), names, *ends])
    headings = ("scene", "stand with", "how many", "which", *(f"distance from {model}" for model in MODELS))
    return table(headings, rows) if rows else NONE


def underestimated(found: Found) -> str:
    """Return one row a scene whose uncertainty had been too small."""
    rows = [
        [str(case.number), number(reported["factor"], 2), reported["sentence"]]
        for case, row in found
        if row["outcome"] == UNDERESTIMATED and (reported := row["confirmation"]) is not None
    ]
    return table(("scene", "factor", "what the ensembles say"), rows) if rows else NONE


def not_decided(found: Found, outcome: str) -> str:
    """Return the scenes of an outcome in which nothing was decided, with the reason."""
    rows = [
        [
            str(case.number),
            _joints(case),
            MISSING if row["coverage"] is None else percent(row["coverage"]),
            row["reason"],
        ]
        for case, row in found
        if row["outcome"] == outcome
    ]
    return table(("scene", "clearance at", "samples predictable", "reason"), rows) if rows else NONE


def failures(found: Found) -> str:
    """Return the runs that did not succeed, by model, status and kind of run."""
    where: dict[tuple[str, str, str], list[str]] = {}
    for case, row in found:
        for one in row["failures"]:
            status = one["status"] + "".join(f", {name}" for name in one["invariants"])
            where.setdefault((one["model"], status, one["kind"]), []).append(str(case.number))
    rows = [[*which, str(len(numbers)), _some(numbers)] for which, numbers in sorted(where.items())]
    return table(("model", "status", "run", "how many", "scenes"), rows) if rows else NONE


def breaches(found: Found) -> str:
    """Return what tables show against their own model, by model and kind."""
    worst: dict[tuple[str, str], tuple[float, Case, dict[str, Any]]] = {}
    scenes: Counter[tuple[str, str]] = Counter()
    for case, row in found:
        for model, shown in row["breaches"].items():
            for name in {one["name"] for one in shown}:
                scenes[model, name] += 1
            for one in shown:
                key = (model, one["name"])
                if key not in worst or one["value"] > worst[key][0]:
                    worst[key] = one["value"], case, one
    rows = []
    for (model, name), (value, case, one) in sorted(worst.items()):
        unit = "s" if name == "overlap" else "m"
        place = f"scene {case.number}, {CONTACTS[one['corner']]}, {one['time']:.6g} s"
        rows.append(
            [
                model,
                name,
                str(scenes[model, name]),
                quantity(value, unit),
                quantity(one["bound"], unit),
                place,
            ]
        )
    headings = ("model", "invariant", "scenes", "largest", "bound", "where")
    return table(headings, rows) if rows else NONE


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
    total: Counter[str] = Counter()
    for _, row in found:
        total.update(row["seconds"])
    scenes = Counter(stage for _, row in found for stage in row["seconds"])
    rows = [
        [
            stage,
            str(scenes[stage]),
            quantity(total[stage] / scenes[stage], "s"),
            f"{total[stage] / 60.0:.1f} min",
        ]
        for stage in ("single runs", "families", "confirmation", "adjudication")
        if scenes[stage]
    ]
    return table(("stage", "scenes", "processor time a scene", "altogether"), rows)


def _some(numbers: Iterable[str], most: int = 12) -> str:
    listed = list(dict.fromkeys(numbers))
    more = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + more
