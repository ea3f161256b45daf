"""The study of the uncertainties: its statistics on known errors, and one scene for real."""

import re

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of

from comparison.accuracy.uncertainty import Runs
from comparison.studies.truth import study
from comparison.studies.truth.study import LIMIT, Samples
from comparison.tables.table import Table

PERIOD = 1.0
N = 1001
TIME = np.linspace(0.0, 1.0, N)
TOUCHES = np.arange(1, 20) / 20  # 20 intervals of 50 samples


def true_table(contacts=contacts_of(*(("ll", t, t + 0.01) for t in TOUCHES))):  # noqa: B008
    return Table(pd.DataFrame({"time": TIME}), contacts)


def channel(faults, name="slider_x", judged=None, u=1e-9, until=1.0):
    """A channel that errs by 1.41 u, in one sample of each of some intervals by 1.42 u."""
    error = np.full(N, 1.41 * u)
    for k in faults:
        error[50 * k + 25] = 1.42 * u
    judged = np.ones(N, dtype=bool) if judged is None else judged
    return Samples(name, 1e-4, error, np.full(N, u), judged, until)


@pytest.mark.parametrize("faults", [(), (0,), (3, 4, 19), range(20)])
def test_a_run_that_errs_by_root_two_u_in_some_intervals_is_outside_in_exactly_these(faults):
    both = [channel(faults), channel((), "slider_y", u=3e-9)]
    rows, intervals = study.sample_rows(both, true_table(), PERIOD, 0.01)
    x, y, every = rows
    assert (x["outcomes"], x["outside"], x["samples"]) == (20, len(faults), N)
    assert (y["outcomes"], y["outside"], every["outcomes"], every["outside"]) == (20, 0, 20, len(faults))
    assert x["largest"] == pytest.approx(1.42 if faults else 1.41)
    assert (x["width"], x["width_90"]) == pytest.approx((1 / 1.41, 1 / 1.41))
    outliers = [one for one in intervals if one["largest"] > LIMIT]
    assert [one["start"] for one in outliers] == pytest.approx([k / 20 for k in faults])
    assert [one["end"] for one in intervals] == pytest.approx([(k + 1) / 20 for k in range(20)])
    assert [one["part"] for one in outliers] == pytest.approx([4.23e-3] * len(faults))  # of 1e-6
    assert {one["name"] for one in outliers} <= {"slider_x"}


def test_what_is_not_predictable_is_no_outcome():
    judged = np.ones(N, dtype=bool)
    judged[150:250] = judged[425] = False  # intervals 3 and 4, and of 8 the sample that errs
    rows, intervals = study.sample_rows([channel((3, 8, 9), judged=judged)], true_table(), PERIOD, 0.01)
    assert [(row["outcomes"], row["outside"]) for row in rows] == [(18, 1), (18, 1)]
    assert len(intervals) == 18


def test_an_interval_has_its_largest_error_up_to_until_and_after_it():
    both = [channel((8,), until=0.43), channel((3,), "slider_y", until=0.3)]
    _, intervals = study.sample_rows(both, true_table(), PERIOD, 0.01)
    before, after = (np.array([one[side] for one in intervals]) for side in ("before", "after"))
    # x errs by most at 0.425 s, y at 0.175 s: both before their `until`.
    assert np.flatnonzero(before > LIMIT).tolist() == [3, 8]
    assert not (after > LIMIT).any()
    assert np.isnan(before).tolist() == [False] * 9 + [True] * 11
    assert np.isnan(after).tolist() == [True] * 6 + [False] * 14
    counts = study.by_until(pd.DataFrame(intervals).assign(origin="random"))
    assert (counts["before"]["random"], counts["after"]["random"]) == ("2 of 9", "0 of 14")


def test_errors_beyond_what_is_judged_are_counted_and_a_run_is_lost_when_it_stays_there():
    one = channel(())
    one.error[[100, 200]] = 2e-6  # alpha times the scale is 1e-6
    (row, _), _ = study.sample_rows([one], true_table(), PERIOD, 0.01)
    assert (row["beyond"], row["until"]) == (2, None)
    one.error[700:] = 2e-6
    (row, _), _ = study.sample_rows([one], true_table(), PERIOD, 0.01)
    assert row["beyond"] == 2 + N - 700
    assert row["until"] == pytest.approx(TIME[700] - 0.01)  # the window of u(t)


def shift(contacts, delay, impulse=1.0):
    return contacts.assign(start=contacts["start"] + delay, impulse=contacts["impulse"] * impulse)


def test_contacts_are_matched_by_corner_and_time_whatever_their_order():
    ties = [place for t in TOUCHES for place in (("ll", t, t + 0.01), ("ul", t, t + 0.02))]
    truth = contacts_of(*ties).assign(impulse=np.arange(1.0, 39.0))
    # The run errs by 1e-6 s, its finer run by half of that: u = 3 x 5e-7 s. It lists a tie in another order.
    order = np.arange(38).reshape(-1, 2)[:, ::-1].ravel()
    runs = Runs(*(true_table(shift(truth, delay, 1 + delay).iloc[order]) for delay in (1e-6, 5e-7)))
    gaps = [channel((), f"corner_{place}_gap") for place in ("ll", "ul")]
    alone, start, impulse = study.contact_rows(gaps, runs, true_table(truth), PERIOD)
    assert (alone["outcomes"], alone["outside"]) == (38, 0)
    assert (start["outcomes"], start["outside"], impulse["outcomes"], impulse["outside"]) == (38, 0, 38, 0)
    assert start["largest"] == pytest.approx(1 / 1.5, rel=1e-6)
    assert impulse["largest"] == pytest.approx(1 / 1.5, rel=1e-6)
    # A contact that the run lacks has no partner.
    runs = Runs(*(true_table(shift(truth.drop(index=[6]), delay)) for delay in (1e-6, 5e-7)))
    alone, start, _ = study.contact_rows(gaps, runs, true_table(truth), PERIOD)
    assert (alone["outside"], start["outcomes"]) == (1, 37)


def rows_of(outside, outcomes):
    """Rows of three scenes with so many outcomes outside."""
    columns = {"kind": "intervals", "name": "", "largest": 1.2, "width": 10.0, "width_90": 99.0}
    columns |= {"model": "exudyn", "tier": "tight", "outside": outside, "outcomes": outcomes}
    scenes = {"scene": [f"scene {k}" for k in range(3)], "origin": ["shipped", "random", "random"]}
    return pd.DataFrame(columns | scenes)


def test_the_limit_of_a_share_is_that_of_drawing_scenes():
    (line,) = study.count_lines(rows_of((3, 0, 0), (100, 100, 100)), ["model", "tier"])
    assert (line["outcomes"], line["outside"], line["u over error, median"]) == ("300", "3", "10")
    # The first scene is drawn two times or three in 7 of 27 cases, three times in one of 27.
    assert line["by scene"] == "2\u00a0%"
    assert study.limit_by_scene(rows_of((0, 0, 0), (10, 20, 30))) == 0.0


def test_the_page_lists_what_is_outside_and_which_run_is_lost(tmp_path):
    rows = rows_of((1, 0, 0), (100, 100, 100))
    both = pd.concat([rows.assign(tier="standard"), rows])
    loss = {"until": 0.25, "beyond": 7, "samples": 50, "name": "slider_x", "kind": "samples"}
    one = {"scene": "scene 0", "model": "exudyn", "tier": "tight", "name": "slider_x"}
    place = {"start": 0.125, "end": 0.25, "part": 0.031}
    intervals = pd.DataFrame(
        one | place | {"origin": origin, "largest": after, "before": before, "after": after}
        for origin, before, after in (("random", 0.1, 1.7), ("shipped", 0.1, 1.4), ("shipped", np.nan, 1.3))
    )
    frame = pd.concat([both, rows[:1].assign(**loss), rows.assign(kind="extrema", name="slider_vx")])
    text = study.STUDY.report(study.Results(frame, intervals, ["a: stopped"]), tmp_path).read_text("utf-8")
    for part in (
        "in 0 of 1 intervals between touches of 1 shipped scenes and 0 of 1 of 2 random ones (at most 95",
        "predictable again, in 0 of 2 and 1 of 1 (at most 100",
        "tight: 1; slider_x, 1.7 u between 0.125 and 0.25 s; errors up to 3.1 % of what",
        "is judged, after `until`.",
        "- scene 0, exudyn, tight: from 0.25 s on.",
        "- a: stopped.",
        "that err by more than is judged: 7 of 50 (shipped).",
    ):
        assert part in text
    assert not re.search(r"\{\w*\}|\bnan\b", text)


@pytest.mark.slow
def test_one_scene_for_real(install):
    """Its headline; no uncertainty is too small, that of the reliability included."""
    pytest.importorskip(
        "heyoka", reason="heyoka has no wheel for this Python and platform, or is not installed"
    )
    install("truth_entry", "", {study.TRUTH: "truth_press:simulate"})
    results = study.measure(study.STUDY.small, 1, None)
    assert not results.failures
    text = study.STUDY.text(results)
    assert re.search(r"uncertainty in 0 of \d+ intervals between touches of 1 shipped scenes", text)
    assert set(results.rows["origin"]) == {"shipped", "random"}
    rows = results.rows[results.rows["origin"] == "shipped"].set_index("kind")
    for kind in ("intervals", "samples", "start of contacts", "impulse of contacts", "reliability"):
        assert rows.loc[kind, "largest"].max() < 1.0, kind
    assert rows.loc["contacts without a partner", "outside"].sum() == 0
    assert (rows["outside"][rows.index.str.startswith("--accuracy")] == 0).all()
    assert rows.loc["samples", "beyond"].sum() == 0
