"""Ten cycles: neighbours part after every reversal; a model is to part no farther than they do.

Over ten cycles no run follows another: chatter magnifies every difference. But the difference of an Exudyn
run from the strict reference can be held against the differences of reference runs whose start was moved by
the error that the Exudyn run has made in its first cycle. At each crank angle it should lie within their
spread: near a reversal that is a tenth of a millimetre and says little; where all runs have collapsed onto
the sustained contact it is 1e-8 m or less, and a model that is another one shows.
"""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d

import exudyn_model
import reference_model
from comparison.scene import load_scene

PER_CYCLE = 1000
PERTURBED = 24
BINS = 100
TEN = {"drive.cycles": 10.0, "output.groups": [], "output.samples_per_cycle": PER_CYCLE}
FORMULATIONS = {
    "full": {"solver.exudyn.step": 2e-6},
    "tree": {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-10},
}


def slider_x(model, changes):
    result = model.simulate(load_scene("150rpm-0.2mm", {**TEN, **changes}).data)
    assert result.status == "success", result.remedy
    return result.columns["slider_x"]


@pytest.fixture(scope="module")
def strict():
    return slider_x(reference_model, {"solver.reference.tolerance": 1e-13})


def by_crank_angle(distance):
    """Largest value in each hundredth of a crank cycle, over all cycles."""
    largest = np.zeros(BINS)
    np.maximum.at(largest, np.arange(distance.size) % PER_CYCLE * BINS // PER_CYCLE, distance)
    return largest


def ratio_to_the_perturbed(distance, perturbed):
    """Ratio of a run's distance to the largest of the perturbed runs', a hundredth of a cycle to either side.

    Not below 1e-14 m, some roundings of x.
    """
    spread = maximum_filter1d(by_crank_angle(perturbed.max(axis=0)), 3, mode="wrap")
    return by_crank_angle(distance) / np.maximum(spread, 1e-14)


def perturbed_distances(error, strict):
    """Distances of reference runs whose start is moved by up to ``error`` (m), shape (PERTURBED, n)."""
    rng = np.random.default_rng(0)
    distances = []
    for x, angle in rng.uniform(-error, error, (PERTURBED, 2)):
        moved = {"initial.slider_offset": 5e-5 + x, "initial.slider_angle": angle / 0.07}
        distances.append(np.abs(slider_x(reference_model, moved) - strict))
    return np.array(distances)


@pytest.mark.slow
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_difference_stays_within_the_spread_of_perturbed_runs(strict, formulation):
    distance = np.abs(slider_x(exudyn_model, FORMULATIONS[formulation]) - strict)
    error = distance[: PER_CYCLE + 1].max()
    assert error <= 4e-7  # the error bound for 2e-6 s
    perturbed = perturbed_distances(error, strict)
    ratios = ratio_to_the_perturbed(distance, perturbed)
    # The largest of 24 is itself a random number: perturbed runs left out and compared with the others exceed
    # these by factors of up to 1.7 in single bins, one of 180 by 3.0. So: 3 at most, and 1 at nine of ten
    # crank angles.
    assert ratios.max() <= 3.0, ratios.argmax()
    assert np.count_nonzero(ratios > 1.0) <= BINS // 10
    # At some crank angles the perturbed runs' spread is ten thousand times smaller than at others.
    spread = by_crank_angle(perturbed.max(axis=0))
    assert spread.min() <= 1e-3 * spread.max()


@pytest.mark.slow
def test_another_stiffness_does_not_hide_in_the_spread(strict):
    """1 % stiffer walls: 1.7e-7 m in the first cycle, like an error of the step; but it stays in contact."""
    distance = np.abs(slider_x(reference_model, {"contact.youngs_modulus": 212.1e9}) - strict)
    error = distance[: PER_CYCLE + 1].max()
    assert error <= 4e-7
    # 12 times the perturbed runs' spread where these collapse, and outside it at 16 of 100 crank angles.
    ratios = ratio_to_the_perturbed(distance, perturbed_distances(error, strict))
    assert ratios.max() > 3.0
    assert np.count_nonzero(ratios > 1.0) > BINS // 10
