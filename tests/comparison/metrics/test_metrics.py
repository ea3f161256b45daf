"""Measures of two signals, of a run among others, and of contacts, where the answer is known."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from comparison import metrics
from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR
from comparison.tables.table import Table

# Whole periods, so that the trapezoidal rule is exact for squares of sines.
TIME = np.linspace(0, 0.8, 2001)
PHASE = 2 * np.pi * TIME / 0.4


def test_a_peak_that_is_late_has_its_delay_and_both_are_sought_on_one_side():
    half_wave = np.maximum(0.0, np.sin(PHASE))
    echo = 0.9 * np.roll(half_wave, 25)
    (value, at), (other, after) = metrics.peaks(TIME, half_wave, echo)
    assert (other - value, after - at) == pytest.approx((-0.1, 25 * 0.0004), rel=1e-12)
    # A wave as high as it is deep: errors make one signal higher and the other one deeper.
    wave = np.sin(PHASE)
    a, b = wave + 1e-6 * (wave > 0.999), wave - 1e-6 * (wave < -0.999)
    (value, at), (other, after) = metrics.peaks(TIME, a, b)
    assert (value, other) == pytest.approx((1.0, 1.0), abs=2e-6)
    assert at == after
    # Periods that differ by round-off: the first counts, in both.
    higher = wave * np.where(TIME > 0.4, 1 + 1e-15, 1.0)
    assert [at for _, at in metrics.peaks(TIME, wave, higher)] == pytest.approx([0.1, 0.1], abs=1e-15)


def test_the_peak_of_a_position_is_sought_from_its_mean():
    a, b = -0.55 + 2e-4 * np.sin(PHASE), -0.55 + 2e-4 * np.sin(PHASE - 1.0)
    result = metrics.measures(TIME, a, b, position=True)
    assert np.isnan(metrics.correlation(TIME, np.full(TIME.shape, 3.0), a))  # a constant has none
    # The last sample repeats the first, which moves the mean by 1 / 2001 of it.
    assert result["correlation"] == pytest.approx(np.cos(1.0), abs=1e-6)
    assert metrics.correlation(TIME, 1e-300 * a, 1e300 * b) == pytest.approx(result["correlation"], rel=1e-10)
    # The peak has its own value, and its delay is that of the wave, to half a sample.
    assert result["peak_a"] == pytest.approx(-0.5498, abs=1e-9)
    assert result["peak_time_difference"] == pytest.approx(0.4 / 2 / np.pi, abs=0.0002)
    assert metrics.measures(TIME, a, b, position=False)["peak_a"] == pytest.approx(-0.5502, abs=1e-9)


def test_left_out_members_are_held_against_the_others_and_a_run_against_all():
    members, run = np.split(np.random.default_rng(0).normal(size=(9, 5)) ** 3, [8])
    floor = np.full(5, 0.5)

    def distance(one, others):
        return (np.abs(one - others.mean(axis=0)) / np.maximum(others.std(axis=0), floor)).max()

    of_members, of_run = metrics.distances(members, run[0], floor)
    expected = [distance(members[n], np.delete(members, n, axis=0)) for n in range(8)]
    np.testing.assert_allclose(of_members, expected, rtol=1e-12)
    assert of_run == pytest.approx(distance(run[0], members))


@example(members=[1000.0] * 18 + [-1000.0], side=1.0)  # the closest case: all but one on the run's side
@given(
    members=st.lists(st.floats(-1000.0, 1000.0), min_size=19, max_size=30), side=st.sampled_from([-1.0, 1.0])
)
def test_what_an_ensemble_does_not_exclude_its_uncertainty_explains(members, side):
    """A run just outside k u of the base, u the ensemble's, is farther out than every member left out."""
    ensemble = np.array(members)[:, None]
    u = np.maximum(ENSEMBLE_FACTOR * np.abs(ensemble).max(axis=0), 1e-3)
    of_members, of_run = metrics.distances(ensemble, side * thresholds().k * u, u)
    assert of_run >= of_members.max() * (1 - 1e-12)


@pytest.mark.parametrize(
    ("count", "peak", "number"), [(20, 40.3, 1), (5, 40.0, 1), (4, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)]
)
def test_a_contact_is_drawn_if_it_has_enough_points_and_the_peak_of_its_event(count, peak, number):
    start = np.array([0.01, 0.02])
    events = pd.DataFrame({"corner": ["ll", "ur"], "start": start, "end": start + 2e-4, "peak_force": 40.0})
    phase = np.linspace(0.0, 1.0, count)
    time, force = 1e-6 + 2e-4 * phase, peak * np.sin(np.pi * phase)  # the touch is inside a step
    force[count // 2] = peak
    columns = {"row": np.full(count, 1), "time": 0.02 + time, "force": force}
    pulses = metrics.pulses_of(Table(pd.DataFrame({"time": [0.0, 1.0]}), events, pulses=columns))
    assert [pulse.row for pulse in pulses] == [1] * number
    for pulse in pulses:
        every = (pulse.time.size - 1) // (count - 1)
        # Differences of times of 0.02 s, rounded at 3.5e-18 s each
        np.testing.assert_allclose(pulse.time[::every], time, rtol=0, atol=1e-17)
        # A spline's nodes round at 1e-16 of the largest
        np.testing.assert_allclose(pulse.force[::every], force, rtol=0, atol=1e-15 * peak)
        assert pulse.time.size >= metrics.PULSE_POINTS
        assert pulse.force.max() == force.max()  # the spline is monotone between points


def test_the_first_contact_that_parts_two_groups_is_named():
    rng, window = np.random.default_rng(3), metrics.WINDOW * 0.4

    def run(*extra):
        common = ("ll", 0.01), ("ul", 0.01), ("ll", 0.1)
        rows = [(corner, start + 0.2 * window * rng.uniform(-1.0, 1.0)) for corner, start in common]
        return pd.DataFrame([*rows, *extra], columns=["corner", "start"])

    def first_contact(one, other, until=0.3):
        return metrics.parting_contact((one, other), period=0.4, until=until)

    with_contact = [run(("ul", 0.05), ("lr", 0.2)) for _ in range(5)]
    without = [run() for _ in range(20)]
    parting = first_contact(without, with_contact)
    assert (parting.corner, parting.counts, parting.sizes) == ("ul", (0, 5), (20, 5))
    assert parting.start == pytest.approx(0.05)
    # Later contacts follow from the first different one; a contact of half the runs of both parts nothing.
    assert first_contact(without, with_contact, 0.04) is None
    runs = [run(("ul", 0.05)) if n % 2 else run() for n in range(10)]
    assert first_contact(runs, runs[::-1]) is None
