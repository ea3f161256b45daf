"""Errors of a result against the ideal mechanism's, and their peaks between samples."""

import numpy as np
import pytest

from comparison.reliability.errors import slider_errors
from comparison.tables.table import Table, TableError

PERIOD = 0.4
ENDS = ("time_of_min", "min", "time_of_max", "max")


def pulse(time, at, length=2e-4):
    """A half wave of height 1 around an instant."""
    phase = (time - at) / length + 0.5
    return np.where((phase > 0) & (phase < 1), np.sin(np.pi * phase), 0.0)


def test_the_ideal_is_interpolated_to_the_times_of_the_result_whatever_they_are(press):
    fine = press(5.0, per_cycle=1000)
    errors = slider_errors(fine, press(per_cycle=400), PERIOD)
    assert np.array_equal(errors.time, fine.time)
    # Cubics with slopes to second order: h^3 y''''/ 24 = 1e-9 * 0.1 * 15.7^4 / 24, twice as much at the ends.
    assert np.abs(errors.by_channel["slider_y"]).max() < 4e-7
    assert errors.by_channel["slider_ay"] == pytest.approx(np.full(2001, 5.0), abs=1e-4)
    odd = Table(fine.frame.iloc[np.r_[0:999, 1000:2001]])
    assert slider_errors(odd, press(), PERIOD).time.size == 2000
    assert not slider_errors(press(), press(), PERIOD).by_channel["slider_vy"].any()


def test_tables_that_cannot_be_held_against_each_other_are_refused_in_one_line(press):
    usual, bare = press(), Table(press().frame.drop(columns="slider_ay"))
    late = Table(usual.frame.assign(time=usual.time + 0.1))
    for actual, ideal, options, rule in (
        (usual, bare, {}, "ideal mechanism's: channel slider_ay is missing"),
        (late, usual, {}, "the result: does not start at t = 0 s"),
        (usual, usual, {"names": ["slider_z"]}, "holds none of slider_z"),
        (usual, usual, {"start": 1.0}, "no interval in common"),
    ):
        with pytest.raises(TableError, match=rule):
            slider_errors(actual, ideal, PERIOD, **options)


def test_the_peak_of_a_window_is_that_of_its_cycle_with_its_sign_also_between_samples(press):
    """The case of the second cycle: the run's extremum is in the first."""
    # Half an interval beside the samples, which are two to a contact.
    time, high, low = press().time, 0.1002, 0.6002
    table = press(-100.0 * pulse(time, high) + 77.5 * pulse(time, low))
    ideal = [-0.1 * (2 * np.pi / PERIOD) ** 2 * np.cos(2 * np.pi * at / PERIOD) for at in (high, low)]
    by_cycle = ([high, 0.6], [ideal[0] - 100.0, ideal[1]], [0.2, low], [ideal[1], ideal[1] + 77.5])
    extrema = {f"slider_ay_{part}": np.array(values) for part, values in zip(ENDS, by_cycle, strict=True)}
    errors = slider_errors(Table(table.frame, cycle_extrema=extrema), press(), PERIOD)
    for window, size, at in (((), -100.0, high), ((0.0, 0.4), -100.0, high), ((0.4, 0.8), 77.5, low)):
        peak = errors.peak("slider_ay", *window)
        # The ideal one between its samples: as above.
        assert (peak.value, peak.time) == (pytest.approx(size, abs=1e-4), at)
    with pytest.raises(TableError, match=r"no sample from 0\.9 to 1 s"):
        errors.peak("slider_ay", 0.9, 1.0)
    assert abs(slider_errors(table, press(), PERIOD).peak("slider_ay", 0.4, 0.8).value) < 60.0
    # Where only other channels have extrema by cycle those of the whole run count.
    whole = {"slider_ay": dict(zip(ENDS, (high, -130.0, 0.2, 30.0), strict=True))}
    of_x = {f"slider_x_{part}": np.array([0.0, 0.0]) for part in ENDS}
    held = Table(table.frame, extrema=whole, cycle_extrema=of_x)
    assert slider_errors(held, press(), PERIOD).peak("slider_ay").time == high
