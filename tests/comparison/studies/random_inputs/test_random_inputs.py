"""Random inputs: their distributions, how a scene names them, and draws whoever runs them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from comparison.scene import SceneError, load_scene
from comparison.studies.random_inputs.draws import (
    RESPONSES,
    Drawn,
    Draws,
    inputs_of,
    label,
    respond,
    run_draws,
    values_at,
)
from comparison.studies.random_inputs.second_moment import fit_plane
from comparison.studies.random_inputs.study import FIRST_ORDER, LIMITS, WITH_RESIDUAL, changes, probabilities
from comparison.studies.shared.scenes import settable


def scene_with(tmp_path, entries):
    path = tmp_path / "scene.toml"
    path.write_text(f'scene.extends = "150rpm-0.2mm"\n{entries}')
    return load_scene(path)


def entry(key, distribution="normal", deviation="1e-5", more=""):
    return f'[[random]]\nkey = "{key}"\ndistribution = "{distribution}"\ndeviation = {deviation}\n{more}\n'


def test_drawn_values_have_the_middle_and_the_deviation_that_were_asked_for(scene):
    inputs = inputs_of(scene)
    # Quantiles in equal steps stand for draws: their moments are those of the distribution to 1e-3.
    numbers = norm.ppf((np.arange(1000) + 0.5) / 1000)
    for i, one in enumerate(inputs):
        drawn = [
            values_at(scene, inputs, number * np.eye(len(inputs))[i])[one.key] for number in [0, *numbers]
        ]
        middle, *found = drawn if one.element is None else [value[one.element] for value in drawn]
        held = settable(scene.data)[one.key]
        assert middle == pytest.approx(held if one.element is None else held[one.element], rel=1e-14)
        assert np.std(found) == pytest.approx(one.deviation, rel=0.02), label(one)
        assert one.distribution == "normal" or min(found) > 0.0
        assert one.key != "contact.restitution" or max(found) <= 1.0
    # Two elements of one key are drawn together.
    both = [one for one in inputs if one.key == "mechanism.rocker_pivot"]
    values = values_at(scene, both, np.array([1.0, -2.0]))
    assert values == {"mechanism.rocker_pivot": pytest.approx([0.2568 + 6.7e-5, 0.2 - 2 * 6.7e-5], rel=1e-14)}


def test_a_scene_says_what_scatters_also_in_one_partner_and_no_run_depends_on_it(tmp_path):
    own = scene_with(tmp_path, entry("contact.youngs_modulus.slider", deviation="1e9"))
    assert [label(one) for one in inputs_of(own)] == ["contact.youngs_modulus.slider"]
    assert own.hash == load_scene("150rpm-0.2mm").hash
    assert own.with_values({"drive.cycles": 1.0}).random == own.random
    values = values_at(own, inputs_of(own), np.array([2.0]))
    assert values == {"contact.youngs_modulus.slider": 212e9}
    assert own.with_values(values).data["contact"]["youngs_modulus"] == {"slider": 212e9, "guide": 210e9}
    apart = own.with_values({"random": [], "contact.youngs_modulus.guide": 69e9})
    with pytest.raises(SceneError, match=r"contact\.youngs_modulus is no number of a scene"):
        inputs_of(apart)  # the defaults name that of both


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
        inputs_of(scene_with(tmp_path, entries))


def test_the_largest_errors_are_those_of_the_second_cycle(scene, make_table):
    run, ideal, nominal = make_table(), make_table(), make_table()
    per_cycle = scene.data["output"]["samples_per_cycle"]
    for channel, second in (("slider_y", -2.0), ("slider_vy", 3.0), ("slider_ay", -4.0)):
        run.frame.loc[10, channel] += 9.0
        run.frame.loc[per_cycle + 10, channel] += second
    nominal.frame["slider_y"] += 1.0
    assert respond(run, ideal, nominal, scene.period) == pytest.approx([2.0, 3.0, 4.0, 3.0], rel=1e-9)
    assert len(RESPONSES) == 4


def test_draws_do_not_depend_on_processes_or_chunks_and_are_kept(fake_models, scene):
    asked = Draws(scene.with_values({"output.groups": ["accelerations"]}), inputs_of(scene), 12, seed=5)
    (one,) = run_draws([asked], 2, None, chunk=4)
    runs = fake_models.read_text().count("\n")
    # The nominal mechanism once a chunk; each run and its ideal mechanism.
    assert runs == 3 + 2 * 12
    (again,) = run_draws([asked], 1, None, chunk=4)
    assert fake_models.read_text().count("\n") == runs
    (other,) = run_draws([asked], 1, None, chunk=5)
    assert one.responses.index.tolist() == list(range(12))
    for of in (again, other):
        assert of.u.tolist() == one.u.tolist()
        assert of.responses.equals(one.responses)
    assert np.abs(one.u).max() < 5.0
    assert one.failures == []


@pytest.mark.usefixtures("fake_models")
def test_a_run_that_cannot_be_made_is_reported_and_the_others_stay(tmp_path):
    wild = scene_with(tmp_path, entry("clearance.slider", deviation="2e-4"))
    few = wild.with_values({"output.samples_per_cycle": 50, "output.groups": ["accelerations"]})
    (drawn,) = run_draws([Draws(few, inputs_of(few), 30, seed=1)], 1, None)
    # A clearance below zero has a probability of 16 %.
    assert 1 <= len(drawn.failures) <= 12
    assert len(drawn.failures) + len(drawn.responses) == 30
    assert "clearance.slider" in drawn.failures[0]


def test_what_the_page_says_of_methods_and_tolerances_follows_the_numbers():
    rng = np.random.default_rng(1)
    u = rng.normal(size=(2000, 2))
    smooth = 3.0 + u @ [0.5, 0.2]
    # The plane through a symmetric kink is flat: no first order without the residual.
    kinked = np.abs(u[:, 0])
    responses = pd.DataFrame({name: smooth if name == "velocity" else kinked for name in RESPONSES})
    planes = {name: fit_plane(u, responses[name].to_numpy()) for name in RESPONSES}
    agrees = probabilities(planes, responses, dict.fromkeys(RESPONSES, (2.0, 3.0))).pivot_table(
        "agrees", "response", "method", aggfunc="sum"
    )
    assert agrees.loc["velocity", [FIRST_ORDER, WITH_RESIDUAL]].tolist() == [2, 2]
    assert agrees.loc["acceleration", FIRST_ORDER] == 0
    # Of 2000 runs 40 fail at the coarse tolerance only.
    limit = LIMITS["velocity"][0]
    fine = pd.DataFrame({name: np.zeros(2000) for name in RESPONSES})
    coarse = fine.assign(velocity=np.where(np.arange(2000) < 40, 2 * limit, 0.0))
    drawn = {t: Drawn(u, of, [], 0.0) for t, of in ((1e-6, coarse), (1e-7, fine), (1e-8, fine))}
    changed = changes(drawn)
    assert changed[changed["shifted"]][["tolerance", "response", "change"]].to_numpy().tolist() == [
        [1e-6, "velocity", 0.02]
    ]
