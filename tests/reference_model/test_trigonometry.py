"""Cosine and sine of the kernels against those of numbers with more digits."""

import math

import numpy as np
import pytest

from reference_model.compiled import kernel
from reference_model.trigonometry import LARGEST, cos_sin


@kernel
def _at_all(angles, cosines, sines) -> None:
    for i in range(angles.size):
        cosines[i], sines[i] = cos_sin(angles[i])


def at_all(angles):
    cosines, sines = np.empty((2, angles.size))
    _at_all(angles, cosines, sines)
    return cosines, sines


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="numpy has no longer floats here")
@pytest.mark.parametrize("size", [1e-9, 0.01, 1.0, 8.0, 1e3, LARGEST])
def test_a_unit_in_the_last_place(size) -> None:
    """One of 1, 2.2e-16: of two million random angles of each size the worst is 0.65 of that."""
    angles = np.random.default_rng(3).uniform(-size, size, 20_000)
    exact = angles.astype(np.longdouble)
    cosines, sines = at_all(angles)
    assert np.abs(cosines - np.cos(exact)).max() < np.finfo(float).eps
    assert np.abs(sines - np.sin(exact)).max() < np.finfo(float).eps


def test_at_quarter_turns_and_halfway_between_them() -> None:
    """There the reduction changes its multiple of pi/2: either has to give the right quadrant."""
    centres = np.arange(-40, 41) * (math.pi / 4.0)
    angles = np.concatenate([centres, np.nextafter(centres, np.inf), np.nextafter(centres, -np.inf)])
    cosines, sines = at_all(angles)
    np.testing.assert_allclose(cosines, np.cos(angles), rtol=0.0, atol=2.0 * np.finfo(float).eps)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=0.0, atol=2.0 * np.finfo(float).eps)


def test_small_angles_keep_all_their_digits() -> None:
    """The slider's angle times half its length is what a corner's gap of some nanometres is about."""
    angles = np.geomspace(1e-300, 0.7, 5000)
    _, sines = at_all(angles)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=2.0 * np.finfo(float).eps)


def test_what_is_not_finite_has_neither() -> None:
    assert np.isnan(at_all(np.array([np.inf, -np.inf, np.nan]))).all()
