"""Runs in worker processes: order, progress, what is stored. The models are fakes (tests/cli has more)."""

import os

import pytest

from comparison.execution.run import Job, run_all

pytestmark = pytest.mark.usefixtures("fake_models")


def log_of(path):
    """What the fake models wrote, one tuple a run: model, gravity, threads, process."""
    return [tuple(line.split()) for line in path.read_text().splitlines()]


def test_results_come_in_the_order_of_the_jobs_with_their_scene_and_progress_rises_to_one(scene, fake_models):
    slow, shares = scene.with_values({"drive.cycles": 6.0}), []
    planned = [Job(scene, "exudyn"), Job(slow, "reference"), Job(scene, "reference")]
    tables = [outcome.table for outcome in run_all(planned, 2, shares.append)]
    assert [len(table.frame) for table in tables] == [401, 1201, 401]
    assert [table.provenance["model"] for table in tables] == ["exudyn", "reference", "reference"]
    assert tables[1].provenance["scene_hash"] == slow.hash
    assert tables[1].events["corner"].tolist() == ["ll"]
    assert {threads for _, _, threads, _ in log_of(fake_models)} == {"1"}
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0, abs=1e-12)  # a sum of costs in another order
    assert len(shares) >= 6  # half and whole of each


@pytest.mark.parametrize("n_jobs", [0, 2])
def test_equal_runs_are_made_once_and_stored_whatever_the_other_models_settings(n_jobs, scene, fake_models):
    again, shares = scene.with_values({"scene.title": "renamed", "solver.exudyn.step": 1e-6}), []
    first, second = run_all([Job(scene, "reference"), Job(again, "reference")], n_jobs, shares.append)
    ((*_, process),) = log_of(fake_models)
    assert (process == str(os.getpid())) == (n_jobs == 0)
    assert shares == [0.5, 1.0]
    assert (first.table.provenance["scene_hash"], second.table.provenance["scene"]) == (
        scene.hash,
        again.data,
    )
    (third,) = run_all([Job(scene, "reference")], 1)
    assert len(log_of(fake_models)) == 1
    assert third.table.frame.to_numpy().tobytes() == first.table.frame.to_numpy().tobytes()
    assert third.table.provenance == first.table.provenance
