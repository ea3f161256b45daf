"""Levels of refinement, the tight tier."""

import pytest

from comparison.accuracy.levels import coarser, finer, refinement, tight
from comparison.scene import load_scene, shipped_scenes

TREE = {"solver.exudyn.formulation": "tree"}
MODELS = ("reference", "exudyn")


@pytest.mark.parametrize(
    ("name", "changes", "model", "fine", "coarse", "factor_and_order"),
    [
        ("ideal", {}, "reference", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
        # Five bodies their step; finer, Newton's tolerance too. The tree its tolerance, not its longest step.
        ("ideal", {}, "exudyn", {"step": 4e-6, "tolerance": 1e-8}, {"step": 1.6e-5}, (2.0, 2.0)),
        ("wedge", TREE, "exudyn", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
    ],
)
def test_a_level_changes_what_controls_the_error_of_its_own_model(
    name, changes, model, fine, coarse, factor_and_order
):
    scene = load_scene(name, changes)
    solver = scene.data["solver"]
    for changed, values in ((finer(model, scene), fine), (coarser(model, scene), coarse)):
        assert changed.data["solver"] == solver | {model: solver[model] | values}
    assert refinement(model, scene) == factor_and_order


@pytest.mark.parametrize("name", shipped_scenes())
def test_at_the_tight_tier_every_joint_with_clearance_is_integrated_without_joints(name):
    scene = load_scene(name)
    solver = tight(scene, MODELS).data["solver"]
    assert solver["reference"]["tolerance"] == 1e-12
    # The tree's largest step, also where the scene gives one for five bodies
    tree = {"formulation": "tree", "step": 1e-4, "tolerance": 1e-11}
    assert solver["exudyn"] == scene.data["solver"]["exudyn"] | (tree if name != "ideal" else {})
    # Forces of joints need five bodies, and models of others have no tight settings.
    for group in ("joints", "energy"):
        forces = scene.with_values({"output.groups": [group]})
        assert tight(forces, MODELS).data["solver"]["exudyn"] == forces.data["solver"]["exudyn"]
    assert tight(scene, ("reference", "other")) is None
