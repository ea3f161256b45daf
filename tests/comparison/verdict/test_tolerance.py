"""Tables without uncertainties: a tolerance for every sample, limits of metrics, holes and shifts."""

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare
from hypothesis import given
from hypothesis import strategies as st

from comparison.accuracy.uncertainty import Runs
from comparison.metrics import tube_distance
from comparison.tables.table import Table
from comparison.verdict.results import Basis
from comparison.words.verdicts import scene_reason

N = 1001
TIME = np.linspace(0.0, 2.0, N)
WAVE = 0.1 * np.sin(5 * TIME) + 0.02
LABELS = ("reference", "exudyn")


def table(time=TIME, **columns):
    return Table(pd.DataFrame({"time": time} | columns))


def judged(a, b, channel="slider_y", **options):
    """Compare one channel, by a tolerance of a thousandth unless there is another limit."""
    options = options if {"tolerance", "gate"} & options.keys() else options | {"tolerance": 1e-3}
    return compare(Runs(table(**{channel: a})), Runs(table(**{channel: b})), **options)


# A shift in time


def slider(time, names, shown=None):
    """y driven by the crank, x flying from wall to wall of 0.2 mm clearance; shown at other times."""
    phase = 2 * np.pi * time / 0.4
    beats = 12 * time / 0.4 + 1.5 * np.sin(phase)
    x = 2e-4 * (2 * np.abs(2 * (beats % 1) - 1) - 1)
    vx = 8e-4 * (12 + 3 * np.pi * np.cos(phase)) / 0.4 * np.where(beats % 1 < 0.5, -1.0, 1.0)
    columns = {
        "slider_x": x - 0.55,
        "slider_y": 0.112 * np.cos(phase) - 0.3 + 0.2 * x,
        "slider_vx": vx,
        "slider_vy": -0.112 * 2 * np.pi / 0.4 * np.sin(phase) + 0.2 * vx,
    }
    return table(time if shown is None else shown, **{name: columns[name] for name in names})


ALL = ("slider_x", "slider_y", "slider_vx", "slider_vy")


@pytest.mark.parametrize("names", [ALL[:2], ALL, ALL[:1]])
@pytest.mark.parametrize(("shift", "finer"), [(1e-4, 1), (-1e-4, 3)])
def test_a_shift_of_a_tenth_of_a_millisecond_never_agrees(names, shift, finer):
    time = np.arange(2001) * 4e-4
    other = np.arange(2000 * finer + 1) * (4e-4 / finer)
    a, b = slider(time, names), slider(other - shift, names, other)
    result = compare(Runs(a), Runs(b), tolerance=0.01, labels=LABELS)
    assert (result.verdict, result.shift.value) == ("differ", pytest.approx(shift, abs=1e-6))
    if "slider_y" in names:  # 0.2 mm of 0.22 m: by itself within the tolerance
        assert result.channels["slider_y"].verdict == "agree"
    if finer == 1:  # it is not applied
        expected = a.values(names[0]) - b.values(names[0])
        np.testing.assert_array_equal(result.channels[names[0]].difference, expected)
    assert compare(Runs(a), Runs(slider(other, names)), tolerance=0.01).verdict == "agree"


def test_a_shift_is_held_against_the_tolerance_and_a_scene_sharpens_it(scene):
    time = np.arange(401) * 2e-3

    def shifted(shift, names=("slider_y", "slider_vy"), **options):
        # Not from an instant at which x turns round: vy would jump at whole multiples of the sample.
        a, b = (Runs(slider(time + 3.7e-4 - late, names, time)) for late in (0.0, shift))
        return compare(a, b, tolerance=0.01, only=names, labels=LABELS, **options)

    # y passes its range at the range of its rate in T / (2 pi) = 64 ms: 0.64 ms at 1 %.
    assert (shifted(5e-4).verdict, shifted(8e-4).verdict) == ("agree", "differ")
    alone = shifted(8e-4, ("slider_y",))
    assert (alone.verdict, alone.channels["slider_y"].verdict) == ("differ", "agree")
    assert scene_reason(alone).startswith("exudyn is later than reference by 0.0008 s")
    assert "The tolerance allows 0.00064 s" in scene_reason(alone)
    # With the scene's scales every difference of y counts, by clearance * tan(beta) = 42 um.
    assert (shifted(1e-7, scene=scene).verdict, shifted(1e-4, scene=scene).verdict) == ("agree", "differ")


# A tolerance in time, and limits of metrics


def impact(start, height=40.0):
    """Half a sine of ten samples."""
    phase = (TIME - start) / 0.02
    return np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0)


def of_force(a, b, **options):
    return judged(a, b, "corner_ll_normal", **options)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.1))
def test_the_distance_within_a_reach_is_symmetric_and_never_more_than_the_difference(seed, reach):
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0.0, 1.0, 50))
    a, b = rng.normal(size=(2, 50))
    distance = tube_distance(time, a, b, reach)
    np.testing.assert_array_equal(distance, tube_distance(time, b, a, reach))
    # Interpolation at the ends of the reach rounds.
    assert np.all(distance <= np.abs(a - b) + 1e-12)
    np.testing.assert_allclose(tube_distance(time, a, b, 0.0), np.abs(a - b), rtol=0, atol=1e-12)
    # Against plain Python, sample by sample; beyond the ends b is continued.
    for n in np.flatnonzero((time >= time[0] + reach) & (time <= time[-1] - reach)):
        near = b[np.abs(time - time[n]) <= reach], np.interp([time[n] - reach, time[n] + reach], time, b)
        low, high = np.concatenate(near).min(), np.concatenate(near).max()
        assert distance[n] >= max(low - a[n], a[n] - high, 0.0) - 1e-12


def test_an_impact_may_be_late_but_not_absent_nor_lower():
    both = {"tolerance": 0.05, "time_tolerance": 0.005}
    result = of_force(impact(0.3), impact(0.304), **both)
    late = result.channels["corner_ll_normal"]
    assert result.verdict == "agree"
    assert late.worst_size <= late.worst_threshold < abs(late.max_difference)
    assert of_force(impact(0.3), impact(0.304), tolerance=0.05).verdict == "differ"
    assert of_force(impact(0.3), impact(0.304, height=30.0), **both).verdict == "differ"
    for pair in ((impact(0.3), 0 * TIME), (0 * TIME, impact(0.3))):
        # With the range of the one that is zero as scale nothing is allowed; the other one's is 40 N.
        absent = of_force(*pair, **both)
        assert (absent.verdict, "within 0.005 s" in scene_reason(absent)) == ("differ", True)
        assert absent.channels["corner_ll_normal"].worst_size == pytest.approx(40.0, rel=0.02)
    for metric in ("max_scaled", "peak_scaled"):
        assert of_force(impact(0.3), 0 * TIME, gate={metric: 0.1}).verdict != "agree"
    # A shift of the whole is allowed up to that time.
    wave, *others = (np.sin(2 * np.pi * (TIME - by) / 0.4) for by in (0.0, 0.008, 0.03))
    assert [judged(wave, b, time_tolerance=0.01).verdict for b in others] == ["agree", "differ"]


@pytest.mark.parametrize(
    ("gate", "tolerance", "verdict", "said"),
    [
        ({"rms_scaled": 1e-2}, None, "agree", "the limit of the gate is met"),
        ({"rms_scaled": 1e-4}, None, "differ", "rms_scaled is "),
        ({"correlation": 0.99, "rms_scaled": 0.02, "peak_scaled": 0.02}, None, "agree", "all 3 "),
        ({"correlation": 0.99, "peak_scaled": 1e-6}, None, "differ", "required: at most 1e-06"),
        ({"tube_share": 0.5}, None, "agree", "the limit of the gate is met"),
        # Beside a tolerance it adds to it
        ({"rms_scaled": 1e-4}, 0.1, "differ", "rms_scaled is "),
        ({"rms_scaled": 0.1}, 0.1, "agree", "samples are outside"),
    ],
)  # fmt: skip
def test_limits_of_metrics_decide_alone_or_beside_a_tolerance(gate, tolerance, verdict, said):
    wave = np.sin(2 * np.pi * TIME / 0.4)
    result = judged(wave, 1.01 * wave, "slider_x", gate=gate, tolerance=tolerance)
    channel = result.channels["slider_x"]
    assert (result.verdict, said in scene_reason(result)) == (verdict, True)
    assert [check.metric for check in channel.checks] == list(gate)
    assert (channel.basis is Basis.GATE) == (not tolerance or verdict == "differ")
    if channel.basis is Basis.GATE:  # no sample decides
        assert np.isnan(channel.ratio)
        assert (result.decisive, result.worst_channel) == (None, channel)
    # It cannot undo what a tolerance finds.
    one = wave + np.where(np.arange(N) == 200, 0.5, 0.0)
    assert judged(wave, one, "slider_x", tolerance=0.1, gate={"rms_scaled": 0.1}).verdict == "differ"
