"""From tables to reliabilities: errors against the ideal mechanism, exact cases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from comparison.reliability.assessment import assess
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene.criteria import AccelerationLimits, Reliability
from comparison.tables.table import Table, TableError

PERIOD = 0.4
LIMIT = 80.0
SETTINGS = Reliability(acceleration=AccelerationLimits(upper=LIMIT))


def test_zero_error_is_at_the_cap_in_every_bin_of_every_quantity(press):
    found = assess(slider_errors(press(), press(), PERIOD), SETTINGS)
    assert list(found) == list(QUANTITIES) == ["displacement", "velocity", "acceleration"]
    for quantity in found.values():
        assert quantity.reliability == pytest.approx(np.full(10, 0.9986501020), abs=5e-11)
        assert quantity.minimum == quantity.cap
        assert quantity.capped.all()
        assert not quantity.half_width.any()
        assert np.all(quantity.within == 1.0)
        # Two equal cycles are no proof: two draws leave 1 - 0.025^(1/2) open.
        assert quantity.within_low == pytest.approx(np.full(10, np.sqrt(0.025)), rel=1e-9)


def test_a_constant_error_has_the_closed_form_and_its_sign_counts_only_if_asked(press):
    cap = 0.9986501020
    for error, errors, beta in ((8.0, "absolute", 2.4), (-8.0, "absolute", 2.4), (-8.0, "signed", 3.6)):
        settings = SETTINGS.model_copy(update={"errors": errors})
        found = assess(slider_errors(press(error), press(), PERIOD), settings)["acceleration"]
        # 80 m/s^2: (40 - 8) / (80 / 6).
        assert found.reliability == pytest.approx(np.full(10, ndtr(beta)), rel=1e-12)
        assert found.minimum != pytest.approx(cap, abs=1e-5)
        assert not found.capped.any()
        assert found.mean == pytest.approx(np.full(10, 8.0 if errors == "absolute" else -8.0), rel=1e-12)


def test_an_error_within_one_bin_is_found_at_its_angle_with_its_share(press):
    angle = np.arange(1, 2001) * 0.36 % 360.0
    error = np.concatenate([[0.0], np.where((angle > 100.0) & (angle <= 108.0), 90.0, 0.0)])
    found = assess(slider_errors(press(error), press(), PERIOD), SETTINGS)["acceleration"]
    assert found.angle[found.worst] == 108.0
    assert found.cycles.tolist() == [2] * 10
    share = np.mean((angle > 100.0) & (angle <= 108.0)) * 10
    assert found.within[found.worst] == pytest.approx(1 - share, abs=1e-12)
    assert np.delete(found.within, found.worst).tolist() == [1.0] * 9
    assert found.mean[found.worst] == pytest.approx(90 * share, rel=1e-12)
    assert found.deviation[found.worst] == pytest.approx(90 * np.sqrt(share * (1 - share)), rel=1e-12)


def test_an_error_to_either_side_is_outside_the_limit(press):
    for error in (90.0, -90.0):
        found = assess(slider_errors(press(error), press(), PERIOD), SETTINGS)["acceleration"]
        assert found.within.tolist() == [0.0] * 10


def test_limits_and_bins_are_the_scenes(press):
    settings = Reliability(bins=4, acceleration=AccelerationLimits(lower=1.0, upper=9.0))
    found = assess(slider_errors(press(2.0), press(), PERIOD), settings)["acceleration"]
    assert found.angle.tolist() == [90.0, 180.0, 270.0, 360.0]
    assert found.reliability == pytest.approx(np.full(4, ndtr((5.0 - 2.0) / (8.0 / 6.0))), rel=1e-12)


def test_a_foreign_ideal_of_other_times_is_interpolated(press):
    fine, coarse = press(5.0, per_cycle=1000), press(per_cycle=400)
    errors = slider_errors(fine, coarse, PERIOD)
    assert errors.per_cycle == 400
    assert errors.by_quantity["displacement"].size == 800
    # y by the cubic of y and vy: h^4 y''''/384 = 1e-3^4 * 0.1 * 15.7^4 / 384.
    assert np.abs(errors.by_quantity["displacement"]).max() < 2e-11
    # a linearly: h^2 a''/8 = (0.4e-3)^2 * 24.7 * 247 / 8.
    assert errors.by_quantity["acceleration"] == pytest.approx(np.full(800, 5.0), abs=2e-4)
    odd = Table(fine.frame.iloc[np.r_[0:999, 1000:2001]])
    assert np.abs(slider_errors(odd, press(), PERIOD).by_quantity["velocity"]).max() < 1e-3


def test_tables_that_cannot_be_held_against_each_other_are_refused_in_one_line(press):
    bare = Table(press().frame.drop(columns="slider_ay"))
    with pytest.raises(TableError, match=r"ideal mechanism's: channel slider_ay is missing"):
        slider_errors(press(), bare, PERIOD)
    late = Table(press().frame.assign(time=press().time + 0.1))
    with pytest.raises(TableError, match=r"the result: does not start at t = 0 s"):
        slider_errors(late, press(), PERIOD)


def test_a_part_of_a_cycle_fills_the_first_bin_as_far_as_it_goes(press):
    found = assess(slider_errors(press(cycles=0.06), press(cycles=0.06), PERIOD), SETTINGS)
    assert found["velocity"].angle.tolist() == [36.0]
    assert found["velocity"].cycles.tolist() == [1]
