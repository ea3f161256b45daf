"""One model's reliability by quantity and crank angle: stress-strength interference, the paper's Eqs. 33-39.

Stress is the error, of mean mu_s and deviation sigma_s, strength the error that is permitted, between limits
of which mu_S is the middle and sigma_S a sixth of the distance; both are taken as normal and independent:
beta = (mu_S - mu_s) / sqrt(sigma_S^2 + sigma_s^2), R = Phi(beta).

**The cap.** Without any error beta = mu_S / sigma_S, which is 3 for a lower limit of zero, whatever the upper
one. The reliabilities that the paper prints end at Phi(3) = 0.99865, which identifies its lower limit as
zero. Only the distance to the cap carries information about a mechanism.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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
from comparison.tables.channels import Array, BoolArray

ROUNDING = 5e-6
"""Half a unit in the fifth digit, to which the paper prints: nearer to the cap nothing can be concluded."""
ROUND_OFF = 1e-13  # of a reliability: a few hundred additions
PHASES = 100  # crank angles in a part of the cycle at which cycles are compared, whatever the samples


def reliability_index(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return beta, Eq. 37, of errors with these moments."""
    strength, spread = _strength(limits)
    return np.asarray((strength - mean) / np.hypot(spread, deviation))


def reliability(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return R = Phi(beta), Eq. 39, of errors with these moments, in the unit of the limits."""
    return np.asarray(ndtr(reliability_index(limits, mean, deviation)))


def cap(limits: Limits) -> float:
    """Return the reliability of a mechanism without error."""
    return float(reliability(limits, 0.0, 0.0))


def sensitivity(limits: Limits, mean: Array | float, deviation: Array | float) -> tuple[Array, Array]:
    """Return the derivatives of beta in the averages of the errors and of their squares."""
    beta = reliability_index(limits, mean, deviation)
    total = np.hypot(_strength(limits)[1], deviation)
    return np.asarray(-1.0 / total + beta * mean / total**2), np.asarray(-0.5 * beta / total**2)


def implied_limit(published: float, mean: float, deviation: float) -> float:
    """Return the upper limit, for a lower one of zero, that gives a published reliability, 0 < R < 1.

    In the unit of the error; infinite from the cap on, nan where no positive limit gives R. Close to the cap
    it grows as mean / (3 - beta): ask for the whole interval of a rounded figure.
    """
    beta = float(ndtri(published))
    leading = 0.25 - beta**2 / 36.0
    if leading <= 0.0 and mean >= 0.0:
        return float("inf")
    # (limit / 2 - mean)^2 = beta^2 (limit^2 / 36 + deviation^2), whose sides lost their signs
    roots = np.roots([leading, -mean, mean**2 - (beta * deviation) ** 2])
    real = roots[np.isreal(roots)].real
    fitting = real[(real > 0.0) & ((real / 2.0 - mean) * beta >= 0.0)]
    return float(fitting.min()) if fitting.size else float("nan")


def _strength(limits: Limits) -> tuple[float, float]:  # mean and deviation, Eq. 38
    return (limits.upper + limits.lower) / 2.0, (limits.upper - limits.lower) / 6.0


class Open(NamedTuple):
    """What is left open of beta in one part of N cycles, by each of `PHASES` of them and by the samples."""

    cycles: Array
    halves: Array
    excess: Array

    def less(self, other: Open, factor: float, factor_of_other: float) -> Open:
        """Return what is left open of a difference of these, times their factors."""
        pairs = zip(self, other, strict=True)
        return Open(*(factor * mine - factor_of_other * theirs for mine, theirs in pairs))

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
    """The reliability of one quantity in ``k`` bins; arrays of shape (k,), intervals of 95 %.

    ``angle`` are the upper edges of the bins, degrees from the start; ``cycles`` how many went into each;
    mean and deviation those of the error over time, or of its size, as the scene says; ``index`` is beta of
    Eq. 37, ``left_open`` what is of it; ``worst`` the first bin with the smallest reliability but for
    round-off, ``cap`` the reliability of a mechanism without error; ``within`` is P(|e| <= upper limit), as
    the share of the time.
    """

    limits: Limits
    angle: Array
    cycles: NDArray[np.intp]
    mean: Array
    deviation: Array
    index: Array
    reliability: Array
    minimum: float
    worst: int
    cap: float
    left_open: list[Open]
    within: Array
    within_low: Array
    within_high: Array

    @property
    def half_width(self) -> Array:
        """Of the interval of beta that cycles and samples leave open."""
        return np.array([np.hypot(left.sampling, left.quadrature) for left in self.left_open])

    @property
    def density(self) -> Array:
        """DR / d beta."""
        return np.asarray(np.exp(-0.5 * self.index**2) / np.sqrt(2.0 * np.pi))

    @property
    def low(self) -> Array:
        """Lower end of the interval of R."""
        return np.asarray(ndtr(self.index - self.half_width))

    @property
    def high(self) -> Array:
        """Upper end of the interval of R."""
        return np.asarray(ndtr(self.index + self.half_width))

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the smallest reliability; what samples leave open may make another bin the worst."""
        quadrature = np.array([left.quadrature for left in self.left_open])
        sampling = self.left_open[self.worst].sampling

        def end(sign: float) -> float:
            cycles = ndtr(self.index[self.worst] + sign * sampling) - self.minimum
            samples = ndtr(self.index + sign * quadrature).min() - self.minimum
            return float(np.clip(self.minimum + sign * np.hypot(cycles, samples), 0.0, 1.0))

        return end(-1.0), end(1.0)

    @property
    def capped(self) -> BoolArray:
        """Whether R is so close to the cap that it carries no information about the mechanism."""
        return np.asarray(np.abs(self.reliability - self.cap) <= ROUNDING)


def assess(errors: SliderErrors, settings: Settings) -> dict[str, Assessment]:
    """Return the assessment of each quantity, by the bins, limits and sign of errors that a scene states."""
    held = {name: channel for name, channel in QUANTITIES.items() if channel in errors.by_channel}
    return {quantity: _assess(quantity, channel, errors, settings) for quantity, channel in held.items()}


def _assess(quantity: str, channel: str, errors: SliderErrors, settings: Settings) -> Assessment:
    time, signed = errors.time, errors.by_channel[channel]
    limits: Limits = getattr(settings, quantity)
    edges = part_edges(float(time[-1]), errors.period, settings.bins)
    width, count = np.diff(edges), min(settings.bins, edges.size - 1)

    def averaged(signed: Array) -> Array:
        sizes = np.abs(signed)
        stress = sizes if settings.errors == "absolute" else signed
        return np.array([stress, signed**2, sizes <= limits.upper], dtype=np.float64)

    series = averaged(signed)
    averages = integrals(time, series, edges) / width
    averages[2] = np.clip(averages[2], 0.0, 1.0)  # but for round-off it is
    mean, square, within = (np.array([row[k::count].mean() for k in range(count)]) for row in averages)
    deviation = np.sqrt(np.maximum(square - mean**2, 0.0))
    slopes = np.array(sensitivity(limits, mean, deviation))
    index = reliability_index(limits, mean, deviation)
    r = np.asarray(ndtr(index))

    halves = halved(time, series, edges) / width[:, None]
    excess = np.zeros((width.size, BLOCKS))
    if (primitive := errors.by_channel.get(PRIMITIVES.get(channel, ""))) is not None:
        excess = mismatch(time, signed, primitive, edges) / width[:, None]
    # What samples do not show is no larger than the largest error, and outside the limit no longer than its
    # size over the limit.
    largest = abs(errors.peak(channel).value)
    steepest = np.abs(slopes[0]) + np.abs(slopes[1]) * largest
    outside = 1.0 / limits.upper if largest > limits.upper else 0.0

    left_open, low, high = [], [], []
    for k in range(count):
        instants = edges[k:-1:count, None] + width[k::count, None] * (np.arange(PHASES) + 1) / PHASES
        e = np.interp(instants, time, signed)
        *moments, inside = averaged(e)
        cycles, halves_of_index = (
            np.tensordot(slopes[:, k], values, axes=1) for values in (np.array(moments), halves[:2, k::count])
        )
        left_open.append(Open(cycles, halves_of_index, steepest[k] * excess[k::count]))
        least, most = proportion(inside > 0.0, np.abs(e))
        unseen = quadrature_error(halves[2, k::count], outside * excess[k::count])
        low.append(max(0.0, min(float(least), within[k]) - unseen))
        high.append(min(1.0, max(float(most), within[k]) + unseen))
    return Assessment(
        limits=limits,
        angle=360.0 * (np.arange(count) + 1) / settings.bins,
        cycles=np.array([width[k::count].size for k in range(count)]),
        mean=mean,
        deviation=deviation,
        index=index,
        reliability=r,
        minimum=float(r.min()),
        worst=int(np.flatnonzero(r <= r.min() + ROUND_OFF)[0]),
        cap=cap(limits),
        left_open=left_open,
        within=within,
        within_low=np.array(low),
        within_high=np.array(high),
    )
