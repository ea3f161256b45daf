"""The names of an accuracy keep their error bounds, on every shipped scene from another start.

Exact is what the reference gives at 1e-14 from the same start. This start lies between those of the
table, which are whole multiples of 10 nm.
"""

from functools import cache

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.accuracy.levels import NAMES, expected, solver_values
from comparison.accuracy.refine import accurate_run
from comparison.scene import load_scene, shipped_scenes

SIMULATE = {"reference": reference_model.simulate, "exudyn": exudyn_model.simulate}
WITH_CLEARANCE = [name for name in shipped_scenes() if load_scene(name).loose]
# m. Of a thousand starts about one grazes a wall and is outside its bound, as the table says: -10.5e-8 m on
# poisson-0.33 at strict, by 6 times.
MOVED = 3.5e-8


@cache
def started(name):
    """The first cycle of a shipped scene, or what it has of it, from the moved start."""
    scene = load_scene(name)
    offset = scene.data["initial"]["slider_offset"] + MOVED
    cycles = min(1.0, scene.data["drive"]["cycles"])
    return scene.with_values({"initial.slider_offset": offset, "drive.cycles": cycles})


def slider_x(scene, model):
    result = SIMULATE[model](scene.data)
    assert result.status == "success", result.remedy
    return result.columns["slider_x"]


@cache
def exact(name):
    return slider_x(started(name).with_values({"solver.reference.tolerance": 1e-14}), "reference")


def assert_kept(name, model, formulation, accuracy):
    values = {f"solver.{model}.formulation": formulation}
    # The error bound is the shipped scene's: a moved start is another one, which would only borrow it.
    shipped = load_scene(name, values)
    chosen = solver_values(model, accuracy, shipped)
    bound = expected(shipped.with_values(chosen), model)
    assert (bound.scene, bound.own) == (name, True)
    simulated = slider_x(started(name).with_values(values).with_values(chosen), model)
    assert np.abs(simulated - exact(name)).max() <= bound.error


@pytest.mark.parametrize("name", shipped_scenes())
def test_the_reference_keeps_its_error_bounds(name):
    for accuracy in NAMES:
        assert_kept(name, "reference", "minimal", accuracy)


@pytest.mark.parametrize("name", WITH_CLEARANCE)
def test_the_tree_keeps_its_error_bounds(name):
    """Against the other model: an error that the tree's own finest run shared would be seen."""
    for accuracy in NAMES:
        assert_kept(name, "exudyn", "tree", accuracy)


@pytest.mark.slow  # some 15 s a scene
@pytest.mark.parametrize("name", shipped_scenes())
def test_five_bodies_keep_their_error_bounds(name):
    for accuracy in NAMES:
        assert_kept(name, "exudyn", "full", accuracy)


def drawn(seed):
    """A random press with clearance at the slider, over part of a cycle, far from what was measured."""
    rng = np.random.default_rng([seed, 64])
    clearance = 10.0 ** rng.uniform(-4.5, -3.0)
    return load_scene(
        "150rpm-0.2mm",
        {
            "drive.speed_rpm": float(rng.uniform(60.0, 400.0)),
            "drive.cycles": 0.2,
            "clearance.slider": float(clearance),
            "initial.slider_offset": float(rng.uniform(-0.9, 0.9) * clearance),
            "contact.youngs_modulus": float(10.0 ** rng.uniform(9.5, 11.5)),
            "contact.restitution": float(rng.uniform(0.3, 1.0)),
            "friction.coefficient": float(rng.uniform(0.0, 0.3)),
            "contact.law": str(rng.choice(["hertz-corners", "foundation", "adams-impact"])),
            "output.groups": [],
            "solver.exudyn.formulation": "tree",
        },
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_an_accuracy_that_is_kept_is_not_exceeded_threefold_on_random_scenes(seed):
    """Judged by the other model's strict run, where its own estimate is as small."""
    scene = drawn(seed)
    strict = {model: accurate_run(scene, model, "strict") for model in SIMULATE}
    for model, judge in (("reference", strict["exudyn"]), ("exudyn", strict["reference"])):
        for wanted in (1e-6, 1e-8):
            result = accurate_run(scene, model, wanted)
            reached = strict[model].estimate.coverage(wanted)
            assert result.coverage >= 0.8 * reached
            if result.kept:
                error = np.abs(result.table.values("slider_x") - judge.table.values("slider_x"))
                sure = (result.estimate.u <= wanted) & (judge.estimate.u <= wanted)
                assert error[sure].max(initial=0.0) <= 3.0 * wanted
