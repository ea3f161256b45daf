"""Runs whose errors are known, and two models that play errors back."""

import pytest
from fake_ensemble import COARSE, MODELS, Fake

from comparison.accuracy.levels import tight
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Outcome, RunError, run_key, run_one
from comparison.scene import load_scene


@pytest.fixture
def make_runs(make_table):
    """Runs of a second-order method with an error: ``make_runs(error, ...)``, the rest as of `make_table`."""

    def make(error, refinement=(2.0, 2.0), **options):
        tables = [make_table(part * error, **options) for part in (1.0, 0.25, 4.0, 4.0, 4.0)]
        return Runs(*tables, refinement=refinement)

    return make


@pytest.fixture
def small():
    """Two cycles with few samples, Exudyn's tree: both models have an ensemble."""
    tree = tight(load_scene("150rpm-0.2mm", COARSE), MODELS)
    assert tree is not None
    return tree


@pytest.fixture
def fake(fake_model, small):
    def make(draw, of=small, **options):
        return Fake(fake_model.signals, of, draw, **options)

    return make


@pytest.fixture
def ran(fake_models, monkeypatch):  # noqa: ARG001
    """What `validate` runs, each once, by the fake models; without worker processes."""
    jobs, outcomes = {}, {}

    def run(job):
        try:
            return Outcome("success", table=run_one(job.scene, job.model))
        except RunError as error:
            return error.outcome

    def run_all(several, *_):
        keys = [run_key(job.scene, job.model, "") for job in several]
        for key, job in zip(keys, several, strict=True):
            if key not in jobs:
                jobs[key], outcomes[key] = job, run(job)
        return [outcomes[key] for key in keys]

    monkeypatch.setattr("comparison.verdict.validate.run_all", run_all)
    return jobs
