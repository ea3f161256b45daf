"""What continuous integration reads: JUnit XML, and the Markdown summary of a job."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import pytest
from markdown_it import MarkdownIt

from comparison.report.ci import LIMIT, write_job_summary, write_junit
from comparison.verdict.results import Basis
from comparison.words.cases import Case, of_comparisons
from comparison.words.verdicts import why

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
    vague = replace(scene.channels["slider_x"], verdict="indeterminate", basis=Basis.COVERAGE)
    tight = replace(
        scene, tier="tight", verdict="indeterminate", channels=scene.channels | {"slider_x": vague}
    )
    both = replace(scene, tight=tight)
    root = ET.parse(
        write_junit(of_comparisons([both, differing, broken]), tmp_path / "j.xml", name="v")
    ).getroot()
    count = len(scene.channels)
    assert [int(suite.get("tests")) for suite in root] == [2 * (1 + count), 1 + count, 1]
    verdicts = [case for case in root.iter("testcase") if case.get("name") == "verdict"]
    assert [[child.tag for child in case] for case in verdicts] == [[], ["skipped"], ["failure"], ["error"]]
    assert verdicts[2][0].get("message") == f"differ: {why(differing)}"
    failed = [case.get("name") for case in root.iter("testcase") if case.find("failure") is not None]
    assert failed == ["verdict", *(n for n, c in differing.channels.items() if c.verdict == "differ")]
    skipped = [c.verdict for c in differing.channels.values() if c.verdict in ("indeterminate", "unexcited")]
    assert int(root[1].get("skipped")) == len(skipped) > 0


HEADINGS = ("scene", "verdict")


def page(tmp_path, rows, cases):
    path = write_job_summary(
        tmp_path / "deep" / "summary.md", title="A & B", sentences=["It <b>is</b>"],
        headings=HEADINGS, rows=rows, cases=cases,
    )  # fmt: skip
    assert path.stat().st_size <= LIMIT
    assert [other.name for other in path.parent.iterdir()] == ["summary.md"]
    return path.read_text("utf-8")


def test_verdicts_first_then_only_what_did_not_pass(tmp_path):
    cases = [
        Case("slow", "tight", "slider_x", "failed", "a|b <c>\nd"),
        Case("slow", "tight", "slider_y", "passed", "fine"),
        Case("slow", "tight", "slider_vx", "skipped", "unexcited"),
        Case("slow", "tight", "run", "error", "died"),
    ]
    lines = page(tmp_path, [("slow", "differ")], cases).splitlines()
    assert lines[0] == "# A &amp; B"
    assert lines[2] == "It &lt;b&gt;is&lt;/b&gt;"
    assert lines[4:7] == ["| scene | verdict |", "|---|---|", "| slow | differ |"]
    assert lines[8] == "## Failed checks"
    assert lines[12:] == [
        r"| slow | tight | slider_x | ✗ a\|b &lt;c&gt; d |",
        "| slow | tight | run | ! died |",
    ]


def test_without_a_failure_there_are_no_details(tmp_path):
    text = page(tmp_path, [("slow", "agree")], [Case("slow", "tight", "slider_x", "passed")])
    assert "Failed checks" not in text


def test_what_is_longer_than_a_job_page_is_cut_between_rows_and_says_so(tmp_path):
    # "&" grows to five bytes and "µ" has two: the limit is in bytes of what is written.
    cases = [Case("slow", "tight", f"c{n}", "failed", "µ&|" * 100) for n in range(3000)]
    text = page(tmp_path, [("slow", "differ")], cases)
    shown = re.findall(r"^\| slow \| tight \| c\d+ \| .* \|$", text, re.MULTILINE)
    (left,) = re.findall(r"^(\d+) more are omitted: the page would be too long.$", text, re.MULTILINE)
    assert len(shown) + int(left) == 3000
    assert len(text.encode()) > 0.99 * LIMIT  # and no more is left out than must be


def test_a_table_of_verdicts_that_is_too_long_by_itself_is_cut_too(tmp_path):
    text = page(tmp_path, [("x" * 5000, "agree")] * 300, [Case("a", "b", "c", "failed", "reported")])
    (left,) = re.findall(r"^(\d+) more rows and all details are omitted", text, re.MULTILINE)
    assert text.count("| agree |") + int(left) == 300


@pytest.mark.parametrize(
    "name",
    [
        "![i](http://example.org/x.png)", "[a](http://b)", "`code`", "*a* _b_ **c** __d__", "~~a~~", r"a\*b",
        "<img src=x>", "&amp;", "http://example.org", "@someone #1", "a|b", r"a\|b", "slider_x", "1*2*3",
    ],
)  # fmt: skip
def test_a_name_is_shown_as_it_is_whatever_markdown_would_make_of_it(name, tmp_path):
    text = page(tmp_path, [(name, "agree")], [Case(name, "tight", "run", "error", name)])
    shown = MarkdownIt("gfm-like", {"linkify": False}).render(text)
    assert shown.count(f"<td>{html.escape(name, quote=False)}</td>") == 2
    assert not re.search("<(img|a|code|em|strong|s)[ >]", shown)
