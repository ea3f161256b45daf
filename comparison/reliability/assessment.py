"""One model's reliability by quantity and crank angle, with its sampling uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from comparison.reliability.bins import Bin, bins
from comparison.reliability.errors import SliderErrors
from comparison.reliability.interference import ROUNDING, cap, influence, reliability_index
from comparison.reliability.sampling import half_width, proportion, standard_error
from comparison.scene.criteria import Limits
from comparison.scene.criteria import Reliability as Settings
from comparison.tables.arrays import Array, BoolArray

ROUND_OFF = 1e-13
"""Of a reliability: a few hundred additions."""


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
        Of the error, or of its size, as the scene says.
    index
        The reliability index beta of Eq. 37.
    half_width
        Of the interval of beta (95 %) that the cycles leave open, see `comparison.reliability.sampling`.
    within, within_low, within_high
        P(|e| <= upper limit), as the share of the samples, and its interval (95 %).
    """

    quantity: str
    limits: Limits
    angle: Array
    cycles: NDArray[np.intp]
    mean: Array
    deviation: Array
    index: Array
    half_width: Array
    within: Array
    within_low: Array
    within_high: Array

    @property
    def reliability(self) -> Array:
        """R of Eq. 39."""
        return np.asarray(ndtr(self.index))

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
    found = {}
    parts = divide(errors, settings)
    for quantity, values in errors.by_quantity.items():
        limits: Limits = getattr(settings, quantity)
        signed = [values[part.rows] for part in parts]
        stress = [stressing(of, settings) for of in signed]
        mean, deviation = moments(stress)
        shares = [proportion(np.abs(of) <= limits.upper, np.abs(of)) for of in signed]
        widths = [float(half_width(standard_error(influence(limits, of)))) for of in stress]
        found[quantity] = Assessment(
            quantity=quantity,
            limits=limits,
            angle=np.array([part.angle for part in parts]),
            cycles=np.array([len(part.rows) for part in parts]),
            mean=mean,
            deviation=deviation,
            index=reliability_index(limits, mean, deviation),
            half_width=np.array(widths),
            within=np.array([float(share.share) for share in shares]),
            within_low=np.array([float(share.low) for share in shares]),
            within_high=np.array([float(share.high) for share in shares]),
        )
    return found


def divide(errors: SliderErrors, settings: Settings) -> list[Bin]:
    """Return the bins of a run."""
    return bins(settings.bins, errors.per_cycle, errors.samples)


def stressing(values: Array, settings: Settings) -> Array:
    """Return what mean and deviation are taken of: the errors or their sizes."""
    return np.abs(values) if settings.errors == "absolute" else values


def moments(parts: list[Array]) -> tuple[Array, Array]:
    """Return mean and deviation of the errors in each bin, shape (k,)."""
    return np.array([part.mean() for part in parts]), np.array([part.std() for part in parts])
