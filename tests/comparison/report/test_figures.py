"""The drawing shows the data: no spike lost, nothing that the verdict denies, no part of another drawing."""

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from comparison.report import svg
from comparison.report.figures import ChannelFigure, Curves
from comparison.report.gallery import figures
from comparison.verdict.results import SceneComparison


@pytest.fixture(autouse=True)
def _style() -> Iterator[None]:
    with svg.style():
        yield


def curves(n: int = 100_001, **fields: object) -> Curves:
    time = np.linspace(0.0, 40.0, n)
    quiet = np.zeros(n)
    plain = Curves(
        label="force", unit="N", period=0.4, walls=None, predictable_below=1.0,
        time=time, a=quiet, b=quiet, size=quiet + 1e-9, threshold=quiet + 1e-6,
        predictable=np.ones(n, dtype=bool), outside=np.zeros(n, dtype=bool),
    )  # fmt: skip
    return replace(plain, **fields)  # type: ignore[arg-type]


def lines(drawing: str, role: str) -> list[np.ndarray]:
    """Return the vertices of every path of that colour, each of shape (n, 2), y downwards."""
    paths = re.findall(rf'<path d="([^"]*)"[^>]*stroke: {re.escape(role)}', drawing)
    return [np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", path), dtype=float) for path in paths]


def data_line(drawing: str, role: str) -> np.ndarray:
    """Return the line itself: the legend has a short one of the same colour."""
    return max(lines(drawing, role), key=len)


def test_a_force_of_one_sample_stands_at_full_height() -> None:
    force = np.zeros(100_001)
    force[73_123] = 50.0
    page = ChannelFigure(("one", "two"), "2 u")
    spike = data_line(page.svg(curves(a=force), "k"), "var(--first)")
    # Axes from -3 to 53 N (6 % of margin), 0.335 of 270 pt high: 50 N are 80.8 pt above the rest.
    # Coordinates are rounded to 0.1 pt, simplification may move a vertex by 0.2 pt.
    assert spike[:, 1].max() - spike[:, 1].min() == pytest.approx(80.8, abs=0.5)


def test_the_same_figure_draws_another_channel_without_a_rest_of_the_first() -> None:
    n = 201
    loud = curves(
        n,
        a=np.sin(np.arange(n)),
        outside=np.arange(n) < 50,
        predictable=np.arange(n) < 100,
        walls=(-1.0, 1.0),
    )
    used, fresh = ChannelFigure(("one", "two"), "2 u"), ChannelFigure(("one", "two"), "2 u")
    used.svg(loud, "k")
    quiet = curves(n, period=None, threshold=None)
    assert used.svg(quiet, "k") == fresh.svg(quiet, "k")


def test_ids_of_equal_drawings_differ_and_references_stay_inside() -> None:
    page = ChannelFigure(("one", "two"), "2 u")
    first, second = page.svg(curves(50), "s0-1"), page.svg(curves(50), "s0-10")
    found = [set(re.findall(r'\bid="([^"]+)"', text)) for text in (first, second)]
    used = [set(re.findall(r'(?:url\(#|href="#)([^")]+)', text)) for text in (first, second)]
    assert found[0]
    assert not found[0] & found[1]
    assert used == found  # nothing dangling, no id without a use


def test_equal_data_give_equal_text_without_a_date_whatever_the_users_settings() -> None:
    def drawn() -> str:
        with svg.style():
            return ChannelFigure(("one", "two"), "2 u").svg(curves(50), "k")

    plain = drawn()
    with mpl.rc_context(
        {"lines.linewidth": 7, "svg.hashsalt": "other", "svg.fonttype": "path", "font.size": 33}
    ):
        assert drawn() == plain
        assert mpl.rcParams["lines.linewidth"] == 7  # and theirs are left alone
    assert "<dc:date>" not in plain
    assert "<metadata" not in plain


def test_every_colour_is_one_of_the_page() -> None:
    drawing = ChannelFigure(("one", "two"), "2 u").svg(
        curves(50, outside=np.arange(50) < 9, walls=(-1.0, 1.0)), "k"
    )
    assert not re.findall(r"#[0-9a-f]{6}\b", drawing)


def test_the_colours_of_a_file_are_written_out_as_not_every_program_knows_variables() -> None:
    drawing = ChannelFigure(("one", "two"), "2 u").svg(curves(), "k")
    alone = svg.standalone(drawing)
    assert alone.count("#") > drawing.count("var(") > 10
    assert not re.search(r"var\(|currentColor|--", alone)
    assert not set(re.findall(r"#[0-9a-f]{6}", alone)) - set(svg.light_colours().values())


def test_text_is_text_and_escaped_never_mathematics() -> None:
    drawing = ChannelFigure(("<b>", "$x"), "2 u").svg(curves(50, label="$a & b$"), "k")
    assert "&lt;b&gt;" in drawing
    assert "$x" in drawing
    assert "$a &amp; b$ (N)" in drawing


def test_names_that_matplotlib_would_hide_or_that_are_too_long() -> None:
    drawing = ChannelFigure(("_run", "x" * 80), "2 u").svg(curves(50), "k")
    assert ">_run<" in drawing
    assert ">xxxxxxxxxxxxxxxxxx…<" in drawing


def test_crosses_stand_where_a_sample_is_outside_and_the_legend_says_so_only_then(
    scene: SceneComparison, differing: SceneComparison
) -> None:
    assert scene.verdict == "agree"
    assert differing.verdict == "differ"
    for comparison in (scene, differing):
        drawings = {d.heading: d for d in figures(comparison, "s0") if "enlarged" not in d.heading}
        for channel in comparison.channels.values():
            drawing = next((d for name, d in drawings.items() if name.startswith(channel.label + " (")), None)
            if drawing is None:
                continue
            crossed = ">outside<" in drawing.svg
            assert drawing.verdict == channel.verdict
            assert crossed == (channel.verdict != "unexcited" and channel.explained < 1.0), channel.channel
            # One is in the legend.
            assert (len(re.findall(r"<use [^>]*--outside", drawing.svg)) > 1) == crossed
            assert (">not predictable<" in drawing.svg) == (channel.coverage < 1.0)


def test_derived_and_unexcited_channels_are_drawn_only_where_they_differ(scene: SceneComparison) -> None:
    def drawn(comparison: SceneComparison) -> set[str]:
        _enlarged, *whole = figures(comparison, "s0")
        return {drawing.caption.partition(":")[0] for drawing in whole}

    names = drawn(scene)
    assert {"slider_x", "corner_ll_normal"} <= names
    assert not {"corner_ll_gap", "corner_ul_normal"} & names
    differ = ("corner_ll_gap", "corner_ul_normal")
    changed = {name: replace(scene.channels[name], verdict="differ") for name in differ}
    assert drawn(replace(scene, channels=scene.channels | changed)) == names | set(changed)


@pytest.mark.parametrize("n", [2, 3, 401, 801])
def test_short_tables_and_constant_values_are_drawn_without_a_warning(n: int) -> None:
    page = ChannelFigure(("one", "two"), "tolerance")
    zero = np.zeros(n)
    for case in (
        curves(n, size=zero, threshold=zero),
        curves(n, size=zero, threshold=None, period=None),
        curves(n, a=zero + 3.7, b=zero + 3.7),
        curves(n, a=zero + 1e300, size=zero + 1e300),
        curves(n, predictable=np.zeros(n, dtype=bool), predictable_below=float("nan")),
    ):
        assert page.svg(case, "k").startswith("<svg ")


def test_pyplot_is_not_imported() -> None:
    code = "import sys, comparison.report; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
