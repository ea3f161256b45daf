"""How long a step of the explicit method DOP853 may be for a linear equation y' = l y."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import DOP853

LONGEST = 12.0
"""Above it |R| > 1 in every direction; far less than the twelve stages could reach at best."""
_ROUNDING = 1e-12


def stability_polynomial() -> Polynomial:
    """Return R(z) = 1 + sum of b A^k 1 z^(k+1), k = 0..11: what one step with l h = z multiplies y by."""
    powers, terms = np.ones(len(DOP853.B)), [1.0]
    for _ in DOP853.B:
        terms.append(float(DOP853.B @ powers))
        powers = DOP853.A @ powers
    return Polynomial(terms)


def limit(direction: complex = -1.0) -> float:
    """Return |l h| up to which |R| <= 1 along the ray of a root l of any size; 0 where it grows at once."""
    along = stability_polynomial()
    unit = direction / abs(direction)
    size = np.linspace(0.0, LONGEST, 120_001)
    unstable = np.flatnonzero(np.abs(along(size * unit)) > 1.0 + _ROUNDING)
    if unstable.size == 0:
        raise ValueError(f"stable up to {LONGEST} along {unit}")
    return float(size[unstable[0] - 1])


def baumgarte_roots(alpha: float, beta: float) -> tuple[complex, complex]:
    """Return the roots (1/s) of the constraints' error, Phi'' + 2 alpha Phi' + beta^2 Phi = 0."""
    spread = np.emath.sqrt(complex(alpha**2 - beta**2))
    return complex(-alpha + spread), complex(-alpha - spread)


def longest_step(alpha: float, beta: float) -> float:
    """Return the longest stable step, s, of the error equation; infinite without a root beside 0."""
    return min((limit(root) / abs(root) for root in baumgarte_roots(alpha, beta) if root), default=np.inf)
