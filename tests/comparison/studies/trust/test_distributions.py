"""Ensembles of synthetic runs: what is found, how often chance is taken for a difference, what is asked."""

from math import comb

import numpy as np
import pandas as pd
import pytest

from comparison.studies.trust.distributions import RATE, distances, numbers_of, scattered
from comparison.tables.table import Table

TIMES = np.linspace(0.0, 3.0, 301)


def run(x, starts=(), corner="ll"):
    """A run whose x is constant, with contacts at these instants."""
    contacts = {name: np.ones(len(starts)) for name in ("largest_depth", "peak_force", "normal_speed")}
    events = pd.DataFrame({"corner": [corner] * len(starts), "start": list(starts)} | contacts)
    return Table(pd.DataFrame({"time": TIMES, "slider_x": np.full(TIMES.size, x)}), events)


def numbers(runs):
    return numbers_of(runs, np.array([1.5]), ["slider_x"], period=1.0, first_cycle=1)


def frame(values):
    return pd.DataFrame(np.asarray(values, dtype=float))


def test_samples_that_do_not_overlap_have_the_known_statistic_and_p():
    n = 8
    a = np.arange(n)[:, None]
    test = distances(frame(a), frame(a + 100.0)).iloc[0]
    assert test["statistic"] == 1.0
    # Of all ways to share out 2n numbers to two samples, two separate them.
    assert test["p"] == pytest.approx(2 / comb(2 * n, n), rel=1e-9)
    assert test["adjusted"] == test["p"]  # one test: nothing to adjust
    # Benjamini and Yekutieli: the smallest of m p-values times m (1 + 1/2 + ... + 1/m).
    three = distances(frame(np.repeat(a, 3, axis=1)), frame(a + np.array([100.0, 0.0, 0.0])))
    assert three["adjusted"][0] == pytest.approx(3 * (1 + 1 / 2 + 1 / 3) * test["p"], rel=1e-12)
    assert three["differs"].tolist() == [True, False, False]
    assert RATE == 0.05


def test_what_both_predict_is_left_out_and_what_one_of_them_scatters_is_compared():
    still, other = (numbers([run(x) for x in xs]) for xs in ((0.5,) * 4, (0.1, 0.2, 0.3, 0.4)))
    for b, expected in ((still, False), (other, True)):
        a, _ = scattered(still, b, {"slider_x": 0.01})
        assert ("slider_x" in a) is expected
        assert "largest depth of a contact" in a


def test_contacts_are_counted_in_the_cycle_and_at_the_corner_where_they_begin():
    a = numbers([run(0.0, [0.5, 1.0, 1.999, 2.0]), run(0.0)])
    b = numbers([run(0.0, [1.5], corner="ur"), run(0.0, [2.9, 2.95], corner="ur")])
    left, right = "contacts, lower left corner", "contacts, upper right corner"
    assert a[left, "cycle 2"].tolist() == [2.0, 0.0]
    assert a[left, "cycle 3"].tolist() == [1.0, 0.0]
    assert b[right, "cycle 2"].tolist() == [1.0, 0.0]
    assert b[right, "cycle 3"].tolist() == [0.0, 2.0]
    assert (left, "cycle 1") not in a
