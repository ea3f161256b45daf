"""What was measured: whole, in order, of the scenes as they are; which scene takes which part."""

import tomllib
from importlib.resources import files
from math import isnan, nan

import pytest

from comparison.accuracy import levels
from comparison.accuracy.levels import (
    SETTINGS,
    Caution,
    expected,
    front,
    is_measured,
    measured_record,
    physics,
    plan,
    solver_values,
)
from comparison.scene import load_scene, shipped_scenes
from comparison.words.accuracy import plan_lines

FILE = tomllib.loads(files("comparison.accuracy").joinpath("measured.toml").read_text("utf-8"))
SAFETY, ROUND_OFF = 3.0, 1e-15  # as benchmarks/error_bounds.py, which says why
MODELS = ("reference", "exudyn")


@pytest.mark.parametrize("name", shipped_scenes())
def test_an_error_bound_is_more_than_was_measured_and_less_for_a_finer_setting(name):
    scene = load_scene(name)
    assert FILE[name]["physics"] == physics(scene), f"{name} has changed: measure it again"
    assert FILE[name]["cycles"] == min(1.0, scene.data["drive"]["cycles"])
    tables = {formulation: table for model in MODELS for formulation, table in FILE[name][model].items()}
    for formulation, table in tables.items():
        assert [row["setting"] for row in table["rows"]] == list(SETTINGS[formulation])
        rows = [row for row in table["rows"] if "failed" not in row]
        assert [row["error"] for row in rows] == sorted((row["error"] for row in rows), reverse=True)
        for row in rows:
            # But for the last bit: 3 x 5e-5 is more than 1.5e-4.
            least = max(SAFETY * row["measured"], SAFETY * FILE[name]["unsure"], ROUND_OFF) * (1 - 1e-12)
            assert row["error"] >= least
            assert row["seconds"] > 0
        assert table["start"] >= 0
        assert table["unit"] == ("step" if formulation == "full" else "cycle")


SCENE, METHOD, SLIDER = Caution.OTHER_SCENE, Caution.OTHER_METHOD, Caution.IDEAL_SLIDER


@pytest.mark.parametrize(
    ("shipped", "changes", "measured_on", "cautions"),
    [
        # The same physics
        ("300rpm-0.2mm", {"drive.cycles": 11.0, "scene.name": "mine"}, "300rpm-0.2mm", ()),
        ("300rpm-0.2mm", {"output.groups": [], "output.samples_per_cycle": 100}, "300rpm-0.2mm", ()),
        ("300rpm-0.2mm", {"solver.reference.tolerance": 1e-6}, "300rpm-0.2mm", ()),
        ("300rpm-0.2mm", {"initial.slider_offset": 5e-5}, "300rpm-0.2mm", ()),  # what it is anyway
        ("crank-pin", {}, "crank-pin", (SLIDER,)),
        # Other physics: the usual scene with the same joints
        ("300rpm-0.2mm", {"clearance.slider": 0.3e-3}, "150rpm-0.2mm", (SCENE,)),
        ("300rpm-0.2mm", {"drive.speed_rpm": 310}, "150rpm-0.2mm", (SCENE,)),
        ("300rpm-0.2mm", {"contact.law": "foundation"}, "150rpm-0.2mm", (SCENE,)),
        ("300rpm-0.2mm", {"initial.slider_offset": 6e-5}, "150rpm-0.2mm", (SCENE,)),
        ("crank-pin", {"friction.coefficient": 0.1}, "crank-pin", (SCENE, SLIDER)),
        ("both-clearances", {"environment.gravity": 0.0}, "both-clearances", (SCENE,)),
        ("ideal", {"mechanism.crank.length": 0.044}, "ideal", (SCENE,)),
        # ... and contacts or a load like its own
        ("adams-impact", {"drive.speed_rpm": 160}, "adams-impact", (SCENE,)),
        ("300rpm-0.2mm", {"load.force": 300.0}, "workpiece", (SCENE,)),
        ("both-clearances", {"load.force": 300.0}, "both-clearances", (SCENE,)),
        # Another method, of both models
        ("150rpm-0.2mm", {"solver.reference.method": "Radau", "output.groups": ["joints"]},
         "150rpm-0.2mm", (METHOD,)),
    ],
)  # fmt: skip
def test_a_scene_takes_the_numbers_of_the_shipped_one_with_its_physics_or_with_its_joints(
    shipped, changes, measured_on, cautions
):
    scene = load_scene(shipped, changes)
    own = not {SCENE, METHOD} & set(cautions)
    for model in MODELS:
        bound = expected(scene, model)
        assert (bound.measured_on, bound.cautions, bound.applies) == (measured_on, cautions, own)
        assert front(scene, model).rows == front(load_scene(measured_on), model).rows
        assert is_measured(scene, model, 1.0) == own
        assert not is_measured(scene, model, 1e-30)
        record = measured_record(scene, model, "1e-6")
        assert record["from"] == f"measured on {measured_on}"
        assert record["bound_m"] == (pytest.approx(nan, nan_ok=True) if bound.far else bound.error)


@pytest.mark.parametrize(
    ("shipped", "changes", "far"),
    [
        ("150rpm-0.2mm", {"clearance.slider": 1.9e-3, "initial.slider_angle": 0.01}, {}),
        ("150rpm-0.2mm", {"clearance.slider": 0.3}, {"clearance.slider": 1500}),
        (
            "150rpm-0.2mm",
            {"drive.speed_rpm": -1501, "friction.coefficient": 0},
            {"drive.speed_rpm": 1501 / 150},
        ),
        ("69GPa", {"contact.youngs_modulus.guide": 2.1e9}, {"contact.youngs_modulus.guide": 0.01}),
        ("150rpm-0.2mm", {"contact.law": "foundation"}, {"contact.law": nan}),
        ("wedge", {}, {}),  # it was measured itself
        # A law or a load like that of a measured scene
        ("150rpm-0.2mm", {"contact.law": "adams-impact", "contact.damping": 250.0}, {}),
        ("150rpm-0.2mm", {"load.force": 600.0}, {}),
        ("workpiece", {"load.force": 5.1e3}, {"load.force": 10.2}),
        # ... and none like it
        ("150rpm-0.2mm", {"load.table": [[0.0, 0.0], [1e-3, 200.0]]}, {"load": nan}),
        ("adams-impact", {"load.force": 500.0}, {"load": nan, "contact.law": nan}),
        ("adams-impact", {"contact.stiffness": 1e9}, {"contact.stiffness": nan}),
    ],
)
def test_a_scene_of_another_order_of_magnitude_is_promised_no_error(shipped, changes, far):
    scene = load_scene(shipped, changes)
    for model in MODELS:
        assert dict(expected(scene, model).far) == pytest.approx(far, rel=1e-12, nan_ok=True)  # a quotient
        made = plan(scene, model)
        assert isnan(made.expected.error) == bool(far)
        said = "\n".join(plan_lines(made))
        assert ("  error       not known" in said) == bool(far)
        assert all(f"{key} (" in said for key in far)


def test_forces_of_joints_need_another_method_of_exudyn_alone():
    forces = load_scene("150rpm-0.2mm", {"output.groups": ["joints"]})
    assert [expected(forces, model).cautions for model in MODELS] == [(), (METHOD,)]


def test_time_is_that_of_the_start_and_of_each_cycle_or_step_at_the_nearest_setting():
    scene = load_scene("69GPa", {"drive.cycles": 5.0, "solver.exudyn.step": 1.25e-7})
    for model, formulation, setting, count in (
        ("reference", "minimal", 1e-10, 5.0),
        ("exudyn", "tree", 1e-10, 5.0),
        ("exudyn", "full", 2.5e-7, scene.duration / 1.25e-7),
    ):
        table = FILE["69GPa"][model][formulation]
        (rate,) = (row["seconds"] for row in table["rows"] if row["setting"] == setting)
        named = scene.with_values({f"solver.{model}.formulation": formulation})
        assert expected(named, model).seconds == pytest.approx(table["start"] + rate * count, rel=1e-12)


def test_a_setting_without_result_is_reported_and_never_chosen(monkeypatch):
    """Neither the coarsest nor one below which there are bounds of coarser ones."""
    table = FILE["wedge"]["exudyn"]["full"]
    gone = [{"setting": setting, "failed": "step-too-small"} for setting in (8e-6, 2e-6)]
    rows = [*gone, *(row for row in table["rows"] if row["setting"] not in (8e-6, 2e-6))]
    broken = FILE | {"wedge": FILE["wedge"] | {"exudyn": {"full": table | {"rows": rows}}}}
    read = levels._read
    monkeypatch.setattr(levels, "_read", lambda name: broken if name == "measured.toml" else read(name))
    for step in (8e-6, 2e-6):
        bound = expected(load_scene("wedge", {"solver.exudyn.step": step}), "exudyn")
        assert isnan(bound.error)
        assert bound.failed == "step-too-small"
    assert solver_values("exudyn", 1.0, load_scene("wedge")) == {"solver.exudyn.step": 4e-6}
