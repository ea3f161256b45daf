"""Pages, tables and printed figures that several studies use."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.studies.shared.errors import second_cycle
from comparison.studies.shared.frames import crossed, quantities
from comparison.studies.shared.page import single_page
from comparison.studies.shared.published import published


def test_rows_and_columns_stand_in_the_order_in_which_they_come_first_and_what_lacks_is_said():
    shown = crossed("modulus", ["10", "10", "2"], ["b", "a", "b"], ["p", "q", "r"])
    assert shown.splitlines() == ["| modulus | b | a |", "|---|---|---|", "| 10 | p | q |", "| 2 | r | n/a |"]
    frame = pd.DataFrame({"law": ["a", "b"], "depth_m": [5.2e-7, np.nan]})
    columns = {"law": "law", "deepest": ("depth_m", "m", 2), "force": ("force_N", "N")}
    assert quantities(frame, columns).replace("\u00a0", " ").splitlines()[2:] == [
        "| a | 520 nm | n/a |",
        "| b | n/a | n/a |",
    ]


def test_the_second_cycle_holds_both_of_its_ends_whatever_the_rounding():
    within = second_cycle(np.arange(2001) * (0.4 / 1000), 0.4)
    assert within.sum() == 1001
    assert not within[999]


def test_figures_come_from_the_published_table():
    found = published("F7-R-a")
    assert (found.value, found.unit, found.time) == (-494.9, "m/s^2", 0.7522)
    with pytest.raises(KeyError):
        published("F99")


def test_the_page_holds_the_figures_and_shows_html_as_text(tmp_path):
    (tmp_path / "figure-1.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0"/></svg>')
    readme = tmp_path / "README.md"
    readme.write_text(
        "# Title & <b>\n\n[to](figure-1.svg) [it](#the-runs)\n\n## The runs\n\n"
        '| a |\n|---|\n| <script>x</script> |\n\n![Fig. 1: "x" < y](figure-1.svg)\n'
    )
    single_page(readme, tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text("utf-8")
    assert "<script>" not in html
    assert "<img" not in html
    for part in (
        "<title>Title &amp; &lt;b&gt;</title>", "&lt;script&gt;",
        '<figure id="figure-1">', '<path d="M0 0"/>',
        "<td>", 'href="#figure-1"', 'href="#the-runs"', '<h2 id="the-runs">',
        "<figcaption>Fig. 1: &quot;x&quot; &lt; y</figcaption>",
    ):  # fmt: skip
        assert part in html
