"""Runs in worker processes: failures of one run, order, progress, the cache. The models are fakes."""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import dataclass

import numpy as np
import pytest

import comparison.execution.run
from comparison.execution.cache import run_key
from comparison.execution.job import Job, RunError, describe
from comparison.execution.run import run_all, run_one, run_uncached
from comparison.execution.task_order import execution_order
from comparison.execution.workers import work
from comparison.scene import SceneError

pytestmark = pytest.mark.usefixtures("fake_models")


def jobs(scene, *gravities, models=("reference", "exudyn")):
    return [Job(scene.with_values({"environment.gravity": g}), model) for g in gravities for model in models]


def log_of(path):
    """What the fake models wrote, one tuple a run: model, gravity, threads, process."""
    return [tuple(line.split()) for line in path.read_text().splitlines()]


def test_results_come_in_the_order_of_the_jobs_with_their_scene(scene, fake_models):
    slow = scene.with_values({"drive.cycles": 6.0})
    outcomes = run_all([Job(scene, "exudyn"), Job(slow, "reference"), Job(scene, "reference")], 2)
    assert [o.status for o in outcomes] == ["success"] * 3
    assert [len(o.table.frame) for o in outcomes] == [401, 1201, 401]
    assert [o.table.provenance["model"] for o in outcomes] == ["exudyn", "reference", "reference"]
    assert outcomes[1].table.provenance["scene_hash"] == slow.hash
    assert outcomes[1].table.events["corner"].tolist() == ["ll"]
    assert {threads for _, _, threads, _ in log_of(fake_models)} == {"1"}


def test_the_threads_of_this_process_are_left_alone(scene, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    run_all([Job(scene, "reference")], 1)
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_an_environment_is_that_of_the_workers_alone(scene, fake_models, tmp_path):
    before, theirs = dict(os.environ), tmp_path / "theirs"
    variables = {"SIXBAR_TEST_LOG": str(theirs), "OMP_NUM_THREADS": "3"}
    with closing(
        work(comparison.execution.run._attempt, [("one", Job(scene, "reference"))], 1, environment=variables)
    ) as events:
        *_, (_, outcome) = events  # shares of progress before it
    assert outcome.status == "success"
    assert dict(os.environ) == before
    assert fake_models.read_text() == ""
    # One thread all the same: a sum over threads has no order of its own.
    assert [threads for _, _, threads, _ in log_of(theirs)] == ["1"]


def test_the_longest_job_starts_first_and_workers_are_kept(scene, fake_models):
    lengths = {"2.0": 2.0, "5.0": 5.0, "3.0": 3.0}
    run_all([Job(scene.with_values({"drive.cycles": c, "environment.gravity": c + 10}), "reference")
             for c in lengths.values()], 1)  # fmt: skip
    assert [gravity for _, gravity, _, _ in log_of(fake_models)] == ["15.0", "13.0", "12.0"]
    assert len({process for *_, process in log_of(fake_models)}) == 1


def test_of_each_kind_of_kernels_one_run_starts_before_all_others(scene):
    """Longest first would start two of the five bodies at once, and both workers would compile the same."""
    closer = scene.with_values({"solver.exudyn.formulation": "tree"})
    with_clearance = scene.with_values({"joints.crank_pin": "clearance"})
    planned = {
        f"{model} {place} {cycles}": Job(each.with_values({"drive.cycles": cycles}), model)
        for place, (each, model) in enumerate(
            [(scene, "exudyn"), (closer, "exudyn"), (scene, "reference"), (with_clearance, "reference")]
        )
        for cycles in (2.0, 3.0)
    }
    order = execution_order(planned)
    assert sorted(order) == sorted(planned)
    assert {name.rpartition(" ")[0] for name in order[:4]} == {
        "exudyn 0", "exudyn 1", "reference 2", "reference 3"
    }  # fmt: skip
    assert all(name.endswith("3.0") for name in order[:4])
    for part in (order[:4], order[4:]):
        costs = [planned[name].cost for name in part]
        assert costs == sorted(costs, reverse=True)


def test_what_needs_two_kinds_of_kernels_waits_for_those_that_need_one():
    @dataclass(frozen=True)
    class Needs:
        cost: float
        kernels: frozenset

    a, b, c = ("a",), ("b",), ("c",)
    tasks = {"abc": (9, {a, b, c}), "ab": (5, {a, b}), "a": (1, {a}), "b": (2, {b}), "a too": (3, {a})}
    order = execution_order({name: Needs(cost, frozenset(needs)) for name, (cost, needs) in tasks.items()})
    assert order == ["a too", "b", "abc", "ab", "a"]


def test_each_failure_takes_its_own_run_only(scene, gravity):
    bad = (gravity.crash, gravity.refuse, gravity.fail, gravity.nan, gravity.bug, gravity.short)
    planned = jobs(scene, *bad, gravity.normal)
    outcomes = [(o.status, o.message) for o in run_all(planned, 2)]
    assert [status for status, _ in outcomes[::2]] == ["success"] * 7  # the reference
    crash, refuse, fail, nan, bug, short, normal = outcomes[1::2]
    assert crash == ("crashed", "its process ended with code 3")
    assert refuse == ("bad input", "contact.law = 'foundation' is not simulated yet")
    assert fail == ("newton-failed", "try a smaller step")
    assert nan[0] == "unusable"
    assert "slider_vy is nan in data row 8" in nan[1]
    assert bug == ("crashed", "RuntimeError: index out of range")
    assert short[0] == "unusable"
    assert "truncated" in short[1]
    assert normal[0] == "success"


def test_a_crash_is_described_in_one_line(scene, gravity):
    (job,) = jobs(scene, gravity.fail, models=["exudyn"])
    (outcome,) = run_all([job], 1)
    assert describe(job, outcome) == (
        f"scene {job.scene.name!r}: the exudyn run did not succeed: newton-failed; try a smaller step"
    )
    (job,) = jobs(scene, gravity.refuse, models=["exudyn"])
    (outcome,) = run_all([job], 1)
    assert (
        describe(job, outcome) == f"scene {job.scene.name!r}: contact.law = 'foundation' is not simulated yet"
    )


def test_progress_rises_to_one(scene):
    seen = []
    run_all(jobs(scene, 9.81, 9.0), 2, seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0, abs=1e-12)
    assert len(seen) >= 8  # half and whole of each


def test_equal_runs_are_made_once_and_kept_and_the_other_models_settings_do_not_matter(scene, fake_models):
    again = scene.with_values({"scene.title": "renamed", "solver.exudyn.step": 1e-6})
    first, second = run_all([Job(scene, "reference"), Job(again, "reference")], 2)
    assert len(log_of(fake_models)) == 1
    assert first.table.provenance["scene_hash"] == scene.hash
    assert second.table.provenance["scene"] == again.data
    (third,) = run_all([Job(scene, "reference")], 1)
    assert len(log_of(fake_models)) == 1
    assert third.table.frame.to_numpy().tobytes() == first.table.frame.to_numpy().tobytes()
    assert third.table.provenance == first.table.provenance
    run_uncached(Job(scene, "exudyn"))
    assert len(log_of(fake_models)) == 2


def test_what_a_model_had_recorded_when_it_gave_up_is_handed_on_but_is_no_result(scene, gravity):
    failed, crashed = run_all(jobs(scene, gravity.fail, gravity.crash, models=["exudyn"]), 2)
    assert failed.table is None
    assert len(failed.partial.frame) == 401
    assert failed.partial.provenance["status"] == "newton-failed"
    assert crashed.partial is None


def test_failed_runs_are_not_kept(scene, fake_models, gravity):
    for _ in range(2):
        run_all(jobs(scene, gravity.fail, models=["exudyn"]), 1)
    assert len(log_of(fake_models)) == 2


def test_after_an_interruption_only_what_is_missing_runs(scene, fake_models, gravity):
    finished = jobs(scene, gravity.normal)
    # Shorter than the others, hence last.
    hanging = Job(scene.with_values({"environment.gravity": gravity.hang, "drive.cycles": 0.5}), "exudyn")

    def interrupt(_share):
        if len(log_of(fake_models)) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_all([hanging, *finished], 1, interrupt)
    assert [o.status for o in run_all(finished, 1)] == ["success"] * 2
    assert len(log_of(fake_models)) == 3


def test_a_model_whose_code_changed_is_run_again_but_not_for_a_comment(scene, fake_models):
    run_all([Job(scene, "reference")], 1)
    source = fake_models.parent / "fakes" / "reference_model" / "__init__.py"
    for change, runs in (("# words\n", 1), ("changed = 1\n", 2)):
        source.write_text(source.read_text() + change)
        run_all([Job(scene, "reference")], 1)
        assert len(log_of(fake_models)) == runs


def test_the_key_knows_the_model_and_the_scene(scene):
    keys = {
        run_key(scene, "reference", "json"),
        run_key(scene, "exudyn", "json"),
        run_key(scene.with_values({"contact.poisson": 0.3}), "reference", "json"),
        run_key(scene, "reference", "email"),
    }
    assert len(keys) == 4


def test_run_one_in_this_process(scene, fake_model, gravity, monkeypatch):
    monkeypatch.setattr(fake_model, "MODEL", "exudyn")
    monkeypatch.setattr(
        comparison.execution.run,
        "_simulate",
        lambda _, data, progress: fake_model.simulate(data, progress=progress),
    )
    shares = []
    table = run_one(scene, "exudyn", shares.append)
    assert shares == [0.5]
    assert np.all(np.diff(table.time) > 0)
    with pytest.raises(SceneError, match="is not simulated yet"):
        run_one(scene.with_values({"environment.gravity": gravity.refuse}), "exudyn")
    with pytest.raises(RunError, match="newton-failed; try a smaller step"):
        run_one(scene.with_values({"environment.gravity": gravity.fail}), "exudyn")


def test_without_workers_all_runs_are_of_this_process_and_cached(scene, fake_models):
    jobs = [Job(scene, "reference"), Job(scene.with_values({"drive.cycles": 1.0}), "reference")]
    ran = run_all(jobs, 0)
    assert [len(outcome.table.frame) for outcome in ran] == [401, 201]
    assert {line.split()[-1] for line in fake_models.read_text().splitlines()} == {str(os.getpid())}
    assert run_all(jobs, 0)[0].table.frame.equals(ran[0].table.frame)
    assert len(fake_models.read_text().splitlines()) == 2
