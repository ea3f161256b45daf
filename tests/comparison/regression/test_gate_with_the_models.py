"""The gate with the two models: it passes what did not change and finds a hundredth of a parameter."""

import re

import pytest

from comparison.regression.check import gate
from comparison.regression.record import new_baseline
from comparison.scene import load_scene
from comparison.words.record import gate_notes, of_gate

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_cache")]
RUNS = ("reference tight", "exudyn standard", "exudyn tight")


@pytest.fixture(scope="module")
def scene():
    """The first impacts and a stretch of sliding."""
    return load_scene("150rpm-0.2mm", {"drive.cycles": 0.25})


@pytest.fixture(scope="module")
def baseline(scene, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIXBAR_CACHE_DIR", str(tmp_path_factory.mktemp("made")))
        return new_baseline([scene], tmp_path_factory.getbasetemp(), n_jobs=2)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_unchanged_tree_passes_to_the_last_counter(baseline, scene, jobs):
    result = gate(baseline, [scene], n_jobs=jobs)
    assert (result.regressions, gate_notes(result), result.exit_code) == ([], [], 0)
    checked = [case for case in of_gate(result) if case.status == "passed"]
    assert {case.group for case in checked} >= set(RUNS)


@pytest.mark.parametrize(
    ("key", "factor"),
    [("friction.coefficient", 1.01), ("contact.youngs_modulus", 0.99), ("contact.restitution", 0.99)],
)
def test_a_hundredth_of_a_parameter_is_found_in_each_model_by_values_alone(baseline, scene, key, factor):
    section, name = key.split(".")
    changed = scene.variant({key: scene.data[section][name] * factor})  # under the baseline's name
    result = gate(baseline, [changed], n_jobs=2)
    assert result.exit_code == 1
    computed = [case for case in of_gate(result) if "checkpoints" in case.message]
    for run in RUNS:
        # The contact moves the slider, and all channels with it. The tight runs see it in most of them, the
        # five bodies at their usual step in a few.
        assert sum(case.group == run for case in computed) > (3 if run == "exudyn standard" else 14), run
    number = r"-?[\d.e-]+"
    said = (
        rf"scene '{re.escape(scene.name)}': \w+ at t = {number} s is {number} \S+, in the baseline {number} "
    )
    assert all(re.match(f"{case.group}, {said}", case.message) for case in computed)
