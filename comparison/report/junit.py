"""Findings as JUnit XML, for GitLab, Jenkins and the test reporters of GitHub Actions.

The format has no standard. The common subset is written: ``testsuites`` with one ``testsuite`` per scene and
one ``testcase`` per finding, which may contain one ``failure``, ``error`` or ``skipped`` with a ``message``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from comparison.files import replacing
from comparison.words.cases import Case

_CHILD = {"failed": "failure", "error": "error", "skipped": "skipped"}
# Characters that XML 1.0 excludes (section 2.2), escaped or not; a message may quote any of them.
_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(cases: Sequence[Case], path: Path, *, name: str) -> Path:
    """Write the findings atomically.

    Parameters
    ----------
    cases
        In any order; suites are ordered by their first case.
    path
        The file; its folder is created.
    name
        Name of the whole, the command that checked.
    """
    root = ET.Element("testsuites", {"name": _text(name), **_counts(cases)})
    for suite in dict.fromkeys(case.suite for case in cases):
        inside = [case for case in cases if case.suite == suite]
        element = ET.SubElement(root, "testsuite", {"name": _text(suite), **_counts(inside)})
        for case in inside:
            _add(element, case)
    ET.indent(root)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        ET.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)
    return path


def _add(suite: ET.Element, case: Case) -> None:
    # Report viewers group by the dots of the class name; those of a scene's name ("90rpm-0.1mm") must not
    # count.
    place = f"{case.suite.replace('.', '_')}.{case.group}"
    element = ET.SubElement(suite, "testcase", {"classname": _text(place), "name": _text(case.name)})
    if case.status in _CHILD:
        child = ET.SubElement(element, _CHILD[case.status], {"message": _text(case.message)})
        if case.status != "skipped":  # some viewers show the text, others the attribute
            child.set("type", case.status)
            child.text = _text(case.message)


def _counts(cases: Sequence[Case]) -> dict[str, str]:
    statuses = [case.status for case in cases]
    return {
        "tests": str(len(statuses)),
        "failures": str(statuses.count("failed")),
        "errors": str(statuses.count("error")),
        "skipped": str(statuses.count("skipped")),
    }


def _text(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)
