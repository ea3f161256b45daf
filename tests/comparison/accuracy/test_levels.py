"""A requested accuracy becomes the cheapest setting whose error bound meets it on the scene."""

from __future__ import annotations

import pytest

from comparison.accuracy.levels import (
    NAMES,
    AccuracyError,
    coarser,
    expected,
    finer,
    recorded_refinement,
    refinement,
    solver_values,
)
from comparison.accuracy.measured import front
from comparison.scene import load_scene, shipped_scenes

TREE = {"solver.exudyn.formulation": "tree"}
EACH = pytest.mark.parametrize(
    ("model", "changes"),
    [("reference", {}), ("exudyn", {}), ("exudyn", TREE)],
    ids=["reference", "full", "tree"],
)


def setting(model, accuracy, scene):
    (value,) = solver_values(model, accuracy, scene).values()
    return value


@EACH
def test_names_are_ordered_from_coarse_to_fine(model, changes):
    scene = load_scene("150rpm-0.2mm", changes)
    settings = [setting(model, name, scene) for name in NAMES]
    assert settings == sorted(settings, reverse=True)


def test_names_stand_for_the_same_settings_on_every_scene():
    """The verdicts of both tiers depend on them."""
    for name in shipped_scenes():
        scene = load_scene(name)
        assert [setting("reference", of, scene) for of in NAMES] == [1e-7, 1e-10, 1e-12]
        assert [setting("exudyn", of, scene) for of in NAMES] == [8e-6, 2e-6, 5e-7]
        tree = scene.with_values(TREE)
        assert [setting("exudyn", of, tree) for of in NAMES] == [1e-7, 1e-10, 1e-11]


@EACH
@pytest.mark.parametrize("name", ["150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm", "wedge"])
def test_a_number_gives_the_cheapest_setting_whose_bound_meets_it(model, changes, name):
    scene = load_scene(name, changes)
    found = front(scene, model)
    for wanted in (1.0, *(row.error for row in found.rows)):
        values = solver_values(model, f"{wanted!r}", scene)
        chosen = scene.with_values(values)
        assert expected(chosen, model).error <= wanted
        cost = expected(chosen, model).seconds
        for row in found.rows:
            if row.error <= wanted:
                assert cost <= expected(scene.with_values(dict.fromkeys(values, row.setting)), model).seconds


def test_a_number_means_the_scene_that_is_asked_of():
    """The bound of 300 rpm at 1e-7 takes three decades more at 90 rpm, whose chatter magnifies errors."""
    fast, slow = load_scene("300rpm-0.2mm"), load_scene("90rpm-0.5mm")
    wanted = expected(fast.with_values({"solver.reference.tolerance": 1e-7}), "reference").error
    assert setting("reference", wanted, fast) >= 1e-7
    assert setting("reference", wanted, slow) <= 1e-10


@EACH
def test_more_than_there_is_names_the_smallest_possible(model, changes):
    for name in ("150rpm-0.2mm", "90rpm-0.5mm"):
        scene = load_scene(name, changes)
        best = min(row.error for row in front(scene, model).rows)
        with pytest.raises(AccuracyError, match=f"smallest error bound is {best:g} m, measured on {name}$"):
            solver_values(model, best * 0.99, scene)
        assert setting(model, best, scene) in [row.setting for row in front(scene, model).rows]


def test_a_formulation_that_nobody_measured_has_names_only():
    ideal = load_scene("ideal", TREE)
    assert solver_values("exudyn", "standard", ideal) == {"solver.exudyn.tolerance": 1e-10}
    with pytest.raises(AccuracyError, match="'tree' is not recorded for these joints; use draft"):
        solver_values("exudyn", 1e-6, ideal)
    word = load_scene("150rpm-0.2mm", {"solver.exudyn.formulation": "rows"})
    assert solver_values("exudyn", "standard", word) == {"solver.exudyn.step": 2e-6}
    with pytest.raises(AccuracyError, match="not recorded"):
        solver_values("exudyn", 1e-6, word)


@pytest.mark.parametrize("wanted", ["precise", "-1", "0", "nan", "inf", ""])
def test_nonsense_is_refused(wanted):
    with pytest.raises(AccuracyError, match="must be draft, standard, strict or a positive number"):
        solver_values("reference", wanted, load_scene("ideal"))


def test_each_formulation_of_exudyn_is_set_by_what_makes_it_accurate():
    tree = load_scene("150rpm-0.2mm", TREE)
    assert solver_values("exudyn", "standard", load_scene("150rpm-0.2mm")) == {"solver.exudyn.step": 2e-6}
    assert solver_values("exudyn", "standard", tree) == {"solver.exudyn.tolerance": 1e-10}
    # The name "standard" is what a scene takes that says nothing.
    assert tree.data["solver"]["exudyn"]["tolerance"] == 1e-10
    # Its error goes with its tolerance, not with the longest step.
    finest, coarsest = finer("exudyn", tree), coarser("exudyn", tree)
    for changed, tolerance in ((finest, 1e-11), (coarsest, 1e-9)):
        assert changed.data["solver"]["exudyn"]["tolerance"] == pytest.approx(tolerance, rel=1e-14)
        assert changed.data["solver"]["exudyn"]["step"] == tree.data["solver"]["exudyn"]["step"]
    assert refinement("exudyn", tree) == (10.0, 1.0)
    assert refinement("exudyn", load_scene("150rpm-0.2mm")) == (2.0, 2.0)


def test_finer_touches_its_own_model_only():
    scene = load_scene("ideal")
    assert finer("reference", scene).data["solver"]["reference"]["tolerance"] == pytest.approx(
        1e-11, rel=1e-15
    )
    assert finer("reference", scene).data["solver"]["exudyn"] == scene.data["solver"]["exudyn"]
    assert finer("exudyn", scene).data["solver"]["exudyn"]["step"] == 4e-6
    assert coarser("exudyn", scene).data["solver"]["exudyn"]["step"] == 1.6e-5
    assert coarser("reference", scene).data["solver"]["reference"]["tolerance"] == pytest.approx(1e-9)
    assert finer("exudyn", scene).data["solver"]["reference"] == scene.data["solver"]["reference"]


def test_a_recorded_formulation_that_is_no_name_is_refined_as_the_model_usually_is():
    """Beside a table there may be anything."""
    for formulation in (["full"], {"a": 1}, None, 3):
        assert recorded_refinement("exudyn", {"formulation": formulation}) == recorded_refinement(
            "exudyn", {}
        )
