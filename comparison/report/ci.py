"""Verdicts for continuous integration: JUnit XML for test reporters, Markdown for the summary of a job."""

import html
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from comparison.files import replacing, write_text
from comparison.formatting import table
from comparison.words.record import Case

MOST = 200
"""Most failed checks in a summary: GitHub shows no summary larger than 1 MiB."""
_CHILD = {"failed": "failure", "error": "error", "skipped": "skipped"}
_SIGNS = {"failed": "✗", "error": "!"}
# Characters that XML 1.0 excludes (section 2.2), escaped or not; a message may quote any of them.
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
# Addresses, too: GitHub makes links of them. An underscore within a word stays.
_MARKUP = re.compile(r"[\\`*\[\]~]|(?<![^\W_])_|_(?![^\W_])|(?<=http):|(?<=https):|(?<!\S)[#@](?=\S)")


def write_junit(cases: Sequence[Case], path: Path, *, name: str) -> None:
    """Write checks as JUnit XML that every viewer reads; suites are in the order of their first case."""

    def element(parent: ET.Element | None, tag: str, inside: Sequence[Case] = (), **texts: str) -> ET.Element:
        status = Counter(case.status for case in inside)
        counts = {"failures": status["failed"], "errors": status["error"], "skipped": status["skipped"]}
        numbers = {"tests": len(inside)} | counts if inside or parent is None else {}
        attributes = {key: _NO_XML.sub("\ufffd", str(value)) for key, value in (texts | numbers).items()}
        return ET.Element(tag, attributes) if parent is None else ET.SubElement(parent, tag, attributes)

    root = element(None, "testsuites", cases, name=name)
    for suite in dict.fromkeys(case.suite for case in cases):
        inside = [case for case in cases if case.suite == suite]
        parent = element(root, "testsuite", inside, name=suite)
        for case in inside:
            # Viewers group by the dots of the class name; those of "90rpm-0.1mm" must not count.
            place = f"{suite.replace('.', '_')}.{case.group}"
            check = element(parent, "testcase", classname=place, name=case.name)
            if case.status in _CHILD:
                child = element(check, _CHILD[case.status], message=case.message)
                if case.status != "skipped":  # some viewers show the text, others the attribute
                    child.set("type", case.status)
                    child.text = child.get("message")
    ET.indent(root)
    with replacing(path) as part:
        ET.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)


def write_job_summary(
    path: Path,
    *,
    title: str,
    sentences: Sequence[str],
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    cases: Sequence[Case],
) -> None:
    """Write the Markdown summary: sentences, table of verdicts, at most `MOST` failed checks."""
    failures = [
        (case.suite, case.group, case.name, f"{_SIGNS[case.status]} {case.message}")
        for case in cases
        if case.status in _SIGNS
    ]
    parts = [f"# {_markdown(title)}", *map(_markdown, sentences), _table(headings, rows)]
    if failures:
        parts += ["## Failed checks", _table(("scene", "what", "item", "result"), failures[:MOST])]
    if len(failures) > MOST:
        parts.append(f"{len(failures) - MOST} more failed checks are omitted.")
    write_text("\n\n".join(parts) + "\n", path)


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return table(headings, [[_markdown(cell) for cell in row] for row in rows])


def _markdown(text: str) -> str:
    """Return a text in one line, with an escape before characters that HTML or Markdown interpret."""
    line = html.escape(" ".join(text.split()), quote=False)
    return _MARKUP.sub(r"\\\g<0>", line)
