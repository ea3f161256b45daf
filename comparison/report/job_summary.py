"""Findings as Markdown for the summary of a CI job: a table of verdicts, then the failed checks."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from pathlib import Path

from comparison.files import replacing
from comparison.formatting import table
from comparison.words.cases import Case

LIMIT = 1_000_000
"""Bytes. GitHub does not show a step summary larger than 1 MiB."""

_SIGNS = {"failed": "✗", "error": "!"}
# Also addresses, which GitHub makes links of. An underscore within a word is one.
_MARKUP = re.compile(r"[\\`*\[\]~]|(?<![^\W_])_|_(?![^\W_])|(?<=http):|(?<=https):|(?<!\S)[#@](?=\S)")
_RESERVE = 500  # bytes for a table's heading and the sentence about what is left out


def write_job_summary(
    path: Path,
    *,
    title: str,
    sentences: Sequence[str],
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    cases: Sequence[Case],
) -> Path:
    """Write the summary atomically, with at most `LIMIT` bytes.

    Parameters
    ----------
    path
        The file; its folder is created.
    title
        Heading of the page.
    sentences
        Sentences below it: result and notes.
    headings, rows
        Of the table of verdicts.
    cases
        The findings; those that failed are listed.
    """
    text = _page(title, sentences, headings, rows, [case for case in cases if case.status in _SIGNS])
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(text, "utf-8")
    return path


def _page(
    title: str,
    sentences: Sequence[str],
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    failed: Sequence[Case],
) -> str:
    parts = [f"# {_text(title)}", *map(_text, sentences)]
    shown, left = _fitting(rows, _room(parts))
    parts.append(table(headings, shown))
    if left:
        return _joined([*parts, f"{left} more rows and all details are omitted: the page would be too long."])
    if failed:
        details = [
            (case.suite, case.group, case.name, f"{_SIGNS[case.status]} {case.message}") for case in failed
        ]
        parts.append("## Failed checks")
        shown, left = _fitting(details, _room(parts))
        parts.append(table(("scene", "what", "item", "finding"), shown))
    if left:
        parts.append(f"{left} more are omitted: the page would be too long.")
    return _joined(parts)


def _joined(parts: Sequence[str]) -> str:
    return "\n\n".join(parts) + "\n"


def _room(parts: Sequence[str]) -> int:
    return LIMIT - _RESERVE - len(_joined(parts).encode())


def _fitting(rows: Sequence[Sequence[str]], room: int) -> tuple[list[list[str]], int]:
    """Return the first rows that fit into so many bytes, escaped, and how many do not."""
    escaped = [[_text(cell) for cell in row] for row in rows]
    kept = 0
    for row in escaped:
        room -= sum(len(cell.replace("|", r"\|").encode()) + 3 for cell in row) + 2
        if room < 0:
            break
        kept += 1
    return escaped[:kept], len(escaped) - kept


def _text(text: str) -> str:
    """Return a text in one line, without what would be taken for HTML or Markdown (an image, a link)."""
    plain = html.escape(" ".join(text.split()), quote=False)
    return _MARKUP.sub(r"\\\g<0>", plain)
