"""From errors to reliabilities: the cap, exact cases, what moves them."""

import numpy as np
import pytest
from scipy.special import ndtr

from comparison.reliability.assessment import assess, cap, reliability_index, sensitivity
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene.schema import AccelerationLimits, Limits, Reliability

PHI_3 = 0.9986501020  # ten digits, as printed in tables
PERIOD = 0.4


@pytest.fixture
def assessed(press):
    """Assess the acceleration of a press with an error."""

    def assessed(error, per_cycle=1000, cycles=2, upper=80.0, lower=0.0, **changes):
        settings = Reliability(acceleration=AccelerationLimits(lower=lower, upper=upper), **changes)
        tables = (press(each, cycles, per_cycle) for each in (error, 0.0))
        return assess(slider_errors(*tables, PERIOD), settings)["acceleration"]

    return assessed


def test_without_error_the_reliability_is_phi_of_3_whatever_the_upper_limit(press):
    for upper in (1e-6, 80.0, 1e3):
        assert cap(Limits(upper=upper)) == pytest.approx(PHI_3, abs=5e-11)
    # A lower limit raises it: (1 + 1/2) / (1 - 1/2) * 3.
    assert cap(Limits(lower=1.0, upper=2.0)) == pytest.approx(ndtr(9.0), rel=1e-15)
    quantities = assess(slider_errors(press(), press(), PERIOD), Reliability())
    assert list(quantities) == list(QUANTITIES) == ["displacement", "velocity", "acceleration"]
    for quantity in quantities.values():
        assert quantity.reliability == pytest.approx(np.full(10, PHI_3), abs=5e-11)
        assert quantity.minimum == quantity.cap
        assert quantity.capped.all()
        assert not quantity.half_width.any()
        assert np.all(quantity.within == 1.0)


@pytest.mark.parametrize(("mean", "deviation"), [(2.0, 1.0), (0.1, 3.0), (-1.0, 0.5)])
def test_the_sensitivity_is_the_derivative_in_the_averages_of_errors_and_of_their_squares(mean, deviation):
    limits, h = Limits(lower=-1.0, upper=8.0), 1e-5

    def index(by_mean, by_square):
        square = mean**2 + deviation**2 + by_square
        return float(reliability_index(limits, mean + by_mean, np.sqrt(square - (mean + by_mean) ** 2)))

    # Central differences leave h^2; round-off 1e-16 / h.
    known = [(index(h, 0) - index(-h, 0)) / (2 * h), (index(0, h) - index(0, -h)) / (2 * h)]
    assert sensitivity(limits, mean, deviation) == pytest.approx(known, rel=1e-8)


@pytest.mark.parametrize(
    ("error", "changes", "mean", "middle", "sixth"),
    [
        (8.0, {}, 8.0, 40.0, 80.0 / 6),
        (-8.0, {}, 8.0, 40.0, 80.0 / 6),
        (-8.0, {"errors": "signed"}, -8.0, 40.0, 80.0 / 6),  # the sign counts only if asked
        (2.0, {"lower": 1.0, "upper": 9.0, "bins": 4}, 2.0, 5.0, 8.0 / 6),
        (-90.0, {}, 90.0, 40.0, 80.0 / 6),  # outside the limit
        (5.0, {"cycles": 0.06}, 5.0, 40.0, 80.0 / 6),  # of a part of a cycle the first bin
    ],
)
def test_a_constant_error_has_the_closed_form(assessed, error, changes, mean, middle, sixth):
    result, bins = assessed(error, **changes), changes.get("bins", 10)
    count = 1 if "cycles" in changes else bins
    # Of a part of a cycle the last bin ends with the run.
    ends = [21.6] if "cycles" in changes else [360.0 / bins * (n + 1) for n in range(bins)]
    assert result.angle.tolist() == ends
    assert result.cycles.tolist() == [1 if "cycles" in changes else 2] * count
    assert result.mean == pytest.approx(np.full(count, mean), rel=1e-12)
    assert result.reliability == pytest.approx(np.full(count, ndtr((middle - mean) / sixth)), rel=1e-12)
    assert result.within.tolist() == [float(abs(error) < 80.0)] * count
    assert not result.capped.any()


def test_an_error_within_one_bin_is_found_at_its_angle_with_its_share(assessed):
    angle = np.arange(2001) * 0.36 % 360.0
    result = assessed(np.where((angle > 100.0) & (angle < 107.9), 90.0, 0.0))
    worst = result.worst
    assert result.angle[worst] == 108.0
    # 22 samples of 100 intervals of 0.36 degrees, from 100.08 to 107.64.
    share = 0.22
    assert result.within[worst] == pytest.approx(1 - share, abs=1e-12)
    assert np.delete(result.within, worst).tolist() == [1.0] * 9
    assert result.mean[worst] == pytest.approx(90 * share, rel=1e-12)
    assert result.deviation[worst] == pytest.approx(90 * np.sqrt(share * (1 - share)), rel=1e-12)


@pytest.mark.parametrize("per_cycle", [300, 333, 10_000])
def test_known_signals_have_their_exact_moments(per_cycle, assessed):
    """A ramp in every part of the cycle, and a sine over all of it."""
    phase = np.arange(2 * per_cycle + 1) / per_cycle % 1.0
    result = assessed(30.0 * np.sin(2 * np.pi * phase) + 5.0, per_cycle, bins=1, errors="signed")
    # The trapezoidal rule over whole periods is exact.
    assert result.mean == pytest.approx([5.0], rel=1e-12)
    assert result.deviation == pytest.approx([30.0 / np.sqrt(2.0)], rel=1e-12)
    of = assessed(10.0 + np.append(phase[:-1], 1.0), per_cycle)
    # In a part it rises by a tenth; where it falls back to zero, between two samples, the last one errs.
    assert of.mean[1:-1] == pytest.approx(10.15 + 0.1 * np.arange(8), rel=1e-12)
    # Squares are not linear: h^2 / 6 too much of an interval h, of a part of one less. Round-off of 10^2.
    variance = of.deviation[1:-1] ** 2 - 0.01 / 12
    assert np.all((variance >= -1e-11) & (variance <= 1 / 6 / per_cycle**2 * 1.02 + 1e-11))
