"""A wanted accuracy becomes the cheapest setting that promises it."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import pytest

from comparison.accuracy import NAMES, AccuracyError, coarser, finer, solver_values
from comparison.scene import load_scene

RECORD = tomllib.loads(files("comparison").joinpath("accuracy.toml").read_text("utf-8"))


@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_names_are_ordered_from_coarse_to_fine_and_stand_in_the_table(model):
    settings = [next(iter(solver_values(model, name).values())) for name in NAMES]
    assert settings == sorted(settings, reverse=True)
    assert set(settings) <= {row["setting"] for row in RECORD[model]["table"]}


@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_a_number_gives_the_cheapest_setting_that_promises_it(model):
    table = RECORD[model]["table"]
    for before, row in zip([None, *table], table, strict=False):
        assert solver_values(model, row["error"]) == {RECORD[model]["key"]: row["setting"]}
        if before:
            just_below = before["error"] * (1 - 1e-9)
            assert solver_values(model, f"{just_below!r}") == {RECORD[model]["key"]: row["setting"]}
    assert solver_values(model, 1.0) == {RECORD[model]["key"]: table[0]["setting"]}


@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_more_than_there_is_names_the_smallest_possible(model):
    best = min(row["error"] for row in RECORD[model]["table"])
    with pytest.raises(AccuracyError, match=f"smallest possible is {best:g} m"):
        solver_values(model, best * 0.99)


@pytest.mark.parametrize("wanted", ["precise", "-1", "0", "nan", "inf", ""])
def test_nonsense_is_refused(wanted):
    with pytest.raises(AccuracyError, match="must be draft, standard, strict or a positive number"):
        solver_values("reference", wanted)


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
