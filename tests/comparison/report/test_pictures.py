"""One picture of one table or two, the press in motion, the schematic: in files, on a page, in a notebook."""

import base64
import hashlib
import json
import re
import shutil
from dataclasses import replace
from html import escape, unescape
from pathlib import Path

import numpy as np
import pytest
from half_sines import half_sines

from comparison.cli import main
from comparison.formatting import number
from comparison.report import svg
from comparison.report.figures import picture
from comparison.report.page import joints
from comparison.report.plots import scene_lines
from comparison.scene import load_scene
from comparison.tables.table import TableError


def test_a_panel_a_channel_with_quantity_and_unit_and_a_curve_a_table(tables):
    figure = picture(tables, ("slider_x", "slider_vy", "corner_ll_normal"))
    labels = [axes.get_ylabel() for axes in figure.axes]
    force = "normal force,\nlower left corner\n(N)"
    assert labels == ["slider x − guide\n(µm)", "slider velocity y\n(m/s)", force]
    assert [len(axes.get_lines()) for axes in figure.axes] == [2, 2, 2]
    first, second = figure.axes[0].get_lines()
    assert first.get_color() != second.get_color()
    # 0.2 mm of clearance, in micrometres.
    assert np.abs(first.get_ydata()).max() == pytest.approx(200.0, rel=1e-3)
    assert figure._repr_svg_().lstrip().startswith("<?xml")
    (axes,) = picture({"a": tables["a"]}, start=0.1, end=0.2).axes
    (line,) = axes.get_lines()
    assert 0.1 <= line.get_xdata().min() <= line.get_xdata().max() <= 0.2
    with pytest.raises(TableError, match=r"a: fewer than two samples are shown; its time is 0 s to 0\.8 s"):
        picture({"a": tables["a"]}, start=5.0)


def test_a_force_is_drawn_up_to_the_peaks_between_its_samples_wherever_it_is_drawn(struck, scene):
    peaks = [events[events["corner"] == "ll"]["peak_force"].max() for events in scene.events]
    sampled = [table.values("corner_ll_normal").max() for table in struck.values()]
    assert all(np.divide(sampled, peaks) < 0.98)
    (axes,) = picture(struck, ["corner_ll_normal"]).axes
    drawn = [line.get_ydata().max() for line in axes.get_lines()]
    channel = scene.channels["corner_ll_normal"]
    resolved = scene_lines(replace(scene, pulses=half_sines(scene)), channel)
    alone = scene_lines(scene, channel)  # peaks, without pulses
    for shown in (drawn, *([each.extremes[1] for each in lines] for lines in (resolved, alone))):
        assert shown == pytest.approx(peaks)
    row = re.search(r"<td>corner_ll_normal</td>.*?</tr>", struck["a"]._repr_html_(), re.DOTALL)[0]
    assert f"<td>{number(peaks[0])}</td>" in row
    # Of a range only what is in it.
    (axes,) = picture(struck, ["corner_ll_normal"], start=0.0, end=0.01).axes
    assert all(line.get_xdata().max() <= 0.01 for line in axes.get_lines())


@pytest.mark.usefixtures("files")
def test_a_table_s_name_is_shown_as_it_is_in_every_format(capsys):
    """A dollar sign begins mathematics in a label, and an underline what a legend leaves out."""
    names = ["$\\frac", "_a", "$x$", "a_{b", "&<i>"]
    magic = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<svg"}
    for name, ending in ((names[0], "png"), (names[0], "pdf"), *((name, "svg") for name in names)):
        shutil.copy("a.csv", f"{name}.csv")
        assert main(["plot", f"{name}.csv", "b.csv", "--out", f"deep/p.{ending}"]) == 0
        assert capsys.readouterr() == (f"deep/p.{ending}\n", "")
        path = Path(f"deep/p.{ending}")
        assert path.read_bytes().startswith(magic[ending])
        if ending == "svg":
            assert f">{escape(name)}</text>" in path.read_text("utf-8")
            assert all(colour in path.read_text() for colour in (svg.FIRST, svg.SECOND))
    assert len(list(Path("deep").iterdir())) == 3


@pytest.mark.usefixtures("files")
def test_the_animation_needs_nothing_holds_the_mechanism_and_no_label_breaks_it(central_case):
    for ending in (".csv", ".json"):
        Path(f"a{ending}").rename(f"<i>&x{ending}")
    assert main(["animate", "<i>&x.csv", "b.csv", "--out", "p.html"]) == 0
    page = Path("p.html").read_text("utf-8")
    assert not re.search(r"\s(?:src|href)=", page.partition("<script")[0])
    script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)[-1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page
    geometry = json.loads(unescape(re.findall(r'data-geometry="([^"]*)"', page)[0]))
    assert geometry["mechanism"] == central_case.data["mechanism"]
    # Pixels per metre: a corner that touches its wall touches it in the drawing, 18 pixels away.
    assert geometry["magnified"] * central_case.data["clearance"]["slider"] == pytest.approx(18.0)
    assert "&lt;i&gt;&amp;x and b, 0.8 s, 2 crank cycles" in page
    assert len(page) < 300_000


@pytest.mark.parametrize("angle", [0.0, 111.36, 200.0, 290.0])
def test_the_joints_keep_the_lengths_and_the_branches(angle):
    mechanism = load_scene("150rpm-0.2mm").data["mechanism"]
    at = joints(mechanism, angle)
    assert at is not None
    lengths = {part: mechanism[part]["length"] for part in ("crank", "rod2", "rocker", "rod4")}
    ends = {"crank": "OA", "rod2": "AB", "rocker": "CH", "rod4": "CF", "centroid": "BH"}
    # Round-off of coordinates of half a metre.
    for part, length in (lengths | {"centroid": mechanism["rocker"]["centroid"]}).items():
        assert abs(at[ends[part][0]] - at[ends[part][1]]) == pytest.approx(length, abs=1e-14)
    assert at["F"].real == mechanism["guide_x"]
    assert at["F"].imag < at["C"].imag  # rod 4 hangs down
    assert ((at["B"] - at["A"]) / (at["H"] - at["A"])).imag > 0  # B is left of the line from A to H
