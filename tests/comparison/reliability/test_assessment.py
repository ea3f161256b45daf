"""From tables to reliabilities: errors and their peaks, averages over parts of the cycle, the cap."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import ndtr

from comparison.reliability.assessment import assess
from comparison.reliability.errors import (
    MANY,
    half_width,
    part_edges,
    slider_errors,
    standard_error,
)
from comparison.scene.schema import AccelerationLimits, Reliability
from comparison.tables.table import Table, TableError

PERIOD = 0.4
REPEATED = 1000
SAMPLES = 100
# Of 1000 intervals with a probability of 0.95 each, the share that covers is within 0.021 of it in 99.7 %.
CHANCE = 3 * np.sqrt(0.95 * 0.05 / REPEATED)


# ---- errors


def test_the_ideal_is_interpolated_to_the_times_of_the_result_whatever_they_are(press):
    fine = press(5.0, per_cycle=1000)
    errors = slider_errors(fine, press(per_cycle=400), PERIOD)
    assert np.array_equal(errors.time, fine.time)
    # Cubics with slopes to second order: h^3 y''''/ 24 = 1e-9 * 0.1 * 15.7^4 / 24, twice as much at the ends.
    assert np.abs(errors.by_channel["slider_y"]).max() < 4e-7
    assert errors.by_channel["slider_ay"] == pytest.approx(np.full(2001, 5.0), abs=1e-4)
    assert not slider_errors(press(), press(), PERIOD).by_channel["slider_vy"].any()
    with pytest.raises(TableError, match="channel slider_ay is missing"):
        slider_errors(fine, Table(press().frame.drop(columns="slider_ay")), PERIOD)


def test_where_only_other_channels_have_extrema_by_cycle_those_of_the_whole_run_count(press):
    """By cycle, against a second computation: test_second_opinion.py."""
    ends = {"time_of_min": 0.1002, "min": -130.0, "time_of_max": 0.2, "max": 30.0}
    of_x = {f"slider_x_{part}": np.array([0.0, 0.0]) for part in ends}
    run = Table(press().frame, extrema={"slider_ay": ends}, cycle_extrema=of_x)
    assert slider_errors(run, press(), PERIOD).peak("slider_ay").time == 0.1002


# ---- averages


@pytest.mark.parametrize(
    ("end", "count", "edges"),
    [
        (0.8, 10, 0.04 * np.arange(21)),
        # A cycle and a half of the second part, then less than a part: that is left out.
        (0.4 * 1.37, 4, 0.1 * np.arange(6)),
        # But of a run shorter than a cycle it is the last one.
        (0.4 * 0.37, 4, [0.0, 0.1, 0.148]),
        (0.024, 10, [0.0, 0.024]),
    ],
)
def test_parts_follow_each_other_as_far_as_the_run_goes(end, count, edges):
    assert part_edges(end, PERIOD, count) == pytest.approx(edges, rel=1e-14)


def remembering(shape, phi, rng):
    """Normal noise of unit variance whose neighbours along the last axis are correlated by phi."""
    steps = rng.normal(size=shape)
    steps[..., 0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], steps, axis=-1) * np.sqrt(1 - phi**2)


LOCKED = np.sin(2 * np.pi * np.arange(SAMPLES) / SAMPLES)
NOISE = {
    "correlated": lambda shape, rng: remembering(shape, 0.9, rng),  # over a tenth of the bin
    # A sine twice as large as the correlated noise around it
    "locked": lambda shape, rng: 1.5 * LOCKED + 0.5 * remembering(shape, 0.8, rng),
    # Every cycle is off by a number of its own: all of a bin's samples together are worth one.
    "offset": lambda shape, rng: LOCKED + 0.5 * rng.normal(size=shape[:2])[..., None] * np.ones(SAMPLES),
}


@pytest.mark.parametrize("kind", NOISE)
@pytest.mark.parametrize("cycles", [5, MANY])
def test_the_interval_of_an_average_covers_it_also_where_the_cycles_share_their_course(kind, cycles):
    errors = NOISE[kind]((REPEATED, cycles, SAMPLES), np.random.default_rng(cycles))
    widths, off = half_width(standard_error(errors)), np.abs(errors.mean((-2, -1)))
    # Estimated correlations cost 2 %.
    assert np.mean(off <= widths) >= 0.95 - CHANCE - 0.02
    # Nor is it merely wide: 1.96 deviations of the averages, but for few degrees of freedom.
    assert np.mean(widths) < (1.4 if cycles >= MANY else 2.2) * 1.96 * off.std() / np.sqrt(1 - 2 / np.pi)
    assert standard_error(np.tile(2 * LOCKED, (3, 1))).error == 0.0  # what repeats leaves nothing open


# ---- reliabilities


def test_of_a_part_of_a_cycle_the_first_bin_ends_with_the_run_and_the_sign_counts_if_it_is_asked_for(press):
    settings = Reliability(acceleration=AccelerationLimits(upper=80.0), errors="signed")
    result = assess(slider_errors(press(-8.0, 0.06), press(0.0, 0.06), PERIOD), settings)["acceleration"]
    assert (result.angle.tolist(), result.cycles.tolist()) == ([21.6], [1.0])
    known = -8.0, float(ndtr((40.0 + 8.0) / (80.0 / 6)))
    assert (*result.mean, *result.reliability) == pytest.approx(known, rel=1e-12)
    assert not result.capped.any()
    without = assess(slider_errors(press(), press(), PERIOD), Reliability())
    assert all(quantity.capped.all() for quantity in without.values())
