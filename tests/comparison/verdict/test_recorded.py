"""Runs from files: the uncertainty and the verdict of `sixbar validate`, and what is missing is said."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare_recorded

from comparison.accuracy.uncertainty import Runs
from comparison.tables.table import Table, TableError
from comparison.verdict.confirmation import ENOUGH_MEMBERS
from comparison.verdict.recorded import ProgramRuns
from comparison.words.differences import confirmation

TIME = np.arange(401) * 2e-3


def runs(error, wave=0.0, count=2, spread=1e-9):
    """Runs of a method of second order; perturbed ones lie around the base."""
    rng = np.random.default_rng(1)

    def table(size, offset=0.0):
        y = 0.1 * np.cos(9 * TIME) * (1 + size + wave) + offset
        return Table(pd.DataFrame({"time": TIME, "slider_y": y}))

    perturbed = [table(4 * error, spread), table(4 * error, -spread)][:count]
    ensemble = [table(error, spread * rng.standard_normal()) for _ in range(count - 2)]
    return ProgramRuns(table(error), table(error / 4), table(4 * error), [*perturbed, *ensemble])


def verdict(a, b, **options):
    return compare_recorded(a, b, scene=None, labels=("a", "b"), **options)


def test_without_a_scene_the_period_sets_the_window():
    usual, wide = (verdict(runs(1e-6), runs(2e-6), **of) for of in ({}, {"period": 100.0}))
    assert usual.verdict == "agree"
    # A window of the whole span takes the largest error everywhere.
    assert np.ptp(wide.channels["slider_y"].u) == 0.0 < np.ptp(usual.channels["slider_y"].u)


def test_the_refinement_of_a_program_is_assumed_aloud_or_stated():
    result, other = (
        verdict(runs(1e-6), replace(runs(1e-6), refinement=(2.0, order))) for order in (2.0, 4.0)
    )
    assert result.warnings == ("a: factor 2 between its settings and order 2 of its error are assumed",)
    # Of fourth order the three levels do not show it: a factor of safety of 3 instead of 1.25 * 4 / 3.
    assert (other.channels["slider_y"].u_b >= 1.7 * result.channels["slider_y"].u_b).all()


def test_a_difference_stays_unconfirmed_without_enough_runs_and_is_confirmed_by_them():
    for count, outcome in (
        (2, "unconfirmed"),
        (2 + ENOUGH_MEMBERS - 1, "unconfirmed"),
        (2 + ENOUGH_MEMBERS, "confirmed"),
    ):
        result = verdict(runs(1e-7, count=count), runs(1e-7, wave=1e-3, count=count))
        assert (result.verdict, result.confirmation.outcome) == ("differ", outcome)
        assert result.confirmation.members == (count - 2, count - 2)
    assert "no runs from moved starts" in confirmation(verdict(runs(1e-7), runs(1e-7, wave=1e-3)))


def test_an_ensemble_that_spreads_as_far_withdraws_the_difference():
    a, b = (
        replace(of, perturbed=[of.base, of.base, *of.perturbed[2:]])
        for of in (runs(1e-7, count=42, spread=1e-4), runs(1e-7, wave=1e-4, count=42, spread=1e-4))
    )
    result = verdict(a, b)
    assert (result.verdict, result.confirmation.outcome) == ("agree", "underestimated")


def test_runs_that_make_no_uncertainty_are_refused():
    whole = runs(1e-6)
    with pytest.raises(TableError, match=r"^b has no finer run, the other one has"):
        verdict(whole, ProgramRuns(whole.base))
    with pytest.raises(TableError, match=r"^b: coarser and perturbed runs count only beside a finer one"):
        verdict(whole, ProgramRuns(whole.base, None, whole.coarser))
    lean = ProgramRuns(whole.base, whole.finer)
    assert "leaves out how neighbouring motions diverge" in verdict(lean, whole).warnings[0]
    assert Runs(whole.base).refinement == lean.runs.refinement
    other = replace(whole, finer=Table(whole.finer.frame.iloc[::2].reset_index(drop=True)))
    with pytest.raises(TableError, match=r"^b finer: its times differ from those of b$"):
        verdict(whole, other)
