"""Materials of slider and guide: one number for both, or one for each."""

import pytest

from comparison.scene import load_scene
from exudyn_model.parameters import read_scene
from reference_model.parameters import read_parameters

MODULUS, POISSON = "contact.youngs_modulus", "contact.poisson"


def each(slider: float, guide: float, key: str = MODULUS) -> dict[str, float]:
    return {f"{key}.slider": slider, f"{key}.guide": guide}


def by_reference(scene):
    """Constants of the guide and of the journal."""
    law = read_parameters(scene).law
    return (law.K, law.Ks), law.Kj


def by_exudyn(scene):
    parameters = read_scene(scene)
    return parameters.guide, parameters.journal


@pytest.mark.parametrize("read", [by_reference, by_exudyn])
def test_contact_constants_follow_from_the_materials_of_both_partners(read) -> None:
    """Equal to the last bit."""

    def constants(*changes):
        return read(load_scene("both-clearances", {k: v for part in changes for k, v in part.items()}).data)

    # Neither 210 GPa nor 0.28, the scene's own, which a partner alone would not change
    numbers = constants({MODULUS: 1e11, POISSON: 0.3})
    assert constants(each(1e11, 1e11), each(0.3, 0.3, POISSON)) == numbers != constants()
    # Exchangeable at the slider; journal and bearing are both of the guide's
    soft_slider = constants(each(69e9, 210e9), each(0.33, 0.28, POISSON))
    soft_guide = constants(each(210e9, 69e9), each(0.28, 0.33, POISSON))
    assert soft_slider[0] == soft_guide[0] != constants()[0]
    assert soft_slider[1] == constants()[1]
    assert soft_guide[1] == constants({MODULUS: 69e9, POISSON: 0.33})[1]


def test_a_stiffness_takes_the_place_of_the_materials_in_adams_impact() -> None:
    """Of corners and journal alike; where there is none each contact keeps that of Eq. 10."""

    def stiffness(**contact):
        scene = load_scene(
            "both-clearances", {f"contact.{key}": value for key, value in contact.items()}
        ).data
        law, exudyn = read_parameters(scene).law, read_scene(scene)
        assert (law.K, law.Kj) == pytest.approx((exudyn.guide.stiffness, exudyn.journal.stiffness), rel=1e-15)
        return law.K, law.Kj

    usual = stiffness()
    assert usual[0] != usual[1]
    assert stiffness(law="adams-impact") == usual
    assert stiffness(law="adams-impact", stiffness=3e9) == (3e9, 3e9)
