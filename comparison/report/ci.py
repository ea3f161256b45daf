"""Verdicts for continuous integration: JUnit XML for test reporters, Markdown for the summary of a job.

JUnit XML has no standard. The common subset is written: ``testsuites`` with one ``testsuite`` per scene and
one ``testcase`` per check, which may contain one ``failure``, ``error`` or ``skipped`` with a ``message``.
"""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from comparison.files import replacing
from comparison.formatting import table
from comparison.words.cases import Case

LIMIT = 1_000_000
"""Bytes of a summary. GitHub does not show one larger than 1 MiB."""
_RESERVE = 500  # bytes for a table's heading and the sentence about what is left out
_CHILD = {"failed": "failure", "error": "error", "skipped": "skipped"}
_SIGNS = {"failed": "✗", "error": "!"}
# Characters that XML 1.0 excludes (section 2.2), escaped or not; a message may quote any of them.
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
# Also addresses, which GitHub makes links of. An underscore within a word is one.
_MARKUP = re.compile(r"[\\`*\[\]~]|(?<![^\W_])_|_(?![^\W_])|(?<=http):|(?<=https):|(?<!\S)[#@](?=\S)")


def write_junit(cases: Sequence[Case], path: Path, *, name: str) -> Path:
    """Write the checks as JUnit XML, atomically.

    Parameters
    ----------
    cases
        In any order; suites are ordered by their first case.
    path
        The file; its folder is created.
    name
        Name of the whole, the command that checked.
    """
    root = ET.Element("testsuites", {"name": _xml(name), **_counts(cases)})
    for suite in dict.fromkeys(case.suite for case in cases):
        inside = [case for case in cases if case.suite == suite]
        element = ET.SubElement(root, "testsuite", {"name": _xml(suite), **_counts(inside)})
        for case in inside:
            # Report viewers group by the dots of the class name; those of a scene's name ("90rpm-0.1mm")
            # must not count.
            place = {"classname": _xml(f"{suite.replace('.', '_')}.{case.group}"), "name": _xml(case.name)}
            check = ET.SubElement(element, "testcase", place)
            if case.status in _CHILD:
                child = ET.SubElement(check, _CHILD[case.status], {"message": _xml(case.message)})
                if case.status != "skipped":  # some viewers show the text, others the attribute
                    child.set("type", case.status)
                    child.text = _xml(case.message)
    ET.indent(root)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        ET.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)
    return path


def _counts(cases: Sequence[Case]) -> dict[str, str]:
    statuses = [case.status for case in cases]
    return {
        "tests": str(len(statuses)),
        "failures": str(statuses.count("failed")),
        "errors": str(statuses.count("error")),
        "skipped": str(statuses.count("skipped")),
    }


def _xml(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)


def write_job_summary(
    path: Path,
    *,
    title: str,
    sentences: Sequence[str],
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    cases: Sequence[Case],
) -> Path:
    """Write the Markdown summary atomically, with at most `LIMIT` bytes.

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
        The checks; those that failed are listed.
    """
    parts = [f"# {_markdown(title)}", *map(_markdown, sentences)]
    shown, left = _fitting(rows, parts)
    parts.append(table(headings, shown))
    failed = [
        (case.suite, case.group, case.name, f"{_SIGNS[case.status]} {case.message}")
        for case in cases
        if case.status in _SIGNS
    ]
    if left:
        parts.append(f"{left} more rows and all details are omitted: the page would be too long.")
    elif failed:
        parts.append("## Failed checks")
        shown, left = _fitting(failed, parts)
        parts.append(table(("scene", "what", "item", "result"), shown))
        if left:
            parts.append(f"{left} more are omitted: the page would be too long.")
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(_joined(parts), "utf-8")
    return path


def _joined(parts: Sequence[str]) -> str:
    return "\n\n".join(parts) + "\n"


def _fitting(rows: Sequence[Sequence[str]], before: Sequence[str]) -> tuple[list[list[str]], int]:
    """Return the first rows that fit below what stands before, escaped, and how many do not."""
    room = LIMIT - _RESERVE - len(_joined(before).encode())
    escaped = [[_markdown(cell) for cell in row] for row in rows]
    kept = 0
    for row in escaped:
        room -= sum(len(cell.replace("|", r"\|").encode()) + 3 for cell in row) + 2
        if room < 0:
            break
        kept += 1
    return escaped[:kept], len(escaped) - kept


def _markdown(text: str) -> str:
    """Return a text in one line, without what would be taken for HTML or Markdown (an image, a link)."""
    plain = html.escape(" ".join(text.split()), quote=False)
    return _MARKUP.sub(r"\\\g<0>", plain)
