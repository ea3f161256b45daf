"""The end of the predictable part of two programs, the start of their difference: a longer run keeps both."""

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from comparison.tables.arguments import as_source
from comparison.verdict.channel import Criteria
from comparison.verdict.recorded import compare_files
from comparison.verdict.until import until


def lorenz(rho=28.0):
    return lambda _, y: [10 * (y[1] - y[0]), y[0] * (rho - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2]]


def decay(t, y):
    return [-5.0 * (y[0] - np.sin(t))]


def runs(f, start, end, method, tolerance, *, step=0.01):
    """A run, a finer one, a coarser one and two from moved starts, by an integrator of scipy."""
    time = np.arange(round(end / step) + 1) * step

    def run(tolerance, offset=0.0):
        y = np.array(start, float) + offset
        states = solve_ivp(f, (0.0, time[-1]), y, method, time, rtol=tolerance, atol=tolerance).y
        return pd.DataFrame({"time": time} | {f"y{n}": row for n, row in enumerate(states)})

    frames = {"base": run(tolerance), "finer": run(tolerance / 10), "coarser": run(10 * tolerance)}
    return [*frames.items(), *(("perturbed", run(10 * tolerance, size)) for size in (1e-8, -1e-8))]


def judge(a, b, rows=None, **criteria):
    sides = [[(kind, as_source(frame.iloc[:rows], kind)) for kind, frame in side] for side in (a, b)]
    refinements = ((10.0, 1.0), (10.0, 1.0))
    return compare_files(*sides, labels=("a", "b"), refinements=refinements, criteria=Criteria(**criteria))


PAIRS = {
    "chaotic": (lorenz(), lorenz(), [3.0, 5.0, 8.0], 0.0),
    "another parameter": (lorenz(), lorenz(28.0 + 1e-3), [3.0, 5.0, 8.0], 0.0),
    "wrong start": (decay, decay, [0.5], 1e-2),
}


@pytest.mark.parametrize("kind", PAIRS)
def test_a_run_of_once_and_four_times_the_length_says_the_same(kind):
    f, g, start, error = PAIRS[kind]
    a = runs(f, start, 72.0, "DOP853", 1e-6)
    b = runs(g, np.add(start, error), 72.0, "LSODA", 1e-6)
    short, whole = (judge(a, b, rows) for rows in (1801, None))
    verdict = "agree" if kind == "chaotic" else "differ"
    assert (short.verdict, whole.verdict, short.window) == (verdict, verdict, whole.window)
    assert error or whole.until < 17.0
    for name, channel in short.channels.items():
        later = whole.channels[name]
        assert channel.differs_from == pytest.approx(later.differs_from, abs=0.0, nan_ok=True)
        assert channel.until == min(later.until, short.time[-1])
        assert channel.isolated == later.isolated or error


@pytest.mark.parametrize(
    ("gaps", "end", "isolated"),
    [
        ([], 199, 0),
        ([(0, 50)], 199, 0),  # at rest, say
        ([(0, 200)], 0, 0),
        ([(50, 57)], 199, 1),  # three samples are widened by the windows, of two samples on either side
        ([(50, 58)], 50, 0),
        ([(0, 9), (20, 25), (40, 47), (60, 90), (100, 199)], 60, 2),
    ],
)
def test_a_stretch_longer_than_the_window_ends_it_and_shorter_ones_are_counted(gaps, end, isolated):
    predictable = np.ones(200, dtype=bool)
    for first, last in gaps:
        predictable[first:last] = False
    assert until(np.arange(200.0), predictable, 2.0) == (end, isolated)


def test_a_run_shorter_than_its_window_is_judged_as_a_whole():
    a, b = (runs(decay, [start], 3, "DOP853", 1e-8) for start in (0.0, 0.1))
    result = judge(a, b, period=400.0)
    assert (result.window, result.until, result.verdict) == (4.0, 3.0, "differ")
