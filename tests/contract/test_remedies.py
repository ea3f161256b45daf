"""What a failed run says to try is what was seen to work: here it is done."""

import pytest

import exudyn_model
from comparison.scene import load_scene

pytestmark = pytest.mark.slow
FORMULATION, STEP, TOLERANCE = (f"solver.exudyn.{key}" for key in ("formulation", "step", "tolerance"))
TREE = {FORMULATION: "tree", "drive.cycles": 0.05}
FULL = {FORMULATION: "full", STEP: 2e-6, "drive.cycles": 0.2}


def run(changes):
    return exudyn_model.simulate(load_scene("150rpm-0.2mm", {"output.groups": [], **changes}).data)


@pytest.mark.parametrize(
    ("changes", "status", "key", "tried"),
    [
        (TREE | {TOLERANCE: 1e-17}, "step-too-small", TOLERANCE, 1e-10),
        (FULL | {STEP: 1e-3}, "invariant-violated", STEP, 2e-5),
        (FULL | {STEP: 1e-3, "contact.law": "paper-switching"}, "newton-failed", STEP, 2e-5),
    ],
)
def test_what_is_said_works(changes, status, key, tried):
    failed = run(changes)
    assert failed.status == status
    assert key in failed.remedy
    assert run(changes | {key: tried}).status == "success"
