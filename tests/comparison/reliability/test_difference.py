"""Two models' reliabilities: what is known of their difference, and what its interval says."""

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

import sixbar
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import at_own_samples, dense_scene, run_one
from comparison.models import MODELS
from comparison.reliability.assessment import MARGIN, compare_reliability, ideal_scenes
from comparison.scene import load_scene
from comparison.scene.schema import AccelerationLimits, Reliability
from comparison.tables.table import Table, TableError

PERIOD = 0.4
LIMIT = 80.0
SETTINGS = Reliability(acceleration=AccelerationLimits(upper=LIMIT))
K = 2.0


def compared(a, b, ideal, settings=SETTINGS):
    """The difference of the acceleration's reliabilities; of runs or tables."""
    sides = tuple(side if isinstance(side, Runs) else Runs(side, side) for side in (a, b))
    ideals = ideal if isinstance(ideal, tuple) else (Runs(ideal, ideal),) * 2
    return compare_reliability(sides, ideals, PERIOD, settings, K)["acceleration"]


def exact(error):
    """R of a constant error: (40 - e) / (80 / 6)."""
    return float(ndtr((LIMIT / 2 - error) / (LIMIT / 6)))


@pytest.mark.parametrize(
    ("runs", "ideal", "distance"),
    [
        # Two levels that show no order: three times their distance, k = 2.
        ({"finer": 8.01}, {"finer": 0.0}, (8.01, 8.0)),
        # Of two perturbed runs the farther one counts.
        ({"finer": 8.0, "perturbed": 8.2, "other_perturbed": 7.7}, {"finer": 0.0}, (8.0, 7.7)),
        # Of the ideal there is the coarser level, of second order: a quarter of its distance.
        ({"finer": 8.0}, {"coarser": 0.01}, (8.0, 7.99)),
    ],
)
def test_the_numerical_part_is_that_of_the_refined_runs_and_of_the_ideal_mechanism(
    press, runs, ideal, distance
):
    def family(base, others):
        return Runs(press(base), **{kind: press(error) for kind, error in others.items()})

    ideals = family(0.0, ideal), family(0.0, dict.fromkeys(ideal, 0.0))
    result = compared(family(8.0, runs), family(8.0, {"finer": 8.0}), ideals)
    farther, nearer = distance
    known = K * (3 / 4 if "coarser" in ideal else 3) * (exact(nearer) - exact(farther))
    assert result.numerical == pytest.approx(known, rel=1e-9)
    # The smallest and the parts of the cycle have the same uncertainty where all parts are equal.
    assert result.curve_half_width == pytest.approx(np.full(10, result.numerical), rel=1e-9)
    assert result.verdict == ("undecided" if known > MARGIN else "agree")


def test_two_samples_of_one_distribution_differ_as_seldom_as_the_level_says(press):
    """Independent courses in both models, 5 cycles of their own scatter: 95 % hold zero."""
    rng, kept, repeated = np.random.default_rng(4), 0, 100

    def alone(error):
        table = press(error, cycles=5, per_cycle=50)
        return Table(table.frame[["time", "slider_ay"]])

    ideal, settings = alone(0.0), SETTINGS.model_copy(update={"bins": 5})
    for _ in range(repeated):
        drawn = [np.append(0.0, np.repeat(rng.normal(0.0, 2.0, 25), 10)) for _ in range(2)]
        result = compared(*(alone(8.0 + error) for error in drawn), ideal, settings)
        kept += int(np.sum(np.abs(result.curve) <= result.curve_half_width))
    # Each bin has one value a cycle, so four degrees of freedom. Three deviations of the number of intervals,
    # and 0.02 for what the influence, a first derivative, does not see.
    count = 5 * repeated
    assert kept / count == pytest.approx(0.95, abs=0.02 + 3 * np.sqrt(0.95 * 0.05 / count))


def test_smallest_values_in_different_parts_of_the_cycle_have_no_pairs(press):
    angle, rng = np.arange(2001) * 0.36 % 360.0, np.random.default_rng(2)

    def run(low):
        scatter = np.append(0.0, np.repeat(rng.normal(0.0, 1.0, 2), 1000))
        return press(5.0 + 3.0 * ((angle > low) & (angle <= low + 36.0)) + scatter)

    result = compared(run(36.0), run(180.0), press())
    assert (result.a.angle[result.a.worst], result.b.angle[result.b.worst]) == (72.0, 216.0)
    # Half-widths of beta times what R changes with it.
    own = [side.half_width[side.worst] * norm.pdf(side.index[side.worst]) for side in (result.a, result.b)]
    assert result.sampling == pytest.approx(np.hypot(*own), rel=1e-12)


def test_results_over_other_cycles_have_no_difference(press):
    with pytest.raises(TableError, match="different parts of the cycles"):
        compared(press(), press(cycles=3), press(cycles=3))


def test_both_models_have_the_same_ideal_mechanism_and_the_ideal_scene_no_error():
    scene = load_scene("ideal", {"drive.cycles": 0.5})
    known, fine = (run_one(ideal_scenes(scene, model)["base"], model) for model in MODELS)
    # As `STEPS` says, with room for round-off and other machines.
    for channel, most in {"slider_y": 1e-11, "slider_vy": 1.5e-7, "slider_ay": 1e-6}.items():
        assert np.abs(fine.values(channel) - known.values(channel)).max() < most


def test_a_coarser_ideal_run_is_coarser_however_many_samples_the_scene_has():
    """Wedge has 10,000 a cycle, between which no step fits that is twice the base's."""
    scene = load_scene("wedge")
    known, fine, coarse = (
        run_one(ideal_scenes(scene, model)[kind], model).values("slider_vy")
        for model, kind in (("reference", "base"), ("exudyn", "base"), ("exudyn", "coarser"))
    )
    sizes = [np.abs(coarse - known[::2]).max(), np.abs(fine - known)[::2].max()]
    assert sizes[0] / sizes[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(("own", "groups"), [(300, []), (333, ["accelerations", "corners"])])
def test_a_dense_run_at_the_samples_of_the_scene_is_the_run_of_the_scene(own, groups):
    """Its times differ in the last digit, 1e-16 s, in which a gap or a force moves by 3e-10 of its range."""
    scene = load_scene("90rpm-0.5mm", {"output.samples_per_cycle": own, "output.groups": groups})
    run, dense = run_one(scene, "reference"), run_one(dense_scene(scene), "reference")
    thinned = at_own_samples(dense, scene)
    assert thinned.names == run.names
    assert thinned.time.tobytes() == run.time.tobytes()
    assert thinned.extrema == run.extrema
    assert thinned.provenance["scene_hash"] == run.provenance["scene_hash"]
    for name in run.channels:
        values = run.values(name)
        np.testing.assert_allclose(thinned.values(name), values, rtol=0, atol=1e-9 * np.ptp(values))


def test_the_reliability_of_tables_is_that_of_validate():
    exact = {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-8, "drive.cycles": 1}
    scene = load_scene("150rpm-0.2mm", exact)
    (judged,) = sixbar.validate([scene], n_jobs=0, tiers=["standard"])
    dense = dense_scene(scene)
    a, b = (run_one(dense, model) for model in MODELS)
    ideal = run_one(dense.with_values({"joints.slider": "ideal"}), MODELS[0])
    result = sixbar.reliability(a, b, ideal=ideal)
    validated = judged.comparison.reliability.quantities
    assert list(validated) == list(result.comparison.quantities)
    for name, both in validated.items():
        own, difference = result.a[name], result.comparison.quantities[name]
        for part in ("reliability", "low", "high", "mean", "deviation", "within"):
            assert np.array_equal(getattr(own, part), getattr(both.a, part))
        assert (own.minimum, own.worst, own.interval) == (both.a.minimum, both.a.worst, both.a.interval)
        # There Exudyn's run has the ideal motion of Exudyn, whose error is in what is stated.
        assert abs(difference.minimum - both.minimum) <= both.half_width
        assert difference.verdict == "undecided"  # without finer runs
    with pytest.raises(TableError, match=r"^table ideal: .*clearance \(slider\)"):
        sixbar.reliability(a, ideal=b)
