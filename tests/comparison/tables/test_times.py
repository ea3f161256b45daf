"""What times tell: missing rows, whatever steps a program takes; a shift within its uncertainty.

Random signals are in `tests/judge`, by a second way.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.tables.align import SAME_GRID, Hole, Shift, estimate, holes, isolated
from comparison.words.verdicts import shift as shift_sentence

EVEN = np.arange(201) * 0.01
PERIOD = 0.4
TIME = np.arange(2001) * (PERIOD / 1000)


@given(first=st.integers(1, 198), count=st.integers(1, 150))
def test_rows_taken_out_of_equidistant_times_are_counted(first, count):
    kept = np.delete(EVEN, np.arange(first, min(first + count, 200)))
    (hole,) = holes(kept)
    assert hole == Hole(EVEN[first - 1], kept[first], 201 - kept.size)


VARYING = np.cumsum(np.random.default_rng(0).uniform(0.5e-3, 2e-3, 1000))


@pytest.mark.parametrize(
    ("time", "result"),
    [
        (np.delete(np.round(np.arange(100) / 30, 4), [40, 41]), [Hole(1.3, 1.4, 2)]),  # few digits
        (np.delete(np.arange(11.0), [4, 5, 6, 7]), [Hole(3.0, 8.0, 4)]),  # few rows
        (np.delete(VARYING, np.arange(300, 800)), [Hole(VARYING[299], VARYING[800], 0)]),
        # Steps of a solver are no holes.
        (EVEN, []),
        (VARYING, []),
        (np.round(np.arange(100) / 30, 4), []),  # few digits: steps of 0.0333 and 0.0334
        (np.round(np.arange(100) * 0.015, 2), []),  # steps of 0.01 and 0.02 in turn
        (np.geomspace(1e-6, 1.0, 50), []),  # a solver that gets faster
        (np.sort(np.concatenate([EVEN, [0.1234, 1.2345]])), []),  # rows at events
        (np.concatenate([k + np.append(np.arange(20) * 1e-5, 0.1) for k in range(10)]), []),  # bursts
        (np.array([0.0, 1.0, 100.0]), []),
    ],
)
def test_what_is_a_hole(time, result):
    assert holes(time) == result


def test_a_sample_that_stands_out_is_told_by_its_distance():
    values = 3.0 * EVEN
    values[70] += 1.0
    distance = isolated(EVEN, values, 0.6)
    assert np.flatnonzero(distance).tolist() == [70]
    assert distance[70] == pytest.approx(1.0, rel=1e-12)  # sums of a few numbers around 1


def slider(time):
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
@pytest.mark.parametrize("shift", [1e-6, -1e-4, 0.05, -0.1])
def test_a_shift_is_measured(shift, names):
    a, b = ({name: side[name] for name in names or side} for side in (slider(TIME), slider(TIME - shift)))
    estimated, back = estimate(TIME, a, b), estimate(TIME, b, a)
    assert estimated.value == pytest.approx(-back.value, abs=estimated.uncertainty + back.uncertainty)
    assert estimated.seen
    # A kink of x between two samples is up to 0.05 m/s * 0.2 ms off, in y a fifth of that, at some fifty of
    # two thousand samples: against 1.7 m/s of y no more than 1e-7 s.
    assert abs(estimated.value - shift) < 1e-7
    assert estimated.uncertainty < 1e-6
    late, early = ("b", "a") if shift > 0 else ("a", "b")
    said = shift_sentence(estimated, ("a", "b"))
    assert said.startswith(f"{late} is later than {early} by {abs(shift):.3g} s")


def test_equal_results_have_none_and_an_offset_is_none():
    a = slider(TIME)
    same = estimate(TIME, a, a)
    assert not same.seen
    assert same.uncertainty == pytest.approx(SAME_GRID * PERIOD / 1000, rel=1e-12)
    assert shift_sentence(same, ("a", "b")).startswith("No significant time shift")
    picosecond = shift_sentence(Shift(1.11e-12, 9.2e-13), ("a", "b"))  # 1.2 of its uncertainties
    assert picosecond.startswith("No significant time shift")
    moved = estimate(TIME, a, a | {"slider_y": a["slider_y"] + 0.01, "slider_x": a["slider_x"] + 1e-3})
    assert abs(moved.value) < 1e-12


HALF, NOISE = np.sin(np.linspace(0, 2, 60)), 0.2 * np.random.default_rng(3).normal(size=60)


@pytest.mark.parametrize(
    ("a", "b", "reason"),
    [
        ({"slider_y": HALF}, {"slider_y": HALF + NOISE}, "the difference too irregular"),
        ({"slider_angle": 5 * TIME}, {"slider_angle": 5 * TIME + 0.1}, "too uniform"),
        ({"slider_y": np.sin(50 * TIME)}, {"slider_y": np.cos(333 * TIME**2)}, "are not correlated"),
        ({"slider_x": 0 * TIME}, {"slider_x": np.sin(TIME)}, "no channel of motion"),
        ({"slider_y": TIME[:20]}, {"slider_y": TIME[:20]}, "20 common samples"),
    ],
)
def test_where_the_signals_cannot_tell_they_say_so(a, b, reason):
    shift = estimate(TIME[: next(iter(a.values())).size], a, b)
    assert np.isnan(shift.value)
    assert not shift.seen
    assert reason in shift_sentence(shift, ("a", "b"))
