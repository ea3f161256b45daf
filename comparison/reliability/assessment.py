"""Reliability by quantity and crank angle, of one model and the difference of two: the paper's Eqs. 34-37.

Stress-strength interference: stress is the error, of mean mu_s and deviation sigma_s, strength the error that
is permitted, between limits of which mu_S is the middle and sigma_S a sixth of the distance; both are taken
as normal and independent: beta = (mu_S - mu_s) / sqrt(sigma_S^2 + sigma_s^2), R = Phi(beta).

**The cap.** Without any error beta = mu_S / sigma_S, which is 3 for a lower limit of zero, whatever the upper
one. The reliabilities that the paper prints end at Phi(3) = 0.99865, which identifies its lower limit as
zero. Only the distance to the cap carries information about a mechanism.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from comparison.accuracy.levels import coarser
from comparison.accuracy.uncertainty import ROUND_OFF, Runs, RunValues, uncertainty
from comparison.execution.run import RunError, dense_scene
from comparison.reliability.errors import (
    SliderErrors,
    half_width,
    integrals,
    part_edges,
    slider_errors,
    standard_error,
)
from comparison.scene import Scene, load_scene
from comparison.scene.loading import BASE, scene_from_mapping
from comparison.scene.schema import ExudynSolver, Limits, ReferenceSolver
from comparison.scene.schema import Reliability as Settings
from comparison.tables.channels import Array, BoolArray
from comparison.tables.table import Table, TableError

ROUNDING = 5e-6
"""Half a unit in the fifth digit, to which the paper prints: nearer to the cap nothing can be concluded."""
_NEAR_EQUAL = 1e-13  # of a reliability: a few hundred additions
PHASES = 100  # crank angles in a part of the cycle at which cycles are compared, whatever the samples


def reliability_index(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return beta, Eq. 35, of errors with these moments."""
    strength, spread = _strength(limits)
    return np.asarray((strength - mean) / np.hypot(spread, deviation))


def reliability(limits: Limits, mean: Array | float, deviation: Array | float) -> Array:
    """Return R = Phi(beta), Eq. 37, of errors with these moments, in the unit of the limits."""
    return np.asarray(ndtr(reliability_index(limits, mean, deviation)))


def cap(limits: Limits) -> float:
    """Return the reliability of a mechanism without error."""
    return float(reliability(limits, 0.0, 0.0))


def sensitivity(limits: Limits, mean: Array | float, deviation: Array | float) -> tuple[Array, Array]:
    """Return the derivatives of beta in the averages of the errors and of their squares."""
    beta = reliability_index(limits, mean, deviation)
    total = np.hypot(_strength(limits)[1], deviation)
    return np.asarray(-1.0 / total + beta * mean / total**2), np.asarray(-0.5 * beta / total**2)


def _strength(limits: Limits) -> tuple[float, float]:  # mean and deviation, Eq. 36
    return (limits.upper + limits.lower) / 2.0, (limits.upper - limits.lower) / 6.0


@dataclass(frozen=True)
class Assessment:
    """The reliability of one quantity in ``k`` bins; arrays of shape (k,), intervals of 95 %.

    ``limits`` and errors are in ``unit``. ``angle`` are the upper edges of the bins, degrees from the start;
    ``cycles`` how many went into each; mean and deviation those of the error over time, or of its size, as
    the scene says; ``index`` is beta of Eq. 35, ``contributions``, by bin, those of each cycle and phase to
    it, shape (cycles, `PHASES`), whose scatter gives its interval; ``worst`` the first bin with the smallest
    reliability, to round-off; ``cap`` the reliability of a mechanism without error; ``within`` the share
    of the time in which the error, or its size, is within the limits.
    """

    limits: Limits
    unit: str
    angle: Array
    cycles: NDArray[np.intp]
    mean: Array
    deviation: Array
    index: Array
    reliability: Array
    minimum: float
    worst: int
    cap: float
    contributions: list[Array]
    within: Array

    @cached_property
    def half_width(self) -> Array:
        """Half-width of the interval of beta, as other cycles would scatter."""
        return np.array([half_width(standard_error(cycles)) for cycles in self.contributions])

    @property
    def density(self) -> Array:
        """Derivative dR / d beta."""
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
        """Interval of the smallest reliability."""
        return float(self.low[self.worst]), float(self.high[self.worst])

    @property
    def capped(self) -> BoolArray:
        """True where R is so close to the cap that it carries no information about the mechanism."""
        return np.asarray(np.abs(self.reliability - self.cap) <= ROUNDING)


def assess(errors: SliderErrors, settings: Settings) -> dict[str, Assessment]:
    """Return the assessment of each quantity, by the bins, limits and sign of errors that a scene states."""
    present = {name: channel for name, channel in settings.channels.items() if channel in errors.by_channel}
    return {quantity: _assess(quantity, channel, errors, settings) for quantity, channel in present.items()}


def _assess(quantity: str, channel: str, errors: SliderErrors, settings: Settings) -> Assessment:
    time, signed = errors.time, errors.by_channel[channel]
    limits: Limits = getattr(settings, quantity)
    edges = part_edges(float(time[-1]), errors.period, settings.bins)
    width, count = np.diff(edges), min(settings.bins, edges.size - 1)

    def averaged(signed: Array) -> Array:
        stress = np.abs(signed) if settings.errors == "absolute" else signed
        within = (limits.lower <= stress) & (stress <= limits.upper)
        return np.array([stress, signed**2, within], dtype=np.float64)

    averages = integrals(time, averaged(signed), edges) / width
    averages[2] = np.clip(averages[2], 0.0, 1.0)  # round-off leaves the range
    mean, square, within = (np.array([row[k::count].mean() for k in range(count)]) for row in averages)
    deviation = np.sqrt(np.maximum(square - mean**2, 0.0))
    slopes = sensitivity(limits, mean, deviation)
    index = reliability_index(limits, mean, deviation)
    r = np.asarray(ndtr(index))

    contributions = []
    for k in range(count):
        instants = edges[k:-1:count, None] + width[k::count, None] * (np.arange(PHASES) + 1) / PHASES
        stress, squared, _ = averaged(np.interp(instants, time, signed))
        contributions.append(slopes[0][k] * stress + slopes[1][k] * squared)
    return Assessment(
        limits=limits,
        unit=errors.units[channel],
        # The last part of a run shorter than a cycle may end within its interval.
        angle=np.minimum(
            360.0 * (np.arange(count) + 1) / settings.bins, round(360.0 * float(edges[-1]) / errors.period, 9)
        ),
        cycles=np.array([width[k::count].size for k in range(count)]),
        mean=mean,
        deviation=deviation,
        index=index,
        reliability=r,
        minimum=float(r.min()),
        worst=int(np.flatnonzero(r <= r.min() + _NEAR_EQUAL)[0]),
        cap=cap(limits),
        contributions=contributions,
        within=within,
    )


# ---- difference of two models, its significance, and what is run for it
#
# The difference has two uncertainties, whose squares add up. Numerical: the distances of the reliabilities
# from those by the finer, the coarser and the perturbed runs of each model and by a coarser ideal mechanism,
# as for any channel (`comparison.accuracy.uncertainty`). Sampling: how far it would move with other cycles,
# paired, since the errors of both models at one instant belong together; where the smallest reliabilities of
# the two are in different bins there are no pairs. The error by `DENSE` samples is less by decades.

MARGIN = 1e-3  # of reliability: an interval that reaches further leaves open whether two models agree
STEPS = 10_000
"""Exudyn's steps per crank cycle of an ideal mechanism: positions err by 1e-12 m, velocities by 1e-7 m/s and
accelerations by 5e-7 m/s^2 at 150 rpm (measured against the closed form)."""
_WITHOUT_EFFECT = ("clearance", "contact", "friction", "initial", "environment")


@dataclass(frozen=True)
class Difference:
    """One quantity's reliability in two models.

    ``curve`` is R_a - R_b in each bin, ``minimum`` the difference of the smallest, both with half-widths of
    their intervals, nan where a model has no numerical uncertainty.
    """

    a: Assessment
    b: Assessment
    curve: Array
    curve_half_width: Array
    minimum: float
    sampling: float
    numerical: float

    @property
    def half_width(self) -> float:
        """Half-width of the interval of `minimum`."""
        return float(np.hypot(self.sampling, self.numerical))

    @property
    def verdict(self) -> str:
        """Verdict: "differ" if the interval excludes zero, "agree" within `MARGIN`, else "undecided"."""
        if abs(self.minimum) > self.half_width:
            return "differ"
        return "agree" if abs(self.minimum) + self.half_width <= MARGIN else "undecided"


@dataclass(frozen=True)
class ReliabilityComparison:
    """A scene's reliability in two models, by quantity, or what prevented it, such as a run that failed.

    It has neither where the drive has no period.
    """

    settings: Settings
    quantities: dict[str, Difference] = field(default_factory=dict)
    missing: RunError | TableError | None = None

    @property
    def verdict(self) -> str:
        """The worst of the quantities'; "undecided" where there is none."""
        verdicts = {difference.verdict for difference in self.quantities.values()} or {"undecided"}
        return next(verdict for verdict in ("differ", "undecided", "agree") if verdict in verdicts)


def has_ideal(scene: Scene) -> bool:
    """Return whether a motion has a period, and joints whose clearance may be left out."""
    return not scene.is_linkage or bool(scene.loose and "speed_rpm" in scene.data["drive"])


def ideal_scenes(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the same scene with ideal joints: "base" and, where the model can be refined, "coarser".

    There is none of a linkage without clearance, or whose drive has no period.
    Samples are those of `dense_scene`, but a coarser run's the scene's, as far as its steps fit between them.
    Keys that do not affect a motion that the drive alone prescribes get one value, also the settings of
    our two models: scenes that differ in nothing else share the run.
    """
    base, sections = load_scene(BASE).data, dict[str, Any]()
    if not scene.is_linkage:
        sections = {section: base[section] for section in _WITHOUT_EFFECT}
        sections["joints"] = {"slider": "ideal", "crank_pin": "ideal"}
    elif not has_ideal(scene):
        return {}
    else:
        loose = ("clearance", "contact", "friction")
        scene = scene_from_mapping({key: table for key, table in scene.data.items() if key not in loose})
    sections |= {
        "solver.reference": ReferenceSolver().model_dump(),
        "solver.exudyn": ExudynSolver(step=scene.period / STEPS).model_dump(),
        "output": {"groups": ["accelerations"]},
    }
    values = {f"{section}.{key}": value for section, keys in sections.items() for key, value in keys.items()}
    ideal = scene.variant(values)
    # A step twice that of the base would not fit between more samples, and the run would be the base itself.
    few = min(int(scene.data["output"]["samples_per_cycle"]), STEPS // 2)
    coarse = coarser(model, ideal.variant({"output.samples_per_cycle": few}))
    return {"base": dense_scene(ideal)} | ({} if coarse is None else {"coarser": coarse})


def compare_reliability(
    runs: tuple[Runs, Runs],
    ideals: tuple[Runs, Runs],
    period: float,
    settings: Settings,
    k: float,
    start: float = 0.0,
) -> dict[str, Difference]:
    """Compare the reliabilities of two models, by quantity, from their runs and ideal mechanisms.

    ``k`` numerical uncertainties explain a difference; the first cycle that counts starts at ``start`` (s).
    Raises `TableError` if the tables cannot be compared.
    """

    def assess_run(run: Table, ideal: Table) -> dict[str, Assessment]:
        names = [*settings.channels.values()]
        return assess(slider_errors(run, ideal, period, start=start, names=names, peaks=False), settings)

    def numerical(runs: Runs, ideal: Runs, base: dict[str, Assessment]) -> dict[str, Array]:
        """Return each quantity's u in every bin and, last, that of the smallest; shape (k bins + 1,)."""
        by_run, by_ideal = {"base": base}, {"base": base}
        by_run |= {
            which: assess_run(table, ideal.base) for which, table in runs.tables.items() if which != "base"
        }
        by_ideal |= {
            which: assess_run(runs.base, table) for which, table in ideal.tables.items() if which != "base"
        }
        return {
            name: np.hypot(
                _uncertainty(name, by_run, runs.refinement), _uncertainty(name, by_ideal, ideal.refinement)
            )
            for name in base
        }

    first, second = (assess_run(model.base, ideal.base) for model, ideal in zip(runs, ideals, strict=True))
    a_cycles, b_cycles = ([(name, *bins.cycles) for name, bins in model.items()] for model in (first, second))
    if a_cycles != b_cycles:
        raise TableError("the two results cover different parts of the cycles, or hold different channels")
    u_first, u_second = (numerical(*sides) for sides in zip(runs, ideals, (first, second), strict=True))
    return {
        name: _difference(a, second[name], k * np.hypot(u_first[name], u_second[name]))
        for name, a in first.items()
    }


def _difference(a: Assessment, b: Assessment, numerical: Array) -> Difference:
    pairs = zip(a.density, a.contributions, b.density, b.contributions, strict=True)
    half_widths = [half_width(standard_error(of_a * in_a - of_b * in_b)) for of_a, in_a, of_b, in_b in pairs]
    sampling = half_widths[a.worst]
    if a.worst != b.worst:
        sampling = np.hypot(*(model.density[model.worst] * model.half_width[model.worst] for model in (a, b)))
    return Difference(
        a=a,
        b=b,
        curve=a.reliability - b.reliability,
        curve_half_width=np.hypot(half_widths, numerical[:-1]),
        minimum=a.minimum - b.minimum,
        sampling=float(sampling),
        numerical=float(numerical[-1]),
    )


def _uncertainty(name: str, runs: dict[str, dict[str, Assessment]], refinement: tuple[float, float]) -> Array:
    values = {which: np.append(bins[name].reliability, bins[name].minimum) for which, bins in runs.items()}
    base = values.pop("base")
    if not values:
        return np.full(base.shape, np.nan)
    finer = values.pop("finer", base)  # without one the coarser run decides alone
    levels = RunValues(base, finer, values.pop("coarser", None), tuple(values.values()), *refinement)
    return uncertainty(levels, half_width=0, floor=ROUND_OFF)
