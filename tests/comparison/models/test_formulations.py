"""Formulations that the models declare: which can run a scene, and the smallest that has what it asks for."""

import pytest

from comparison.models import MODELS, formulations, smallest
from comparison.scene import load_scene


@pytest.mark.parametrize(
    ("scene", "names"),
    [
        ("150rpm-0.2mm", ["minimal", "multiplier", "tree", "full"]),
        ("ideal", ["minimal", "multiplier", "full"]),
        ("crank-pin", ["minimal", "tree", "full"]),
    ],
)
def test_those_that_run_a_scene(scene, names):
    data = load_scene(scene, {"output.groups": []}).data
    assert [name for model in MODELS for name in formulations(model, data)] == names
    assert [smallest(model, data) for model in MODELS] == [names[0], names[-2 if "tree" in names else -1]]
    data = load_scene(scene, {"output.groups": ["joints"]}).data
    assert smallest("exudyn", data) == "full"
