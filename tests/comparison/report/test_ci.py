"""Files for continuous integration: JUnit XML, and the Markdown summary of a job."""

import html
import re
from xml.etree import ElementTree as ET

from markdown_it import MarkdownIt

from comparison.report.ci import MOST, write_job_summary, write_junit
from comparison.words.record import Case

NAMES = [
    "![i](http://example.org/x.png)", "[a](http://b)", "`code`", "*a* _b_ **c** __d__", "~~a~~", r"a\*b",
    "<img src=x>", "&amp;", "http://example.org", "@someone #1", "a|b", r"a\|b", "slider_x", "1*2*3",
]  # fmt: skip


def test_suites_are_scenes_and_texts_are_as_xml_can_hold_them(tmp_path):
    message = 'at <t> = 1 s & "more"\x00\x1b[31m \ud800'
    cases = [
        Case("slow", "standard", "slider_x", "passed", "agree: 99.9 %"),
        Case("90rpm-0.1mm", "tight", "slider_y", "failed", message),
        Case("slow", "standard", "slider_angle", "skipped", "unexcited"),
    ]
    write_junit(cases, tmp_path / "deep" / "junit.xml", name="sixbar gate")
    root = ET.parse(tmp_path / "deep" / "junit.xml").getroot()
    assert [suite.get("name") for suite in root] == ["slow", "90rpm-0.1mm"]
    *others, testcase = root.iter("testcase")
    assert [[child.tag for child in case] for case in others] == [[], ["skipped"]]
    assert testcase.get("classname") == "90rpm-0_1mm.tight"  # viewers group by its dots
    (failure,) = testcase
    assert failure.get("message") == failure.text == 'at <t> = 1 s & "more"\ufffd\ufffd[31m \ufffd'


def test_a_name_in_the_summary_is_shown_as_it_is_whatever_markdown_would_make_of_it(tmp_path):
    def summary(rows, cases):
        texts = {"title": "A & B", "sentences": ["It <b>is</b>"], "headings": ("scene", "verdict")}
        write_job_summary(tmp_path / "s.md", rows=rows, cases=cases, **texts)
        return (tmp_path / "s.md").read_text("utf-8")

    rows = [(name, "agree") for name in NAMES]
    cases = [Case(name, "tight", "run", "error", name) for name in NAMES]
    output = MarkdownIt("gfm-like", {"linkify": False}).render(summary(rows, cases))
    for name in NAMES:
        assert output.count(f"<td>{html.escape(name, quote=False)}</td>") == 2, name
    assert not re.search("<(img|a|code|em|strong|s|b)[ >]", output)
    assert "2 more failed checks are omitted." in summary([], cases[:1] * (MOST + 2))
