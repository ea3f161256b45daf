"""Two models' reliabilities: what is known of their difference, and what its interval says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

from comparison.accuracy.levels import tight
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Outcome, run_all, run_key, run_one
from comparison.models import MODELS
from comparison.reliability.assessment import assess
from comparison.reliability.difference import (
    MARGIN,
    FailedRun,
    ReliabilityComparison,
    compare_reliability,
    dense_scene,
    ideal_scenes,
)
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene import load_scene
from comparison.scene.schema import AccelerationLimits, Reliability
from comparison.studies.reliability.study import STUDY
from comparison.tables.table import TableError
from comparison.verdict.validate import validate
from comparison.words.reliability import line, notes, rounded

PERIOD = 0.4
LIMIT = 80.0
SETTINGS = Reliability(acceleration=AccelerationLimits(upper=LIMIT))
K = 2.0


def compared(a, b, ideal):
    """The difference of the accelerations' reliabilities; runs or tables."""
    sides = tuple(of if isinstance(of, Runs) else Runs(of, of) for of in (a, b))
    ideals = ideal if isinstance(ideal, tuple) else (Runs(ideal, ideal),) * 2
    return compare_reliability(sides, ideals, PERIOD, SETTINGS, K)["acceleration"]


def exact(error):
    """R of a constant error: (40 - e) / (80 / 6)."""
    return float(ndtr((LIMIT / 2 - error) / (LIMIT / 6)))


def test_equal_results_agree_and_leave_nothing_open(press):
    found = compared(press(8.0), press(8.0), press())
    assert (found.minimum, found.sampling, found.verdict) == (0.0, 0.0, "agree")
    assert found.numerical < 1e-14
    assert not found.curve.any()


def test_a_difference_that_neither_numerics_nor_cycles_explain_is_one(press):
    found = compared(press(8.0), press(8.1), press())
    assert found.minimum == pytest.approx(exact(8.0) - exact(8.1), rel=1e-9)
    assert found.curve == pytest.approx(np.full(10, exact(8.0) - exact(8.1)), rel=1e-9)
    assert found.verdict == "differ"


def test_the_numerical_part_is_that_of_the_refined_runs_and_of_the_ideal_mechanism(press):
    base = press(8.0)
    finer = compared(Runs(base, press(8.01)), Runs(base, base), press())
    # Two levels that show no order: three times their distance, k = 2.
    assert finer.numerical == pytest.approx(K * 3 * (exact(8.0) - exact(8.01)), rel=1e-9)
    perturbed = compared(Runs(base, base, perturbed=press(8.2), coarser=base), Runs(base, base), press())
    assert perturbed.numerical == pytest.approx(K * 3 * (exact(8.0) - exact(8.2)), rel=1e-9)
    assert perturbed.verdict == "undecided"
    assert perturbed.half_width > MARGIN
    # Of two perturbed runs the farther one counts.
    both = Runs(base, base, perturbed=press(8.2), other_perturbed=press(7.7), coarser=base)
    farther = compared(both, Runs(base, base), press())
    assert farther.numerical == pytest.approx(K * 3 * (exact(7.7) - exact(8.0)), rel=1e-9)
    # Of the ideal there is the coarser level, of second order: a quarter of its distance.
    ideals = (Runs(press(), coarser=press(0.01)), Runs(press(), coarser=press()))
    ideal = compared(base, base, ideals)
    assert ideal.numerical == pytest.approx(K * 3 / 4 * (exact(7.99) - exact(8.0)), rel=1e-9)
    # The smallest and the parts of the cycle have the same uncertainty where all parts are equal.
    assert ideal.curve_half_width == pytest.approx(np.full(10, ideal.numerical), rel=1e-9)


def test_without_a_refined_run_nothing_is_decided_and_the_line_says_that_the_uncertainty_is_unknown(press):
    found = compared(Runs(press(8.0)), Runs(press(8.0)), press())
    assert np.isnan(found.half_width)
    assert found.verdict == "undecided"
    words = line(ReliabilityComparison(SETTINGS, {"acceleration": found}))
    assert words.endswith("; largest difference 0.0e+00 of unknown uncertainty")


def test_results_that_follow_one_course_are_distinguished_better_than_their_cycles_scatter(press):
    """The pairing: cycles that scatter by 2 m/s^2 in both alike leave a difference of 0.1 m/s^2 visible."""
    scatter = np.repeat(np.random.default_rng(1).normal(0.0, 2.0, 5), 1000)
    course = 8.0 + np.append(0.0, scatter)
    a, b = (press(course + offset, cycles=5) for offset in (0.0, 0.1))
    found = compared(a, b, press(cycles=5))
    alone = 0.5 * (found.a.high - found.a.low)[found.a.worst]
    assert found.sampling < 0.05 * alone
    assert found.verdict == "differ"


def test_two_samples_of_one_distribution_differ_as_seldom_as_the_level_says(press):
    """Independent courses in both models, 5 cycles of their own scatter: 95 % hold zero."""
    rng = np.random.default_rng(4)
    kept = 0
    repeated = 100
    ideal = press(cycles=5, per_cycle=50)
    for _ in range(repeated):
        sides = [
            press(8.0 + np.append(0.0, np.repeat(rng.normal(0.0, 2.0, 25), 10)), cycles=5, per_cycle=50)
            for _ in range(2)
        ]
        found = compared(*sides, ideal)
        kept += int(np.sum(np.abs(found.curve) <= found.curve_half_width))
    # Each bin has one value a cycle, so four degrees of freedom; neighbouring bins share it, which makes 500
    # independent intervals. Three deviations of their number, and 0.02 for what the influence, a first
    # derivative, does not see.
    independent = 5 * repeated
    assert kept / (10 * repeated) == pytest.approx(0.95, abs=0.02 + 3 * np.sqrt(0.95 * 0.05 / independent))


def test_smallest_values_in_different_parts_of_the_cycle_have_no_pairs(press):
    angle = np.arange(2001) * 0.36 % 360.0
    rng = np.random.default_rng(2)
    noise = [np.repeat(rng.normal(0.0, 1.0, 2), 1000) for _ in range(2)]
    early, late = (
        press(5.0 + 3.0 * ((angle > low) & (angle <= low + 36.0)) + np.append(0.0, of))
        for low, of in zip((36.0, 180.0), noise, strict=True)
    )
    found = compared(early, late, press())
    assert (found.a.angle[found.a.worst], found.b.angle[found.b.worst]) == (72.0, 216.0)
    # Half-widths of beta times what R changes with it.
    own = [of.left_open[of.worst].sampling * norm.pdf(of.index[of.worst]) for of in (found.a, found.b)]
    assert found.sampling == pytest.approx(np.hypot(*own), rel=1e-12)
    steps = [of.left_open[of.worst].quadrature * norm.pdf(of.index[of.worst]) for of in (found.a, found.b)]
    assert found.quadrature == pytest.approx(np.hypot(*steps), rel=1e-12)


def test_results_of_other_grids_are_compared_and_of_other_cycles_refused(press):
    found = compared(press(8.0), press(8.1, per_cycle=333), press())
    assert found.minimum == pytest.approx(exact(8.0) - exact(8.1), rel=1e-6)
    with pytest.raises(TableError, match="other parts of the cycles"):
        compared(press(), press(cycles=3), press(cycles=3))


def test_what_samples_leave_open_of_both_alike_is_no_part_of_the_difference(press):
    """The pairing: pulses of two samples each, at the same instants in both."""
    pulses = np.zeros(2001)
    pulses[np.random.default_rng(3).choice(2000, 100, replace=False)] = 30.0
    found = compared(press(8.0 + pulses), press(8.05 + pulses), press())
    worst = found.a.left_open[found.a.worst].quadrature * norm.pdf(found.a.index[found.a.worst])
    assert found.a.worst == found.b.worst
    assert found.quadrature < 0.01 * worst
    shifted = compared(press(8.0 + pulses), press(8.05 + np.roll(pulses, 1)), press())
    assert shifted.quadrature > 0.5 * worst


def scene_of(a, b, ideal):
    runs, ideals = (Runs(a, a), Runs(b, b)), (Runs(ideal, ideal),) * 2
    return ReliabilityComparison(SETTINGS, compare_reliability(runs, ideals, PERIOD, SETTINGS, K))


def test_the_line_names_the_smallest_and_the_cap(press):
    comparison = scene_of(press(8.0), press(8.1), press())
    assert comparison.verdict == "differ"
    assert line(comparison) == (
        "differ: smallest of displacement 0.9986501 (the cap), acceleration "
        f"{rounded(exact(8.0))} and {rounded(exact(8.1))} at 36 deg; largest difference "
        f"{exact(8.0) - exact(8.1):.1e} ± {comparison.quantities['acceleration'].half_width:.1e}"
    )
    limits, capped, sampled = notes(comparison)
    assert limits.endswith("displacement 0.0002 m, acceleration 80 m/s^2.")
    assert capped.endswith("wide: displacement in 10 of 10 parts.")
    assert sampled.startswith("Cycles sampled: 2, few")


def test_of_a_part_of_a_cycle_and_of_nothing_it_says_so(press):
    short = scene_of(press(cycles=0.06), press(cycles=0.06), press(cycles=0.06))
    assert notes(short)[-1].startswith("Of one cycle nothing is known about others")
    nothing = ReliabilityComparison(SETTINGS, missing=TableError("the two results: cover other parts"))
    assert (line(nothing), nothing.verdict) == (
        "not available: the two results: cover other parts",
        "undecided",
    )
    assert notes(nothing) == ["Not available: the two results: cover other parts."]
    job = Job(load_scene("ideal"), "exudyn")
    for ideal, run in ((True, "the ideal mechanism"), (False, "with more samples")):
        failed = FailedRun(job, Outcome("crashed", "exit code 9"), ideal)
        assert line(ReliabilityComparison(SETTINGS, missing=failed)) == (
            f"not available: {run}: scene 'ideal': the exudyn run did not succeed: crashed; exit code 9"
        )


@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_scenes_that_differ_in_their_clearance_only_share_one_ideal_mechanism(model):
    keys = {
        name: run_key(ideal_scenes(load_scene(name), model)["base"], model, "")
        for name in ("150rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm")
    }
    assert len(set(keys.values())) == 3  # one a speed
    longer = load_scene("150rpm-0.2mm", {"mechanism.rod4.length": 0.25})
    assert run_key(ideal_scenes(longer, model)["base"], model, "") not in keys.values()


def test_its_time_and_samples_are_the_scenes():
    scene = load_scene("crank-pin", {"output.samples_per_cycle": 300})
    levels = ideal_scenes(scene, "exudyn")
    ideal = levels["base"]
    assert ideal.duration == pytest.approx(scene.duration, rel=1e-14)
    assert ideal.period == scene.period
    # The coarser run's step would not fit between dense samples
    samples = {kind: of.data["output"]["samples_per_cycle"] for kind, of in levels.items()}
    assert samples == {"base": 10_200, "coarser": 300}
    assert ideal.data["joints"] == {"slider": "ideal", "crank_pin": "ideal"}
    assert ideal.data["mechanism"] == scene.data["mechanism"]


def test_both_models_have_the_same_ideal_mechanism_and_the_ideal_scene_no_error():
    scene = load_scene("ideal", {"drive.cycles": 0.5})
    levels = ideal_scenes(scene, "exudyn")
    exact = run_one(ideal_scenes(scene, "reference")["base"], "reference")
    fine, coarse = (run_one(levels[kind], "exudyn") for kind in ("base", "coarser"))
    # As `STEPS` says, with room for round-off and other machines.
    bounds = {"slider_y": 1e-11, "slider_vy": 1.5e-7, "slider_ay": 1e-6}
    for channel, most in bounds.items():
        assert np.abs(fine.values(channel) - exact.values(channel)).max() < most
    # Of second order: a quarter of the coarser run's error is the finer one's.
    every = (exact.time.size - 1) // (coarse.time.size - 1)
    right = exact.values("slider_vy")[::every]
    size = [np.abs(v - right).max() for v in (coarse.values("slider_vy"), fine.values("slider_vy")[::every])]
    assert size[0] / size[1] == pytest.approx(4.0, rel=0.05)
    found = assess(slider_errors(fine, exact, scene.period), scene.reliability)
    assert list(found) == list(QUANTITIES)
    for quantity in found.values():
        # 1e-7 m/s of 0.02 m/s are 3e-5 of beta, 1.3e-7 of R = Phi(beta) there.
        assert quantity.reliability == pytest.approx(np.full(5, 0.9986501020), abs=2e-7)
        assert quantity.capped.all()


def test_a_dense_scene_has_a_whole_multiple_of_samples_and_no_forces_at_corners():
    scene = load_scene("150rpm-0.2mm")
    for own, most in ((1000, 10_000), (300, 10_200), (333, 10_323), (30_000, 30_000), (10_000, 10_000)):
        dense = dense_scene(scene.with_values({"output.samples_per_cycle": own}))
        assert dense.data["output"] == {"samples_per_cycle": most, "groups": ["accelerations"]}
    # Joints and energies decide which of Exudyn's integrators runs.
    asked = scene.with_values({"output.groups": ["corners", "energy"]})
    assert dense_scene(asked).data["output"]["groups"] == ["accelerations", "energy"]
    # A long run does not become too large to be stored.
    long = dense_scene(scene.with_values({"drive.cycles": 100.0}))
    assert long.data["output"]["samples_per_cycle"] == 4000
    assert dense_scene(dense_scene(scene)).hash == dense_scene(scene).hash


@pytest.mark.slow
def test_the_difference_of_the_two_models_is_within_its_interval_in_every_case(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    closest = [tight(load_scene(name), MODELS) for name in STUDY.full.cases]
    for result in validate(closest, n_jobs=2, tiers=("standard",)):
        found = result.comparison.reliability
        assert list(found.quantities) == ["displacement", "velocity", "acceleration"], found.missing
        for name, difference in found.quantities.items():
            sizes = f"{result.comparison.name}, {name}: {difference.minimum} within {difference.half_width}"
            assert abs(difference.minimum) <= difference.half_width, sizes


@pytest.mark.slow
def test_a_restitution_one_percent_lower_in_one_model_is_a_difference(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    usual = dense_scene(tight(load_scene("90rpm-0.5mm"), MODELS))
    lower = usual.with_values({"contact.restitution": 0.891})
    ideal = ideal_scenes(usual, "reference")["base"]
    levels = [
        scene.with_values({"solver.reference.tolerance": tolerance})
        for scene in (usual, lower)
        for tolerance in (1e-12, 1e-13)
    ]
    *tables, still = (o.table for o in run_all([Job(of, "reference") for of in (*levels, ideal)], 2))
    sides = (Runs(*tables[:2]), Runs(*tables[2:]))
    found = compare_reliability(sides, (Runs(still, still),) * 2, usual.period, usual.reliability, 2.0)
    # Which of them shows it depends on the limits; that none does would mean that the interval takes in all.
    assert "differ" in {difference.verdict for difference in found.values()}, found
