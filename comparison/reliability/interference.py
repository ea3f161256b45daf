r"""Reliability by stress-strength interference, Eqs. 33-39 of the paper.

Stress is the error, strength the error that is permitted; both are taken as normal and independent. With the
limits :math:`\Delta_\mu > \Delta_\nu` of the permitted error and mean and deviation of the error,

.. math::

    \mu_S = \frac{\Delta_\mu + \Delta_\nu}{2}, \quad \sigma_S = \frac{\Delta_\mu - \Delta_\nu}{6}, \quad
    \beta = \frac{\mu_S - \mu_s}{\sqrt{\sigma_S^2 + \sigma_s^2}}, \quad R = \Phi(\beta).

**The cap.** Without any error :math:`\beta = \mu_S / \sigma_S`, which is 3 for a lower limit of zero,
whatever the upper one: R = Phi(3) = 0.99865 comes from the sixth of the range alone. The reliabilities that
the paper prints end there, which identifies its lower limit as zero. Only the distance to the cap carries
information about a mechanism.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

from comparison.scene.schema import Limits
from comparison.tables.arrays import Array

ROUNDING = 5e-6
"""Half a unit in the fifth digit, to which the paper prints: nearer to the cap nothing can be concluded."""


def reliability_index(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return beta, Eq. 37.

    Parameters
    ----------
    limits
        Of the permitted error.
    mean, deviation
        Of the error, in the unit of the limits, of one shape.
    """
    strength, spread = _strength(limits)
    return np.asarray((strength - mean) / np.hypot(spread, deviation))


def reliability(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return R = Phi(beta), Eq. 39; parameters as of `reliability_index`."""
    return np.asarray(ndtr(reliability_index(limits, mean, deviation)))


def cap(limits: Limits) -> float:
    """Return the reliability of a mechanism without error."""
    return float(reliability(limits, 0.0, 0.0))


def sensitivity(limits: Limits, mean: Array | float, deviation: Array | float) -> tuple[Array, Array]:
    r"""Return the derivatives of beta in the averages of the errors and of their squares.

    With :math:`s^2 = \sigma_S^2 + \sigma_s^2`: :math:`-1/s + \beta \mu_s/s^2` and :math:`-\beta / 2 s^2`.
    Parameters are those of `reliability_index`.
    """
    beta = reliability_index(limits, mean, deviation)
    total = np.hypot(_strength(limits)[1], deviation)
    return np.asarray(-1.0 / total + beta * mean / total**2), np.asarray(-0.5 * beta / total**2)


def implied_limit(published: float, mean: float, deviation: float) -> float:
    r"""Return the upper limit, for a lower one of zero, that gives a published reliability.

    Solves :math:`(\Delta_\mu / 2 - \mu_s)^2 = \beta^2 (\Delta_\mu^2 / 36 + \sigma_s^2)` on the branch where
    both sides have the sign that they had before squaring.

    Parameters
    ----------
    published
        R, 0 < R < 1.
    mean, deviation
        Of the error whose reliability that is.

    Returns
    -------
    limit
        In the unit of the error. Infinite from the cap on, where a positive error cannot be that reliable,
        and nan where no positive limit gives R (of zero error, or a negative mean).

    Notes
    -----
    Close to the cap the limit grows as mean / (3 - beta): a published figure that is rounded there names any
    limit beyond some number. Ask for the figure's whole interval of rounding.
    """
    beta = float(ndtri(published))
    leading = 0.25 - beta**2 / 36.0
    if leading <= 0.0 and mean >= 0.0:
        return float("inf")
    constant = mean**2 - (beta * deviation) ** 2
    roots = np.roots([leading, -mean, constant])
    real = roots[np.isreal(roots)].real
    fitting = [root for root in real if root > 0.0 and (root / 2.0 - mean) * beta >= 0.0]
    return float(min(fitting)) if fitting else float("nan")


def _strength(limits: Limits) -> tuple[float, float]:
    """Return mean and deviation of the permitted error, Eq. 38."""
    return (limits.upper + limits.lower) / 2.0, (limits.upper - limits.lower) / 6.0
