"""The ideal mechanism: published facts, and an independent Newton solution of the constraint rows."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_model.linkage import ideal_motion
from reference_model.parameters import read_parameters


@pytest.fixture
def c(scene):
    return read_parameters(scene()).mechanism


def rows(q, theta1, m):
    """Rows 1-13 of Eq. 16 and the two of an ideal slider, written out once more; q = (x, y, theta) x 5."""
    bodies = [m[name] for name in ("crank", "rod2", "rocker", "rod4")]
    p, a = q.reshape(5, 3)[:, :2], q[2::3]
    u = np.column_stack([np.cos(a), np.sin(a)])
    to_start = [body["centroid"] * of for body, of in zip(bodies, u, strict=False)]
    to_tip = [(body["length"] - body["centroid"]) * of for body, of in zip(bodies, u, strict=False)]
    return np.concatenate(
        [
            p[0] - to_start[0],
            p[1] - to_start[1] - p[0] - to_tip[0],
            p[2] - to_start[2] - np.array(m["rocker_pivot"]),
            p[2] - p[1] - to_tip[1],
            p[3] - to_start[3] - p[2] - to_tip[2],
            p[4] - p[3] - to_tip[3],
            [a[0] - theta1, p[4, 0] - m["guide_x"] - m["reference_offset"], a[4]],
        ]
    )


def test_slider_height_equals_newton_solution_all_round(c, scene):
    # A rough guess read off the drawing: rod 2 up to the left, rocker to the left, rod 4 hanging down.
    q = [-0.01, 0.02, 1.9, -0.07, 0.18, 2.0, -0.12, 0.3, 2.9, -0.52, 0.3, -1.8, -0.55, 0.19, 0.0]
    m, angles, newton = scene()["mechanism"], c.theta0 + np.linspace(0.0, 2.0 * math.pi, 181), []
    for angle in angles:
        for _ in range(8):  # a Jacobian by central differences is exact to 1e-10
            slopes = [(rows(q + e, angle, m) - rows(q - e, angle, m)) / 2e-6 for e in 1e-6 * np.eye(15)]
            q = q - np.linalg.solve(np.transpose(slopes), rows(np.asarray(q), angle, m))
        newton.append(q[13])
    closed = ideal_motion(c, (angles - c.theta0) / c.omega)[4, 1]
    # Residuals of 1e-15 m; the conditioning of the linkage is of order 10.
    np.testing.assert_allclose(closed, newton, rtol=0, atol=2e-14)


def test_published_stroke_top_dead_centre_and_speeds(c):
    y, vy = ideal_motion(c, np.linspace(0.0, 0.4, 40001))[4, [1, 4]]
    # The published figures with the precision of their last digit and of the identified geometry.
    assert np.ptp(y) == pytest.approx(0.2239, abs=1e-4)
    assert vy.min() == pytest.approx(-1.598, abs=1e-3)
    assert vy.max() == pytest.approx(2.002, abs=1e-3)
    top = brentq(lambda t: ideal_motion(c, np.array([t]))[4, 4, 0], -1e-3, 1e-3, xtol=1e-12)
    assert math.degrees(c.theta0 + c.omega * top) == pytest.approx(111.355, abs=5e-3)
