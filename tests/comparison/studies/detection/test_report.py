"""Rates of verdicts, and what the study writes of them."""

from __future__ import annotations

import re

import pandas as pd
import pytest
from scipy.stats import beta

from comparison.regression import record as update
from comparison.studies.detection.draws import BOTH, HASHED, OWN, ROUNDINGS, trials
from comparison.studies.detection.faults import catalogue, records
from comparison.studies.detection.study import STUDY, Results, count
from comparison.studies.shared.rates import interval, upper_limit

AGREE = {"verdict": "agree", "reason": "", "channels": {"slider_x": ["agree", 0.5]}, "first": None}
DIFFER = AGREE | {"verdict": "differ", "channels": {"slider_x": ["differ", 1.0]}}
OPEN = AGREE | {"verdict": "indeterminate"}
CORRECTED = AGREE | {"confirmation": {"outcome": "underestimated", "sentence": "too small"}}


@pytest.mark.parametrize(("alarms", "trials"), [(0, 1), (0, 300), (1, 300), (3, 40), (63, 64), (20, 20)])
def test_intervals_are_quantiles_of_the_beta_distribution(alarms, trials):
    low, high = interval(alarms, trials)
    assert low == pytest.approx(beta.ppf(0.025, alarms, trials - alarms + 1) if alarms else 0.0, rel=1e-9)
    expected = beta.ppf([0.975, 0.95], alarms + 1, trials - alarms) if alarms < trials else [1.0, 1.0]
    assert [high, upper_limit(alarms, trials)] == pytest.approx(expected, rel=1e-9)
    assert (*interval(0, 0), upper_limit(0, 0)) == (0.0, 1.0, 1.0)


def test_counts_of_verdicts_without_a_fault():
    hidden = OPEN | {"confirmation": {"outcome": "underestimated"}}
    counts = count([AGREE, AGREE, CORRECTED, hidden, OPEN, DIFFER, DIFFER, {"verdict": "cannot compare"}])
    numbers = {"draws": 8, "decided": 6, "underestimated": 1, "alarms": 3}
    assert counts == numbers | {"upper_limit_95": round(upper_limit(3, 6), 5)}


def test_what_the_study_writes_is_what_a_baseline_reads(tmp_path):
    tried = trials(catalogue())
    first = {"channel": "slider_x", "unit": "m", "time": 0.1, "difference": 1e-6, "threshold": 1e-9}
    search = {"found": 1.23456e-7, "shown": 1.23456e-7}
    results = Results(
        both=[(BOTH[0], {ROUNDINGS[0]: [AGREE] * 200, ROUNDINGS[1]: [AGREE] * 99 + [CORRECTED]})],
        own=[(OWN[0], [AGREE] * 300 + [DIFFER, OPEN])],
        bits={variant: (str(n),) * len(HASHED) for n, variant in enumerate(ROUNDINGS)},
        healthy=[AGREE],
        faults=[(trial, DIFFER | {"first": first}) for trial in tried[:-1]] + [(tried[-1], AGREE)],
        smallest={name: [{"found": None, "shown": 1e-8}, search, search] for name in records()["smallest"]},
    )
    page = STUDY.report(results, tmp_path).read_text("utf-8")
    read = update._rates(tmp_path / "detection.json", None)
    assert read is not None
    numbers = {"draws": 302, "decided": 301, "underestimated": 0, "alarms": 1, "upper_limit_95": 0.01566}
    assert read.false_alarms[OWN[0].label] == numbers
    numbers = {"draws": 300, "decided": 300, "underestimated": 1, "alarms": 0, "upper_limit_95": 0.00994}
    assert read.false_alarms[BOTH[0].label] == numbers
    assert read.detected["tight"]["faults"] == sum(trial.tier == "tight" for trial in tried)
    assert page.splitlines()[2].startswith("**1 false alarms in 601 decided comparisons; ")
    assert "| both models, tight | 0 | 300 |" in page
    assert "draw 99 (): agree: too small." in page
    assert not re.search(r"\{\w*\}|\bnan\b", page)
    faults = pd.read_csv(tmp_path / "faults.csv")
    assert len(faults) == len(tried)
    assert (
        faults["detected"].sum() == read.detected["tight"]["detected"] + read.detected["standard"]["detected"]
    )
    lines = pd.read_csv(tmp_path / "comparisons.csv").set_index("comparison").loc[OWN[0].label]
    assert len(lines) == 302
    assert lines["slider_x"].value_counts().to_dict() == {"agree": 301, "differ": 1}
