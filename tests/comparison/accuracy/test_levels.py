"""An accuracy becomes the cheapest setting whose error bound meets it on the scene; levels and tiers."""

import pytest

from comparison.accuracy.levels import (
    NAMES,
    AccuracyError,
    coarser,
    expected,
    finer,
    front,
    refinement,
    solver_values,
    tight,
)
from comparison.scene import load_scene, shipped_scenes

FULL, TREE, ROWS = ({"solver.exudyn.formulation": name} for name in ("full", "tree", "rows"))
EACH = {"reference": ("reference", {}), "full": ("exudyn", FULL), "tree": ("exudyn", TREE)}
NAMED = {"reference": [1e-7, 1e-10, 1e-12], "full": [8e-6, 2e-6, 5e-7], "tree": [1e-7, 1e-10, 1e-11]}


def setting(model, accuracy, scene):
    (value,) = solver_values(model, accuracy, scene).values()
    return value


@pytest.mark.parametrize("each", EACH)
def test_names_stand_for_the_same_settings_on_every_scene_from_coarse_to_fine(each):
    """The verdicts of both tiers depend on them."""
    model, changes = EACH[each]
    for name in shipped_scenes():
        scene = load_scene(name, changes)
        assert [setting(model, accuracy, scene) for accuracy in NAMES] == NAMED[each]
    rows = load_scene("150rpm-0.2mm", ROWS)  # without measurements there are names too
    assert solver_values("exudyn", "standard", rows) == {"solver.exudyn.step": 2e-6}


@pytest.mark.parametrize("each", EACH)
@pytest.mark.parametrize("name", ["150rpm-0.2mm", "wedge"])
def test_a_number_gives_the_cheapest_setting_whose_bound_meets_it(each, name):
    model, changes = EACH[each]
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
    ("model", "wanted", "name", "changes", "rule"),
    [
        ("exudyn", 1e-6, "ideal", TREE, "is not recorded for these joints; use draft, standard, strict"),
        ("exudyn", 1e-6, "150rpm-0.2mm", ROWS, "is not recorded for these"),
        ("adams", "strict", "ideal", {}, "model 'adams' is not recorded; set its solver.adams"),
        *(
            ("reference", text, "ideal", {}, "must be draft, standard, strict or a positive number")
            for text in ("precise", "-1", "0", "nan", "inf", "")
        ),
    ],
)
def test_what_is_no_accuracy_or_not_measured_is_refused(model, wanted, name, changes, rule):
    with pytest.raises(AccuracyError, match=rule):
        solver_values(model, wanted, load_scene(name, changes))


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
    scene, models = load_scene(name), ("reference", "exudyn")
    solver = tight(scene, models).data["solver"]
    assert solver["reference"]["tolerance"] == 1e-12
    # The tree's largest step, also where the scene gives one for five bodies
    tree = {"formulation": "tree", "step": 1e-4, "tolerance": 1e-11}
    assert solver["exudyn"] == scene.data["solver"]["exudyn"] | (tree if name != "ideal" else {})
    # Forces of joints need five bodies, and models of others have no tight settings.
    for group in ("joints", "energy"):
        forces = scene.with_values({"output.groups": [group]})
        assert tight(forces, models).data["solver"]["exudyn"] == forces.data["solver"]["exudyn"]
    assert tight(scene, ("reference", "other")) is None
