"""Switching instants on the dense output, with systems whose solution is a formula."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("pinocchio", reason="pin has no wheel for this Python and platform, or is not installed")

from pinocchio_press.integration import StepError, integrate

pytestmark = pytest.mark.slow


class Dip:
    """y = t, and a surface that is passed twice within a thousandth of a step."""

    def __init__(self):
        self.side, self.passed = 1.0, []

    def rates(self, _t, _y):
        return np.ones(1)

    def surfaces(self, _t, y):
        return {("dip", 0): (self.side * ((y[0] - 0.53) ** 2 - 1e-8), self.side * 2.0 * (y[0] - 0.53))}

    def switch(self, _surface, t, _y):
        self.side *= -1.0
        self.passed.append(t)


class Blowup(Dip):
    """y = 1 / (1 - t)."""

    def rates(self, _t, y):
        return y**2

    def surfaces(self, _t, _y):
        return {}


def test_a_dip_between_two_checks_is_found():
    system = Dip()
    pieces = list(integrate(system, np.zeros(1), 1.0, np.full(1, 1e-10), 1.0))
    # The square root of the rounding 1e-16 of the surface, over its slope of 2e-4.
    np.testing.assert_allclose(system.passed, [0.5299, 0.5301], rtol=0, atol=1e-11)
    assert [piece.switched for piece in pieces if piece.switched] == [("dip", 0)] * 2
    assert all(a.end == b.start for a, b in pairwise(pieces))


def test_a_step_below_rounding_is_an_error():
    with pytest.raises(StepError, match=r"at (0\.99|1 s)"):
        list(integrate(Blowup(), np.ones(1), 2.0, np.full(1, 1e-10), 1.0))
