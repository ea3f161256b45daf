"""Intervals of counted rates, the draws of the self comparisons, and the search for the smallest change."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.stats import beta

from comparison.files import write_json
from comparison.regression import record as update
from comparison.studies.detection import alarms, limits
from comparison.studies.detection.cross_model import KINDS
from comparison.studies.detection.faults import catalogue, trials
from comparison.studies.detection.rates import interval, share, upper_limit
from comparison.studies.detection.results import Results, record
from comparison.studies.detection.rounding import PLACES, ROUNDINGS
from comparison.studies.detection.study import STUDY


@pytest.mark.parametrize("trials", [1, 20, 300])
def test_intervals_without_an_alarm_are_those_of_the_closed_form(trials):
    # (1 - p)^n = 0.025, one-sided 0.05; brentq inside scipy stops at 1e-12.
    low, high = interval(0, trials)
    assert low == 0.0
    assert high == pytest.approx(1 - 0.025 ** (1 / trials), rel=1e-9)
    assert upper_limit(0, trials) == pytest.approx(1 - 0.05 ** (1 / trials), rel=1e-9)
    assert interval(trials, trials) == pytest.approx((1 - high, 1.0), rel=1e-9)


@pytest.mark.parametrize(("count", "trials"), [(1, 300), (3, 40), (63, 64)])
def test_intervals_are_quantiles_of_the_beta_distribution(count, trials):
    low, high = interval(count, trials)
    assert low == pytest.approx(beta.ppf(0.025, count, trials - count + 1), rel=1e-9)
    assert high == pytest.approx(beta.ppf(0.975, count + 1, trials - count), rel=1e-9)
    assert upper_limit(count, trials) == pytest.approx(beta.ppf(0.95, count + 1, trials - count), rel=1e-9)


def test_three_hundred_without_an_alarm_are_enough_for_one_percent():
    assert upper_limit(0, 299) < 0.01 < upper_limit(0, 298)
    assert share(upper_limit(0, 300)) == "0.99\u00a0%"
    assert interval(0, 0) == (0.0, 1.0)
    assert upper_limit(0, 0) == 1.0


@pytest.mark.parametrize("kind", alarms.KINDS, ids=lambda kind: kind.label)
def test_draws_start_between_the_walls_and_differ_by_numerics_alone(kind):
    for draw in range(5):
        pair = alarms.pair(kind, np.random.default_rng([7, draw]))
        assert pair.identity == alarms.pair(kind, np.random.default_rng([7, draw])).identity
        first, second = pair.a.scene.data, pair.b.scene.data
        assert pair.a.model == pair.b.model == kind.model
        assert pair.a.scene.hash == pair.scene.hash
        clearance, slider = first["clearance"]["slider"], first["mechanism"]["slider"]
        start, moved = first["initial"], second["initial"]
        reach = abs(start["slider_offset"]) + abs(start["slider_angle"]) * slider["length"] / 2
        assert reach < 0.98 * clearance
        shift = [
            (moved["slider_offset"] - start["slider_offset"]) / clearance,
            (moved["slider_angle"] - start["slider_angle"]) * slider["length"] / clearance,
        ]
        # An offset of 5e-4 m has a last digit of 1e-19 m: 1e-6 of a billionth of 1e-4 m.
        assert 0 < np.hypot(*shift) <= 1e-9 * (1 + 1e-5)
        settings = [data["solver"][kind.model][kind.setting] for data in (first, second)]
        assert 0.3 <= settings[1] / settings[0] <= 3.0
        changed = {key for key in first if first[key] != second[key]}
        assert changed == {"initial", "solver"}


@pytest.mark.parametrize("smallest", [3e-9, 1e-4, 0.09])
def test_the_search_ends_within_a_third_of_the_smallest_change(smallest, monkeypatch):
    monkeypatch.setattr(limits.Search, "shows", lambda _, change: change >= smallest)
    monkeypatch.setattr(limits.Search, "confirmed", lambda *_: True)
    found = limits.searches()[0].find()
    assert found["missed"] < smallest <= found["found"]
    assert found["found"] / found["missed"] == pytest.approx(
        (limits.MOST / limits.LEAST) ** (1 / 64), rel=1e-9
    )


@pytest.mark.parametrize("smallest", [3e-9, 1e-4, 0.09])
def test_a_change_that_is_not_confirmed_is_a_miss_and_the_next_larger_one_is_tried(smallest, monkeypatch):
    asked = []
    monkeypatch.setattr(limits.Search, "shows", lambda _, change: change >= 1e-9)
    monkeypatch.setattr(
        limits.Search, "confirmed", lambda _, change: asked.append(change) or change >= smallest
    )
    found = limits.searches()[0].find()
    assert found["missed"] < smallest <= found["found"]
    assert found["found"] / found["missed"] == pytest.approx(limits.searches()[0].step, rel=1e-9)
    assert asked == sorted(asked)
    assert asked[-2:] == [found["missed"], found["found"]]
    assert asked[0] == found["shown"]


def test_a_search_without_an_end_says_so(monkeypatch):
    monkeypatch.setattr(limits.Search, "shows", lambda *_: False)
    assert limits.searches()[0].find() == {"found": None, "missed": limits.MOST, "shown": None}
    monkeypatch.setattr(limits.Search, "shows", lambda *_: True)
    monkeypatch.setattr(limits.Search, "confirmed", lambda *_: True)
    assert limits.searches()[0].find()["missed"] is None
    monkeypatch.setattr(limits.Search, "confirmed", lambda *_: False)
    found = limits.searches()[0].find()
    assert found["found"] is None
    assert found["missed"] == pytest.approx(limits.MOST, rel=1e-9)
    assert found["shown"] == pytest.approx(limits.LEAST * limits.searches()[0].step, rel=1e-9)


def test_what_the_study_writes_is_what_a_baseline_reads(tmp_path):
    agree = {"verdict": "agree", "reason": "", "channels": {}, "first": None}
    alarm = agree | {"verdict": "differ"}
    corrected = agree | {"confirmation": {"outcome": "underestimated", "sentence": "too small"}}
    bits = {variant: (str(number),) * len(PLACES) for number, variant in enumerate(ROUNDINGS)}
    results = Results(
        both=[(KINDS[0], {ROUNDINGS[0]: [agree] * 200, ROUNDINGS[1]: [agree] * 99 + [corrected]})],
        own=[(alarms.KINDS[0], [agree] * 300 + [alarm, agree | {"verdict": "indeterminate"}])],
        bits=bits,
        healthy=[agree],
        faults=[(trial, alarm) for trial in trials(catalogue())],
        smallest={
            name: [{"found": None, "shown": 1e-8}] + [{"found": 1.23456e-7, "shown": 1.23456e-7}] * 2
            for name, _, _ in limits.PARAMETERS
        },
    )
    path = tmp_path / "detection.json"
    write_json(record(results), path)
    read = update._rates(path, None)
    assert read is not None
    counted = read.false_alarms[alarms.KINDS[0].label]
    assert counted == {
        "draws": 302, "decided": 301, "underestimated": 0, "alarms": 1, "upper_limit_95": 0.01566
    }  # fmt: skip
    both = read.false_alarms[KINDS[0].label]
    assert both == {
        "draws": 300, "decided": 300, "underestimated": 1, "alarms": 0, "upper_limit_95": 0.00994
    }  # fmt: skip
    assert read.detected["tight"]["faults"] == sum(trial.tier == "tight" for trial, _ in results.faults)
    page = STUDY.report(results, tmp_path).read_text("utf-8")
    assert "- both models, tight: 0 false alarms in 300 decided comparisons" in page
    assert "agree: too small." in page
    assert not re.search(r"\{\w*\}", page)
