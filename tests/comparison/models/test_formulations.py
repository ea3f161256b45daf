"""Formulations that the models declare: which can run a scene, what controls their error, the smallest."""

import pytest

from comparison.accuracy.levels import scene_at
from comparison.execution.run import run_one
from comparison.models import MODELS, declared_formulations, formulations, smallest
from comparison.scene import SceneError, load_scene


@pytest.mark.parametrize(
    ("scene", "names"),
    [
        ("150rpm-0.2mm", ["minimal", "multiplier", "tree", "full"]),
        ("ideal", ["minimal", "multiplier", "full"]),
        ("crank-pin", ["minimal", "tree", "full"]),
    ],
)
def test_those_that_are_declared_run_a_scene_and_no_other(scene, names):
    short = load_scene(scene, {"drive.cycles": 1e-3, "output.samples_per_cycle": 1000, "output.groups": []})
    possible = {model: formulations(model, short.data) for model in MODELS}
    assert [name for model in MODELS for name in possible[model]] == names
    for model in MODELS:
        assert smallest(model, short.data) == possible[model][0]
        for name in declared_formulations(model):
            named = scene_at(short, model, name, 1e-7)
            if name in possible[model]:
                assert len(run_one(named, model).time) == 2
            else:
                with pytest.raises(SceneError, match=name):
                    run_one(named, model)
