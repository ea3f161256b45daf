"""What a failed run says to try is what was seen to work: here it is done."""

import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

pytestmark = pytest.mark.slow
MODELS = {"reference": reference_model, "exudyn": exudyn_model}
FORMULATION, STEP, TOLERANCE = (f"solver.exudyn.{key}" for key in ("formulation", "step", "tolerance"))
TREE = {FORMULATION: "tree", "drive.cycles": 0.05}
FULL = {FORMULATION: "full", STEP: 2e-6, "drive.cycles": 0.2}


def run(model, changes):
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "output.groups": [], **changes})
    return MODELS[model].simulate(scene.data)


@pytest.mark.parametrize(
    ("model", "changes", "status", "key", "tried"),
    [
        ("exudyn", TREE | {TOLERANCE: 1e-17}, "step-too-small", TOLERANCE, 1e-10),
        ("exudyn", FULL | {STEP: 1e-3}, "invariant-violated", STEP, 2e-5),
        ("exudyn", FULL | {STEP: 1e-3, "contact.law": "paper-switching"}, "newton-failed", STEP, 2e-5),
    ],
)
def test_what_is_said_works(model, changes, status, key, tried):
    failed = run(model, changes)
    assert failed.status == status
    assert key in failed.remedy
    assert run(model, changes | {key: tried}).status == "success"


def test_less_friction_ends_a_run_that_jams(monkeypatch):
    # Rounding decides which status a jammed run has; the limit is 100 times the steps of a run that ends.
    monkeypatch.setattr("reference_model.simulation.STEPS_PER_CYCLE_LIMIT", 200_000)
    failed = run("reference", {"friction.coefficient": 3.0})
    assert failed.status in ("step-too-small", "work-limit", "non-finite", "chatter")
    assert "friction.coefficient" in failed.remedy
    assert run("reference", {"friction.coefficient": 1.0}).status == "success"
