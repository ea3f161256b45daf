"""Random inputs: their distributions, what cannot be drawn, and what their draws show."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from comparison.scene import SceneError, load_scene
from comparison.studies.paper import random_inputs as draws
from comparison.studies.paper.runs import Config
from comparison.studies.shared.scenes import settable


def scene_with(tmp_path, entries):
    path = tmp_path / "scene.toml"
    path.write_text(f'scene.extends = "150rpm-0.2mm"\n{entries}')
    return load_scene(path)


def entry(key, distribution="normal", deviation="1e-5", more=""):
    return f'[[random]]\nkey = "{key}"\ndistribution = "{distribution}"\ndeviation = {deviation}\n{more}\n'


# ---- inputs


def test_drawn_values_have_the_middle_and_the_deviation_that_were_asked_for(scene):
    inputs = draws.inputs_of(scene)
    # Quantiles in equal steps stand for draws: a normal one's deviation is low by 3e-3.
    numbers = norm.ppf((np.arange(200) + 0.5) / 200)
    for axis, one in zip(np.eye(len(inputs)), inputs, strict=True):
        drawn = [draws.values_at(scene, inputs, number * axis)[one.key] for number in [0, *numbers]]
        middle, *values_drawn = drawn if one.element is None else [value[one.element] for value in drawn]
        held = settable(scene.data)[one.key]
        assert middle == pytest.approx(held if one.element is None else held[one.element], rel=1e-14)
        assert np.std(values_drawn) == pytest.approx(one.deviation, rel=0.02), draws.label(one)
        assert one.distribution == "normal" or min(values_drawn) > 0.0
        assert one.key != "contact.restitution" or max(values_drawn) <= 1.0
    # Two elements of one key are drawn together.
    both = [one for one in inputs if one.key == "mechanism.rocker_pivot"]
    values = draws.values_at(scene, both, np.array([1.0, -2.0]))
    assert values == {"mechanism.rocker_pivot": pytest.approx([0.2568 + 6.7e-5, 0.2 - 2 * 6.7e-5], rel=1e-14)}


def test_a_scene_says_what_scatters_also_in_one_partner_and_no_run_depends_on_it(tmp_path):
    own = scene_with(tmp_path, entry("contact.youngs_modulus.slider", deviation="1e9"))
    assert [draws.label(one) for one in draws.inputs_of(own)] == ["contact.youngs_modulus.slider"]
    assert own.hash == load_scene("150rpm-0.2mm").hash
    assert own.with_values({"drive.cycles": 1.0}).random == own.random
    values = draws.values_at(own, draws.inputs_of(own), np.array([2.0]))
    assert values == {"contact.youngs_modulus.slider": 212e9}
    assert own.with_values(values).data["contact"]["youngs_modulus"] == {"slider": 212e9, "guide": 210e9}
    apart = own.with_values({"random": [], "contact.youngs_modulus.guide": 69e9})
    with pytest.raises(SceneError, match=r"contact\.youngs_modulus is no number of a scene"):
        draws.inputs_of(apart)  # the defaults name that of both


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        (entry("clearance.sider"), "'clearance.sider' is not a key of a scene"),
        (entry("contact.law"), "contact.law is no number of a scene"),
        (entry("mechanism.rocker_pivot"), "mechanism.rocker_pivot is no number"),
        (entry("mechanism.rocker_pivot", more="element = 2"), r"mechanism.rocker_pivot\[2\] is no number"),
        (entry("mechanism.guide_x", "lognormal"), "mechanism.guide_x = -0.55 must be > 0 to be lognormal"),
        (2 * entry("clearance.slider"), "names a key twice"),
        (entry("clearance.slider", "cauchy"), "random"),
        (entry("clearance.slider", deviation="0.0"), "must be > 0"),
    ],
)
def test_an_input_that_cannot_be_drawn_is_reported(entries, message, tmp_path):
    with pytest.raises(SceneError, match=message):
        draws.inputs_of(scene_with(tmp_path, entries))


# ---- draws


def test_a_draw_has_the_drawn_numbers_and_nothing_runs_twice(fake_models):
    few = Config(samples=100, long_samples=50, cycles=2, draws=4)
    frame, failures = draws.measure(few, 1, None)
    assert failures == []
    assert frame.shape == (4, 6 + 11)
    assert (frame[["R of displacement", "R of velocity", "R of acceleration"]] <= 0.99866).to_numpy().all()
    runs = fake_models.read_text().count("\n")
    assert runs == 2 * 4  # each draw, and the ideal mechanism with the same numbers
    fewer, _ = draws.measure(few._replace(draws=3), 1, None)
    assert fake_models.read_text().count("\n") == runs
    assert fewer.equals(frame.iloc[:3])


def test_the_decisive_input_and_the_share_above_the_limit_follow_the_draws():
    u = np.random.default_rng(1).normal(size=(2000, 2))
    limits = {"displacement": 2e-4, "velocity": 2e-2, "acceleration": 150.0}
    # Errors of a thousandth of the limit and the scatter; one that falls where b rises; one that both move.
    frame = pd.DataFrame(
        {
            "displacement": 2e-4 * (1 + 1e-3 * u[:, 0]),
            "velocity": 2e-2 * np.exp(-u[:, 1]),
            "acceleration": 15.0 + 3.0 * u[:, 0] + 4.0 * u[:, 1],
        }
    ).assign(**{f"R of {name}": np.linspace(0.9, 0.99, 2000) for name in limits}, a=u[:, 0], b=u[:, 1])
    shown = draws.summary(frame).set_index("quantity")
    assert shown["limit"].to_dict() == limits
    assert shown["decisive"].to_list() == ["a", "b", "b"]
    # Of a sum of normal numbers the rank correlation is near the correlation, 0.8.
    assert shown["rank_share"].to_list() == pytest.approx([1.0, 1.0, 0.64], abs=0.04)
    share, low, high = shown.loc["displacement", ["share_above", "share_low", "share_high"]]
    assert low < 0.5 < high
    assert low < share < high
    assert share == np.mean(u[:, 0] > 0)
    # Of 0 in n the upper limit solves (1 - p)^n = 0.025.
    assert shown.loc["acceleration", "share_high"] == pytest.approx(1 - 0.025 ** (1 / 2000), rel=1e-9)
    assert shown.loc["velocity", ["R_median", "R_5"]].to_list() == pytest.approx([0.945, 0.9045], abs=1e-9)
