"""Names and units of columns, from the rows above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from comparison.tables.imports.units import parse

_INDEX = re.compile(r"\s*\d+\s*(?:,\s*\d+\s*)*")
_BRACKETS = re.compile(r"(?P<name>.*\S)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")


def names_and_units(titles: Sequence[Sequence[str]]) -> tuple[list[str], list[str | None]]:
    """Return the names of columns, and their units or None.

    Parameters
    ----------
    titles
        The last row or two above the numbers: names, or titles and names, or names and units.
    """
    named = [_split(field) for field in titles[-1]]
    below: list[str | None] = [None] * len(named)
    if len(titles) == 2 and _are_units(titles[-1]):
        named, below = [_split(field) for field in titles[0]], [_bare(field) for field in titles[1]]
    return [name for name, _ in named], [
        unit or beside for unit, (_, beside) in zip(below, named, strict=True)
    ]


def numbered(count: int) -> tuple[list[str], list[str | None]]:
    """Return names of columns by their position, and no units."""
    return [position(n) for n in range(count)], [None] * count


def position(n: int) -> str:
    """Return the name of a column by its position, counted from 0: ``#1`` for the first."""
    return f"#{n + 1}"


def _bare(field: str) -> str | None:
    """Return a unit without its brackets; None for an empty field."""
    return field.strip().strip("[]()").strip() or None


def _split(field: str) -> tuple[str, str | None]:
    """Return name and unit of ``x [mm]``, ``x (mm)`` or ``x``; ``r[1]`` and ``der(x)`` are names."""
    field = field.strip()
    found = _BRACKETS.fullmatch(field)
    attached = field.strip('"')[-1:] in "])" and not re.search(r"\s[\[(][^\[(]*$", field)
    if found is None:
        return field.strip('"'), None
    square, round_ = found["square"], found["round"]
    if attached and square is not None and _INDEX.fullmatch(square):
        return field.strip('"'), None
    if attached and square is None and (parse(round_ or "") is None or found["name"].endswith("der")):
        return field.strip('"'), None
    return found["name"].strip('"'), _bare(square or round_ or "")


def _are_units(fields: Sequence[str]) -> bool:
    """Whether a line below the names holds units: all in brackets, or at least one known."""
    if all(field[:1] in "[(" and field[-1:] in "])" for field in fields if field):
        return True
    return any(parse(field) is not None for field in fields)
