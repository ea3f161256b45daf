"""The one list of formulations: which can run a scene, whose they are, and what controls their error."""

import pytest

from comparison.execution.run import run_one
from comparison.models import FORMULATIONS, formulations, key_of, model_of
from comparison.scene import SceneError, load_scene


@pytest.mark.parametrize(
    ("scene", "names"),
    [
        ("150rpm-0.2mm", ["minimal", "multiplier", "tree", "full"]),
        ("ideal", ["minimal", "multiplier", "full"]),
        ("crank-pin", ["minimal", "tree", "full"]),
    ],
)
def test_those_in_the_list_run_a_scene_and_no_other(scene, names):
    short = load_scene(scene, {"drive.cycles": 1e-3, "output.samples_per_cycle": 1000, "output.groups": []})
    assert formulations(short.data) == names
    for name in FORMULATIONS:
        named = short.with_values({f"solver.{model_of(name)}.formulation": name})
        assert key_of(name).rpartition(".")[2] in named.data["solver"][model_of(name)]
        if name in names:
            assert len(run_one(named, model_of(name)).time) == 2
        else:
            with pytest.raises(SceneError, match=name):
                run_one(named, model_of(name))
