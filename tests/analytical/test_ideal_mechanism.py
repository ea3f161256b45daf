"""The ideal mechanism: published facts, and an independent Newton solution of the constraint rows."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_model.linkage import Mechanism, ideal_motion
from reference_model.parameters import read_parameters

PAPER = tomllib.loads(
    (Path(__file__).parents[2] / "comparison" / "scene" / "shipped" / "paper.toml").read_text()
)
PAPER["initial"]["slider_offset"] = 5e-5
PAPER["solver"] = {
    "reference": {"method": "dop853", "tolerance": 1e-9, "baumgarte_alpha": 10.0, "baumgarte_beta": 10.0}
}


@pytest.fixture(scope="module")
def c() -> Mechanism:
    return read_parameters(PAPER).mechanism


def ideal_slider(c: Mechanism, time: np.ndarray) -> np.ndarray:
    """Return y, vy, ay of the slider, shape (3, n)."""
    return ideal_motion(c, time)[4, [1, 4, 7]]


def rows(q: np.ndarray, theta1: float) -> np.ndarray:
    """Rows 1-13 of Eq. 16 and the two of an ideal slider, written out once more; q = (x, y, theta) x 5."""
    m = PAPER["mechanism"]
    L = {i: m[n]["length"] for i, n in enumerate(("crank", "rod2", "rocker", "rod4"), start=1)}
    s = {i: m[n]["centroid"] for i, n in enumerate(("crank", "rod2", "rocker", "rod4"), start=1)}
    x, y, a = q[0::3], q[1::3], q[2::3]
    u = [np.array([math.cos(angle), math.sin(angle)]) for angle in a]
    p = [np.array([x[i], y[i]]) for i in range(5)]
    return np.concatenate(
        [
            p[0] - s[1] * u[0],
            p[1] - s[2] * u[1] - p[0] - (L[1] - s[1]) * u[0],
            p[2] - s[3] * u[2] - np.array(m["rocker_pivot"]),
            p[2] - p[1] - (L[2] - s[2]) * u[1],
            p[3] - s[4] * u[3] - p[2] - (L[3] - s[3]) * u[2],
            p[4] - p[3] - (L[4] - s[4]) * u[3],
            [a[0] - theta1, x[4] - m["guide_x"] - m["reference_offset"], a[4]],
        ]
    )


def solve(theta1: float, q: np.ndarray) -> np.ndarray:
    """Newton's method with a central-difference Jacobian (exact to 1e-10)."""
    for _ in range(20):
        jacobian = np.empty((15, 15))
        for j in range(15):
            step = np.zeros(15)
            step[j] = 1e-6
            jacobian[:, j] = (rows(q + step, theta1) - rows(q - step, theta1)) / 2e-6
        q = q - np.linalg.solve(jacobian, rows(q, theta1))
        if np.abs(rows(q, theta1)).max() < 1e-15:
            break
    return q


def start() -> np.ndarray:
    """A rough guess read off the drawing: rod 2 up to the left, rocker to the left, rod 4 hanging down."""
    return np.array([-0.01, 0.02, 1.9, -0.07, 0.18, 2.0, -0.12, 0.3, 2.9, -0.52, 0.3, -1.8, -0.55, 0.19, 0.0])


def test_slider_height_equals_newton_solution_all_round(c: Mechanism) -> None:
    q = start()
    angles = c.theta0 + np.linspace(0.0, 2.0 * math.pi, 181)
    newton = []
    for angle in angles:
        q = solve(angle, q)
        newton.append(q[13])
    closed = ideal_slider(c, (angles - c.theta0) / c.omega)[0]
    # Newton stops at residuals of 1e-15 m; the conditioning of the linkage is of order 10.
    np.testing.assert_allclose(closed, newton, rtol=0, atol=2e-14)


def test_published_stroke_top_dead_centre_and_speeds(c: Mechanism) -> None:
    time = np.linspace(0.0, 0.4, 40001)
    y, vy, _ = ideal_slider(c, time)
    # The published figures with the precision of their last digit and of the identified geometry.
    assert y.max() - y.min() == pytest.approx(0.2239, abs=1e-4)
    assert vy.min() == pytest.approx(-1.598, abs=1e-3)
    assert vy.max() == pytest.approx(2.002, abs=1e-3)
    top = brentq(lambda t: ideal_slider(c, np.array([t]))[1, 0], -1e-3, 1e-3, xtol=1e-12)
    assert math.degrees(c.theta0 + c.omega * top) == pytest.approx(111.355, abs=5e-3)


@pytest.mark.parametrize("which", ["slider", "rocker"])
def test_rates_are_the_derivatives(c: Mechanism, which: str) -> None:
    """Velocity and acceleration against sixth-order central differences of position and velocity."""
    time, h = np.linspace(0.01, 0.39, 50), 1e-4
    offsets, weights = np.array([-3, -2, -1, 1, 2, 3]), np.array([-1, 9, -45, 45, -9, 1]) / 60.0

    def motion(t: np.ndarray) -> np.ndarray:
        if which == "slider":
            return ideal_slider(c, t)
        return ideal_motion(c, t)[2, [1, 4, 7]]

    differenced = sum(w * motion(time + o * h) for o, w in zip(offsets, weights, strict=True)) / h
    # h^6 times the seventh derivative (omega^7 = 2e8 times 0.2 m) and round-off 1e-16 / 1e-4: below 1e-9.
    np.testing.assert_allclose(differenced[0], motion(time)[1], atol=1e-9)
    np.testing.assert_allclose(differenced[1], motion(time)[2], atol=1e-8)
