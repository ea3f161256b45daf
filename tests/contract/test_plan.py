"""The plan of a run agrees with the models: names, channels left out, the smallest by default."""

import pytest
from reference_states import IDEAL, PIN

import exudyn_model
import reference_model
from comparison.accuracy.levels import plan
from comparison.scene import load_scene
from comparison.tables.channels import expected

MODELS = {"reference": reference_model, "exudyn": exudyn_model}
AUTO = {"solver.exudyn.formulation": "auto"}
SHORT = {"drive.cycles": 0.002}
JOINTS = {"slider": {}, "pin": IDEAL | PIN, "both": PIN, "none": IDEAL}


@pytest.mark.parametrize("groups", [[], ["joints"]])
@pytest.mark.parametrize("joints", JOINTS)
@pytest.mark.parametrize("model", MODELS)
def test_the_model_records_the_formulation_that_was_planned(model, joints, groups):
    scene = load_scene("150rpm-0.2mm", JOINTS[joints] | AUTO | SHORT | {"output.groups": groups})
    scheme = plan(scene, model)
    result = MODELS[model].simulate(scene.data)
    assert result.provenance["formulation"] == scheme.formulation
    assert sorted(result.columns) == sorted(["time", *expected(scene.data)])
    assert set(scheme.integrated) | set(scheme.prescribed) == {"crank", "rod 2", "rocker", "rod 4", "slider"}
    # Two coordinates for every clearance; one less where an ideal slider does not turn with rod 4.
    clearances = {"slider": 1, "pin": 1, "both": 2, "none": 0}[joints]
    if model == "reference":
        assert (scheme.coordinates, scheme.constraints) == (2 * clearances, 0)
    elif groups or joints == "none":
        # The constraints leave two of 15 coordinates for each clearance.
        assert scheme.coordinates - scheme.constraints == 2 * clearances
    else:
        assert scheme.coordinates == {"slider": 2, "pin": 3, "both": 4}[joints]
    assert bool(scheme.contacts) == bool(clearances)
    omissions = " ".join(name for name, _ in scheme.left_out)
    assert ("reactions" in omissions) == (groups == [])
    assert ("contact at the crank pin" in omissions) == (joints in ("slider", "none"))


def test_a_larger_formulation_of_the_reference_runs_on_request():
    minimal = load_scene("150rpm-0.2mm", AUTO | SHORT)
    multiplier = minimal.with_values({"solver.reference.formulation": "multiplier"})
    minimal_plan, multiplier_plan = plan(minimal, "reference"), plan(multiplier, "reference")
    assert multiplier_plan.coordinates - multiplier_plan.constraints == minimal_plan.coordinates
    assert reference_model.simulate(multiplier.data).provenance["formulation"] == multiplier_plan.formulation
    assert [each[:2] for each in minimal_plan.instead] == [
        ("solver.reference.formulation = 'multiplier'", multiplier_plan.formulation)
    ]


def test_five_bodies_and_the_tree_are_reported_beside_each_other():
    full, tree = load_scene("150rpm-0.2mm"), load_scene("150rpm-0.2mm", AUTO)
    of_full, of_tree = plan(full, "exudyn"), plan(tree, "exudyn")
    assert (of_full.coordinates, of_full.constraints) == (15, 13)
    ratio = of_tree.expected.seconds / of_full.expected.seconds
    assert of_full.instead[0][1:] == (of_tree.formulation, pytest.approx(ratio, rel=1e-12))
    assert of_tree.instead[0][1:] == (of_full.formulation, pytest.approx(1 / ratio, rel=1e-12))
    assert "equations written here; only five bodies test its own joints" in of_tree.note
    assert of_full.note == plan(load_scene("crank-pin", AUTO), "exudyn").note == ""
    # Reactions need the joints: then there is nothing smaller.
    assert plan(full.with_values({"output.groups": ["joints"]}), "exudyn").instead == ()
