"""Data of the interactive plots: stored without loss that a reader could see, bounded for long runs."""

import base64
import json
import zlib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from bouncing_press import stretched
from half_sines import half_sines

from comparison.report.plots import MOST, scene_plots, table_plots
from comparison.tables.table import Table


def octaves(steps):
    steps = np.cumsum(steps)
    return np.where(steps == 0, 0.0, np.sign(steps) * 2.0 ** ((np.abs(steps) - 40_000) / 32))


class Unpacked:
    """What a page's script reads."""

    def __init__(self, text):
        self.head = json.loads(zlib.decompress(base64.b64decode(text)))
        self.time = self.head["start"] + np.array(self.head["time"])
        self.channels = {}
        for channel in self.head["channels"]:
            lowest, step = channel["grid"]
            first = (lowest + np.cumsum(np.cumsum(channel["steps"]))) * step
            own = {"first": first, "apart": [octaves(steps) for steps in channel["apart"]]}
            own["limit"] = channel["limit"] and octaves(channel["limit"])
            self.channels[channel["name"]] = channel | own


def test_what_is_packed_is_what_was_compared(scene):
    packed = Unpacked(scene_plots(scene))
    assert packed.head["labels"] == ["reference", "exudyn"]
    assert packed.head["threshold"] == "2 u"
    np.testing.assert_allclose(packed.time, scene.time, atol=1e-12)
    for name, plot in packed.channels.items():
        channel = scene.channels[name]
        zero = scene.scene["mechanism"]["guide_x"] if plot["guide"] else 0.0
        # Half of one of 65,534 steps; of a 32nd of an octave.
        step = np.ptp(channel.a) / 65534
        np.testing.assert_allclose(plot["first"], channel.a - zero, rtol=0, atol=0.51 * step)
        np.testing.assert_array_equal(plot["first"][channel.a == zero], 0.0)
        np.testing.assert_allclose(plot["apart"][0], channel.difference, rtol=1.1e-2)
        np.testing.assert_allclose(np.abs(plot["limit"]), channel.threshold, rtol=1.1e-2)
        np.testing.assert_array_equal(np.array(plot["limit"]) > 0, channel.predictable)
    assert packed.channels["slider_x"]["guide"]
    assert {"slider_x", "slider_ax", "corner_ll_normal"} <= packed.channels.keys()
    # Constant ones, and those that follow from others, are left to the tables.
    assert not {"corner_ul_normal", "corner_ll_gap"} & packed.channels.keys()


def test_contacts_and_resolved_ones_are_in_order_of_time_with_their_peaks(scene):
    pulses = half_sines(scene)
    some = pulses[0][5:2:-1], pulses[1]  # in any order
    packed = Unpacked(scene_plots(replace(scene, pulses=some)))
    for side, (contacts, events) in enumerate(zip(packed.head["contacts"], scene.events, strict=True)):
        assert [start for _, start, _, _ in contacts] == pytest.approx(sorted(events["start"]), abs=1e-8)
        assert sorted(peak for *_, peak in contacts) == pytest.approx(sorted(events["peak_force"]), rel=5e-4)
        by_start = {round(events["start"][pulse.row], 8): pulse for pulse in some[side]}
        drawn = packed.head["pulses"][side]
        assert len(drawn) == len(some[side])
        for each in drawn:
            pulse = by_start[contacts[each["place"]][1]]
            assert each["peak"] == pulse.force.max()
            for shares, most, values in (("t", "last", pulse.time), ("n", "peak", pulse.force)):
                shown = np.array(each[shares]) / 255 * each[most]
                assert np.abs(shown - values).max() <= 0.51 / 255 * each[most]


def test_an_axis_shows_neither_the_rounding_of_a_constant_nor_the_steps_of_what_is_stored(scene):
    noise = 1e-16 * (np.arange(11) % 2)
    columns = {
        "time": np.arange(11.0),
        "slider_x": noise - 0.55,
        "slider_angle": 0.0,
        "slider_y": noise * 1e14,
    }
    tables = dict.fromkeys("ab", Table(pd.DataFrame(columns)))
    plots = Unpacked(table_plots(tables, list(columns)[1:], scene.scene)).channels
    # The clearance, and it over the slider's length; of y, which is excited, 20 of 65,534 steps.
    wanted = {"slider_x": 2e-4, "slider_angle": 2e-4 / 0.07, "slider_y": 20 * 1e-2 / 65534}
    assert {name: plot["least"] for name, plot in plots.items()} == pytest.approx(wanted, rel=5e-3)


def test_a_long_run_keeps_its_peaks_in_bounded_space(scene):
    longer = stretched(scene.channels["corner_ll_normal"], 40)
    time, n = longer.time, longer.time.size
    longer.a[n // 2 + 7] = longer.b[n // 2 + 7] = 1e4  # a contact of one sample, in both models alike
    packed = Unpacked(scene_plots(replace(scene, time=time, channels={"corner_ll_normal": longer})))
    assert packed.time.size <= MOST < packed.head["of"] == n
    first = packed.channels["corner_ll_normal"]["first"]
    assert first.max() == pytest.approx(1e4)
    assert packed.time[first.argmax()] == pytest.approx(time[n // 2 + 7])
