"""Drawings show what the samples hold: no spike lost, no part of another drawing, colours of the page."""

import re
from dataclasses import replace
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
from bouncing_press import stretched
from hypothesis import given
from hypothesis import strategies as st

from comparison.metrics import Pulse
from comparison.report import svg
from comparison.report.figures import channel_figure


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


@pytest.mark.parametrize("known", ["sample", "pulse", "peak"])
def test_a_force_stands_at_full_height_whatever_is_known_of_it(known, scene):
    """A sample, or of a contact between two samples its pulse or its peak alone."""
    channel = scene.channels["corner_ll_normal"]
    force = np.zeros_like(scene.time)
    force[733] = 50.0 * (known == "sample")
    event = scene.events[1].iloc[:1].assign(corner="ll", start=0.2931, end=0.2933, peak_force=50.0)
    phase = np.linspace(0.0, 1.0, 25)
    pulse = Pulse(0, 2e-4 * phase, 50.0 * np.sin(np.pi * phase))
    struck = replace(
        scene,
        events=(event.iloc[:0], event.iloc[: int(known != "sample")]),
        pulses=((), (pulse,) * (known == "pulse")),
    )
    drawing = channel_figure(struck, replace(channel, a=0.0 * force, b=force), "k")
    paths = re.findall(r'<path d="([^"]*)"[^>]*stroke: var\(--second\)', drawing)
    heights = [[float(y) for _, y in re.findall(r"(-?[\d.]+) (-?[\d.]+)", path)] for path in paths]
    # As high as its axes, of which 6 % are margin at either end. Simplification may take 0.2 pt.
    clip = float(re.search(r'<clipPath[^>]*>\s*<rect[^>]*height="([^"]*)"', drawing)[1])
    assert max(map(np.ptp, heights)) == pytest.approx(clip / 1.12, abs=0.5)


def test_a_figure_says_what_is_beyond_and_what_is_not_predictable(scene, differing):
    for comparison in (scene, differing):
        for name in ("slider_x", "corner_ll_normal"):
            channel = comparison.channels[name]
            drawing = channel_figure(comparison, channel, "k")
            crossed = bool(channel.beyond.any())
            assert (">beyond<" in drawing) == crossed == (channel.explained < 1.0)
            # One is in the legend.
            assert (len(re.findall(r"<use [^>]*--outside", drawing)) > 1) == crossed
            assert (">not predictable<" in drawing) == (channel.coverage < 1.0)
    assert ">beyond<" in channel_figure(differing, differing.channels["corner_ll_normal"], "k")


def test_two_drawings_on_a_page_do_not_use_each_others_parts(scene):
    drawings = [channel_figure(scene, scene.channels["slider_x"], key) for key in ("s0", "s1")]
    ids = [set(re.findall(r'\bid="([^"]+)"', text)) for text in drawings]
    used = [set(re.findall(r'(?:url\(#|href="#)([^")]+)', text)) for text in drawings]
    assert ids[0]
    assert not ids[0] & ids[1]
    assert used == ids  # nothing dangling, no id without a use


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


def test_a_figure_of_many_cycles_stays_small(scene):
    longer = stretched(scene.channels["slider_x"], 200)
    # At most 800 vertices a model and for the threshold and 400 for the difference, 25 bytes each, are 70 kB;
    # 400 stretches of shade in both axes, 300 bytes each, 240 kB.
    assert len(channel_figure(scene, longer, "k")) < 320e3
