"""What was measured: whole, in order, of the scenes as they are; which scene takes which part."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from math import isfinite, isnan

import pytest

from comparison.accuracy.levels import NAMES, expected, solver_values
from comparison.accuracy.measured import front, physics
from comparison.accuracy.plan import expectation, lines, plan
from comparison.models import joints_with_clearance
from comparison.scene import load_scene, shipped_scenes

FILE = tomllib.loads(files("comparison.accuracy").joinpath("measured.toml").read_text("utf-8"))
SAFETY, ROUND_OFF = 3.0, 1e-15  # as benchmarks/error_bounds.py, which says why
TABLES = [
    pytest.param(name, model, formulation, id=f"{name} {formulation}")
    for name, found in FILE.items()
    for model in ("reference", "exudyn")
    for formulation in found[model]
]
EACH = pytest.mark.parametrize(("name", "model", "formulation"), TABLES)
OTHER = "measured on {}; this scene may magnify errors: estimate them by --check"


def formulations(name):
    """Those with a bound for a named accuracy: the tree where a joint has clearance."""
    free = joints_with_clearance(load_scene(name).data)
    return [("reference", "minimal"), ("exudyn", "full"), *([("exudyn", "tree")] if free else [])]


def test_every_shipped_scene_is_there_as_it_is_now():
    assert sorted(FILE) == shipped_scenes()
    for name in shipped_scenes():
        scene = load_scene(name)
        assert FILE[name]["physics"] == physics(scene), f"{name} has changed: measure it again"
        assert FILE[name]["cycles"] == min(1.0, scene.data["drive"]["cycles"])


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_name_of_an_accuracy_is_there(name):
    for model, formulation in formulations(name):
        scene = load_scene(name, {f"solver.{model}.formulation": formulation})
        settings = [row["setting"] for row in FILE[name][model][formulation]["rows"]]
        for accuracy in NAMES:
            values = solver_values(model, accuracy, scene)
            assert set(values.values()) <= set(settings)
            found = expected(scene.with_values(values), model)
            assert isfinite(found.seconds)
            # A name without result says so.
            assert isfinite(found.error) or any("no result" in words for words in found.cautions)


@EACH
def test_an_error_bound_is_more_than_was_measured_and_less_for_a_finer_setting(name, model, formulation):
    table = FILE[name][model][formulation]
    rows = [row for row in table["rows"] if "failed" not in row]
    assert [row["setting"] for row in table["rows"]] == sorted(
        (row["setting"] for row in table["rows"]), reverse=True
    )
    assert [row["error"] for row in rows] == sorted((row["error"] for row in rows), reverse=True)
    for row in rows:
        # But for the last bit: 3 x 5e-5 is more than 1.5e-4.
        least = max(SAFETY * row["measured"], SAFETY * FILE[name]["unsure"], ROUND_OFF) * (1 - 1e-12)
        assert row["error"] >= least
        assert row["seconds"] > 0
    assert table["start"] >= 0
    assert table["unit"] == ("step" if formulation == "full" else "cycle")


@pytest.mark.parametrize(
    "changes",
    [
        {"drive.cycles": 11.0},
        {"output.groups": []},
        {"output.samples_per_cycle": 100},
        {"solver.reference.tolerance": 1e-6},
        {"scene.name": "mine", "scene.title": "Mine"},
        {"initial.slider_offset": 5e-5},  # what it is anyway
    ],
)
def test_a_scene_with_the_same_physics_takes_the_numbers_of_the_shipped_one(changes):
    found = front(load_scene("300rpm-0.2mm", changes), "reference")
    assert (found.scene, found.cautions) == ("300rpm-0.2mm", ())
    assert found.rows == front(load_scene("300rpm-0.2mm"), "reference").rows


@pytest.mark.parametrize(
    ("shipped", "changes", "usual"),
    [
        ("300rpm-0.2mm", {"clearance.slider": 0.3e-3}, "150rpm-0.2mm"),
        ("300rpm-0.2mm", {"drive.speed_rpm": 310}, "150rpm-0.2mm"),
        ("300rpm-0.2mm", {"contact.law": "foundation"}, "150rpm-0.2mm"),
        ("300rpm-0.2mm", {"initial.slider_offset": 6e-5}, "150rpm-0.2mm"),
        ("crank-pin", {"friction.coefficient": 0.1}, "crank-pin"),
        ("both-clearances", {"environment.gravity": 0.0}, "both-clearances"),
        ("ideal", {"mechanism.crank.length": 0.044}, "ideal"),
    ],
)
def test_any_other_scene_takes_those_of_the_usual_one_and_says_so(shipped, changes, usual):
    scene = load_scene(shipped, changes)
    for model in ("reference", "exudyn"):
        assert front(scene, model).scene == usual
        assert OTHER.format(usual) in expected(scene, model).cautions
        assert OTHER.format(usual) in expectation(scene, model)
        assert any(OTHER.format(usual) in line for line in lines(plan(scene, model)))
    assert not any("magnify" in words for words in expected(load_scene(shipped), "exudyn").cautions)


def test_another_method_is_reported():
    implicit = load_scene("150rpm-0.2mm", {"solver.reference.method": "Radau"})
    forces = load_scene("150rpm-0.2mm", {"output.groups": ["joints"]})
    for model, scene in (("reference", implicit), ("exudyn", forces)):
        assert "measured with another method" in expectation(scene, model)
    assert "another method" not in expectation(forces, "reference")


def test_the_part_of_a_cycle_that_was_measured_is_reported():
    assert "slider_x over the first cycle, and" in expectation(load_scene("69GPa"), "reference")
    assert "slider_x over the first 0.06 cycles, and" in expectation(load_scene("both-clearances"), "exudyn")
    assert "for y choose by a name" in expectation(load_scene("crank-pin"), "reference")


def test_time_goes_with_the_cycles_and_the_steps():
    scene = load_scene("69GPa")
    for model, changes in (
        ("reference", {}),
        ("exudyn", {}),
        ("exudyn", {"solver.exudyn.formulation": "tree"}),
    ):
        one, three, five = (
            expected(scene.with_values(changes | {"drive.cycles": cycles}), model).seconds
            for cycles in (1.0, 3.0, 5.0)
        )
        assert five - three == pytest.approx(three - one, rel=1e-9)
        assert three > 1.5 * one
    fine = scene.with_values({"solver.exudyn.step": 2.5e-7})
    finest = scene.with_values({"solver.exudyn.step": 1.25e-7})
    assert expected(finest, "exudyn").seconds / expected(fine, "exudyn").seconds == pytest.approx(2, rel=0.01)


def test_a_setting_without_result_is_reported_and_never_chosen(monkeypatch):
    table = {**FILE["wedge"]["exudyn"]["full"]}
    table["rows"] = [
        {"setting": row["setting"], "failed": "step-too-small", "seconds": row["seconds"]}
        if row["setting"] == 8e-6
        else row
        for row in table["rows"]
    ]
    broken = FILE | {"wedge": FILE["wedge"] | {"exudyn": {"full": table}}}
    monkeypatch.setattr("comparison.accuracy.measured._file", lambda: broken)
    scene = load_scene("wedge", {"solver.exudyn.step": 8e-6})
    assert isnan(expected(scene, "exudyn").error)
    assert "expected: nothing recorded" in expectation(scene, "exudyn")
    assert "no result at this setting: step-too-small" in expectation(scene, "exudyn")
    assert solver_values("exudyn", 1.0, scene) == {"solver.exudyn.step": 4e-6}


def test_the_plan_has_the_materials_of_both_partners():
    for changes, words in (
        ({}, "(hertz-corners; 210 GPa, Poisson's ratio 0.28)"),
        ({"contact.youngs_modulus.slider": 69e9}, "(hertz-corners; 69 on 210 GPa, Poisson's ratio 0.28)"),
    ):
        for model in ("reference", "exudyn"):
            assert plan(load_scene("150rpm-0.2mm", changes), model).contacts == (
                f"four corners of the slider {words}",
            )
