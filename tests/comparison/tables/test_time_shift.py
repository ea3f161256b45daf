"""The estimated time shift: found within its uncertainty, or said not to be there to be found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparison.tables.times import SAME_GRID, estimate

PERIOD = 0.4
TIME = np.arange(2001) * (PERIOD / 1000)


def slider(time: np.ndarray) -> dict[str, np.ndarray]:
    """Something like the slider at 150 rpm: y driven by the crank, x flying from wall to wall."""
    phase = 2 * np.pi * time / PERIOD
    beats = 12 * time / PERIOD + 1.5 * np.sin(phase)  # flights, quicker and slower
    rate = (12 + 1.5 * 2 * np.pi * np.cos(phase)) / PERIOD
    x = 2e-4 * (2 * np.abs(2 * (beats % 1) - 1) - 1)
    vx = 8e-4 * rate * np.where(beats % 1 < 0.5, -1.0, 1.0)
    y = 0.112 * np.cos(phase) + 0.01 * np.cos(2 * phase)
    vy = -(0.112 * np.sin(phase) + 0.02 * np.sin(2 * phase)) * 2 * np.pi / PERIOD
    return {"slider_x": x - 0.55, "slider_y": y - 0.3 + 0.2 * x, "slider_vx": vx, "slider_vy": vy + 0.2 * vx}


@pytest.mark.parametrize("names", [("slider_x", "slider_y"), ("slider_y", "slider_vy"), None])
@pytest.mark.parametrize("shift", [1e-6, 1e-4, -1e-4, 2.5e-3, 0.05, -0.1])
def test_a_shift_is_found(shift, names):
    a, b = slider(TIME), slider(TIME - shift)
    a, b = ({name: side[name] for name in names or side} for side in (a, b))
    found = estimate(TIME, a, b)
    assert found.seen
    # A kink of x between two samples is up to 0.05 m/s * 0.2 ms off, in y a fifth of that, at some fifty of
    # two thousand samples: against 1.7 m/s of y no more than 1e-7 s.
    assert abs(found.value - shift) < 1e-7
    assert found.uncertainty < 1e-6


@settings(max_examples=30)
@given(st.floats(-0.05, 0.05))
def test_exchanging_the_two_changes_the_sign(shift):
    there, back = (estimate(TIME, *pair) for pair in _both_ways(slider(TIME), slider(TIME - shift)))
    assert there.value == pytest.approx(-back.value, abs=there.uncertainty + back.uncertainty)


def _both_ways(a, b):
    return (a, b), (b, a)


def test_equal_results_have_none_and_an_offset_is_none():
    a = slider(TIME)
    same = estimate(TIME, a, a)
    assert not same.seen
    assert same.uncertainty == pytest.approx(SAME_GRID * PERIOD / 1000, rel=1e-3)
    moved = estimate(TIME, a, a | {"slider_y": a["slider_y"] + 0.01, "slider_x": a["slider_x"] + 1e-3})
    assert abs(moved.value) < 1e-12


def test_the_channel_on_which_they_agree_best_decides():
    a, b = slider(TIME), slider(TIME - 1e-4)
    lost = b | {"slider_x": np.roll(b["slider_x"], 300), "slider_vx": np.roll(b["slider_vx"], 300)}
    assert estimate(TIME, a, lost).value == pytest.approx(1e-4, abs=1e-6)


def test_the_uncertainty_covers_the_error_about_as_often_as_it_says():
    rng = np.random.default_rng(1)

    def smooth(time: np.ndarray) -> np.ndarray:
        return 0.112 * np.cos(2 * np.pi * time / PERIOD) + 0.01 * np.cos(4 * np.pi * time / PERIOD)

    covered = 0
    for _ in range(60):
        noisy = smooth(TIME - 1e-4) + 2e-5 * rng.normal(size=TIME.size)
        found = estimate(TIME, {"slider_y": smooth(TIME)}, {"slider_y": noisy})
        # Noise over the root mean square of the rate and the root of the number: twice 2e-5 / 1.26 / 44.7,
        # known from some ten stretches that count (the others are near a dead centre): a factor of 2.5.
        assert 7e-7 / 2.5 < found.uncertainty < 7e-7 * 2.5
        covered += abs(found.value - 1e-4) <= found.uncertainty
    # 94 % of 60 is 56.6 with a standard deviation of 1.8.
    assert covered >= 51


@pytest.mark.parametrize(
    ("a", "b", "reason"),
    [
        ({"slider_angle": 5 * TIME}, {"slider_angle": 5 * TIME + 0.1}, "too uniform"),
        ({"slider_y": np.sin(50 * TIME)}, {"slider_y": np.cos(333 * TIME**2)}, "are not correlated"),
        ({"slider_x": 0 * TIME}, {"slider_x": np.sin(TIME)}, "no channel of motion"),
        ({"slider_ax": np.sin(9 * TIME)}, {"slider_ax": np.sin(9 * TIME)}, "no channel of motion"),
    ],
)
def test_where_the_signals_cannot_tell_they_say_so(a, b, reason):
    found = estimate(TIME, a, b)
    assert np.isnan(found.value)
    assert not found.seen
    assert reason in found.reason
    assert reason in found.sentence(("a", "b"))


def test_a_few_samples_cannot_tell():
    time = TIME[:20]
    assert "20 common samples" in estimate(time, slider(time), slider(time)).reason


def test_the_sentence_names_the_later_one():
    a, b = slider(TIME), slider(TIME - 1e-4)
    assert (
        estimate(TIME, a, b)
        .sentence(("first", "second"))
        .startswith("second is later than first by 0.0001 s")
    )
    assert (
        estimate(TIME, b, a)
        .sentence(("first", "second"))
        .startswith("first is later than second by 0.0001 s")
    )
    assert estimate(TIME, a, a).sentence(("first", "second")).startswith("No significant time shift")


def test_a_million_samples_are_as_good_and_quick():
    time = np.linspace(0, 10, 1_000_000)
    found = estimate(time, slider(time), slider(time - 1e-4))
    assert found.value == pytest.approx(1e-4, abs=1e-7)
