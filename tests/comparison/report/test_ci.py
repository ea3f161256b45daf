"""What continuous integration reads: JUnit XML, and the Markdown summary of a job."""

import html
import re
from xml.etree import ElementTree as ET

from markdown_it import MarkdownIt

from comparison.report.ci import MOST, write_job_summary, write_junit
from comparison.words.record import Case

CASES = [
    Case("slow", "standard", "slider_x", "passed", "agree: 99.9 %"),
    Case("90rpm-0.1mm", "tight", "slider_y", "failed", 'at <t> = 1 s & "more"\x00\x1b[31m \ud800'),
    Case("slow", "standard", "slider_angle", "skipped", "unexcited"),
    Case("slow", "tight", "run", "error", "a|b <c>\nd"),
]


def junit(cases, folder):
    write_junit(cases, folder / "deep" / "junit.xml", name="sixbar gate")
    return ET.parse(folder / "deep" / "junit.xml").getroot()


def counted(element):
    return tuple(int(element.get(key)) for key in ("tests", "failures", "errors", "skipped"))


def test_a_suite_a_scene_a_case_a_finding_counts_that_add_up_and_texts_as_xml_can_hold_them(tmp_path):
    root = junit(CASES, tmp_path)
    assert (root.tag, root.get("name"), counted(root)) == ("testsuites", "sixbar gate", (4, 1, 1, 1))
    suites = [(suite.get("name"), counted(suite)) for suite in root]
    assert suites == [("slow", (3, 0, 1, 1)), ("90rpm-0.1mm", (1, 1, 0, 0))]
    cases = list(root.iter("testcase"))
    assert [[child.tag for child in case] for case in cases] == [[], ["skipped"], ["error"], ["failure"]]
    assert cases[3].get("classname") == "90rpm-0_1mm.tight"
    (failure,) = cases[3]
    assert failure.get("message") == failure.text == 'at <t> = 1 s & "more"\ufffd\ufffd[31m \ufffd'
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["junit.xml"]


def page(tmp_path, rows, cases):
    path = tmp_path / "deep" / "summary.md"
    write_job_summary(
        path, title="A & B", sentences=["It <b>is</b>"], headings=("scene", "verdict"), rows=rows, cases=cases
    )
    assert [path] == list(path.parent.iterdir())
    return path.read_text("utf-8")


def test_verdicts_first_then_only_what_did_not_pass(tmp_path):
    lines = page(tmp_path, [("slow", "differ")], CASES[2:]).splitlines()
    assert lines[:3] == ["# A &amp; B", "", "It &lt;b&gt;is&lt;/b&gt;"]
    assert lines[4:7] == ["| scene | verdict |", "|---|---|", "| slow | differ |"]
    assert lines[8] == "## Failed checks"
    assert lines[12:] == [r"| slow | tight | run | ! a\|b &lt;c&gt; d |"]
    assert "Failed checks" not in page(tmp_path, [("slow", "agree")], CASES[:1])
    assert "2 more failed checks are omitted." in page(tmp_path, [], CASES[3:] * (MOST + 2))


NAMES = [
    "![i](http://example.org/x.png)", "[a](http://b)", "`code`", "*a* _b_ **c** __d__", "~~a~~", r"a\*b",
    "<img src=x>", "&amp;", "http://example.org", "@someone #1", "a|b", r"a\|b", "slider_x", "1*2*3",
]  # fmt: skip


def test_a_name_is_shown_as_it_is_whatever_markdown_would_make_of_it(tmp_path):
    rows = [(name, "agree") for name in NAMES]
    cases = [Case(name, "tight", "run", "error", name) for name in NAMES]
    shown = MarkdownIt("gfm-like", {"linkify": False}).render(page(tmp_path, rows, cases))
    for name in NAMES:
        assert shown.count(f"<td>{html.escape(name, quote=False)}</td>") == 2, name
    assert not re.search("<(img|a|code|em|strong|s)[ >]", shown)
