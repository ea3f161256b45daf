"""Tables without uncertainties: a shift, a tolerance in time, limits of metrics."""

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare

from comparison.accuracy.uncertainty import Runs
from comparison.tables.table import Table
from comparison.verdict.results import Basis
from comparison.words.verdicts import scene_reason

TIME = np.linspace(0.0, 2.0, 1001)
WAVE = np.sin(2 * np.pi * TIME / 0.4)


def compared(name, a, b, **options):
    return compare(*(Runs(Table(pd.DataFrame({"time": TIME, name: each}))) for each in (a, b)), **options)


def test_a_shift_is_held_against_the_tolerance():
    """Most samples of a slow channel stay within a share of its range."""

    def shifted(late):
        w = 2 * np.pi / 0.4
        y, vy = np.cos(w * (TIME - late)), -w * np.sin(w * (TIME - late))
        return Runs(Table(pd.DataFrame({"time": TIME, "slider_y": y, "slider_vy": vy})))

    for shift, verdict in ((5e-4, "agree"), (8e-4, "differ"), (-8e-4, "differ")):
        # y passes its range at the range of its rate in T / (2 pi) = 64 ms: 0.64 ms at 1 %.
        sides = shifted(0.0), shifted(shift)
        result = compare(*sides, tolerance=0.01, only=["slider_y"], labels=("reference", "exudyn"))
        assert (result.verdict, result.channels["slider_y"].verdict) == (verdict, "agree")
    assert scene_reason(result).startswith("reference is later than exudyn by 0.0008 s")
    assert "The tolerance allows 0.00064 s" in scene_reason(result)


def impact(start, height=40.0):
    """Half a sine of ten samples."""
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
        result = compared("corner_ll_normal", *pair, **options)
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
        ({"rms_scaled": 0.1}, 1e-3, "differ"),  # and cannot undo what that finds
    ],
)
def test_limits_of_metrics_decide_alone_or_beside_a_tolerance(gate, tolerance, verdict):
    result = compared("slider_x", WAVE, 1.01 * WAVE, gate=gate, tolerance=tolerance)
    channel = result.channels["slider_x"]
    assert result.verdict == verdict
    assert [check.metric for check in channel.checks] == list(gate)
    assert (channel.basis is Basis.GATE) == (not tolerance or (verdict, tolerance) == ("differ", 0.1))
    if channel.basis is Basis.GATE:  # no sample decides
        assert np.isnan(channel.ratio)
        assert (result.decisive, result.worst_channel) == (None, channel)
