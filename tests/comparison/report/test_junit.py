"""JUnit XML: what its readers need, and texts that would break it."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree as ET

from comparison.report.junit import write_junit
from comparison.words.cases import Case, of_comparisons

CASES = [
    Case("slow", "standard", "slider_x", "passed", "agree: 99.9 %"),
    Case("90rpm-0.1mm", "tight", "slider_y", "failed", 'at <t> = 1 s & "more"\x00\x1b[31m \ud800'),
    Case("slow", "standard", "slider_angle", "skipped", "unexcited"),
    Case("slow", "tight", "run", "error", "the process died"),
]


def counted(element: ET.Element) -> tuple[int, ...]:
    return tuple(int(element.get(key)) for key in ("tests", "failures", "errors", "skipped"))


def test_a_suite_a_scene_a_case_a_finding_and_counts_that_add_up(tmp_path):
    root = ET.parse(write_junit(CASES, tmp_path / "deep" / "junit.xml", name="sixbar gate")).getroot()
    assert (root.tag, root.get("name"), counted(root)) == ("testsuites", "sixbar gate", (4, 1, 1, 1))
    suites = root.findall("testsuite")
    assert [(suite.get("name"), counted(suite)) for suite in suites] == [
        ("slow", (3, 0, 1, 1)),
        ("90rpm-0.1mm", (1, 1, 0, 0)),
    ]
    cases = [case for suite in suites for case in suite]
    assert [case.tag for case in cases] == ["testcase"] * 4
    assert [[child.tag for child in case] for case in cases] == [[], ["skipped"], ["error"], ["failure"]]
    assert len({(case.get("classname"), case.get("name")) for case in cases}) == 4
    assert cases[3].get("classname") == "90rpm-0_1mm.tight"
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["junit.xml"]


def test_a_text_with_markup_and_control_characters_survives_as_far_as_xml_can_hold_it(tmp_path):
    path = write_junit(CASES, tmp_path / "junit.xml", name="a & b")
    (failure,) = ET.parse(path).getroot().iter("failure")
    assert failure.get("message") == failure.text == 'at <t> = 1 s & "more"\ufffd\ufffd[31m \ufffd'
    assert b"<t>" not in path.read_bytes()


def test_verdicts_of_scenes_and_channels_are_cases_at_every_tier(scene, differing, broken, tmp_path):
    both = replace(scene, tight=replace(scene, tier="tight", verdict="indeterminate"))
    root = ET.parse(
        write_junit(of_comparisons([both, differing, broken]), tmp_path / "j.xml", name="v")
    ).getroot()
    count = len(scene.channels)
    assert [int(suite.get("tests")) for suite in root] == [2 * (1 + count), 1 + count, 1]
    verdicts = [case for case in root.iter("testcase") if case.get("name") == "verdict"]
    assert [[child.tag for child in case] for case in verdicts] == [[], ["skipped"], ["failure"], ["error"]]
    assert verdicts[2][0].get("message") == f"differ: {differing.reason}"
    failed = [case.get("name") for case in root.iter("testcase") if case.find("failure") is not None]
    assert failed == ["verdict", *(n for n, c in differing.channels.items() if c.verdict == "differ")]
    skipped = [c.verdict for c in differing.channels.values() if c.verdict in ("indeterminate", "unexcited")]
    assert int(root[1].get("skipped")) == len(skipped) > 0
