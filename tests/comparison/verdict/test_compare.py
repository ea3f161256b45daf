"""The origin of a difference; verdicts by tolerances and limits; the outlier of three models."""

from dataclasses import replace
from math import isnan

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare

from comparison.accuracy.uncertainty import Runs
from comparison.tables.table import Table
from comparison.verdict.results import Basis
from comparison.verdict.validate import pairs, standing
from comparison.words import verdicts as words
from comparison.words.differences import attribution_lines
from comparison.words.verdicts import scene_reason


@pytest.fixture
def make_runs(make_table):
    """Runs of a second-order method with an error: ``make_runs(error, ...)``, the rest as of `make_table`."""

    def make(error, refinement=(2.0, 2.0), **options):
        tables = [make_table(part * error, **options) for part in (1.0, 0.25, 4.0, 4.0, 4.0)]
        return Runs(*tables, refinement=refinement)

    return make


def comparison(scene, a, b):
    return compare(a, b, scene=scene, labels=("reference", "exudyn"))


def move(runs, start, **columns):
    for kind in ("base", "finer", "perturbed", "coarser", "other_perturbed"):
        frame = getattr(runs, kind).frame
        for name, offset in columns.items():
            frame.loc[frame["time"] > start, name] += offset
    return runs


# Sizes go with the errors e_a and e_b, and refining leaves a quarter of its own side's.
# The tables round at 1e-16 m of differences of 2e-10 m: 1e-6 of them.
@pytest.mark.parametrize(("e_a", "e_b"), [(3e-6, 0.0), (1e-6, -2e-6), (1e-6, 3e-5)])
def test_what_refining_either_side_or_both_leaves_of_a_difference(scene, make_runs, e_a, e_b):
    result = comparison(scene, make_runs(e_a), make_runs(e_b))
    attribution = result.attribution
    assert (result.verdict, attribution.explained, attribution.outside_in) == ("agree", 1.0, "")
    distances = {"a": abs(e_a / 4 - e_b), "b": abs(e_a - e_b / 4), "both": abs(e_a / 4 - e_b / 4)}
    expected = {key: pytest.approx(size / abs(e_a - e_b), rel=1e-5) for key, size in distances.items()}
    assert (attribution.remaining, attribution.unpredictable) == (expected, {})


def test_the_lines_state_the_setting_its_value_and_what_was_expected_of_it(scene, make_runs):
    result = comparison(scene, make_runs(1e-10, refinement=(10.0, 1.0)), make_runs(1e-6))
    assert attribution_lines(result) == [
        "100.00% of the judged samples explained",
        "remaining difference: 100.0% with reference's tolerance / 10 (1e-10; 0.1 of its own error), 25.0% "
        "with exudyn's step / 2 (2e-06 s; with its tolerance, 1e-07; 0.25 of its own error), 25.0% with both",
    ]


def test_a_difference_of_models_is_located_by_time_channel_and_contact(scene, make_runs):
    # From 14 ms on the second model moves further: the first sample then is the eighth, at 2 ms each.
    a, b = make_runs(1e-6), move(make_runs(2e-6), 0.013, slider_x=1e-7, slider_y=1e-12)
    events = pd.DataFrame({"corner": ["ul", "ll"], "start": [0.0135, 0.1], "end": [0.0145, 0.2]})
    events = events.assign(normal_speed=0.1, impulse=0.1, peak_force=1.0, largest_depth=1e-6)
    result = comparison(scene, replace(a, base=replace(a.base, events=events)), b)
    attribution = result.attribution
    assert result.verdict == "differ"
    # Of channels that part at one instant the one farthest outside is named.
    assert (attribution.outside_in, attribution.outside_from) == ("slider_x", pytest.approx(0.014))
    assert attribution_lines(result)[-1] == (
        "first outside the band: slider_x at 0.014 s (cycle 1, crank at 124°), "
        "during contact of the upper left corner"
    )
    # Errors of 1e-6 and 2e-6 of 2e-4 m beside 1e-7 m: refinement removes less than 3/4 * 2 * 2 * 4e-10.
    assert all(abs(attribution.remaining[key] - 1) < 1.2e-2 for key in ("a", "b", "both"))
    # Of 21 channels one differs: the share that is explained counts all of them.
    assert 1 - 2 / 21 < attribution.explained < 1 - 0.9 / 21
    # Of tables without uncertainties only that instant is known.
    alone = compare(Runs(a.base), Runs(b.base), tolerance=1e-4).attribution
    assert (alone.outside_from, alone.refinements) == (pytest.approx(0.014), ())
    assert isnan(alone.explained)


def test_the_model_that_limits_the_coverage_is_named(scene, make_runs):
    result = comparison(scene, make_runs(1e-6), make_runs(3e-2))
    assert result.channels["slider_x"].verdict == "indeterminate"
    assert result.attribution.unpredictable == {"a": 0.0, "b": 1.0, "each": 0.0, "together": 0.0}


THREE = ("one", "two", "three")


@pytest.mark.parametrize(
    ("verdicts", "outcome", "sentence"),
    [
        ("differ, differ, agree", "outlier", "One is the outlier: it differs from two and three, which"),
        ("differ, agree, differ", "outlier", "Two is the outlier"),
        ("agree, agree, agree", "agree", "All 3 agree."),
        # Near the threshold agreement is not transitive.
        ("agree, agree, differ", "differ", "No model is the outlier: two and three differ"),
        ("differ, differ, differ", "differ", "one and three differ"),
        ("indeterminate, differ, differ", "undecided", "one and two: indeterminate"),
        ("agree, cannot compare, cannot compare", "agree", "; three cannot be compared."),
        ("differ, cannot compare, cannot compare", "differ", "one and two differ"),
        ("agree, agree, cannot compare", "undecided", "two and three: cannot compare"),
        ("cannot compare, cannot compare, cannot compare", "cannot compare", "one, two and three cannot be"),
    ],
)
def test_the_model_that_differs_from_two_that_agree_is_the_outlier_else_none(verdicts, outcome, sentence):
    result = standing(THREE, dict(zip(pairs(THREE), verdicts.split(", "), strict=True)))
    assert (result.outcome, bool(result.outlier)) == (outcome, outcome == "outlier")
    assert sentence in words.standing(result)


TIME = np.linspace(0.0, 2.0, 1001)
WAVE = np.sin(2 * np.pi * TIME / 0.4)


def judge(name, a, b, **options):
    return compare(*(Runs(Table(pd.DataFrame({"time": TIME, name: each}))) for each in (a, b)), **options)


def test_a_shift_is_held_against_the_tolerance():
    """Most samples of a slow channel stay within a share of its range."""

    def runs(delay):
        w = 2 * np.pi / 0.4
        y, vy = np.cos(w * (TIME - delay)), -w * np.sin(w * (TIME - delay))
        return Runs(Table(pd.DataFrame({"time": TIME, "slider_y": y, "slider_vy": vy})))

    for shift, verdict in ((5e-4, "agree"), (8e-4, "differ"), (-8e-4, "differ")):
        # y passes its range at the range of its rate in T / (2 pi) = 64 ms: 0.64 ms at 1 %.
        sides = runs(0.0), runs(shift)
        result = compare(*sides, tolerance=0.01, only=["slider_y"], labels=("reference", "exudyn"))
        assert (result.verdict, result.channels["slider_y"].verdict) == (verdict, "agree")
    assert scene_reason(result).startswith("reference is later than exudyn by 0.0008 s")
    assert "The tolerance allows 0.00064 s" in scene_reason(result)


@pytest.mark.parametrize(
    ("options", "verdict"),
    [
        ({"tolerance": 1e-6}, "indeterminate"),
        ({"tolerance": 1e-6, "gate": {"rms_scaled": 1e-3}}, "indeterminate"),
        ({"tolerance": 1e-12, "absolute": True}, "differ"),
        ({"tolerance": 1e-6, "tolerances": {"energy_residual": 1e-6}}, "differ"),
    ],
)
def test_a_share_of_its_own_range_does_not_limit_an_error(options, verdict):
    """The residual of one run is its round-off, that of the other a thousand times as large."""
    sides = (
        Runs(Table(pd.DataFrame({"time": TIME, "slider_x": WAVE, "energy_residual": size * WAVE})))
        for size in (1e-11, 1e-8)
    )
    result = compare(*sides, **options)
    assert result.channels["energy_residual"].verdict == verdict
    assert result.verdict == ("differ" if verdict == "differ" else "agree")


def test_no_sample_of_a_constant_channel_is_outside():
    channel = judge("slider_x", 1e-16 * WAVE, 2e-16 * WAVE, tolerance=1e-6).channels["slider_x"]
    assert (channel.verdict, channel.outside) == ("unexcited", 0)


def test_a_spike_between_the_compared_times_stands_out_and_the_curvature_of_a_wave_does_not():
    spike = WAVE + 0.1 * (np.arange(TIME.size) == 503)
    for x, alarm in ((WAVE, False), (spike, True)):
        fine = pd.DataFrame({"time": TIME, "slider_x": x, "slider_y": WAVE})
        coarse = pd.DataFrame({"time": TIME, "slider_x": WAVE, "slider_y": WAVE})[::5]
        warnings = " ".join(compare(Runs(Table(fine)), Runs(Table(coarse)), tolerance=1e-6).warnings)
        assert ("stand out" in warnings, "slider_x at t = 1.006 s by 0.1" in warnings) == (alarm, alarm)
        assert ("in 1 channel, most" in warnings) == alarm


def impact(start, height=40.0):
    phase = (TIME - start) / 0.02
    return np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0)


BOTH = {"tolerance": 0.05, "time_tolerance": 0.005}


@pytest.mark.parametrize(
    ("b", "options", "verdict"),
    [
        (impact(0.304), BOTH, "agree"),
        (impact(0.304), {"tolerance": 0.05}, "differ"),
        (impact(0.304, height=30.0), BOTH, "differ"),
        (0 * TIME, BOTH, "differ"),
        (0 * TIME, {"gate": {"peak_scaled": 0.1}}, "differ"),
    ],
)
def test_an_impact_may_be_late_but_not_absent_nor_lower(b, options, verdict):
    for pair in ((impact(0.3), b), (b, impact(0.3)))[: 1 + ("gate" not in options)]:
        result = judge("corner_ll_normal", *pair, **options)
        channel = result.channels["corner_ll_normal"]
        assert result.verdict == verdict
        if verdict == "agree":
            assert channel.worst_size <= channel.worst_threshold < abs(channel.max_difference)
        if options is BOTH and not b.any():
            assert channel.worst_size == pytest.approx(40.0, rel=0.02)


@pytest.mark.parametrize(
    ("gate", "tolerance", "verdict"),
    [
        ({"correlation": 0.99, "rms_scaled": 0.02, "peak_scaled": 0.02}, None, "agree"),
        ({"correlation": 0.99, "peak_scaled": 1e-6}, None, "differ"),
        ({"tube_share": 0.5}, None, "agree"),
        # Beside a tolerance it adds to it
        ({"rms_scaled": 1e-4}, 0.1, "differ"),
        ({"rms_scaled": 0.1}, 0.1, "agree"),
        ({"rms_scaled": 0.1}, 1e-3, "differ"),  # and cannot undo its finding
    ],
)
def test_limits_of_metrics_decide_alone_or_beside_a_tolerance(gate, tolerance, verdict):
    result = judge("slider_x", WAVE, 1.01 * WAVE, gate=gate, tolerance=tolerance)
    channel = result.channels["slider_x"]
    assert result.verdict == verdict
    assert [check.metric for check in channel.checks] == list(gate)
    assert (channel.basis is Basis.GATE) == (not tolerance or (verdict, tolerance) == ("differ", 0.1))
    if channel.basis is Basis.GATE:  # no sample decides
        assert np.isnan(channel.ratio)
        assert (result.decisive, result.worst_channel) == (None, channel)
