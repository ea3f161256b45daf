"""Ensembles of synthetic runs: what is found, how often chance is taken for a difference, what is asked."""

from __future__ import annotations

from math import comb

import numpy as np
import pandas as pd
import pytest

from comparison.studies.ensembles.statistics import RATE, Sample, ask, distances
from comparison.tables.table import Table

PERIOD = 1.0
TIMES = np.linspace(0.0, 3.0, 301)
FLOORS = {"slider_x": (0.01, "m")}


def run(x, starts=(), corner="ll"):
    """A run whose x is constant, with contacts at these instants."""
    contacts = {name: np.ones(len(starts)) for name in ("largest_depth", "peak_force", "normal_speed")}
    events = pd.DataFrame({"corner": [corner] * len(starts), "start": list(starts)} | contacts)
    return Table(pd.DataFrame({"time": TIMES, "slider_x": np.full(TIMES.size, x)}), events)


def asked(a, b, instants=(1.5,), first_cycle=1):
    return ask(
        a, b, instants=np.array(instants), floors=FLOORS, period=PERIOD, first_cycle=first_cycle
    )  # fmt: skip


def test_samples_that_do_not_overlap_have_the_known_statistic_and_p():
    n = 8
    (test,) = distances([Sample("x", "", "m", np.arange(n) + 0.0, np.arange(n) + 100.0)])
    assert test.statistic == 1.0
    # Of all ways to share out 2n numbers to two samples, two separate them.
    assert test.p == pytest.approx(2 / comb(2 * n, n), rel=1e-9)
    assert test.wasserstein == pytest.approx(100.0, rel=1e-12)
    assert test.adjusted == test.p  # one test: nothing to adjust
    assert test.found


def test_the_adjusted_p_is_that_of_benjamini_and_yekutieli():
    rng = np.random.default_rng(1)
    samples = [Sample("x", str(k), "m", rng.normal(size=30), rng.normal(0.2 * k, size=30)) for k in range(6)]
    tests = distances(samples)
    p = np.array([test.p for test in tests])
    order = np.argsort(p)
    # The formula of the paper: p_(i) m (1 + 1/2 + ... + 1/m) / i, made monotone from the top.
    raw = p[order] * p.size * np.sum(1 / np.arange(1, p.size + 1)) / np.arange(1, p.size + 1)
    expected = np.minimum(np.minimum.accumulate(raw[::-1])[::-1], 1.0)
    assert np.array([test.adjusted for test in tests])[order] == pytest.approx(expected, rel=1e-12)


def test_chance_is_seldom_taken_for_a_difference_and_a_shift_of_one_deviation_is_found():
    """100 families of 30 dependent tests; the shifted half of them differs in every one."""
    rng = np.random.default_rng(7)
    mixing = rng.normal(size=(30, 30)) / np.sqrt(30)

    def family(shift):
        a, b = (rng.normal(size=(40, 30)) @ mixing for _ in range(2))
        spread = a.std(axis=0)
        return distances([Sample("x", str(k), "m", a[:, k], b[:, k] + shift * spread[k]) for k in range(30)])

    false = sum(any(test.found for test in family(0.0)) for _ in range(50))
    # At most the share RATE of the families without a difference: 2.5 of 50; 8 has a probability of 0.2 %.
    assert false <= 8
    assert RATE == 0.05
    assert all(sum(test.found for test in family(1.5)) > 20 for _ in range(5))


def test_what_both_predict_is_not_asked_and_what_one_of_them_scatters_is():
    still = [run(0.5) for _ in range(4)]
    scattered = [run(x) for x in (0.1, 0.2, 0.3, 0.4)]
    assert [s.quantity for s in asked(still, still) if s.quantity == "slider_x"] == []
    (x,) = [s for s in asked(still, scattered) if s.quantity == "slider_x"]
    assert x.a.tolist() == [0.5] * 4
    assert x.b.tolist() == [0.1, 0.2, 0.3, 0.4]


def test_contacts_are_counted_in_the_cycle_and_at_the_corner_where_they_begin():
    a = [run(0.0, [0.5, 1.0, 1.999, 2.0]), run(0.0)]
    b = [run(0.0, [1.5], corner="ur"), run(0.0, [2.9, 2.95], corner="ur")]
    counts = {(s.quantity, s.where): (s.a.tolist(), s.b.tolist()) for s in asked(a, b)}
    assert counts["contacts, lower left corner", "cycle 2"] == ([2.0, 0.0], [0.0, 0.0])
    assert counts["contacts, lower left corner", "cycle 3"] == ([1.0, 0.0], [0.0, 0.0])
    assert counts["contacts, upper right corner", "cycle 2"] == ([0.0, 0.0], [1.0, 0.0])
    assert counts["contacts, upper right corner", "cycle 3"] == ([0.0, 0.0], [0.0, 2.0])
    assert ("contacts, lower left corner", "cycle 1") not in counts


def test_a_run_without_an_event_table_is_refused():
    blind = [Table(run(0.0).frame)] * 2
    with pytest.raises(ValueError, match="no event table"):
        asked(blind, blind)
