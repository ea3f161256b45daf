r"""One model's reliability by quantity and crank angle: stress-strength interference, the paper's Eqs. 33-39.

Stress is the error, strength the error that is permitted; both are taken as normal and independent. With the
limits :math:`\Delta_\mu > \Delta_\nu` of the permitted error and mean and deviation of the error,

.. math::

    \mu_S = \frac{\Delta_\mu + \Delta_\nu}{2}, \quad \sigma_S = \frac{\Delta_\mu - \Delta_\nu}{6}, \quad
    \beta = \frac{\mu_S - \mu_s}{\sqrt{\sigma_S^2 + \sigma_s^2}}, \quad R = \Phi(\beta).

**The cap.** Without any error :math:`\beta = \mu_S / \sigma_S`, which is 3 for a lower limit of zero,
whatever the upper one: R = Phi(3) = 0.99865 comes from the sixth of the range alone. The reliabilities that
the paper prints end there, which identifies its lower limit as zero. Only the distance to the cap carries
information about a mechanism.

Below, limits are those of the permitted error, and mean and deviation those of the error, in the unit of the
limits, numbers or arrays of one shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from comparison.reliability.averages import (
    BLOCKS,
    half_width,
    halved,
    integrals,
    mismatch,
    part_edges,
    proportion,
    quadrature_error,
    standard_error,
)
from comparison.reliability.errors import PRIMITIVES, QUANTITIES, SliderErrors
from comparison.scene.schema import Limits
from comparison.scene.schema import Reliability as Settings
from comparison.tables.arrays import Array, BoolArray

ROUNDING = 5e-6
"""Half a unit in the fifth digit, to which the paper prints: nearer to the cap nothing can be concluded."""
ROUND_OFF = 1e-13
"""Of a reliability: a few hundred additions."""
PHASES = 100
"""Crank angles in a part of the cycle at which cycles are compared, whatever the samples."""


def reliability_index(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return beta, Eq. 37."""
    strength, spread = _strength(limits)
    return np.asarray((strength - mean) / np.hypot(spread, deviation))


def reliability(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return R = Phi(beta), Eq. 39."""
    return np.asarray(ndtr(reliability_index(limits, mean, deviation)))


def cap(limits: Limits) -> float:
    """Return the reliability of a mechanism without error."""
    return float(reliability(limits, 0.0, 0.0))


def sensitivity(limits: Limits, mean: Array | float, deviation: Array | float) -> tuple[Array, Array]:
    r"""Return the derivatives of beta in the averages of the errors and of their squares.

    With :math:`s^2 = \sigma_S^2 + \sigma_s^2`: :math:`-1/s + \beta \mu_s/s^2` and :math:`-\beta / 2 s^2`.
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
        R, 0 < R < 1, of an error with this mean and deviation.
    mean, deviation
        Of the error.

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


@dataclass(frozen=True)
class Open:
    """What is left open of beta in one part of N cycles: how it changes with each and with the samples."""

    cycles: Array
    """Shape (N, `PHASES`), for `standard_error`."""
    halves: Array
    """Shape (N, 2 `BLOCKS`), for `quadrature_error`, as what follows."""
    excess: Array
    """Shape (N, `BLOCKS`)."""

    def less(self, other: Open, factor: float, factor_of_other: float) -> Open:
        """Return what is left open of a difference; the factors are what both are multiplied by."""
        return Open(
            factor * self.cycles - factor_of_other * other.cycles,
            factor * self.halves - factor_of_other * other.halves,
            factor * self.excess - factor_of_other * other.excess,
        )

    @property
    def sampling(self) -> float:
        """Half-width (95 %) that other cycles leave open."""
        return float(half_width(standard_error(self.cycles)))

    @property
    def quadrature(self) -> float:
        """Half-width that the samples leave open."""
        return quadrature_error(self.halves, self.excess)


@dataclass(frozen=True)
class Assessment:
    """The reliability of one quantity in ``k`` bins; arrays of shape (k,).

    Attributes
    ----------
    limits
        Of the permitted error, in the unit of the quantity.
    angle
        Upper edges of the bins, degrees from the start.
    cycles
        How many cycles went into each bin.
    mean, deviation
        Of the error, or of its size, as the scene says, over time.
    index
        The reliability index beta of Eq. 37.
    left_open
        Of each bin's beta.
    within, within_low, within_high
        P(|e| <= upper limit), as the share of the time, and its interval (95 %).
    """

    limits: Limits
    angle: Array
    cycles: NDArray[np.intp]
    mean: Array
    deviation: Array
    index: Array
    left_open: list[Open]
    within: Array
    within_low: Array
    within_high: Array

    @property
    def half_width(self) -> Array:
        """Of the interval of beta (95 %) that cycles and samples leave open."""
        return np.array([np.hypot(left.sampling, left.quadrature) for left in self.left_open])

    @property
    def reliability(self) -> Array:
        """R of Eq. 39."""
        return np.asarray(ndtr(self.index))

    @property
    def density(self) -> Array:
        """DR / d beta."""
        return np.asarray(np.exp(-0.5 * self.index**2) / np.sqrt(2.0 * np.pi))

    @property
    def low(self) -> Array:
        """Lower end of the interval of R (95 %)."""
        return np.asarray(ndtr(self.index - self.half_width))

    @property
    def high(self) -> Array:
        """Upper end of the interval of R (95 %)."""
        return np.asarray(ndtr(self.index + self.half_width))

    @property
    def worst(self) -> int:
        """Index of the bin with the smallest reliability; the first of those equal but for round-off."""
        return int(np.flatnonzero(self.reliability <= self.minimum + ROUND_OFF)[0])

    @property
    def minimum(self) -> float:
        """The smallest reliability."""
        return float(self.reliability.min())

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the smallest reliability (95 %).

        Other cycles count as in the worst bin. What the samples leave open may make another bin the worst.
        """
        r, k = self.minimum, self.worst
        quadrature = np.array([left.quadrature for left in self.left_open])
        ends = []
        for sign in (-1.0, 1.0):
            cycles = ndtr(self.index[k] + sign * self.left_open[k].sampling) - r
            samples = ndtr(self.index + sign * quadrature).min() - r
            ends.append(float(np.clip(r + sign * np.hypot(cycles, samples), 0.0, 1.0)))
        return ends[0], ends[1]

    @property
    def cap(self) -> float:
        """The reliability of a mechanism without error."""
        return cap(self.limits)

    @property
    def capped(self) -> BoolArray:
        """Whether R is so close to the cap that it carries no information about the mechanism."""
        return np.asarray(np.abs(self.reliability - self.cap) <= ROUNDING)


def assess(errors: SliderErrors, settings: Settings) -> dict[str, Assessment]:
    """Return the assessment of each quantity, by the bins, limits and sign of errors that a scene states."""
    return {
        quantity: _assess(quantity, errors, settings)
        for quantity, channel in QUANTITIES.items()
        if channel in errors.by_channel
    }


def _assess(quantity: str, errors: SliderErrors, settings: Settings) -> Assessment:
    channel, time = QUANTITIES[quantity], errors.time
    limits: Limits = getattr(settings, quantity)
    edges = part_edges(float(time[-1]), errors.period, settings.bins)
    width, count = np.diff(edges), min(settings.bins, edges.size - 1)
    signed = errors.by_channel[channel]

    def averaged(signed: Array) -> Array:
        """Return errors or their sizes, their squares, and whether they are within the limit."""
        sizes = np.abs(signed)
        stress = sizes if settings.errors == "absolute" else signed
        return np.array([stress, signed**2, sizes <= limits.upper], dtype=np.float64)

    series = averaged(signed)
    averages = integrals(time, series, edges) / width
    averages[2] = np.clip(averages[2], 0.0, 1.0)  # but for round-off it is
    mean, square, within = (np.array([row[k::count].mean() for k in range(count)]) for row in averages)
    deviation = np.sqrt(np.maximum(square - mean**2, 0.0))
    slopes = np.array(sensitivity(limits, mean, deviation))

    halves = halved(time, series, edges) / width[:, None]
    largest = abs(errors.peak(channel).value)
    excess = np.zeros((width.size, BLOCKS))
    if (primitive := errors.by_channel.get(PRIMITIVES.get(channel, ""))) is not None:
        excess = mismatch(time, signed, primitive, edges) / width[:, None]
    # What samples do not show is no larger than the largest error: its square is at most that times its size,
    # and it is outside the limit no longer than that size over the limit.
    steepest = np.abs(slopes[0]) + np.abs(slopes[1]) * largest
    outside = 1.0 / limits.upper if largest > limits.upper else 0.0

    left_open, low, high = [], [], []
    for k in range(count):
        instants = edges[k:-1:count, None] + width[k::count, None] * (np.arange(PHASES) + 1) / PHASES
        e = np.interp(instants, time, signed)
        stress, squares, inside = averaged(e)
        cycles = np.tensordot(slopes[:, k], np.array([stress, squares]), axes=1)
        halves_of_index = np.tensordot(slopes[:, k], halves[:2, k::count], axes=1)
        left_open.append(Open(cycles, halves_of_index, steepest[k] * excess[k::count]))
        share = proportion(inside > 0.0, np.abs(e))
        unseen = quadrature_error(halves[2, k::count], outside * excess[k::count])
        low.append(max(0.0, min(float(share.low), within[k]) - unseen))
        high.append(min(1.0, max(float(share.high), within[k]) + unseen))
    return Assessment(
        limits=limits,
        angle=360.0 * (np.arange(count) + 1) / settings.bins,
        cycles=np.array([width[k::count].size for k in range(count)]),
        mean=mean,
        deviation=deviation,
        index=reliability_index(limits, mean, deviation),
        left_open=left_open,
        within=within,
        within_low=np.array(low),
        within_high=np.array(high),
    )
