"""The gate on real runs: one fault of each kind and model is detected, and a model agrees with itself."""

from __future__ import annotations

from dataclasses import replace

import pytest

from comparison.execution.store import read_rows
from comparison.studies.detection import alarms
from comparison.studies.detection.copies import installed
from comparison.studies.detection.faults import catalogue, controls, trials
from comparison.studies.detection.tasks import find_all

FEW = (
    "stiffness +0.1 %",
    "static speed v0 doubled",
    "friction drives instead of braking",
    "slider x in millimetres",
)


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """Nothing that was found before is used."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.slow
def test_a_fault_of_each_kind_and_model_is_detected_and_nothing_without_one(alone):
    tried = [t for t in trials(catalogue()) if t.fault.name in FEW and t.tier == "tight"]
    assert {(t.fault.kind, t.model) for t in tried} == {
        ("number", "reference"), ("number", "exudyn"), ("code", "reference"), ("code", "exudyn"),
        ("table", "exudyn"),
    }  # fmt: skip
    healthy = [pair for pair in controls() if pair.tier == "tight"][:2]
    tasks = [*healthy, *(t.pair for t in tried)]
    with installed([t.fault for t in tried if t.fault.engine]):
        found = find_all(tasks, 2, None)
    for result in found[: len(healthy)]:
        assert result["verdict"] == "agree", result["reason"]
    for trial, result in zip(tried, found[len(healthy) :], strict=True):
        if result["verdict"] == "cannot compare":  # its own run refutes it before anybody compares
            assert "invariant-violated" in result["reason"], result["reason"]
            continue
        assert result["verdict"] == "differ", trial
        differing = {name for name, (verdict, _) in result["channels"].items() if verdict == "differ"}
        assert set(trial.fault.shows) <= differing
    # What was found is kept: nothing runs again.
    kept = {path: path.stat().st_size for path in alone.iterdir()}
    assert len(kept) == 1
    assert len(read_rows(next(iter(kept)))) == len(tasks)


@pytest.mark.slow
@pytest.mark.usefixtures("alone")
def test_twenty_comparisons_of_a_model_with_itself_give_no_alarm():
    by_label = {kind.label: kind for kind in alarms.KINDS}
    counts = {"reference, tight": 12, "reference, standard": 6, "rod 4 and slider in Exudyn, tight": 2}
    pairs = [pair for label, count in counts.items() for pair in alarms.pairs(by_label[label])[:count]]
    shares = []
    found = find_all(pairs, 2, shares.append)
    assert {result["verdict"] for result in found} <= {"agree", "indeterminate"}
    assert sum(result["verdict"] == "agree" for result in found) >= 18
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    again = find_all([replace(pair) for pair in pairs], 2, None)
    assert again == found
