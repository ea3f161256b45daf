"""Random inputs: their distributions, and what their draws show."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from comparison.studies.paper import random_inputs
from comparison.studies.paper.runs import Config
from comparison.studies.shared.scenes import settable


def test_drawn_values_have_the_middle_and_the_deviation_that_were_asked_for(scene):
    inputs = list(random_inputs.INPUTS.values())
    # Quantiles in equal steps stand for draws: a normal one's deviation is low by 3e-3.
    numbers = norm.ppf((np.arange(200) + 0.5) / 200)
    for axis, one in zip(np.eye(len(inputs)), inputs, strict=True):
        drawn = [random_inputs.values_at(scene, inputs, number * axis)[one.key] for number in [0, *numbers]]
        middle, *values = drawn if one.element is None else [value[one.element] for value in drawn]
        held = settable(scene.data)[one.key]
        assert middle == pytest.approx(held if one.element is None else held[one.element], rel=1e-14)
        assert np.std(values) == pytest.approx(one.deviation, rel=0.02), one.key
        assert one.distribution == "normal" or min(values) > 0.0
        assert one.key != "contact.restitution" or max(values) <= 1.0


def test_a_draw_has_the_drawn_numbers_and_nothing_runs_twice(fake_models):
    few = Config(samples=100, long_samples=50, cycles=2, draws=4)
    frame = random_inputs.measure(few, 1, None)
    assert frame.shape == (4, 6 + len(random_inputs.INPUTS))
    assert (frame[["R of displacement", "R of velocity", "R of acceleration"]] <= 0.99866).to_numpy().all()
    runs = fake_models.read_text().count("\n")
    assert runs == 2 * 4  # each draw, and the ideal mechanism with the same numbers
    assert random_inputs.measure(few._replace(draws=3), 1, None).equals(frame.iloc[:3])
    assert fake_models.read_text().count("\n") == runs


def test_the_decisive_input_and_the_share_above_the_limit_follow_the_draws():
    u = np.random.default_rng(1).normal(size=(2000, len(random_inputs.INPUTS)))
    limits = {"displacement": 2e-4, "velocity": 2e-2, "acceleration": 150.0}
    # A thousandth of the limit around it; one that falls where the second rises; one that both move.
    frame = pd.DataFrame(
        {
            "displacement": 2e-4 * (1 + 1e-3 * u[:, 0]),
            "velocity": 2e-3 * np.exp(-u[:, 1]),
            "acceleration": 75.0 + 3.0 * u[:, 0] + 4.0 * u[:, 1],
        }
    ).assign(**{f"R of {name}": np.linspace(0.9, 0.99, 2000) for name in limits})
    frame[list(random_inputs.INPUTS)] = u
    shown, (first, second, *_) = random_inputs.summary(frame).set_index("quantity"), random_inputs.INPUTS
    assert shown["limit"].to_dict() == limits
    assert shown["decisive"].to_list() == [first, second, second]
    # Of a sum of normal numbers the rank correlation is near the correlation, 0.8.
    assert shown["rank_share"].to_list() == pytest.approx([1.0, 1.0, 0.64], abs=0.04)
    share, low, high = shown.loc["displacement", ["share_above", "share_low", "share_high"]]
    assert low < 0.5 < high
    assert share == np.mean(u[:, 0] > 0)
    # Of 0 in n the upper limit solves (1 - p)^n = 0.025.
    assert shown.loc["acceleration", "share_high"] == pytest.approx(1 - 0.025 ** (1 / 2000), rel=1e-9)
    assert shown.loc["velocity", ["R_median", "R_5"]].to_list() == pytest.approx([0.945, 0.9045], abs=1e-9)
