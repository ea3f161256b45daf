"""Lines that fit the terminal, or 80 columns in a file: aligned columns, wrapped sentences, colours."""

from __future__ import annotations

import os
import shutil
import textwrap
import unicodedata
from collections.abc import Callable, Collection, Mapping, Sequence

import typer

_GAP = "  "
_COLOURS = {
    "agree": "green",
    "differ": "red",
    "cannot compare": "red",
    "indeterminate": "yellow",
    "undecided": "yellow",
}


_HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories of what a terminal would obey instead of showing it."""


def width() -> int:
    """Return the columns of the terminal, or ``$COLUMNS``; 80 where stdout is a file or a pipe."""
    return shutil.get_terminal_size((80, 24)).columns


def printable(text: str) -> str:
    r"""Escape what is not shown by itself: ``\x1b``."""
    return "".join(
        character.encode("unicode_escape").decode()
        if character not in "\n\t" and unicodedata.category(character) in _HIDDEN
        else character
        for character in text
    )


def coloured(text: str, verdict: str) -> str:
    """Return a text in the colour of a verdict; plain where ``$NO_COLOR`` is set. A file gets no colours."""
    colour = None if os.environ.get("NO_COLOR") else _COLOURS.get(verdict.strip())
    return text if colour is None else typer.style(text, fg=colour)


def columns(
    rows: Sequence[Sequence[str]],
    *,
    right: Collection[int] = (),
    paint: Mapping[int, Callable[[str], str]] | None = None,
    available: int | None = None,
) -> list[str]:
    """Return rows as aligned lines that are no longer than the terminal is wide.

    Columns that do not fit are left out from the right; of the last one that is shown, text is cut.

    Parameters
    ----------
    rows
        Cells, as many in each row, the headings among them; the most important columns first.
    right
        Columns aligned to the right; these are never cut.
    paint
        Column -> what colours a cell, at its full width.
    available
        Columns of the terminal; default: `width`.
    """
    limit = width() if available is None else available
    rows = [[printable(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    shown, used = 0, -len(_GAP)
    for number, wide in enumerate(widths):
        heading = len(rows[0][number])
        least = wide if number in right else min(wide, max(heading, 8))
        if shown and used + len(_GAP) + least > limit:
            break
        shown, used = number + 1, used + len(_GAP) + wide
        if used > limit:
            widths[number] -= used - limit
            break
    lines = []
    for row in rows:
        cells = [
            _cut(cell, wide).rjust(wide) if number in right else _cut(cell, wide).ljust(wide)
            for number, (cell, wide) in enumerate(zip(row[:shown], widths[:shown], strict=True))
        ]
        while cells and not cells[-1].strip():
            cells.pop()
        if cells:
            cells[-1] = cells[-1].rstrip()
        painted = [(paint or {}).get(number, str)(cell) for number, cell in enumerate(cells)]
        lines.append(_GAP.join(painted))
    return lines


def wrapped(text: str, *, first: str = "", rest: str | None = None) -> list[str]:
    """Return a text as lines no longer than the terminal is wide; names and paths are not broken.

    Parameters
    ----------
    text
        One line.
    first, rest
        What the first line and the others begin with; by default the others are indented alike.
    """
    return textwrap.wrap(
        printable(text),
        max(width(), 40),
        initial_indent=first,
        subsequent_indent=" " * len(first) if rest is None else rest,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _cut(cell: str, wide: int) -> str:
    return cell if len(cell) <= wide else cell[: max(0, wide - 3)].rstrip() + "..."
