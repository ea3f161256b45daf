"""Errors of a slider, their averages over parts of the cycle, and the difference of two models."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter
from scipy.special import ndtr
from scipy.stats import norm

import sixbar
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import run_one
from comparison.reliability.assessment import MARGIN, assess, compare_reliability, ideal_scenes
from comparison.reliability.errors import MANY, half_width, part_edges, slider_errors, standard_error
from comparison.scene import load_scene
from comparison.scene.schema import AccelerationLimits, Reliability
from comparison.tables.table import Table, TableError

PERIOD = 0.4
LIMIT = 80.0
SETTINGS = Reliability(acceleration=AccelerationLimits(upper=LIMIT))
K = 2.0
REPETITIONS = 1000
SAMPLES = 100
# Of 1000 intervals with a probability of 0.95 each, the share that covers is within 0.021 of it in 99.7 %.
CHANCE = 3 * np.sqrt(0.95 * 0.05 / REPETITIONS)


def press(error=0.0, cycles=2, per_cycle=1000):
    """Return a slider that follows a sine of the crank, with errors of the acceleration alone.

    With errors there is no velocity: the acceleration would not be its rate.
    """
    time = np.arange(round(cycles * per_cycle) + 1) * (PERIOD / per_cycle)
    phase, w = 2 * np.pi * time / PERIOD, 2 * np.pi / PERIOD
    columns = {"time": time, "slider_y": 0.1 * np.cos(phase)}
    if not np.any(error):
        columns["slider_vy"] = -0.1 * w * np.sin(phase)
    return Table(pd.DataFrame(columns | {"slider_ay": -0.1 * w**2 * np.cos(phase) + error}))


def test_parts_follow_each_other_as_far_as_the_run_goes():
    # A cycle, one part of the second, and less than a part, which is left out.
    assert part_edges(0.4 * 1.37, PERIOD, 4) == pytest.approx(0.1 * np.arange(6), rel=1e-14)
    # In a run shorter than a cycle it is the last part.
    assert part_edges(0.4 * 0.37, PERIOD, 4) == pytest.approx([0.0, 0.1, 0.148], rel=1e-14)


def correlated_noise(shape, phi, rng):
    """Normal noise of unit variance whose neighbours along the last axis are correlated by phi."""
    steps = rng.normal(size=shape)
    steps[..., 0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], steps, axis=-1) * np.sqrt(1 - phi**2)


SINE = np.sin(2 * np.pi * np.arange(SAMPLES) / SAMPLES)
NOISE = {
    "correlated": lambda shape, rng: correlated_noise(shape, 0.9, rng),  # over a tenth of the bin
    # A sine twice as large as the correlated noise around it
    "locked": lambda shape, rng: 1.5 * SINE + 0.5 * correlated_noise(shape, 0.8, rng),
    # Every cycle is off by a number of its own: all of a bin's samples together are worth one.
    "offset": lambda shape, rng: SINE + 0.5 * rng.normal(size=shape[:2])[..., None] * np.ones(SAMPLES),
}


@pytest.mark.parametrize("kind", NOISE)
@pytest.mark.parametrize("cycles", [5, MANY])
def test_the_interval_of_an_average_covers_it_also_where_the_cycles_share_their_course(kind, cycles):
    errors = NOISE[kind]((REPETITIONS, cycles, SAMPLES), np.random.default_rng(cycles))
    widths, offsets = half_width(standard_error(errors)), np.abs(errors.mean((-2, -1)))
    # Estimated correlations cost 2 %.
    assert np.mean(offsets <= widths) >= 0.95 - CHANCE - 0.02
    # Nor is it too wide: 1.96 deviations of the averages, more for few degrees of freedom.
    assert np.mean(widths) < (1.4 if cycles >= MANY else 2.2) * 1.96 * offsets.std() / np.sqrt(1 - 2 / np.pi)
    assert standard_error(np.tile(2 * SINE, (3, 1))).error == 0.0  # errors that repeat leave nothing open


def test_of_a_part_of_a_cycle_the_first_bin_ends_with_the_run_and_the_sign_counts_if_it_is_asked_for():
    settings = Reliability(acceleration=AccelerationLimits(upper=LIMIT), errors="signed")
    result = assess(slider_errors(press(-8.0, 0.06), press(0.0, 0.06), PERIOD), settings)["acceleration"]
    assert (result.angle.tolist(), result.cycles.tolist()) == ([21.6], [1.0])
    assert (*result.mean, *result.reliability) == pytest.approx((-8.0, reliability(-8.0)), rel=1e-12)
    assert result.within.tolist() == [0.0]  # it is below the lower limit
    assert not result.capped.any()


def difference(a, b, ideal, settings=SETTINGS):
    """The difference of the acceleration's reliabilities; of runs or tables."""
    sides = tuple(side if isinstance(side, Runs) else Runs(side, side) for side in (a, b))
    ideals = ideal if isinstance(ideal, tuple) else (Runs(ideal, ideal),) * 2
    return compare_reliability(sides, ideals, PERIOD, settings, K)["acceleration"]


def reliability(error):
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
def test_the_numerical_part_is_that_of_the_refined_runs_and_of_the_ideal_mechanism(runs, ideal, distance):
    def family(base, others):
        return Runs(press(base), **{kind: press(error) for kind, error in others.items()})

    ideals = family(0.0, ideal), family(0.0, dict.fromkeys(ideal, 0.0))
    result = difference(family(8.0, runs), family(8.0, {"finer": 8.0}), ideals)
    farther, nearer = distance
    width = K * (3 / 4 if "coarser" in ideal else 3) * (reliability(nearer) - reliability(farther))
    assert result.numerical == pytest.approx(width, rel=1e-9)
    # The smallest and the parts of the cycle have the same uncertainty where all parts are equal.
    assert result.curve_half_width == pytest.approx(np.full(10, result.numerical), rel=1e-9)
    assert result.verdict == ("undecided" if width > MARGIN else "agree")


def test_smallest_values_in_different_parts_of_the_cycle_have_no_pairs():
    angle, rng = np.arange(2001) * 0.36 % 360.0, np.random.default_rng(2)

    def run(low):
        scatter = np.append(0.0, np.repeat(rng.normal(0.0, 1.0, 2), 1000))
        return press(5.0 + 3.0 * ((angle > low) & (angle <= low + 36.0)) + scatter)

    result = difference(run(36.0), run(180.0), press())
    assert (result.a.angle[result.a.worst], result.b.angle[result.b.worst]) == (72.0, 216.0)
    # Half-widths of beta times the slope of R in it.
    widths = [side.half_width[side.worst] * norm.pdf(side.index[side.worst]) for side in (result.a, result.b)]
    assert result.sampling == pytest.approx(np.hypot(*widths), rel=1e-12)
    with pytest.raises(TableError, match="different parts of the cycles"):
        difference(press(), press(cycles=3), press(cycles=3))


def test_a_run_with_clearance_is_no_ideal_one():
    run = run_one(load_scene("150rpm-0.2mm", {"drive.cycles": 0.1}), "reference")
    with pytest.raises(TableError, match=r"^table ideal: .*clearance \(slider\)"):
        sixbar.reliability(run, ideal=run)


def test_a_coarser_ideal_run_is_coarser_however_many_samples_the_scene_has():
    """Between the 10,000 samples of wedge's cycle no step fits that is twice the base's."""
    scene = load_scene("wedge")
    reference, fine, coarse = (
        run_one(ideal_scenes(scene, model)[kind], model).values("slider_vy")
        for model, kind in (("reference", "base"), ("exudyn", "base"), ("exudyn", "coarser"))
    )
    sizes = [np.abs(coarse - reference[::2]).max(), np.abs(fine - reference)[::2].max()]
    assert sizes[0] / sizes[1] == pytest.approx(4.0, rel=0.05)
