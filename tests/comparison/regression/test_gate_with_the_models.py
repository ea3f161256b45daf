"""The gate with the two models; what passes is asked in tests/cli/test_gate.py."""

import pytest

from comparison.regression.check import gate
from comparison.regression.record import new_baseline
from comparison.scene import load_scene
from comparison.words.record import of_gate

# The contact moves the slider, and all channels with it. The tight runs see it in most of them, the five
# bodies at their usual step in a few.
LEAST = {"reference tight": 15, "exudyn standard": 4, "exudyn tight": 15}
FACTORS = {"friction.coefficient": 1.01, "contact.youngs_modulus": 0.99, "contact.restitution": 0.99}


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_a_hundredth_of_a_parameter_is_found_in_each_model_by_values_alone(tmp_path):
    """In the first impacts and a stretch of sliding."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.25})
    baseline = new_baseline([scene], tmp_path, n_jobs=2)
    for key, factor in FACTORS.items():
        section, name = key.split(".")
        changed = scene.variant({key: scene.data[section][name] * factor})  # under the baseline's name
        result = gate(baseline, [changed], n_jobs=2)
        assert result.exit_code == 1
        moved = [case.group for case in of_gate(result) if "checkpoints" in case.message]
        assert all(moved.count(run) >= least for run, least in LEAST.items()), (key, moved)
