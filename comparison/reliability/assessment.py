"""One model's reliability by quantity and crank angle, with what the cycles and the samples leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from comparison.reliability.averages import BLOCKS, halved, integrals, mismatch, part_edges, quadrature_error
from comparison.reliability.errors import PRIMITIVES, QUANTITIES, SliderErrors
from comparison.reliability.interference import ROUNDING, cap, reliability_index, sensitivity
from comparison.reliability.sampling import half_width, proportion, standard_error
from comparison.scene.schema import Limits
from comparison.scene.schema import Reliability as Settings
from comparison.tables.arrays import Array, BoolArray

ROUND_OFF = 1e-13
"""Of a reliability: a few hundred additions."""
PHASES = 100
"""Crank angles in a part of the cycle at which cycles are compared, whatever the samples."""


@dataclass(frozen=True)
class Open:
    """What is left open of beta in one part of N cycles: how it changes with each cycle and with the samples.

    Attributes
    ----------
    cycles
        Shape (N, `PHASES`): see `comparison.reliability.sampling.standard_error`.
    halves, excess
        Shape (N, 2 `BLOCKS`) and (N, `BLOCKS`): see `comparison.reliability.averages.quadrature_error`.
    """

    cycles: Array
    halves: Array
    excess: Array

    def less(self, other: Open, factor: float, factor_of_other: float) -> Open:
        """Return what is left open of a difference; the factors are what both are multiplied by."""
        return Open(
            *(
                factor * mine - factor_of_other * theirs
                for mine, theirs in zip(vars(self).values(), vars(other).values(), strict=True)
            )
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

    quantity: str
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
        return np.array([np.hypot(of.sampling, of.quadrature) for of in self.left_open])

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
        ends = []
        for sign in (-1.0, 1.0):
            cycles = ndtr(self.index[k] + sign * self.left_open[k].sampling) - r
            samples = ndtr(self.index + sign * np.array([of.quadrature for of in self.left_open])).min() - r
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
    """Return the assessment of each quantity.

    Parameters
    ----------
    errors
        Of the model's run.
    settings
        ``[reliability]`` of the scene: bins, limits, signed or absolute errors.
    """
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
    series = _series(signed, limits, settings)
    averages = integrals(time, series, edges) / width
    averages[2] = np.clip(averages[2], 0.0, 1.0)  # but for round-off it is
    mean, square, within = (np.array([row[k::count].mean() for k in range(count)]) for row in averages)
    deviation = np.sqrt(np.maximum(square - mean**2, 0.0))
    slopes = np.array(sensitivity(limits, mean, deviation))
    index = reliability_index(limits, mean, deviation)

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
        at = edges[k:-1:count, None] + width[k::count, None] * (np.arange(PHASES) + 1) / PHASES
        e = np.interp(at, time, signed)
        sizes = _series(e, limits, settings)
        cycles = np.tensordot(slopes[:, k], sizes[:2], axes=1)
        halves_of_index = np.tensordot(slopes[:, k], halves[:2, k::count], axes=1)
        left_open.append(Open(cycles, halves_of_index, steepest[k] * excess[k::count]))
        share = proportion(sizes[2] > 0.0, np.abs(e))
        unseen = quadrature_error(halves[2, k::count], outside * excess[k::count])
        low.append(max(0.0, min(float(share.low), within[k]) - unseen))
        high.append(min(1.0, max(float(share.high), within[k]) + unseen))
    return Assessment(
        quantity=quantity,
        limits=limits,
        angle=360.0 * (np.arange(count) + 1) / settings.bins,
        cycles=np.array([width[k::count].size for k in range(count)]),
        mean=mean,
        deviation=deviation,
        index=index,
        left_open=left_open,
        within=within,
        within_low=np.array(low),
        within_high=np.array(high),
    )


def _series(signed: Array, limits: Limits, settings: Settings) -> Array:
    """Return what is averaged: errors or their sizes, their squares, whether they are within the limit."""
    sizes = np.abs(signed)
    stress = sizes if settings.errors == "absolute" else signed
    return np.array([stress, signed**2, sizes <= limits.upper], dtype=np.float64)
