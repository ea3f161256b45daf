"""A comparison of the study: what its ensembles are given, and how a confirmation changes what is found."""

from __future__ import annotations

from dataclasses import replace

import pytest

from comparison.accuracy.uncertainty import moved
from comparison.execution.run import VIOLATED, Job, Outcome, RunError
from comparison.studies.detection import limits, pairs
from comparison.studies.detection.faults import Trial, catalogue, scenes
from comparison.studies.detection.pairs import Pair
from comparison.studies.detection.tables import SPOILS
from comparison.studies.detection.tasks import Side, runs
from comparison.verdict.compare import Runs
from comparison.verdict.refinement import Settled
from comparison.verdict.results import Confirmation

FAULTS = {(fault.name, fault.model): fault for fault in catalogue()}


@pytest.fixture
def asked(monkeypatch):
    """What is run in an ensemble: engine and scene; each run comes to its scene."""
    scenes_of = []

    def run_one(scene, engine):
        scenes_of.append((engine, scene))
        return scene

    monkeypatch.setattr(pairs, "run_one", run_one)
    monkeypatch.setattr(pairs, "load_copy", lambda _: None)
    return scenes_of


def trial(name, model, tier="tight", of=""):
    return Trial(FAULTS[name, of], model, tier)


def starts(pair):
    return [moved(pair.scene, shift, -shift) for shift in (1e-9, 2e-9)]


@pytest.mark.parametrize("name", ["stiffness +1 %", "clearance +1 µm", "gravity upwards"])
@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_the_ensemble_of_a_faulty_model_has_its_wrong_number_and_the_moved_starts(name, model, asked):
    pair = trial(name, model).pair
    fault, others = FAULTS[name, ""], starts(pair)
    assert pair.b.model == model
    pair.ensemble(others, model)
    assert [engine for engine, _ in asked] == [model] * 2
    for (_, given), other in zip(asked, others, strict=True):
        assert given.data["initial"] == other.data["initial"] != pair.scene.data["initial"]
        assert given.hash == other.with_values({fault.key: fault.wrong(pair.scene)}).hash
    asked.clear()
    pair.ensemble(others, pair.a.model)
    assert [(engine, given.hash) for engine, given in asked] == [(pair.a.model, o.hash) for o in others]


def test_a_wrong_start_is_moved_as_the_right_one_is(asked):
    # The crank's angle is what an ensemble moves where the crank pin alone has clearance.
    pin = scenes("tight")["press"].with_values({"joints.slider": "ideal", "joints.crank_pin": "clearance"})
    right = pin.data["mechanism"]["crank_angle_deg"]
    wrong = pin.with_values({"mechanism.crank_angle_deg": right + 2.0})
    pair = Pair(pin, Side(pin, "exudyn"), Side(wrong, "reference"), "tight")
    pair.ensemble([moved(pin, 1e-6, 0.0)], "reference")
    turned = moved(pin, 1e-6, 0.0).data["mechanism"]["crank_angle_deg"] - right
    ((_, given),) = asked
    assert turned != 0.0
    assert given.data["mechanism"]["crank_angle_deg"] == pytest.approx(right + 2.0 + turned, abs=1e-12)


def test_wrong_code_runs_its_ensemble_itself_and_runs_that_fail_are_left_out(asked, monkeypatch):
    pair = trial("a corner left out", "reference", of="reference").pair
    pair.ensemble(starts(pair), "reference")
    assert [engine for engine, _ in asked] == ["reference_fault_corner"] * 2

    def run_one(*_):
        raise RunError(Outcome("chatter"), None)

    monkeypatch.setattr(pairs, "run_one", run_one)
    monkeypatch.setattr("comparison.execution.run.describe", lambda *_: "chatter")
    assert pair.ensemble(starts(pair), "reference") == []


@pytest.fixture(scope="module")
def table():
    return runs(Side(scenes("tight")["press"], "reference")).base


@pytest.mark.parametrize("spoil", ["zero force", "sign", "both constant"])
def test_the_ensemble_of_a_spoiled_table_is_spoiled_alike(spoil, table, monkeypatch):
    monkeypatch.setattr(pairs, "run_one", lambda *_: table)
    fault = next(fault for fault in FAULTS.values() if fault.spoil == spoil)
    pair = Trial(fault, "exudyn", "tight").pair
    expected = [side.base.frame for side in SPOILS[spoil](Runs(table), Runs(table))]
    for model, frame in zip((pair.a.model, pair.b.model), expected, strict=True):
        (made,) = pair.ensemble(starts(pair)[:1], model)
        assert made.frame.equals(frame)
    assert expected[0].equals(table.frame) == (spoil != "both constant")


@pytest.fixture(scope="module")
def two():
    """A pair that differs by a tenth of the gravity, and what ran."""
    scene = scenes("tight")["press"]
    wrong = scene.with_values({"environment.gravity": 9.0})
    pair = Pair(scene, Side(scene, "exudyn"), Side(wrong, "reference"), "tight")
    return pair, (runs(pair.a), runs(pair.b))


def test_a_difference_that_is_not_confirmed_is_a_miss(two, monkeypatch):
    pair, both = two

    def confirm(result, of, *, scene, models, run, run_families, level):
        assert (result.verdict, level) == ("differ", 0)
        assert (of, scene, models) == (both, pair.scene, ("exudyn", "reference"))
        assert (run, run_families) == (pair.ensemble, pair.families)
        made = Confirmation("underestimated", members=(99, 30), factor=7.0)
        return Settled(replace(result, verdict="agree", confirmation=made), of, scene)

    monkeypatch.setattr(pairs, "settle", confirm)
    found = pairs.summary(pair.judged(both))
    assert found["verdict"] == "agree"
    assert found["confirmation"]["outcome"] == "underestimated"
    assert not trial("gravity upwards", "exudyn").detected(found)
    monkeypatch.setattr(Pair, "find", lambda _: found)
    assert not limits.searches()[0].confirmed(1e-3)


def test_finer_runs_of_both_sides_keep_their_difference(two):
    pair, (_, faulty) = two
    closer = pair.scene.with_values({"solver.reference.tolerance": 1e-13, "solver.exudyn.tolerance": 1e-12})
    finer = pair.families(closer)
    assert finer is not None
    for runs_of, model, key in zip(finer, ("exudyn", "reference"), (1e-12, 1e-13), strict=True):
        assert runs_of.base.provenance["settings"]["tolerance"] == key, model
    # Only the second side has the wrong gravity: at t = 0 it accelerates as before, but for rounding.
    wrong, right = (of.base.values("slider_ay")[0] for of in (finer[1], finer[0]))
    assert wrong == pytest.approx(faulty.base.values("slider_ay")[0], rel=1e-12)
    # Of 0.81 m/s^2 the share tan^2 of rod 4's inclination, 0.045, since the rocker's tip is driven.
    assert abs(wrong - right) > 0.01
    assert pair.families(pair.scene.with_values({"solver.reference.tolerance": 1e-30})) is None


@pytest.mark.parametrize("status", [VIOLATED, "newton-failed"])
def test_five_bodies_that_violate_an_invariant_run_at_half_the_step(status, monkeypatch):
    scene = scenes("standard")["press"]
    wrong = scene.with_values({"environment.gravity": 9.0})
    pair = Pair(scene, Side(scene, "reference"), Side(wrong, "exudyn"), "standard")
    step = scene.data["solver"]["exudyn"]["step"]

    def cached(side):
        """The side itself in place of its runs."""
        if side.model == "exudyn" and side.scene.data["solver"]["exudyn"]["step"] == step:
            raise RunError(Outcome(status, "lower the step"), Job(side.scene, side.runs_by))
        return side

    monkeypatch.setattr(pairs, "cached_runs", cached)
    if status != VIOLATED:
        with pytest.raises(RunError, match=status):
            pair.valid_runs()
        return
    sides, closer, level = pair.valid_runs()
    assert (closer.data["solver"]["exudyn"]["step"], level) == (step / 2, 1)
    for side, gravity in zip(sides, (9.81, 9.0), strict=True):
        assert side.scene.data["solver"] == closer.data["solver"]
        assert side.scene.data["environment"]["gravity"] == gravity  # each keeps its own number


def test_models_that_agree_run_nothing_more(two, monkeypatch):
    pair, (a, _) = two
    for more in ("ensemble", "families"):
        monkeypatch.setattr(Pair, more, lambda *_, **__: pytest.fail("was asked"))
    found = pairs.summary(pair.judged((a, a)))
    assert (found["verdict"], found["confirmation"]) == ("agree", None)


def test_a_wrong_number_is_confirmed_by_the_ensembles_of_both_models(two):
    pair, both = two
    found = pairs.summary(pair.judged(both))
    assert found["verdict"] == "differ"
    assert found["confirmation"]["outcome"] == "confirmed"
    assert found["confirmation"]["members"] == [30, 99]
