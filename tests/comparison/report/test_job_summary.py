"""The Markdown page of a CI job."""

from __future__ import annotations

import html
import re

import pytest
from markdown_it import MarkdownIt

from comparison.report.job_summary import LIMIT, write_job_summary
from comparison.words.cases import Case

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
    assert "did not pass" not in text


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
