"""From tables to reliabilities: errors against the ideal mechanism, exact cases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from comparison.reliability.assessment import assess
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene.schema import AccelerationLimits, Reliability

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
    angle = np.arange(2001) * 0.36 % 360.0
    error = np.where((angle > 100.0) & (angle < 107.9), 90.0, 0.0)
    found = assess(slider_errors(press(error), press(), PERIOD), SETTINGS)["acceleration"]
    assert found.angle[found.worst] == 108.0
    assert found.cycles.tolist() == [2] * 10
    # 22 samples of 100 intervals of 0.36 degrees, from 100.08 to 107.64.
    share = 0.22
    assert found.within[found.worst] == pytest.approx(1 - share, abs=1e-12)
    assert np.delete(found.within, found.worst).tolist() == [1.0] * 9
    assert found.mean[found.worst] == pytest.approx(90 * share, rel=1e-12)
    assert found.deviation[found.worst] == pytest.approx(90 * np.sqrt(share * (1 - share)), rel=1e-12)
    # Where between samples it begins and ends is not known: of each a half interval by either half of them.
    assert found.within_high[found.worst] - found.within[found.worst] >= 0.01


def test_known_signals_have_their_exact_moments(press):
    """A ramp in every part of the cycle, and a sine over all of it."""
    whole = Reliability(bins=1, errors="signed", acceleration=AccelerationLimits(upper=LIMIT))
    for per_cycle in (300, 333, 1000, 10_000):
        ideal = press(per_cycle=per_cycle)
        phase = ideal.time / PERIOD % 1.0
        sine = 30.0 * np.sin(2 * np.pi * phase) + 5.0
        found = assess(slider_errors(press(sine, per_cycle=per_cycle), ideal, PERIOD), whole)["acceleration"]
        # The trapezoidal rule over whole periods is exact.
        assert found.mean == pytest.approx([5.0], rel=1e-12)
        assert found.deviation == pytest.approx([30.0 / np.sqrt(2.0)], rel=1e-12)
        ramp = np.append(phase[:-1], 1.0)
        found = assess(slider_errors(press(10.0 + ramp, per_cycle=per_cycle), ideal, PERIOD), SETTINGS)
        of = found["acceleration"]
        # In a part it rises by a tenth; where it falls back to zero, between two samples, the last one errs.
        assert of.mean[1:-1] == pytest.approx(10.15 + 0.1 * np.arange(8), rel=1e-12)
        # Squares are not linear: h^2 / 6 too much of an interval h, of a part of one less. Round-off of 10^2.
        variance = of.deviation[1:-1] ** 2 - 0.01 / 12
        assert np.all((variance >= -1e-11) & (variance <= 1 / 6 / per_cycle**2 * 1.02 + 1e-11))


def test_an_error_to_either_side_is_outside_the_limit(press):
    for error in (90.0, -90.0):
        found = assess(slider_errors(press(error), press(), PERIOD), SETTINGS)["acceleration"]
        assert found.within.tolist() == [0.0] * 10


def test_limits_and_bins_are_the_scenes(press):
    settings = Reliability(bins=4, acceleration=AccelerationLimits(lower=1.0, upper=9.0))
    found = assess(slider_errors(press(2.0), press(), PERIOD), settings)["acceleration"]
    assert found.angle.tolist() == [90.0, 180.0, 270.0, 360.0]
    assert found.reliability == pytest.approx(np.full(4, ndtr((5.0 - 2.0) / (8.0 / 6.0))), rel=1e-12)


def test_a_part_of_a_cycle_fills_the_first_bin_as_far_as_it_goes(press):
    found = assess(slider_errors(press(5.0, cycles=0.06), press(cycles=0.06), PERIOD), SETTINGS)
    assert found["acceleration"].angle.tolist() == [36.0]
    assert found["acceleration"].cycles.tolist() == [1]
    assert found["acceleration"].mean == pytest.approx([5.0], rel=1e-12)
