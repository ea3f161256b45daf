"""Where the models' classes differ, and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from comparison.formatting import quantity, table
from comparison.studies.extremes.cells import BASE_LABEL, HYPERCUBE, LAWS
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Class, Verdict
from comparison.studies.extremes.reasons import UNEXPLAINED, Base, may_jam, reason
from comparison.studies.extremes.ways import BODIES, MINIMAL, TREE

_HEADINGS = ("reference, minimal", "exudyn, tree", "exudyn, five bodies")
_KINDS = (
    (UNEXPLAINED, UNEXPLAINED),
    ("no setting resolves", "no setting resolves what decides"),
    ("too coarse a setting", "too coarse a setting for the scene"),
    ("at the edge of stopping", "at the edge of stopping"),
    ("literal switch", "the literal switch creates energy"),
    ("steps", "few steps a contact"),
    ("magnifies", "the scene magnifies"),
    ("strict runs", "the strict runs differ too"),
    ("scatter", "scatter of single runs"),
)
"""What a reason says, and its kind."""


def bases(found: Sequence[Found]) -> dict[str, Base]:
    """Return what the cells of each law are compared with."""
    unchanged = {of.cell.law: of for of in found if of.cell.label == BASE_LABEL}
    promised = unchanged[LAWS[0]]
    return {law: Base(promised, unchanged.get(law, promised)) for law in LAWS}


def differing(found: Sequence[Found]) -> list[Found]:
    """Return the cells whose classes differ between the two models' usual formulations."""
    return [of for of in found if len({of.verdicts[name].kind for name in compared(of)}) > 1]


def compared(of: Found) -> list[str]:
    """Return the formulations whose classes are compared: the smallest of each model and the five bodies."""
    return [way.name for way in (MINIMAL, TREE, BODIES) if way.name in of.verdicts]


def along_the_axes(found: Sequence[Found]) -> str:
    """Return a table of the cells along the axes whose classes differ, with the reason of each."""
    by_law = bases(found)
    rows = [
        [of.cell.axis, of.cell.label, of.cell.law, *_classes(of, _short), _why(of, by_law[of.cell.law])]
        for of in differing(found)
        if of.cell.axis != HYPERCUBE
    ]
    return table(("axis", "value", "law", *_HEADINGS, "why"), rows)


def in_the_hypercube(found: Sequence[Found]) -> str:
    """Return the same of the hypercube, points with the same classes and endings together."""
    by_law = bases(found)
    groups: dict[tuple[str, ...], list[str]] = {}
    for of in differing(found):
        if of.cell.axis == HYPERCUBE:
            endings = [_ending(of, name, by_law[of.cell.law]) for name in compared(of)]
            key = (
                of.cell.law,
                *_classes(of, lambda verdict: str(verdict.kind)),
                "; ".join(filter(None, endings)),
            )
            groups.setdefault(key, []).append(of.cell.label)
    rows = [
        [*key, str(len(points)), " ".join(points)]
        for key, points in sorted(groups.items(), key=lambda item: (item[0][0], -len(item[1])))
    ]
    return table(("law", *_HEADINGS, "why", "points", "which"), rows)


def _ending(of: Found, name: str, base: Base) -> str:
    """Return the kind of a run's reason: without numbers of its own, so that points can be put together."""
    verdict, row = of.verdicts[name], of.rows[name]
    if verdict.kind is Class.STOPPED:
        started = "not started: too long" if row["message"].startswith("not started") else row["status"]
        return f"{name}: {started}" + (" (friction may jam it)" if may_jam(of) else "")
    if verdict.kind is Class.REFUSED:
        return f"{name}: " + (
            "tolerance too coarse" if "tolerance" in row["message"] else "no such mechanism"
        )
    why = reason(of, name, base)
    kind = next((words for mark, words in _KINDS if mark in why), "")
    return f"{name}: {kind}" if kind else ""


def _why(of: Found, base: Base) -> str:
    return ". ".join(f"{name}: {why}" for name in compared(of) if (why := reason(of, name, base)))


def _classes(of: Found, words: Callable[[Verdict], str]) -> list[str]:
    return [
        words(of.verdicts[way.name]) if way.name in of.verdicts else "" for way in (MINIMAL, TREE, BODIES)
    ]


def unexplained(found: Sequence[Found]) -> list[tuple[int, str]]:
    """Return the number of the cell and the way of each run whose class nothing explains."""
    by_law = bases(found)
    return [
        (number, name)
        for number, of in enumerate(found)
        for name in of.verdicts
        if UNEXPLAINED in reason(of, name, by_law[of.cell.law])
    ]


def listed(of: Found, name: str) -> str:
    """Return a run and its class in one line."""
    return f"{of.cell.axis} {of.cell.label}, {of.cell.law}, {name}: {_short(of.verdicts[name])}"


def _short(verdict: Verdict) -> str:
    if verdict.kind is not Class.DEGRADED:
        return str(verdict.kind)
    return f"degraded, {quantity(verdict.error, 'm', 2)}"
