"""An accuracy becomes the cheapest setting whose error bound meets it on the scene; levels and tiers."""

from __future__ import annotations

import pytest

from comparison.accuracy.levels import (
    NAMES,
    AccuracyError,
    coarser,
    finer,
    refinement,
    solver_values,
    tight,
)
from comparison.accuracy.measured import expected, front
from comparison.scene import load_scene, shipped_scenes

TREE = {"solver.exudyn.formulation": "tree"}
EACH = pytest.mark.parametrize(
    ("model", "changes"),
    [("reference", {}), ("exudyn", {}), ("exudyn", TREE)],
    ids=["reference", "full", "tree"],
)
MODELS = ("reference", "exudyn")


def setting(model, accuracy, scene):
    (value,) = solver_values(model, accuracy, scene).values()
    return value


def test_names_stand_for_the_same_settings_on_every_scene_from_coarse_to_fine():
    """The verdicts of both tiers depend on them."""
    for name in shipped_scenes():
        scene = load_scene(name)
        assert [setting("reference", accuracy, scene) for accuracy in NAMES] == [1e-7, 1e-10, 1e-12]
        assert [setting("exudyn", accuracy, scene) for accuracy in NAMES] == [8e-6, 2e-6, 5e-7]
        tree = scene.with_values(TREE)
        assert [setting("exudyn", accuracy, tree) for accuracy in NAMES] == [1e-7, 1e-10, 1e-11]


@EACH
@pytest.mark.parametrize("name", ["150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm", "wedge"])
def test_a_number_gives_the_cheapest_setting_whose_bound_meets_it(model, changes, name):
    scene = load_scene(name, changes)
    known = front(scene, model)
    (key,) = solver_values(model, "draft", scene)
    cost = {row.setting: expected(scene.with_values({key: row.setting}), model).seconds for row in known.rows}
    for wanted in (1.0, *(row.error for row in known.rows)):
        chosen = setting(model, f"{wanted!r}", scene)
        assert expected(scene.with_values({key: chosen}), model).error <= wanted
        assert cost[chosen] == min(cost[row.setting] for row in known.rows if row.error <= wanted)
    with pytest.raises(AccuracyError, match=f"smallest error bound is {known.best:g} m, measured on {name}$"):
        solver_values(model, known.best * 0.99, scene)


@pytest.mark.parametrize(
    ("scene", "values"),
    [
        (load_scene("ideal", TREE), {"solver.exudyn.tolerance": 1e-10}),
        (load_scene("150rpm-0.2mm", {"solver.exudyn.formulation": "rows"}), {"solver.exudyn.step": 2e-6}),
    ],
)
def test_a_formulation_without_measurements_has_names_only(scene, values):
    assert solver_values("exudyn", "standard", scene) == values
    with pytest.raises(AccuracyError, match="is not recorded for these joints; use draft, standard, strict"):
        solver_values("exudyn", 1e-6, scene)


@pytest.mark.parametrize("wanted", ["precise", "-1", "0", "nan", "inf", ""])
def test_nonsense_is_refused(wanted):
    with pytest.raises(AccuracyError, match="must be draft, standard, strict or a positive number"):
        solver_values("reference", wanted, load_scene("ideal"))


def test_a_level_changes_what_controls_the_error_of_its_own_model():
    """Five bodies their step; finer, Newton's tolerance too. The tree its tolerance, not its longest step."""
    for scene, model, fine, coarse, factor_and_order in (
        (load_scene("ideal"), "reference", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
        (load_scene("ideal"), "exudyn", {"step": 4e-6, "tolerance": 0.1}, {"step": 1.6e-5}, (2.0, 2.0)),
        (load_scene("wedge", TREE), "exudyn", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
    ):
        solver = scene.data["solver"]
        for changed, values in ((finer(model, scene), fine), (coarser(model, scene), coarse)):
            if values.get("tolerance") == 0.1:
                values = values | {"tolerance": pytest.approx(0.1 * solver[model]["tolerance"])}
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
