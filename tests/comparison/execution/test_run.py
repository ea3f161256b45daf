"""Runs that are equal are made once. The models are fakes (tests/cli has more)."""

import os

import pytest

from comparison.execution.run import Job, run_all

pytestmark = pytest.mark.usefixtures("fake_models")


@pytest.mark.parametrize("n_jobs", [0, 2])
def test_equal_runs_are_made_once_and_stored_whatever_the_other_models_settings(n_jobs, scene, fake_models):
    again, shares = scene.with_values({"scene.title": "renamed", "solver.exudyn.step": 1e-6}), []
    first, second = run_all([Job(scene, "reference"), Job(again, "reference")], n_jobs, shares.append)
    ((*_, process),) = map(str.split, fake_models.read_text().splitlines())
    assert (process == str(os.getpid())) == (n_jobs == 0)
    assert shares == [0.5, 1.0]
    assert (first.table.provenance["scene_hash"], second.table.provenance["scene"]) == (
        scene.hash,
        again.data,
    )
    (third,) = run_all([Job(scene, "reference")], 1)
    assert fake_models.read_text().count("\n") == 1
    assert third.table.frame.to_numpy().tobytes() == first.table.frame.to_numpy().tobytes()
    assert third.table.provenance == first.table.provenance
