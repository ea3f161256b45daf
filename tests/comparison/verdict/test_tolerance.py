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


def test_a_shift_is_held_against_the_tolerance_and_a_scene_sharpens_it(scene):
    """Most samples of a slow channel stay within a share of its range."""
    time = np.arange(401) * 2e-3

    def shifted(shift, names=("slider_y", "slider_vy"), **options):
        sides = []
        for late in (0.0, shift):
            phase = 2 * np.pi * (time - late) / 0.4
            y, vy = 0.112 * np.cos(phase) - 0.3, -0.112 * 2 * np.pi / 0.4 * np.sin(phase)
            sides.append(Runs(Table(pd.DataFrame({"time": time, "slider_y": y, "slider_vy": vy}))))
        return compare(*sides, tolerance=0.01, only=names, labels=("reference", "exudyn"), **options)

    # y passes its range at the range of its rate in T / (2 pi) = 64 ms: 0.64 ms at 1 %.
    assert [shifted(shift).verdict for shift in (5e-4, 8e-4, -8e-4)] == ["agree", "differ", "differ"]
    alone = shifted(8e-4, ("slider_y",))
    assert (alone.verdict, alone.channels["slider_y"].verdict) == ("differ", "agree")
    assert scene_reason(alone).startswith("exudyn is later than reference by 0.0008 s")
    assert "The tolerance allows 0.00064 s" in scene_reason(alone)
    # With the scene's scales every difference of y counts, by clearance * tan(beta) = 42 um.
    assert (shifted(1e-7, scene=scene).verdict, shifted(1e-4, scene=scene).verdict) == ("agree", "differ")


def impact(start, height=40.0):
    """Half a sine of ten samples."""
    phase = (TIME - start) / 0.02
    return np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0)


BOTH = {"tolerance": 0.05, "time_tolerance": 0.005}
NOTHING = 0 * TIME


@pytest.mark.parametrize(
    ("a", "b", "options", "verdict"),
    [
        (impact(0.3), impact(0.304), BOTH, "agree"),
        (impact(0.3), impact(0.304), {"tolerance": 0.05}, "differ"),
        (impact(0.3), impact(0.304, height=30.0), BOTH, "differ"),
        # With the range of the one that is zero as scale nothing is allowed; the other one's is 40 N.
        (impact(0.3), NOTHING, BOTH, "differ"),
        (NOTHING, impact(0.3), BOTH, "differ"),
        (impact(0.3), NOTHING, {"gate": {"max_scaled": 0.1}}, "differ"),
        (impact(0.3), NOTHING, {"gate": {"peak_scaled": 0.1}}, "differ"),
    ],
)
def test_an_impact_may_be_late_but_not_absent_nor_lower(a, b, options, verdict):
    result = compared("corner_ll_normal", a, b, **options)
    channel = result.channels["corner_ll_normal"]
    assert result.verdict == verdict
    if verdict == "agree":
        assert channel.worst_size <= channel.worst_threshold < abs(channel.max_difference)
    if options is BOTH and not (a.any() and b.any()):
        assert channel.worst_size == pytest.approx(40.0, rel=0.02)


@pytest.mark.parametrize(
    ("gate", "tolerance", "verdict"),
    [
        ({"rms_scaled": 1e-2}, None, "agree"),
        ({"rms_scaled": 1e-4}, None, "differ"),
        ({"correlation": 0.99, "rms_scaled": 0.02, "peak_scaled": 0.02}, None, "agree"),
        ({"correlation": 0.99, "peak_scaled": 1e-6}, None, "differ"),
        ({"tube_share": 0.5}, None, "agree"),
        # Beside a tolerance it adds to it
        ({"rms_scaled": 1e-4}, 0.1, "differ"),
        ({"rms_scaled": 0.1}, 0.1, "agree"),
    ],
)
def test_limits_of_metrics_decide_alone_or_beside_a_tolerance(gate, tolerance, verdict):
    result = compared("slider_x", WAVE, 1.01 * WAVE, gate=gate, tolerance=tolerance)
    channel = result.channels["slider_x"]
    assert result.verdict == verdict
    assert [check.metric for check in channel.checks] == list(gate)
    assert (channel.basis is Basis.GATE) == (not tolerance or verdict == "differ")
    if channel.basis is Basis.GATE:  # no sample decides
        assert np.isnan(channel.ratio)
        assert (result.decisive, result.worst_channel) == (None, channel)


def test_a_limit_cannot_undo_what_a_tolerance_finds_and_a_shift_is_allowed_up_to_its_time():
    one = WAVE + np.where(np.arange(TIME.size) == 200, 0.5, 0.0)
    assert compared("slider_x", WAVE, one, tolerance=0.1, gate={"rms_scaled": 0.1}).verdict == "differ"
    shifted = (np.sin(2 * np.pi * (TIME - by) / 0.4) for by in (0.008, 0.03))
    shifts = {"tolerance": 1e-3, "time_tolerance": 0.01}
    assert [compared("slider_x", WAVE, b, **shifts).verdict for b in shifted] == ["agree", "differ"]
