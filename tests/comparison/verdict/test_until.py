"""Until when two programs are predictable and since when they differ: a longer run keeps what was said."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from comparison.accuracy.levels import thresholds
from comparison.tables.arguments import as_source
from comparison.verdict.channel import Criteria
from comparison.verdict.recorded import compare_files
from comparison.verdict.until import differs, pace, until

LABELS = ("a", "b")


def lorenz(rho=28.0):
    return lambda _, y: [10 * (y[1] - y[0]), y[0] * (rho - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2]]


def decay(t, y):
    return [-5.0 * (y[0] - np.sin(t))]


def pendulum(t, y):
    return [y[1], -np.sin(y[0]) - 0.05 * y[1] + 0.3 * np.cos(0.7 * t)]


def runs(f, start, end, method, tolerance, *, step=0.01):
    """Run, finer and coarser one and two from moved starts, of an integrator of scipy."""
    time = np.arange(round(end / step) + 1) * step

    def run(tolerance, moved=0.0):
        y = np.array(start, float) + moved
        states = solve_ivp(f, (0.0, time[-1]), y, method, time, rtol=tolerance, atol=tolerance).y
        return pd.DataFrame({"time": time} | {f"y{n}": row for n, row in enumerate(states)})

    kinds = {"base": run(tolerance), "finer": run(tolerance / 10), "coarser": run(10 * tolerance)}
    return [*kinds.items(), *(("perturbed", run(10 * tolerance, size)) for size in (1e-8, -1e-8))]


def judged(a, b, rows=None, **criteria):
    sides = [[(kind, as_source(frame.iloc[:rows], kind)) for kind, frame in side] for side in (a, b)]
    refinements = ((10.0, 1.0), (10.0, 1.0))
    return compare_files(*sides, labels=LABELS, refinements=refinements, criteria=Criteria(**criteria))


def said(comparison):
    """What is said of every channel."""
    return {name: (c.until, c.isolated, c.differs_from) for name, c in comparison.channels.items()}


PAIRS = {
    "chaotic": lambda rng: (lorenz(), lorenz(), rng.uniform(1, 9, 3), 1.0),
    "chaotic, another parameter": lambda rng: (lorenz(), lorenz(28.0 + 1e-3), rng.uniform(1, 9, 3), 1.0),
    "regular": lambda rng: (pendulum, pendulum, rng.uniform(0.1, 1, 2), 2.0),
    "regular, a wrong start": lambda rng: (decay, decay, rng.uniform(0, 1, 1), 1.0),
}


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("seed", range(2))
def test_a_run_of_once_twice_and_four_times_the_length_says_the_same(kind, seed):
    rng = np.random.default_rng(seed)
    f, g, start, slower = PAIRS[kind](rng)
    length, wrong = 18.0 * slower, 1e-2 * ("wrong" in kind)
    a = runs(f, start, 4 * length, "DOP853", 1e-6)
    b = runs(g, start + wrong, 4 * length, "LSODA", 1e-6)
    count = len(a[0][1]) - 1
    short, twice, whole = (judged(a, b, rows) for rows in (count // 4 + 1, count // 2 + 1, None))
    if kind.startswith("chaotic"):
        assert whole.until < length - 1.0
        assert said(short) == said(twice) == said(whole)
    assert short.verdict == twice.verdict == whole.verdict
    assert whole.verdict == ("agree" if kind in ("chaotic", "regular") else "differ")
    for name, channel in short.channels.items():
        later = whole.channels[name]
        assert channel.differs_from == pytest.approx(later.differs_from, abs=0.0, nan_ok=True)
        assert channel.until == min(later.until, short.time[-1])


def test_a_chaotic_pair_agrees_until_one_time_whatever_its_length():
    a, b = (runs(lorenz(), [1, 1, 1], 80, method, 1e-9) for method in ("DOP853", "LSODA"))
    results = {end: judged(a, b, 100 * end + 1) for end in (15, 25, 40, 80)}
    assert {result.verdict for result in results.values()} == {"agree"}
    assert len({result.window for result in results.values()}) == 1
    ends = [result.until for result in results.values()]
    assert ends[0] == 15.0 < 20.0 < ends[1] == ends[2] == ends[3] < 25.0
    # Nobody said that this is enough; of the shortest all was said.
    assert [result.exit_code for result in results.values()] == [0, 3, 3, 3]
    for demand, code in ((20.0, 0), ("any", 0), (ends[1], 0), (ends[1] + 0.01, 3)):
        assert judged(a, b, 4001, until=demand).exit_code == code


@pytest.mark.parametrize("end", [100, 200, 400])
def test_later_agreement_does_not_dilute_a_difference(end):
    result = judged(runs(decay, [0.0], end, "DOP853", 1e-8), runs(decay, [0.01], end, "LSODA", 1e-8))
    (channel,) = result.channels.values()
    assert (result.verdict, channel.differs_from <= 0.1, channel.ratio > 1.0) == ("differ", True, True)


@pytest.mark.parametrize(("rho", "verdict", "code"), [(28.0, "agree", 3), (28.56, "differ", 1)])
def test_what_is_predictable_for_a_moment_alone_is_not_enough(rho, verdict, code):
    a, b = (runs(lorenz(r), [1, 1, 1], 40, m, 1e-2) for r, m in ((28.0, "DOP853"), (rho, "LSODA")))
    result = judged(a, b)
    assert (result.verdict, result.exit_code) == (verdict, code)
    assert result.until < 1.0
    # Differences from half a percent of the scale on are seen, no smaller ones.
    assert all(channel.resolution > 5e-3 for channel in result.channels.values())


def test_a_difference_that_even_the_largest_uncertainty_does_not_explain_stays():
    """Millimetres for metres by a coarse run: nothing is predictable, until later it is."""
    time = np.arange(4001) * 0.01
    a, b = (
        [
            (kind, pd.DataFrame({"time": time, "y": unit * np.sin(time) + unit * error * (time < 15.0)}))
            for kind, error in (("base", 0.0), ("finer", 0.05))
        ]
        for unit in (1.0, 1e-3)
    )
    short, whole = judged(a, b, 1400), judged(a, b)
    assert short.verdict == whole.verdict == "differ"
    first, later = (result.channels["y"] for result in (short, whole))
    assert first.basis.name == "LARGEST"
    assert first.differs_from == later.differs_from < 14.0


# By themselves


def test_the_window_is_a_share_of_the_time_between_turning_points_of_the_first_samples():
    time = np.arange(8000) * 0.01
    noise = 1e-4 * np.random.default_rng(0).standard_normal(time.size)
    curve = np.where(time < 10.0, np.sin(2 * np.pi * time) + noise, 0.0)
    assert pace(time, [curve, 0.0 * time]) == pytest.approx(0.5, abs=0.02)
    assert pace(time[:1000], [curve[:1000]]) == pace(time, [curve])
    # One that does not turn takes as long as was looked at, or more.
    assert pace(time, [np.exp(-time)]) == time[999]


def predictable(*gaps):
    known = np.ones(200, dtype=bool)
    for first, last in gaps:
        known[first:last] = False
    return known


@pytest.mark.parametrize(
    ("gaps", "end", "isolated"),
    [
        ([], 199, 0),
        ([(0, 50)], 199, 0),  # at rest, say
        ([(0, 200)], 0, 0),
        ([(50, 57)], 199, 1),  # three samples are widened by the windows, of two samples on either side
        ([(50, 58)], 50, 0),
        ([(0, 9), (20, 25), (40, 47), (60, 90), (100, 199)], 60, 2),
        ([(150, 200)], 150, 0),
    ],
)
def test_a_stretch_longer_than_the_window_ends_it_and_shorter_ones_are_counted(gaps, end, isolated):
    assert until(np.arange(200.0), predictable(*gaps), 2.0) == (end, isolated)


@pytest.mark.parametrize(("wrong", "verdict"), [(0.0, "agree"), (0.1, "differ")])
def test_a_run_shorter_than_its_window_is_judged_as_a_whole(wrong, verdict):
    a, b = (runs(decay, [start], 3, "DOP853", 1e-8) for start in (0.0, wrong))
    result = judged(a, b, period=400.0)
    assert (result.window, result.until, result.verdict) == (4.0, 3.0, verdict)


def test_a_channel_differs_from_the_third_sample_on_that_is_outside_if_these_are_one_percent():
    every, limits = np.ones(1000, dtype=bool), thresholds()
    outside = SimpleNamespace(early=np.zeros(1000, dtype=bool), late=np.zeros(1000, dtype=bool))
    outside.early[[5, 80, 90]] = True
    outside.late[[600, 610, 620]] = True
    assert differs(every, every, outside.early, limits).argmax() == 90
    assert not differs(every, every, outside.late, limits).any()
    few = np.arange(1000) < 100  # of a tenth that is predictable
    outside.early[:9] = True
    assert differs(few, every, outside.early, limits).any()
    assert not differs(few & (np.arange(1000) % 4 == 0), every, outside.late, limits).any()
