"""Drawings show what the samples hold, under the names of the tables, in files, on pages, in notebooks."""

import base64
import json
import re
import zlib
from dataclasses import replace
from html import escape
from itertools import pairwise, product
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from bouncing_press import stretched
from half_sines import half_sines
from hypothesis import given
from hypothesis import strategies as st

from comparison.cli import main
from comparison.formatting import number
from comparison.report import svg
from comparison.report.figures import channel_figure, picture
from comparison.report.page import joints
from comparison.report.pictures.notebook import RunTable
from comparison.report.plots import MOST, scene_lines, scene_plots
from comparison.scene import load_scene
from comparison.tables.table import TableError
from comparison.tables.table_files import write

FORCE = "corner_ll_normal"


@pytest.fixture(scope="module")
def struck(scene):
    """The runs of the press as tables with their contacts, and of these the forces in time."""
    tables, times = {}, {"time": scene.time}
    for side, (label, events) in enumerate(zip("ab", scene.events, strict=True)):
        pulses = half_sines(scene)[side]
        columns = {
            "row": np.repeat(np.arange(len(pulses)), [pulse.time.size for pulse in pulses]),
            "time": np.concatenate([events["start"][pulse.row] + pulse.time for pulse in pulses]),
            "force": np.concatenate([pulse.force for pulse in pulses]),
        }
        values = {name: (channel.a, channel.b)[side] for name, channel in scene.channels.items()}
        record = {"scene": scene.scene, "model": label}
        tables[label] = RunTable(
            pd.DataFrame(times | values), events, provenance=record, pulses=columns, extrema={}
        )
    return tables


@given(st.integers(1, 3000), st.integers(1, 50), st.integers(0, 2**32 - 1))
def test_envelopes_keep_the_extrema_of_every_column(n, columns, seed):
    values = np.random.default_rng(seed).standard_normal(n)
    kept, upper = svg.envelope(values, columns), svg.upper_envelope(values, columns)
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, n - 1)
    assert len(kept) <= max(2 * columns + 2, n if n <= 2 * columns else 0)
    edges = (np.arange(columns + 1) * n) // columns
    for start, stop in pairwise(edges):
        inside = values[kept[(kept >= start) & (kept < stop)]]
        if stop > start:
            assert inside.min() == values[start:stop].min()
            assert inside.max() == values[start:stop].max()
    if n > columns:
        largest = [values[start:stop].max() for start, stop in pairwise(edges)]
        np.testing.assert_array_equal(values[upper], largest)


@given(st.lists(st.booleans(), min_size=2, max_size=400))
def test_spans_cover_the_mask_and_nothing_else(mask):
    time = np.arange(len(mask)) * 0.1
    # As many columns as samples: no stretch needs widening but the halves at both ends.
    spans = svg.spans(np.array(mask), time, columns=len(mask))
    assert [any(low - 1e-12 <= t <= high + 1e-12 for low, high in spans) for t in time] == mask
    assert all(end < start for (_, end), (start, _) in pairwise(spans))


def test_a_force_is_drawn_up_to_the_peaks_between_its_samples_wherever_it_is_drawn(struck, scene):
    peaks = [events[events["corner"] == "ll"]["peak_force"].max() for events in scene.events]
    sampled = [table.values(FORCE).max() for table in struck.values()]
    assert all(np.divide(sampled, peaks) < 0.98)
    (axes,) = picture(struck, [FORCE]).axes
    drawn = [line.get_ydata().max() for line in axes.get_lines()]
    channel = scene.channels[FORCE]
    resolved = scene_lines(replace(scene, pulses=half_sines(scene)), channel)
    alone = scene_lines(scene, channel)  # peaks, without pulses
    for shown in (drawn, *([each.extremes[1] for each in lines] for lines in (resolved, alone))):
        assert shown == pytest.approx(peaks)
    row = re.search(rf"<td>{FORCE}</td>.*?</tr>", struck["a"]._repr_html_(), re.DOTALL)[0]
    assert f"<td>{number(peaks[0])}</td>" in row
    # Of a range only what is in it.
    (axes,) = picture(struck, [FORCE], start=0.0, end=0.01).axes
    assert all(line.get_xdata().max() <= 0.01 for line in axes.get_lines())


def test_a_figure_says_what_is_beyond_and_what_is_not_predictable_in_bounded_space(scene, differing):
    for comparison, name in product((scene, differing), ("slider_x", FORCE)):
        channel = comparison.channels[name]
        drawing = channel_figure(comparison, channel, "k")
        crossed = bool(channel.beyond.any())
        assert crossed == (comparison is differing and name == FORCE)
        assert (">beyond<" in drawing) == crossed == (channel.explained < 1.0)
        # One is in the legend.
        assert (len(re.findall(r"<use [^>]*--outside", drawing)) > 1) == crossed
        assert (">not predictable<" in drawing) == (channel.coverage < 1.0)
    # At most 800 vertices a model and for the threshold and 400 for the difference, 25 bytes each, are 70 kB;
    # 400 stretches of shade in both axes, 300 bytes each, 240 kB.
    assert len(channel_figure(scene, stretched(scene.channels["slider_x"], 200), "k")) < 320e3


def test_equal_data_give_equal_text_in_the_colours_of_the_page_whatever_the_users_settings(scene):
    plain = channel_figure(scene, scene.channels["slider_x"], "k")
    own = {"lines.linewidth": 7, "svg.hashsalt": "other", "svg.fonttype": "path", "font.size": 33}
    with mpl.rc_context(own):
        assert channel_figure(scene, scene.channels["slider_x"], "k") == plain
        assert mpl.rcParams["lines.linewidth"] == 7  # and theirs are left alone
    assert not re.findall(r"date|#[0-9a-f]{6}\b", plain)
    alone = svg.standalone(plain)
    assert not re.search(r"var\(|--", alone)  # programs other than browsers know no variables
    assert {svg.INK, svg.FIRST, svg.SECOND} <= set(re.findall(r"#[0-9a-f]{6}", alone))


def test_a_long_run_keeps_its_peaks_in_bounded_space(scene):
    longer = stretched(scene.channels[FORCE], 40)
    n = longer.time.size
    longer.a[n // 2 + 7] = longer.b[n // 2 + 7] = 1e4  # a contact of one sample, in both models alike
    struck = replace(scene, time=longer.time, channels={FORCE: longer})
    head = json.loads(zlib.decompress(base64.b64decode(scene_plots(struck))))
    assert len(head["time"]) <= MOST < head["of"] == n
    ((lowest, step), seconds) = head["channels"][0]["grid"], head["start"] + np.array(head["time"])
    values = (lowest + np.cumsum(np.cumsum(head["channels"][0]["steps"]))) * step
    assert values.max() == pytest.approx(1e4)
    assert seconds[values.argmax()] == pytest.approx(longer.time[n // 2 + 7])


# ---- of tables


def test_a_channel_is_drawn_in_its_own_unit_with_a_curve_a_table(struck):
    (axes,) = picture(struck, ["slider_x"]).axes
    assert axes.get_ylabel() == "slider x − guide\n(µm)"
    assert len({line.get_color() for line in axes.get_lines()}) == 2
    largest = np.abs(struck["a"].values("slider_x") + 0.55).max()  # m from the guide
    assert np.abs(axes.get_lines()[0].get_ydata()).max() == pytest.approx(1e6 * largest)
    with pytest.raises(TableError, match=r"a: fewer than two samples are shown; its time is 0 s to 0\.8 s"):
        picture({"a": struck["a"]}, start=5.0)


@pytest.mark.usefixtures("elsewhere")
def test_a_table_s_name_is_shown_as_it_is(make_table, capsys):
    """A dollar sign begins mathematics in a label, and an underline what a legend leaves out."""
    write(make_table(), "b.csv")
    for name in ("$\\frac", "_a", "&<i>"):
        write(make_table(), f"{name}.csv")
        assert main(["plot", f"{name}.csv", "b.csv", "--channels", "slider_x", "--out", "p.svg"]) == 0
        assert capsys.readouterr().err == ""
        drawn = Path("p.svg").read_text("utf-8")
        assert f">{escape(name)}</text>" in drawn
        assert all(colour in drawn for colour in (svg.FIRST, svg.SECOND))


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
