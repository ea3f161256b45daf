"""Materials of slider and guide: one number for both, or one for each."""

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

MODULUS, POISSON = "contact.youngs_modulus", "contact.poisson"
# Nothing is lost, so the normal force is the elastic one.
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0, "drive.cycles": 0.05}


def each(slider: float, guide: float, of: str = MODULUS) -> dict[str, float]:
    return {f"{of}.slider": slider, f"{of}.guide": guide}


def assert_same_tables(one, other) -> None:
    """To the last bit: columns, contacts, extrema."""
    assert list(one.columns) == list(other.columns)
    for name in one.columns:
        assert np.array_equal(one.columns[name], other.columns[name]), name
    for name in one.result.events:
        assert np.array_equal(one.result.events[name], other.result.events[name]), name
    assert one.result.extrema == other.result.extrema


def test_equal_partners_are_one_number(run, variant) -> None:
    """Neither 210 GPa nor 0.28, the scene's own, which a partner alone would not change."""
    numbers = run(variant, "rattle", {**LOSSLESS, MODULUS: 1e11, POISSON: 0.3})
    partners = run(variant, "rattle", {**LOSSLESS, **each(1e11, 1e11), **each(0.3, 0.3, POISSON)})
    assert numbers.scene["contact"]["youngs_modulus"] == 1e11
    assert partners.scene["contact"]["youngs_modulus"] == {"slider": 1e11, "guide": 1e11}
    assert numbers.result.events["start"].size > 3
    assert_same_tables(numbers, partners)


def test_partners_are_exchangeable_at_the_slider(run, variant) -> None:
    soft_slider = run(variant, "rattle", {**LOSSLESS, **each(69e9, 210e9), **each(0.33, 0.28, POISSON)})
    soft_guide = run(variant, "rattle", {**LOSSLESS, **each(210e9, 69e9), **each(0.28, 0.33, POISSON)})
    assert_same_tables(soft_slider, soft_guide)


@pytest.mark.parametrize("model", [reference_model, exudyn_model], ids=["reference", "exudyn"])
def test_journal_and_bearing_are_of_the_guide_s_material(model) -> None:
    def columns(changes):
        named = {"solver.exudyn.formulation": "tree", "drive.cycles": 0.02}
        result = model.simulate(load_scene("crank-pin", named | changes).data)
        assert result.status == "success"
        assert result.events["start"].size >= 1
        return result.columns

    steel, soft_slider = columns({}), columns({f"{MODULUS}.slider": 1e9, f"{POISSON}.slider": 0.4})
    soft_both, soft_guide = columns({MODULUS: 1e9}), columns({f"{MODULUS}.guide": 1e9})
    for name in steel:
        assert np.array_equal(steel[name], soft_slider[name]), name
        assert np.array_equal(soft_both[name], soft_guide[name]), name
    assert not np.array_equal(steel["slider_y"], soft_guide["slider_y"])
