"""Tight tier: in which formulation each scene is run."""

import pytest

from comparison.accuracy.tiers import tight
from comparison.scene import load_scene, shipped_scenes

MODELS = ("reference", "exudyn")


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_joint_with_clearance_is_integrated_without_joints(name):
    scene = load_scene(name)
    solver = tight(scene, MODELS).data["solver"]
    assert solver["reference"]["tolerance"] == 1e-12
    if name == "ideal":
        assert solver["exudyn"] == scene.data["solver"]["exudyn"]
    else:
        assert solver["exudyn"]["formulation"] == "tree"
        # The tree's largest step, also where the scene gives one for five bodies
        assert (solver["exudyn"]["step"], solver["exudyn"]["tolerance"]) == (1e-4, 1e-11)


@pytest.mark.parametrize("group", ["joints", "energy"])
def test_forces_of_joints_need_five_bodies(group):
    scene = load_scene("crank-pin", {"output.groups": [group]})
    assert tight(scene, MODELS).data["solver"]["exudyn"] == scene.data["solver"]["exudyn"]


def test_models_of_others_have_no_tight_settings():
    assert tight(load_scene("wedge"), ("reference", "other")) is None
