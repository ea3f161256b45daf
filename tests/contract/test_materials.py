"""Materials of slider and guide: one number for both, or one for each."""

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

MODULUS, POISSON = "contact.youngs_modulus", "contact.poisson"
# Nothing is lost, so the normal force is the elastic one.
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0, "drive.cycles": 0.05}
PARTNERS = {f"{MODULUS}.slider": 69e9, f"{POISSON}.slider": 0.33}


def each(slider: float, guide: float, of: str = MODULUS) -> dict[str, float]:
    """Dotted keys of a material's numbers."""
    return {f"{of}.slider": slider, f"{of}.guide": guide}


def compliance(scene: dict) -> float:
    """sigma_s + sigma_g, 1/Pa, of a scene that gives each its number."""
    modulus, poisson = scene["contact"]["youngs_modulus"], scene["contact"]["poisson"]
    return sum((1 - poisson[partner] ** 2) / modulus[partner] for partner in ("slider", "guide"))


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


def test_a_softer_slider_alone_has_the_paper_s_stiffness(run, variant) -> None:
    """K = 4 / (3 (sigma_s + sigma_g)) sqrt(R), from forces and depths of single corners."""
    found = run(variant, "rattle", {**LOSSLESS, **PARTNERS})
    assert found.scene["contact"]["youngs_modulus"] == {"slider": 69e9, "guide": 210e9}
    contact = found.scene["contact"]
    K = 4 / (3 * compliance(found.scene)) * np.sqrt(contact["corner_radius"])
    # Between those of steel on steel, 4.80e9, and of aluminium on aluminium, 1.63e9.
    assert pytest.approx(2.437e9, rel=1e-3) == K
    measured = []
    for corner in ("ll", "lr", "ul", "ur"):
        depth, normal = -found.columns[f"corner_{corner}_gap"], found.columns[f"corner_{corner}_normal"]
        # A gap rounds at 1e-15 m: 1.5e-8 of the force and less.
        deep = depth > 1e-7
        measured += list(normal[deep] / depth[deep] ** contact["exponent"])
    assert len(measured) > 100
    np.testing.assert_allclose(measured, K, rtol=1e-7)
    # And at the steps between the samples: the peak force is that of the largest depth.
    events = found.result.events
    peaks = events["peak_force"] / events["largest_depth"] ** contact["exponent"]
    np.testing.assert_allclose(peaks, K, rtol=1e-3)


def test_an_elastic_hit_lasts_longer_on_a_softer_slider(run, variant) -> None:
    """By Hertz as K^(-2/5), at one approach: the first hit, after equal flights."""
    steel, soft = (run(variant, "rattle", {**LOSSLESS, **changes}) for changes in ({}, PARTNERS))
    first = [
        {name: of.result.events[name][0] for name in ("corner", "start", "end", "normal_speed")}
        for of in (steel, soft)
    ]
    assert first[0]["corner"] == first[1]["corner"]
    # Steps of 2e-6 s, of other lengths in flight: 2.4e-6 is found.
    assert first[0]["normal_speed"] == pytest.approx(first[1]["normal_speed"], rel=1e-5)
    σ = (1 - 0.28**2) / 210e9
    ratio = (compliance(soft.scene) / (2 * σ)) ** (2 / 5)
    lasted = [hit["end"] - hit["start"] for hit in first]
    # Meanwhile the linkage moves on and the slider turns away: a few per cent of the duration, equal in both.
    assert lasted[1] / lasted[0] == pytest.approx(ratio, rel=0.02)
    assert ratio > 1.2


@pytest.mark.parametrize("law", ["foundation", "paper-switching"])
@pytest.mark.parametrize("name", ["reference-minimal", "exudyn-tree"])
def test_a_side_has_the_stiffness_of_both_partners(run, name, law) -> None:
    """K_s = a / (0.475 (sigma_s + sigma_g)): both corners pressed in, f1 + f2 = K_s (d1 + d2) / 2."""
    pressed = {
        "contact.law": law,
        "initial.slider_offset": 2.02e-4,
        "initial.slider_angle": 1e-5,
        "drive.cycles": 1e-5,
        "output.samples_per_cycle": 10_000_000,
    }
    found = run(name, "150rpm-0.2mm", {**LOSSLESS, **PARTNERS, **pressed})
    K_s = (0.05 + 0.07) / (0.475 * compliance(found.scene))
    depths = [-found.columns[f"corner_{corner}_gap"] for corner in ("lr", "ur")]
    force = sum(found.columns[f"corner_{corner}_normal"] for corner in ("lr", "ur"))
    both = np.minimum(*depths) > 1e-8
    assert both.sum() >= 5
    np.testing.assert_allclose(force[both], K_s * sum(depths)[both] / 2, rtol=1e-7)


MODELS = pytest.mark.parametrize("model", [reference_model, exudyn_model], ids=["reference", "exudyn"])


@MODELS
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
