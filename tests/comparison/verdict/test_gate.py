"""Limits of metrics, and a tolerance in time, for tables without uncertainties."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.cli import main
from comparison.metrics.signals import tube_distance
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import write
from comparison.verdict.compare import Runs, compare
from comparison.verdict.results import METRICS, Basis
from comparison.words.cards import card
from comparison.words.record import as_mapping
from comparison.words.verdicts import scene_reason

N = 401
TIME = np.linspace(0.0, 0.8, N)
WAVE = np.sin(2 * np.pi * TIME / 0.4)


def impact(start: float, height: float = 40.0) -> np.ndarray:
    """Half a sine of ten samples."""
    phase = (TIME - start) / 0.02
    return np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0)


def judged(a, b, name="corner_ll_normal", **options):
    tables = [Table(pd.DataFrame({"time": TIME, "slider_y": WAVE, name: values})) for values in (a, b)]
    return compare(*map(Runs, tables), **options)


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
    # Against plain Python, sample by sample.
    for n in (0, 17, 49):
        near = np.abs(time - time[n]) <= reach
        if time[0] + reach <= time[n] <= time[-1] - reach:  # beyond the ends b is continued
            ends = np.interp([time[n] - reach, time[n] + reach], time, b)
            low, high = min(b[near].min(), *ends), max(b[near].max(), *ends)
            assert distance[n] >= max(low - a[n], a[n] - high, 0.0) - 1e-12


def test_an_impact_may_be_late_but_not_absent():
    late = judged(impact(0.3), impact(0.304), tolerance=0.05, time_tolerance=0.005)
    assert late.verdict == "agree"
    assert judged(impact(0.3), impact(0.304), tolerance=0.05).verdict == "differ"
    for a, b in ((impact(0.3), 0 * TIME), (0 * TIME, impact(0.3))):
        # With the range of the one that is zero as scale nothing is allowed; the other one's is 40 N.
        absent = judged(a, b, tolerance=0.05, time_tolerance=0.005)
        assert absent.verdict == "differ"
        assert absent.channels["corner_ll_normal"].worst_size == pytest.approx(40.0, rel=0.02)
        assert "within 0.005 s" in scene_reason(absent)
    low = judged(impact(0.3), impact(0.304, height=30.0), tolerance=0.05, time_tolerance=0.005)
    assert low.verdict == "differ"


def test_a_shift_of_the_whole_is_allowed_up_to_the_time_tolerance():
    def shifted(by: float):
        tables = [
            Table(pd.DataFrame({"time": TIME, "slider_y": np.sin(2 * np.pi * (TIME - s) / 0.4)}))
            for s in (0.0, by)
        ]
        return compare(*map(Runs, tables), tolerance=1e-3, time_tolerance=0.01).verdict

    assert shifted(0.008) == "agree"
    assert shifted(0.03) == "differ"


@pytest.mark.parametrize(
    ("gate", "verdict"),
    [
        ({"rms_scaled": 1e-2}, "agree"),
        ({"rms_scaled": 1e-4}, "differ"),
        ({"correlation": 0.99, "sprague_geers_combined": 0.02, "peak_scaled": 0.02}, "agree"),
        ({"correlation": 0.99, "sprague_geers_combined": 1e-6}, "differ"),
        ({"iso18571": 0.94}, "agree"),
    ],
)
def test_a_gate_alone_decides(gate, verdict):
    result = judged(WAVE, 1.01 * WAVE, "slider_x", gate=gate)
    assert result.verdict == verdict
    channel = result.channels["slider_x"]
    assert channel.basis is Basis.GATE
    assert [check.metric for check in channel.checks] == list(gate)
    assert ("of the gate " in scene_reason(result)) == (verdict == "agree")


def test_a_gate_adds_to_a_tolerance_and_cannot_undo_it():
    spiked = WAVE + np.where(np.arange(N) == 200, 0.5, 0.0)
    assert judged(WAVE, spiked, "slider_x", tolerance=0.1, gate={"rms_scaled": 0.1}).verdict == "differ"
    assert judged(WAVE, 1.01 * WAVE, "slider_x", tolerance=0.1, gate={"rms_scaled": 1e-4}).verdict == "differ"
    assert judged(WAVE, 1.01 * WAVE, "slider_x", tolerance=0.1, gate={"rms_scaled": 0.1}).verdict == "agree"


def test_a_gate_that_fails_within_the_tolerance_has_no_ratio_and_is_the_channel_shown():
    result = judged(WAVE, 1.01 * WAVE, "slider_x", tolerance=0.1, gate={"rms_scaled": 1e-4})
    failing = result.channels["slider_x"]
    assert (failing.verdict, failing.basis) == ("differ", Basis.GATE)
    assert np.isnan(failing.ratio)
    assert result.channels["slider_y"].verdict == "agree"
    assert result.decisive is None
    assert result.worst_channel is failing
    assert card(result).sentence.startswith("1 of 2 channels differ, most of all slider_x: rms_scaled is ")


def test_a_late_sample_is_shown_by_what_was_held_against_the_tolerance():
    result = judged(impact(0.3), impact(0.304), tolerance=0.05, time_tolerance=0.005)
    late = result.channels["corner_ll_normal"]
    assert late.worst_size <= late.worst_threshold < abs(late.max_difference)
    assert as_mapping(result)["channels"]["corner_ll_normal"]["worst_size"] == late.worst_size


def test_a_scene_whose_gate_names_no_metric_is_refused_before_its_runs(fake_models, scene_file, capsys):
    assert main(["validate", scene_file("own", extra="[compare.gate]\nrms = 1.0\n")]) == 2
    assert "scene 'own': compare.gate: 'rms' is not a metric" in capsys.readouterr().err
    assert not fake_models.read_text()


def test_an_absent_impact_fails_every_gate_that_sees_size():
    for metric in ("max_scaled", "sprague_geers_magnitude", "russell_comprehensive", "peak_scaled"):
        assert judged(impact(0.3), 0 * TIME, gate={metric: 0.1}).verdict != "agree"


def test_what_is_no_metric_is_refused_and_every_metric_is_measured():
    with pytest.raises(TableError, match=r"^gate: 'rms' is not a metric; there are max_scaled, "):
        judged(WAVE, WAVE, "slider_x", gate={"rms": 1.0})
    result = judged(WAVE, 1.01 * WAVE, "slider_x", gate=dict.fromkeys(METRICS, 0.0))
    assert [check.metric for check in result.channels["slider_x"].checks] == list(METRICS)


def test_they_stand_in_a_scene_or_a_mapping_and_in_the_numbers(make_table, scene_file, capsys):
    write(make_table(), Path("a.csv"))
    write(make_table(stretch=1e-3), Path("b.csv"))
    Path("loose.toml").write_text("[gate]\nrms_scaled = 1e-2\n")
    Path("close.toml").write_text("[gate]\nrms_scaled = 1e-5\n")
    assert main(["compare", "a.csv", "b.csv", "--mapping", "loose.toml"]) == 0
    capsys.readouterr()
    assert main(["compare", "a.csv", "b.csv", "--mapping", "close.toml", "--json"]) == 1
    (check,) = json.loads(capsys.readouterr().out)["channels"]["slider_x"]["gate"]
    assert (check["metric"], check["limit"], check["met"]) == ("rms_scaled", 1e-5, False)
    own = Path(
        scene_file("own", extra="[compare]\ntime_tolerance = 1e-4\n[compare.gate]\nrms_scaled = 1e-2\n")
    )
    own.write_text(own.read_text().replace("samples_per_cycle = 100", "samples_per_cycle = 200"))
    assert main(["compare", "a.csv", "b.csv", "--scene", str(own)]) == 0
    assert main(["compare", "a.csv", "b.csv", "--time-tolerance", "-1"]) == 2
