"""One picture of one table or two: in a file, on the command line, in a notebook."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest

from comparison.cli import main
from comparison.report import svg
from comparison.report.pictures.notebook import tabulated
from comparison.report.pictures.plot import picture
from comparison.tables.table import TableError


def test_a_panel_a_channel_with_quantity_and_unit_and_a_curve_a_table(tables):
    figure = picture(tables, ("slider_x", "slider_vy", "corner_ll_normal"))
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == [
        "slider x − guide\n(µm)",
        "slider velocity y\n(m/s)",
        "normal force,\nlower left corner\n(N)",
    ]
    assert figure.axes[-1].get_xlabel() == "time (s)"
    assert [len(axes.get_lines()) for axes in figure.axes] == [2, 2, 2]
    first, second = figure.axes[0].get_lines()
    assert first.get_color() != second.get_color()
    assert first.get_linewidth() > 2 * second.get_linewidth()
    # 0.2 mm of clearance, in micrometres.
    assert np.abs(first.get_ydata()).max() == pytest.approx(200.0, rel=1e-3)
    assert figure._repr_svg_().lstrip().startswith("<?xml")


def test_a_window_shows_its_samples_alone(tables):
    (axes,) = picture({"a": tables["a"]}, start=0.1, end=0.2).axes
    (line,) = axes.get_lines()
    assert 0.1 <= line.get_xdata().min() <= line.get_xdata().max() <= 0.2
    with pytest.raises(TableError, match=r"a: fewer than two samples are shown; its time is 0 s to 0\.8 s"):
        picture({"a": tables["a"]}, start=5.0)


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(("ending", "magic"), [("svg", b"<svg"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_the_command_writes_every_format(ending, magic, capsys):
    assert (
        main(["plot", "a.csv", "b.csv", "--channels", "slider_x,slider_vx", "--out", f"deep/p.{ending}"]) == 0
    )
    assert capsys.readouterr().out == f"deep/p.{ending}\n"
    content = Path(f"deep/p.{ending}").read_bytes()
    assert content.startswith(magic)
    if ending == "svg":
        assert all(svg.light_colours()[role].encode() in content for role in (svg.FIRST, svg.SECOND))
    assert [path.name for path in Path("deep").iterdir()] == [f"p.{ending}"]


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        (["a.csv", "--channels", "slider_q"], "a: channel 'slider_q' is missing; it has slider_x, "),
        (["a.csv", "--channels", ","], "needs at least one name"),
        (["a.csv", "--out", "p.jpg"], "p.jpg: the name must end in .svg, .png or .pdf"),
        (["a.csv", "b.csv", "c.csv"], "3 tables: give one or two"),
        (["a.csv", "a.csv"], "a.csv is given twice"),
        (["c.csv"], "c.csv: No such file"),
    ],
)
def test_mistakes_are_one_line(arguments, rule, capsys):
    before = set(Path.cwd().iterdir())
    assert main(["plot", *arguments]) == 2
    err = capsys.readouterr().err
    assert rule in err
    assert err.count("\n") == 1
    assert set(Path.cwd().iterdir()) == before


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("name", ["$\\frac", "_a", "$x$", "a_{b", "&<i>"])
@pytest.mark.parametrize("ending", ["svg", "png"])
def test_a_table_s_name_is_shown_as_it_is(name, ending, capsys):
    """A dollar sign begins mathematics in a label, and an underline what a legend leaves out."""
    Path("a.csv").rename(f"{name}.csv")
    assert main(["plot", f"{name}.csv", "b.csv", "--out", f"p.{ending}"]) == 0
    assert capsys.readouterr().err == ""
    if ending == "svg":
        assert f">{escape(name)}</text>" in Path("p.svg").read_text("utf-8")


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("content", ["1e308", "text", "nan", "inf"])
def test_what_cannot_be_drawn_is_one_line(content, capsys):
    lines = Path("a.csv").read_text().splitlines()
    lines[5] = f"{lines[5].split(',')[0]},{content}," + lines[5].split(",", 2)[2]
    Path("a.csv").write_text("\n".join(lines))
    for command in (["plot", "a.csv", "--out", "p.svg"], ["animate", "a.csv", "--out", "p.html"]):
        assert main(command) == 2
        err = capsys.readouterr().err
        assert "in data row 5" in err
        assert err.count("\n") == 1
    assert main(["plot", "a.csv", "--channels", "slider_y", "--out", "p.svg"]) == 0  # one that is sound


def test_an_estimated_error_is_shaded_about_its_curve(tables):
    u = np.full(len(tables["a"].frame), 5e-5)
    with_u = replace(tables["a"], frame=tables["a"].frame.assign(slider_x_u=u))
    assert picture({"a": with_u}, ["slider_x_u"]).axes[0].get_ylabel() == "estimated error of slider x\n(µm)"
    (axes,) = picture({"a": with_u, "b": tables["b"]}).axes
    (shade,) = axes.collections
    (line, _) = axes.get_lines()
    corners = shade.get_paths()[0].vertices
    # Micrometres, from the guide's centre line; the shade is as wide at the top as at the bottom.
    assert corners[:, 1].max() == pytest.approx(line.get_ydata().max() + 50.0)
    assert corners[:, 1].min() == pytest.approx(line.get_ydata().min() - 50.0)


def test_one_call_makes_a_table_that_shows_and_draws_itself(fake_model, central_case):
    table = tabulated(fake_model.simulate(central_case.data))
    assert list(table.frame)[:2] == ["time", "slider_x"]
    assert len(table.events) == 1
    shown = table._repr_html_()
    assert shown.startswith("<p>")
    assert "success; 401 samples to 0.800 s, 1 contacts" in shown
    assert shown.count("<tr") == 1 + len(table.channels)
    (axes,) = table.plot().axes
    assert axes.get_ylabel().startswith("slider x")
    upper, lower = table.plot("slider_vx", "slider_vy", other=table).axes
    assert len(upper.get_lines()) == len(lower.get_lines()) == 2


def test_names_are_escaped(fake_model, central_case):
    result = fake_model.simulate(central_case.data)
    result.columns["<b>"] = result.columns["time"]
    assert "<b>" not in tabulated(result)._repr_html_()
