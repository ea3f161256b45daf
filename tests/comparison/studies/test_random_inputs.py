"""Random inputs, draws, first-order second moments: known answers, rough responses, intervals that cover."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from comparison.scene import SceneError, load_scene
from comparison.studies.random_inputs import draws, study
from comparison.studies.shared.scenes import settable

SLOPES = np.array([3.0, 0.0, -4.0])


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


def test_the_largest_errors_are_those_of_the_second_cycle(scene, make_table):
    run, ideal, nominal = make_table(), make_table(), make_table()
    per_cycle = scene.data["output"]["samples_per_cycle"]
    for channel, second in (("slider_y", -2.0), ("slider_vy", 3.0), ("slider_ay", -4.0)):
        run.frame.loc[10, channel] += 9.0
        run.frame.loc[per_cycle + 10, channel] += second
    nominal.frame["slider_y"] += 1.0
    sizes = draws.respond(run, ideal, nominal, scene.period)
    assert sizes == pytest.approx([2.0, 3.0, 4.0, 3.0], rel=1e-9)
    assert len(sizes) == len(draws.RESPONSES)


def test_draws_do_not_depend_on_processes_or_their_count_and_failures_leave_the_others(fake_models, tmp_path):
    wild = scene_with(tmp_path, entry("clearance.slider", deviation="2e-4"))
    few = wild.with_values({"output.samples_per_cycle": 50, "output.groups": ["accelerations"]})
    asked = draws.Draw(few, draws.inputs_of(few), seed=1)
    (one,) = draws.run_draws([(asked, 12)], 2, None)
    # A clearance below zero has a probability of 16 %.
    assert 1 <= len(one.failures) <= 6
    assert "clearance.slider" in one.failures[0]
    assert len(one.failures) + len(one.responses) == 12
    runs = fake_models.read_text().count("\n")
    # Each run that can be made, its ideal mechanism and the nominal one.
    assert runs == 3 * len(one.responses)
    (again,) = draws.run_draws([(asked, 12)], 1, None)
    assert fake_models.read_text().count("\n") == runs
    assert again.u.tolist() == one.u.tolist()
    assert again.responses.equals(one.responses)
    assert again.failures == one.failures
    fewer, other = draws.run_draws([(asked, 5), (replace(asked, seed=2), 5)], 1, None)
    assert fewer.responses.equals(one.responses.loc[:4])
    assert fewer.u.tolist() == one.u[: len(fewer.u)].tolist()
    assert not {*map(tuple, other.u)} & {*map(tuple, one.u)}


def test_what_the_page_says_of_methods_and_tolerances_follows_the_numbers():
    u = np.random.default_rng(1).normal(size=(2000, 2))
    smooth = 3.0 + u @ [0.5, 0.2]
    # The plane through a symmetric kink is flat: no first order without the residual.
    kinked = np.abs(u[:, 0])
    responses = pd.DataFrame({name: smooth if name == "velocity" else kinked for name in draws.RESPONSES})
    planes = {name: study.fit_plane(u, responses[name].to_numpy()) for name in draws.RESPONSES}
    shares = study.probabilities(planes, responses, dict.fromkeys(draws.RESPONSES, (2.0, 3.0)))
    agrees = shares.pivot_table("agrees", "response", "method", aggfunc="sum")
    assert agrees.loc["velocity", [study.FIRST_ORDER, study.WITH_RESIDUAL]].tolist() == [2, 2]
    assert agrees.loc["acceleration", study.FIRST_ORDER] == 0
    # Of 2000 runs 40 fail at the coarse tolerance only.
    fine = pd.DataFrame({name: np.zeros(2000) for name in draws.RESPONSES})
    coarse = fine.assign(velocity=np.where(np.arange(2000) < 40, 2 * study.LIMITS["velocity"][0], 0.0))
    common = {1e-6: coarse, 1e-7: fine, 1e-8: fine}
    changed = study.changes({t: draws.Drawn(u, each, [], 0.0) for t, each in common.items()})
    assert changed[changed["shifted"]][["tolerance", "response", "change"]].to_numpy().tolist() == [
        [1e-6, "velocity", 0.02]
    ]


# ---- first-order second moments


def drawn(rng, n, rough=0.0, scale=1.0):
    """A plane with roughness of a wave length far below any scatter of the inputs."""
    u = scale * rng.normal(size=(n, 3))
    return u, 10.0 + u @ SLOPES + rough * np.sqrt(2.0) * np.sin(1e7 * u[:, 0])


def test_a_plane_is_found_with_its_moments_importance_and_probability():
    plane = study.fit_plane(*drawn(np.random.default_rng(1), 50))
    assert plane.gradient == pytest.approx(SLOPES, abs=1e-12)
    assert plane.mean == pytest.approx(10.0, rel=1e-13)
    assert plane.deviation == pytest.approx(5.0, rel=1e-12)
    assert plane.importance == pytest.approx([0.36, 0.0, 0.64], abs=1e-12)
    value, low, high = study.failure_probability(plane, 20.0)
    assert value == pytest.approx(norm.sf(2.0), rel=1e-10)
    assert low == pytest.approx(high, rel=1e-9)  # no error is left
    still = study.fit_plane(np.random.default_rng(6).normal(size=(30, 2)), np.full(30, 7.0))
    assert study.failure_probability(still, 8.0) == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="5 runs are too few for a plane over 2 inputs"):
        study.fit_plane(np.zeros((5, 2)), np.zeros(5))


def test_roughness_hides_the_slope_over_a_small_scale_only_and_the_error_says_so():
    rng = np.random.default_rng(3)
    # Residuals of deviation 2 over 400 runs: 0.1 a slope, and a thousand times that over a thousandth.
    for scale, error in ((1.0, 0.1), (1e-3, 100.0)):
        plane = study.fit_plane(*drawn(rng, 400, rough=2.0, scale=scale))
        assert plane.errors == pytest.approx(error, rel=0.2)
        assert np.abs(plane.gradient - SLOPES).max() < 4 * plane.errors.max()
        assert plane.rest == pytest.approx(2.0, rel=0.1)
    # Deviations 5 and 5 together: 7.07; its own error is 1 %, and the probability's ten times that.
    plane = study.fit_plane(*drawn(rng, 4000, rough=5.0))
    with_rest, _, _ = study.failure_probability(plane, 20.0, with_rest=True)
    assert with_rest == pytest.approx(norm.sf(10 / np.hypot(5, 5)), rel=0.1)
    _, low, high = study.failure_probability(plane, 20.0)
    assert low < norm.sf(2.0) < high


def test_the_errors_of_slope_and_probability_cover_also_where_the_roughness_grows_with_an_input():
    exact, slopes, shares, trials = norm.sf(2.0), 0, 0, 300
    for seed in range(trials):
        rng = np.random.default_rng([4, seed])
        u = rng.normal(size=(120, 3))
        plane = study.fit_plane(u, u @ SLOPES + (0.2 + np.abs(u[:, 0])) * rng.normal(size=120))
        slopes += abs(plane.gradient[0] - SLOPES[0]) < 1.96 * plane.errors[0]
        _, low, high = study.failure_probability(study.fit_plane(*drawn(rng, 150, rough=2.0)), 20.0)
        shares += low < exact < high
    # 95 % of 300 is 285 +- 3.8; the usual error, of equal roughness everywhere, covers some 80 %.
    assert 270 <= slopes <= 298
    assert 270 <= shares <= 298


def test_a_paired_change_counts_only_runs_that_differ():
    failed = np.zeros(1000, dtype=bool)
    # Of 0 in n the upper limit solves (1 - p)^n = 0.025.
    assert study.counted_probability(failed)[2] == pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-9)
    failed[:60] = True
    other = failed.copy()
    most = pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-9)
    assert study.paired_change(failed, other)[::2] == (0.0, most)
    other[:20] = False
    value, low, high = study.paired_change(failed, other)
    assert value == pytest.approx(0.02)
    # All 20 in one direction: at least (0.025)^(1/20) of such changes go there.
    assert low == pytest.approx(0.02 * (2 * 0.025 ** (1 / 20) - 1), rel=1e-9)
    assert high == pytest.approx(0.02)
