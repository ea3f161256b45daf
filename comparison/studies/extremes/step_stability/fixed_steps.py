"""What a method of fixed steps makes of a linear spring, and of one mass that hits a wall with such a spring.

Generalized-alpha in the form for constrained systems (M. Arnold, O. Bruels, "Convergence of the
generalized-alpha scheme for constrained mechanical systems", Multibody Syst. Dyn. 18, 2007): forces are met
at the end of each step, and the algorithmic acceleration a follows the true one, q'',

    (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) q1'' + alpha_f q0'',
    q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),    v1 = v0 + h ((1 - gamma) a0 + gamma a1).

The trapezoidal rule is the case alpha_m = alpha_f = 0, beta = 1/4, gamma = 1/2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from comparison.tables.arrays import Array

SPECTRAL_RADIUS = 0.9
"""At infinite frequency, as the Exudyn model runs generalized-alpha."""
_SETTLED = 60
"""Steps in flight after which the algorithmic acceleration has died away: 0.73^60 = 6e-9."""


@dataclass(frozen=True)
class Method:
    """The coefficients of a method, see the module."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


def generalized_alpha(radius: float) -> Method:
    """Return the method of a spectral radius at infinite frequency (J. Chung, G. Hulbert, 1993)."""
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    shift = alpha_f - alpha_m
    return Method(alpha_m, alpha_f, 0.25 * (1 + shift) ** 2, 0.5 + shift)


METHODS = {
    "generalized-alpha": generalized_alpha(SPECTRAL_RADIUS),
    "trapezoidal-index2": Method(0.0, 0.0, 0.25, 0.5),
}


def amplification(method: Method, wh: float) -> Array:
    """Return the matrix of one step on q'' = -w^2 q, by its w h, shape (4, 4).

    It multiplies position, velocity times h, algorithmic and true acceleration times h^2.
    """
    m = method
    left = np.array(
        [[1, 0, -m.beta, 0], [0, 1, -m.gamma, 0], [0, 0, 1 - m.alpha_m, m.alpha_f - 1], [wh**2, 0, 0, 1]]
    )
    right = np.array(
        [[1, 1, 0.5 - m.beta, 0], [0, 1, 1 - m.gamma, 0], [0, 0, -m.alpha_m, m.alpha_f], [0] * 4]
    )
    return np.asarray(np.linalg.solve(left, right))


def spectral_radius(method: Method, wh: float) -> float:
    """Return the largest size of an eigenvalue of one step on q'' = -w^2 q, by its w h."""
    return float(np.abs(np.linalg.eigvals(amplification(method, wh))).max())


def rebounds(method: Method, wh: float, phases: Array) -> Array:
    """Return the speeds at which a mass flies off a unilateral linear spring, in units of that before.

    Of all contacts that follow on one another, since a mass may touch again while its algorithmic
    acceleration dies away.

    Parameters
    ----------
    wh
        Step times the frequency sqrt(K/m); the exact contact lasts pi / wh steps and returns 1.
    phases
        How much of a step before the touch the last state in flight is, in (0, 1]; shape (n,).
    """
    m = method
    # In steps and speeds before the touch: h = 1 and v = 1. The wall is at q = 0, the mass comes from below.
    q, v = -np.asarray(phases, dtype=np.float64), np.ones(len(phases))
    a, true = np.zeros_like(q), np.zeros_like(q)
    stiffness, share = wh * wh, m.beta * (1 - m.alpha_f) / (1 - m.alpha_m)
    for _ in range(int(4 * pi / wh) + _SETTLED):
        carried = (m.alpha_f * true - m.alpha_m * a) / (1 - m.alpha_m)
        free = q + v + (0.5 - m.beta) * a + m.beta * carried
        # Implicit, and linear on either side of the touch: a position inside the wall is drawn towards it.
        end = np.where(free > 0, free / (1 + share * stiffness), free)
        true = -stiffness * np.maximum(end, 0.0)
        following = carried + (1 - m.alpha_f) / (1 - m.alpha_m) * true
        v = v + (1 - m.gamma) * a + m.gamma * following
        q, a = end, following
    return np.asarray(-v)
