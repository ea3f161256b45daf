"""Two tables on one grid: angles count alike; what a hole in times is (tests/judge has interpolation)."""

import numpy as np
import pandas as pd
import pytest

from comparison.tables.align import Hole, align, holes
from comparison.tables.table import Table

NAMES = ["slider_x", "slider_vx", "slider_angle"]


def wave(time, **columns):
    """x = sin t with its derivative; an angle without its rate."""
    frame = {"time": time, "slider_x": np.sin(time), "slider_vx": np.cos(time), "slider_angle": np.cos(time)}
    return Table(pd.DataFrame(frame | columns))


@pytest.mark.parametrize("every", [1, 11])
def test_the_finer_table_tells_how_often_an_angle_has_turned_and_the_first_one_how_it_is_counted(every):
    time = np.arange(0, 1.54, 0.01)
    angle = 7.3 * 2 * np.pi * time  # of the coarsest table eight tenths of a turn from row to row
    wrapped = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    fine = wave(time, slider_angle=wrapped)
    for counted in (wrapped, angle, angle + 6 * np.pi):
        coarse = wave(time[::every], slider_angle=counted[::every])
        for pair in ((fine, coarse), (coarse, fine)):
            aligned = align(*pair, NAMES)
            # 70 rad round at 1e-14, and a line between two samples is as exact.
            a, b = aligned.a["slider_angle"], aligned.b["slider_angle"]
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
            np.testing.assert_allclose(np.diff(a), np.diff(angle[::every]), rtol=0, atol=1e-12)
            assert a[0] == pytest.approx(pair[0].values("slider_angle")[0], abs=1e-12)


EVEN = np.arange(201) * 0.01
VARYING = np.cumsum(np.random.default_rng(0).uniform(0.5e-3, 2e-3, 1000))


@pytest.mark.parametrize(
    ("time", "result"),
    [
        (np.delete(np.round(np.arange(100) / 30, 4), [40, 41]), [Hole(1.3, 1.4, 2)]),  # few digits
        (np.delete(EVEN, np.arange(1, 151)), [Hole(0.0, EVEN[151], 150)]),
        (np.delete(VARYING, np.arange(300, 800)), [Hole(VARYING[299], VARYING[800], 0)]),
        # Steps of a solver are no holes.
        (VARYING, []),
        (np.geomspace(1e-6, 1.0, 50), []),  # a solver that gets faster
        (np.sort(np.concatenate([EVEN, [0.1234, 1.2345]])), []),  # rows at events
        (np.concatenate([k + np.append(np.arange(20) * 1e-5, 0.1) for k in range(10)]), []),  # bursts
    ],
)
def test_what_is_a_hole(time, result):
    assert holes(time) == result
