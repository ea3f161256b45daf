"""A tolerance that the user states holds for every sample; its scale is that of the first table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.tables.channels import channels
from comparison.tables.mapping import Quantity, Stated, own_channel
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare
from comparison.verdict.results import SceneComparison
from comparison.words.verdicts import scene_reason

N = 1001
TIME = np.linspace(0.0, 2.0, N)
WAVE = 0.1 * np.sin(5 * TIME) + 0.02


def table(time: np.ndarray = TIME, **columns: np.ndarray) -> Table:
    return Table(pd.DataFrame({"time": time} | columns))


def judged(a: np.ndarray, b: np.ndarray, channel: str = "slider_y", **options: float) -> SceneComparison:
    return compare(
        Runs(table(**{channel: a})), Runs(table(**{channel: b})), **({"tolerance": 1e-3} | options)
    )


def with_samples(values: np.ndarray, where: slice | int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[where] = value
    return changed


def test_a_column_of_zeros_with_one_large_sample_differs():
    result = judged(np.zeros(N), with_samples(np.zeros(N), 300, 1e5), "reaction_A_x")
    channel = result.channels["reaction_A_x"]
    assert (result.verdict, channel.outside, channel.scale) == ("differ", 1, 0.0)
    assert "at t = 0.6 s" in scene_reason(result)
    assert "constant in the first table" in scene_reason(result)
    # As the first table it makes its own scale; it is told all the same.
    assert judged(with_samples(np.zeros(N), 300, 1e5), np.zeros(N), "reaction_A_x").verdict == "differ"


@pytest.mark.parametrize("swapped", [False, True])
def test_an_outlier_does_not_hide_an_error_everywhere(swapped):
    pair = WAVE, with_samples(1.05 * WAVE, 500, 1e5)
    result = judged(*(pair[::-1] if swapped else pair))
    assert result.verdict == "differ"
    channel = result.channels["slider_y"]
    assert channel.worst_time == TIME[500]
    # Where the first table is sound, all samples more than 2 % of its range 0.2 m from zero are told.
    if not swapped:
        assert channel.scale == np.ptp(WAVE)
        assert channel.outside == np.sum(np.abs(0.05 * WAVE) > 1e-3 * np.ptp(WAVE))


def test_the_last_five_samples_count():
    result = judged(WAVE, with_samples(WAVE, slice(-5, None), 1e6))
    assert result.verdict == "differ"
    assert result.channels["slider_y"].outside == 5
    assert "5 of 1001 samples are outside the tolerance" in scene_reason(result)


def test_a_spike_of_half_the_range_differs_and_a_share_may_allow_it():
    spiked = WAVE + np.where(np.arange(N) == 400, 0.1, 0.0)
    result = judged(WAVE, spiked)
    assert (result.verdict, result.channels["slider_y"].outside) == ("differ", 1)
    assert "required: at least" not in scene_reason(result)
    allowed = judged(WAVE, spiked, share=0.999)
    assert allowed.verdict == "agree"
    # Count and worst stand there even so.
    assert "1 of 1001 samples are outside the tolerance, at worst at t = 0.8 s" in scene_reason(allowed)
    assert "required: at least 99.95%" in scene_reason(judged(WAVE, spiked, share=0.9995))


def test_an_agreement_names_the_sample_that_is_nearest_to_the_tolerance():
    result = judged(WAVE, WAVE + np.where(np.arange(N) == 400, 1e-5, 0.0))
    assert result.verdict == "agree"
    assert "0 of 1001 samples are outside the tolerance, the nearest at t = 0.8 s" in scene_reason(result)


def test_a_constant_rate_is_no_crash_and_a_late_table_still_differs():
    steady = 3.0 * TIME
    assert judged(steady, steady).verdict == "agree"
    assert judged(steady, steady + 1.0, tolerance=1e-2).verdict == "differ"
    both = {"slider_y": steady, "slider_vy": np.full(N, 3.0)}
    assert compare(Runs(table(**both)), Runs(table(**both)), tolerance=1e-3).verdict == "agree"


@pytest.mark.parametrize("rows", [2, 3])
def test_tables_of_few_rows(rows):
    few = table(TIME[:rows], slider_y=WAVE[:rows])
    other = table(TIME[:rows], slider_y=with_samples(WAVE[:rows], 1, 0.5))
    assert compare(Runs(few), Runs(few), tolerance=1e-3).verdict == "agree"
    assert compare(Runs(few), Runs(other), tolerance=1e-3).verdict == "differ"


@pytest.mark.parametrize("finer", [1, 2, 3])
@pytest.mark.parametrize("first", [True, False])
def test_eighty_percent_of_a_run_missing_in_the_middle_is_refused(finer, first):
    time = np.linspace(0.0, 2.0, finer * (N - 1) + 1)
    holed = np.abs(time - 1.0) > 0.8
    whole, part = table(slider_y=WAVE), table(time[holed], slider_y=0.1 * np.sin(5 * time[holed]) + 0.02)
    pair = (part, whole) if first else (whole, part)
    with pytest.raises(TableError, match=r"^[ab] has no row between 0.19.* and 1.80.* s: \d+ rows are"):
        compare(*map(Runs, pair), tolerance=1e-3)


def test_one_missing_row_is_a_warning_and_two_are_refused():
    def without(*rows: int) -> Table:
        kept = np.delete(np.arange(N), rows)
        return table(TIME[kept], slider_y=WAVE[kept])

    # Between its neighbours, 4 ms apart, the line through them is off by 25 * 0.1 * (2e-3)^2 / 2 = 5e-6 m.
    result = compare(Runs(table(slider_y=WAVE)), Runs(without(500)), tolerance=1e-3)
    assert result.verdict == "agree"
    assert "b has no row between 0.998 and 1.002 s: 1 row is missing" in result.warnings
    for rows in ((500, 501), (300, 700)):
        with pytest.raises(TableError, match=r"b has no row between .* 2 rows are missing"):
            compare(Runs(table(slider_y=WAVE)), Runs(without(*rows)), tolerance=1e-3)
    # What both lack is compared nowhere, which is said.
    result = compare(Runs(without(*range(300, 700))), Runs(without(*range(300, 700))), tolerance=1e-3)
    assert result.warnings == ("both tables have no row between 0.598 and 1.4 s: 400 rows are missing",)


def test_a_spike_between_the_times_of_the_other_table_is_reported():
    fine = np.linspace(0.0, 2.0, 3 * (N - 1) + 1)
    spiked = 0.1 * np.sin(5 * fine) + 0.02
    quiet = compare(Runs(table(slider_y=WAVE)), Runs(table(fine, slider_y=spiked)), tolerance=1e-3)
    assert not [line for line in quiet.warnings if "stand out" in line]
    result = compare(
        Runs(table(slider_y=WAVE)),
        Runs(table(fine, slider_y=with_samples(spiked, 1000, 1e5))),
        tolerance=1e-3,
    )
    (line,) = [line for line in result.warnings if "stand out" in line]
    assert f"slider_y at t = {fine[1000]:.6g} s by 1e+05 m" in line


COLUMNS = {
    "slider_x": 1e-4 * np.sin(9 * TIME) - 0.55,
    "slider_y": WAVE,
    "slider_omega": np.cos(3 * TIME),
    "reaction_A_x": 40 * np.sin(7 * TIME),
    "corner_ll_normal": np.where(np.sin(40 * TIME) > 0.9, 30.0, 0.0),
    "energy_kinetic": np.full(N, 2.0),
    "guide_moment": np.zeros(N),
    "crank_speed": np.full(N, 15.0) + 0.1 * np.sin(2 * TIME),
    "knee": 30 * np.sin(6 * TIME),
    "force per weight": np.abs(np.sin(4 * TIME)),
}
OWN = {
    name: own_channel(name, Quantity(), [Stated("a", unit, COLUMNS[name])])
    for name, unit in (("knee", "deg"), ("force per weight", None))
}


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    name=st.sampled_from(list(COLUMNS)),
    row=st.integers(0, N - 1),
    times=st.floats(1.01, 1e9),
    sign=st.sampled_from([-1, 1]),
    tolerance=st.sampled_from([1e-6, 1e-3, 0.05]),
    first=st.booleans(),
)
def test_any_single_corrupted_sample_beyond_the_tolerance_is_told(name, row, times, sign, tolerance, first):
    values = COLUMNS[name]
    # Of a constant column any change is one; above the floor below which nothing counts as motion.
    size = max(times * tolerance * np.ptp(values), 1e-5)
    whole, bad = (replace(table(**COLUMNS), own=OWN) for _ in range(2))
    bad.frame.loc[row, name] += sign * size
    a, b = (bad, whole) if first else (whole, bad)
    result = compare(Runs(a), Runs(b), tolerance=tolerance)
    allowed = tolerance * result.channels[name].scale
    if abs(bad.values(name)[row] - values[row]) <= allowed:  # the sample itself widened its table's range
        assert first
        return
    assert result.verdict == "differ"
    assert {other for other, channel in result.channels.items() if channel.verdict == "differ"} == {name}
    assert (result.channels[name].outside, result.channels[name].worst_time) == (1, TIME[row])
    assert name in scene_reason(result)


@pytest.mark.parametrize(("scale", "outcome"), [(10.0, "agree"), (1.0, "differ")])
def test_a_given_scale_takes_the_place_of_the_range(scale, outcome):
    own = {"slider_y": replace(channels()["slider_y"], given=scale)}
    a, b = (replace(table(slider_y=values), own=own) for values in (np.zeros(N), np.full(N, 5e-3)))
    result = compare(Runs(a), Runs(b), tolerance=1e-3)
    assert (result.verdict, result.channels["slider_y"].scale) == (outcome, scale)
