r"""First-order second-moment estimates of a response whose inputs are independent standard normal numbers u.

With gradients b of the response g(u) about u = 0,

.. math:: \mu \approx g_0, \quad \sigma^2 \approx \sum b_i^2, \quad \alpha_i^2 = b_i^2 / \sigma^2, \quad
          P(g > l) \approx \Phi(-\beta), \quad \beta = (l - \mu) / \sigma

(A. H.-S. Ang and W. H. Tang, Probability Concepts in Engineering Planning and Design II, 1984, Ch. 6).

Impacts make a response rough, and a difference over a small step shows the roughness. So the gradient is that
of a plane fitted to runs that scatter over a chosen scale: the average slope over that scale. Its standard
error comes from the residuals, whose size may change from place to place: HC3 (J. S. Long and L. H. Ervin,
The American Statistician 54 (2000) 217-224). What the plane leaves is the roughness, together with the
curvature.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest, norm

from comparison.tables.channels import Array, BoolArray

CONFIDENCE = 0.95


class Plane(NamedTuple):
    """A plane fitted to a response."""

    mean: float
    mean_error: float  # at u = 0, and its standard error
    gradient: Array
    errors: Array  # per standard deviation of each input, and their standard errors, shape (d,)
    rest: float  # standard deviation of what the plane leaves

    @property
    def deviation(self) -> float:
        """Standard deviation of the plane over the inputs; the noise of the gradient is taken out."""
        return float(np.sqrt(max(0.0, float(np.sum(self.gradient**2 - self.errors**2)))))

    @property
    def importance(self) -> Array:
        """Share of each input in the plane's variance, shape (d,)."""
        squares = self.gradient**2
        return np.asarray(squares / (np.sum(squares) or 1.0))


def fit_plane(u: Array, response: Array) -> Plane:
    """Fit a plane to responses, shape (n,), over inputs in standard deviations, shape (n, d).

    Raises ValueError if there are fewer runs than twice the unknowns.
    """
    basis = np.column_stack([np.ones(len(u)), u])
    if len(u) < 2 * basis.shape[1]:
        raise ValueError(f"{len(u)} runs are too few for a plane over {u.shape[1]} inputs")
    inverse = np.linalg.inv(basis.T @ basis)
    coefficients = inverse @ (basis.T @ response)
    residuals = response - basis @ coefficients
    leverage = np.einsum("ij,jk,ik->i", basis, inverse, basis)
    weighted = basis * (residuals / (1.0 - leverage))[:, None]
    errors = np.sqrt(np.diag(inverse @ (weighted.T @ weighted) @ inverse))
    rest = float(np.sqrt(np.sum(residuals**2) / (len(u) - basis.shape[1])))
    return Plane(float(coefficients[0]), float(errors[0]), coefficients[1:], errors[1:], rest)


def failure_probability(plane: Plane, limit: float, *, with_rest: bool = False) -> tuple[float, float, float]:
    """Return P(response > limit) after first order, with the interval that the standard errors leave.

    With the rest: what the plane leaves counts as one more independent normal input.
    """
    deviation = float(np.sqrt(plane.deviation**2 + (plane.rest**2 if with_rest else 0.0)))
    if deviation == 0.0:
        return (float(plane.mean > limit),) * 3
    beta = (limit - plane.mean) / deviation
    # Of the mean and of the deviation: d beta = -d mean / sigma - beta d sigma / sigma.
    spread = float(np.sqrt(np.sum((plane.gradient * plane.errors) ** 2))) / deviation
    error = float(np.hypot(plane.mean_error, beta * spread)) / deviation
    half = float(norm.ppf(0.5 * (1.0 + CONFIDENCE))) * error
    return float(norm.sf(beta)), float(norm.sf(beta + half)), float(norm.sf(beta - half))


def counted_probability(failed: BoolArray) -> tuple[float, float, float]:
    """Return the share of failures with its exact interval (C. J. Clopper and E. S. Pearson, 1934)."""
    interval = binomtest(int(failed.sum()), failed.size).proportion_ci(CONFIDENCE)
    return float(failed.mean()), float(interval.low), float(interval.high)


def paired_change(failed: BoolArray, reference: BoolArray) -> tuple[float, float, float]:
    """Return by how much the share of failures differs between runs with the same inputs, with its interval.

    Only runs that fail in one of the two count (Q. McNemar, Psychometrika 12 (1947) 153-157); their share in
    one direction has the exact interval, given how many they are.
    """
    changed = failed != reference
    if not changed.any():
        # None of n runs changed: with that confidence no more than this share does, either way.
        most = 1.0 - (0.5 * (1.0 - CONFIDENCE)) ** (1.0 / failed.size)
        return 0.0, -most, most
    _, low, high = counted_probability(failed[changed])
    share, change = float(changed.mean()), (int(failed.sum()) - int(reference.sum())) / failed.size
    return change, share * (2 * low - 1), share * (2 * high - 1)
