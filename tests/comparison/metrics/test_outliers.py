"""The statistic is exact in rank, its floor keeps noise out, and a contact parts two groups."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.stats import binomtest

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR
from comparison.metrics import WINDOW, distances, parting_contact


def heavy_tailed(rng, count):
    """Errors of one size a run, which spreads over six decades, along one course of the motion."""
    sizes = rng.choice([-1.0, 1.0], count) * 10 ** rng.uniform(-9.0, -3.0, count)
    return sizes[:, None] * np.linspace(0.5, 1.0, 20) + 1e-10 * rng.standard_normal((count, 20))


def normal(rng, count):
    """Errors of one kind and of about one size."""
    return 1e-6 * rng.standard_normal((count, 1)) * np.linspace(0.5, 1.0, 20)


@pytest.mark.parametrize("seed", range(5))
def test_left_out_members_are_held_against_the_others_and_a_run_against_all(seed):
    members, run = np.split(np.random.default_rng(seed).normal(size=(9, 5)) ** 3, [8])
    floor = np.full(5, 0.5)

    def away(one, others):
        return (np.abs(one - others.mean(axis=0)) / np.maximum(others.std(axis=0), floor)).max()

    of_members, of_run = distances(members, run[0], floor)
    expected = [away(members[n], np.delete(members, n, axis=0)) for n in range(8)]
    np.testing.assert_allclose(of_members, expected, rtol=1e-12)
    assert of_run == pytest.approx(away(run[0], members))
    assert distances(members[:, :0], np.empty(0), np.empty(0))[1] == 0.0


@pytest.mark.parametrize("draw", [heavy_tailed, normal])
@pytest.mark.parametrize("count", [19, 99])
def test_a_run_of_the_same_model_is_outside_no_more_than_once_in_as_many_draws_as_there_are_runs(draw, count):
    rng, outside, trials = np.random.default_rng(count), 0, 3000
    for _ in range(trials):
        drawn = draw(rng, count + 1)
        of_members, of_run = distances(drawn[1:], drawn[0], np.full(drawn.shape[1], 1e-10))
        outside += of_run > of_members.max()
    # It is held against one run more than each member is, so it is outside less often, but not never.
    expected = 1 / (count + 1)
    assert binomtest(outside, trials).proportion_ci(0.999).low <= expected
    assert outside / trials > 0.2 * expected


@example(members=[1000.0] * 18 + [-1000.0], side=1.0)  # the closest case: all but one on the run's side
@given(
    members=st.lists(st.floats(-1000.0, 1000.0), min_size=19, max_size=30), side=st.sampled_from([-1.0, 1.0])
)
def test_what_an_ensemble_does_not_exclude_its_uncertainty_explains(members, side):
    """A run just outside k u of the base, u the ensemble's, is farther out than every member left out."""
    ensemble = np.array(members)[:, None]
    u = np.maximum(ENSEMBLE_FACTOR * np.abs(ensemble).max(axis=0), 1e-3)
    of_members, of_run = distances(ensemble, side * thresholds().k * u, u)
    assert of_run >= of_members.max() * (1 - 1e-12)


def test_the_first_contact_that_parts_two_groups_is_named():
    rng, window = np.random.default_rng(3), WINDOW * 0.4

    def run(*extra, common=(("ll", 0.01), ("ul", 0.01), ("ll", 0.1))):
        rows = [(corner, start + 0.2 * window * rng.uniform(-1.0, 1.0)) for corner, start in common]
        return pd.DataFrame([*rows, *extra], columns=["corner", "start"])

    def parted(one, other, until=0.3):
        return parting_contact((one, other), period=0.4, until=until)

    with_contact = [run(("ul", 0.05), ("lr", 0.2)) for _ in range(5)]
    without = [run() for _ in range(20)]
    parting = parted(without, with_contact)
    assert (parting.corner, parting.having, parting.sizes) == ("ul", (0, 5), (20, 5))
    assert parting.start == pytest.approx(0.05)
    # A corner that the first run of either group does not touch parts them all the same.
    bare = run(common=[("ll", 0.01)])
    parting = parted([bare] * 20, [bare, *(run(("ul", 0.05)) for _ in range(10))])
    assert (parting.corner, parting.having) == ("ul", (0, 10))
    # What comes later is a consequence; and a contact that half of both have parts nothing.
    assert parted(without, with_contact, 0.04) is None
    mixed = [run(("ul", 0.05)) if n % 2 else run() for n in range(10)]
    assert parted(mixed, mixed[::-1]) is None
