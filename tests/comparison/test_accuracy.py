"""A wanted accuracy becomes the cheapest setting that promises it."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import pytest

from comparison.accuracy import NAMES, AccuracyError, coarser, finer, refinement, solver_values
from comparison.scene import load_scene

RECORD = tomllib.loads(files("comparison").joinpath("accuracy.toml").read_text("utf-8"))
EACH = pytest.mark.parametrize(
    ("model", "formulation", "record"),
    [
        ("reference", "auto", RECORD["reference"]),
        ("exudyn", "auto", RECORD["exudyn"]),
        ("exudyn", "tree", RECORD["exudyn"]["formulation"]["tree"]),
    ],
)


@EACH
def test_names_are_ordered_from_coarse_to_fine_and_stand_in_the_table(model, formulation, record):
    settings = [next(iter(solver_values(model, name, formulation).values())) for name in NAMES]
    assert settings == sorted(settings, reverse=True)
    assert set(settings) <= {row["setting"] for row in record["table"]}


@EACH
def test_a_number_gives_the_cheapest_setting_that_promises_it(model, formulation, record):
    table = record["table"]
    for before, row in zip([None, *table], table, strict=False):
        assert solver_values(model, row["error"], formulation) == {record["key"]: row["setting"]}
        if before:
            just_below = before["error"] * (1 - 1e-9)
            assert solver_values(model, f"{just_below!r}", formulation) == {record["key"]: row["setting"]}
    assert solver_values(model, 1.0, formulation) == {record["key"]: table[0]["setting"]}


@EACH
def test_more_than_there_is_names_the_smallest_possible(model, formulation, record):
    best = min(row["error"] for row in record["table"])
    with pytest.raises(AccuracyError, match=f"smallest possible is {best:g} m"):
        solver_values(model, best * 0.99, formulation)


@pytest.mark.parametrize("wanted", ["precise", "-1", "0", "nan", "inf", ""])
def test_nonsense_is_refused(wanted):
    with pytest.raises(AccuracyError, match="must be draft, standard, strict or a positive number"):
        solver_values("reference", wanted)


def test_each_formulation_of_exudyn_is_set_by_what_makes_it_accurate():
    assert solver_values("exudyn", "standard", "native") == {"solver.exudyn.step": 2e-6}
    assert solver_values("exudyn", "standard", "tree") == {"solver.exudyn.tolerance": 1e-10}
    assert solver_values("exudyn", 1e-9, "tree") == {"solver.exudyn.tolerance": 1e-9}
    # The name "standard" is what a scene takes that says nothing.
    tree = load_scene("150rpm-0.2mm", {"solver.exudyn.formulation": "tree"})
    assert tree.data["solver"]["exudyn"]["tolerance"] == 1e-10
    # Its error goes with its tolerance, not with the longest step.
    finest, coarsest = finer("exudyn", tree), coarser("exudyn", tree)
    for changed, tolerance in ((finest, 1e-11), (coarsest, 1e-9)):
        assert changed.data["solver"]["exudyn"]["tolerance"] == pytest.approx(tolerance, rel=1e-14)
        assert changed.data["solver"]["exudyn"]["step"] == tree.data["solver"]["exudyn"]["step"]
    assert refinement("exudyn", tree) == (10.0, 1.0)
    assert refinement("exudyn", load_scene("150rpm-0.2mm")) == (2.0, 2.0)


def test_a_word_of_the_record_is_no_formulation():
    assert solver_values("exudyn", "standard", "table") == {"solver.exudyn.step": 2e-6}


def test_finer_touches_its_own_model_only():
    scene = load_scene("ideal")
    assert finer("reference", scene).data["solver"]["reference"]["tolerance"] == pytest.approx(
        1e-11, rel=1e-15
    )
    assert finer("reference", scene).data["solver"]["exudyn"] == scene.data["solver"]["exudyn"]
    assert finer("exudyn", scene).data["solver"]["exudyn"]["step"] == 1e-6
    assert coarser("exudyn", scene).data["solver"]["exudyn"]["step"] == 4e-6
    assert coarser("reference", scene).data["solver"]["reference"]["tolerance"] == pytest.approx(1e-9)
    assert finer("exudyn", scene).data["solver"]["reference"] == scene.data["solver"]["reference"]
