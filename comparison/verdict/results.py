"""Results of a comparison as data, of a channel and of a scene at one tier; texts: `comparison.words`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import cached_property
from importlib import import_module
from math import inf, isnan, nan
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from comparison.accuracy.levels import Thresholds
from comparison.accuracy.uncertainty import combined
from comparison.execution.run import Job
from comparison.execution.store import hash_of
from comparison.metrics import (
    Extrema,
    Impacts,
    Parting,
    Pulse,
    contact_places,
    impacts_of,
    maximum,
    measures,
    rms,
    scaled_value,
    time_shares,
    tube_distance,
)
from comparison.reliability.assessment import ReliabilityComparison
from comparison.scene import Scene
from comparison.tables.align import Shift
from comparison.tables.channels import CONTACTS, Array, BoolArray, Channel
from comparison.verdict.until import is_state

SUSPICIOUS = 10.0
"""Factor of underestimation of u that is reported as suspicious; by chance alone 6 has been observed."""
EXIT_CODES = {"agree": 0, "differ": 1, "cannot compare": 2, "indeterminate": 3}
_WORST_FIRST = (70, 2, 1, 3, 0)
_VERDICTS = ("unexcited", "agree", "indeterminate", "differ", "cannot compare")


class Basis(Enum):
    """Ground of a channel's verdict."""

    RANGE = auto()  # unexcited: its range in both is below the channel's floor
    # Indeterminate
    NO_LIMIT = auto()  # neither an uncertainty nor a tolerance
    ERROR = auto()  # an error of either, which a share of its range does not limit
    COVERAGE = auto()  # too few samples are predictable
    NOTHING_JUDGED = auto()  # no predictable sample is non-zero
    FEW_JUDGED = auto()  # too few predictable samples are non-zero
    FEW_OUTSIDE = auto()  # too many samples are outside to agree, too few to differ
    # Agree or differ
    SAMPLES = auto()  # by the share of the judged samples within their threshold
    GATE = auto()  # by limits of metrics
    LARGEST = auto()  # differ, although too little is predictable: even the largest u explains too little


METRICS = {
    **dict.fromkeys(("max_scaled", "rms_scaled", "peak_scaled", "peak_time_difference"), 1),
    **dict.fromkeys(("tube_share", "correlation"), -1),
}
"""Metrics that a gate can limit: 1 if the limit is on the size of an error, -1 if a rating must reach it.

Scaled ones are shares of the channel's scale; `comparison.metrics.measures` has the others.
"""


@dataclass(frozen=True)
class Check:
    """A metric of a channel against the limit of a gate."""

    metric: str
    value: float
    limit: float

    @property
    def met(self) -> bool:
        """True for an error of at most, or a rating of at least, the limit; False for an undefined metric."""
        return abs(self.value) <= self.limit if METRICS[self.metric] > 0 else self.value >= self.limit


@dataclass(frozen=True)
class ChannelComparison:
    """Comparison of one channel of two runs at ``n`` common times; arrays have shape (n,), unknown is nan.

    Of the samples that decide, ``worst`` has the largest |a - b| / threshold, and ``outside`` are outside;
    ``explained`` is the share of the judged samples within.
    """

    definition: Channel
    scale: float
    time: Array  # s
    a: Array
    b: Array
    u_a: Array | None  # numerical uncertainties of a and b
    u_b: Array | None
    tolerance: float | None  # allowed |a - b| in the channel's unit, where there is no uncertainty
    predictable: BoolArray  # u <= alpha * scale; all True where u is None
    limits: Thresholds
    verdict: str  # "agree", "differ", "indeterminate" or "unexcited"
    basis: Basis
    explained: float = nan
    outside: int = 0
    worst: int | None = None
    worst_threshold: float = nan
    until: float = nan  # s, predictable before it, see `comparison.verdict.until`; nan where u is None
    isolated: int = 0  # unpredictable stretches before that, too short to end it
    differs_from: float = nan  # s, where too many samples are outside for the first time
    time_tolerance: float = 0.0  # s, by which either may be early or late; 0 where there is an uncertainty
    checks: tuple[Check, ...] = ()
    coverage_error: float = nan  # estimates, by sampling, see `comparison.verdict.compare`
    rms_error: float = nan
    extrema: Extrema = ((), ())  # of a and b at steps between the samples; of both or of none

    def __repr__(self) -> str:
        """Return name and verdict, not the numbers."""
        return f"ChannelComparison({self.channel!r}, {self.verdict!r})"

    @property
    def channel(self) -> str:
        """Name of the channel."""
        return self.definition.name

    @property
    def label(self) -> str:
        """Words for the channel."""
        return self.definition.label

    @property
    def unit(self) -> str:
        """Unit of the channel; empty where it is unknown."""
        return self.definition.unit

    @cached_property
    def difference(self) -> Array:
        """Difference a - b."""
        return self.a - self.b

    @cached_property
    def size(self) -> Array:
        """Size of the difference that the threshold limits: |a - b|, or less within the time tolerance."""
        if self.time_tolerance:
            return tube_distance(self.time, self.a, self.b, self.time_tolerance)
        return np.abs(self.difference)

    @cached_property
    def u(self) -> Array | None:
        """Numerical uncertainty of the difference; None if unknown."""
        return None if self.u_a is None or self.u_b is None else combined(self.u_a, self.u_b)

    @cached_property
    def threshold(self) -> Array | None:
        """Threshold of |a - b|: k u, or the tolerance; None without either."""
        if self.u is not None:
            return self.limits.k * self.u
        return None if self.tolerance is None else np.full(self.time.shape, self.tolerance)

    @property
    def extent(self) -> float:
        """Range of both results together."""
        return float(max(self.a.max(), self.b.max()) - min(self.a.min(), self.b.min()))

    @property
    def nonzero(self) -> BoolArray:
        """Samples at which either result is not zero: a zero force in both is no evidence."""
        return np.asarray((self.a != 0) | (self.b != 0))

    @property
    def judged(self) -> BoolArray:
        """Samples on which the verdict rests: predictable and non-zero."""
        return self.predictable & self.nonzero

    @property
    def outlying(self) -> BoolArray:
        """Samples outside their threshold, judged or not."""
        return np.asarray(self.size > (inf if self.threshold is None else self.threshold))

    @property
    def beyond(self) -> BoolArray:
        """Judged samples outside their threshold."""
        return self.judged & self.outlying

    @property
    def deciding(self) -> tuple[BoolArray, Array]:
        """Samples that decide, and u, or tolerance / k, at these.

        They are all non-zero ones where the largest u of all times decides.
        """
        assert self.threshold is not None
        if self.basis is Basis.LARGEST:
            return self.nonzero, np.full(int(self.nonzero.sum()), self.worst_threshold / self.limits.k)
        u = self.threshold / self.limits.k if self.u is None else self.u
        return self.judged, u[self.judged]

    @property
    def coverage(self) -> float:
        """Share of predictable samples."""
        return float(self.predictable.mean())

    @property
    def resolution(self) -> float:
        """Median threshold of the judged samples over the scale: less is no difference; nan without u."""
        if self.u is None or not self.judged.any():
            return nan
        return scaled_value(self.limits.k * float(np.median(self.u[self.judged])), self.scale)

    @property
    def worst_time(self) -> float:
        """Time of the worst sample, s."""
        return nan if self.worst is None else float(self.time[self.worst])

    @property
    def worst_difference(self) -> float:
        """Difference at the worst sample."""
        return nan if self.worst is None else float(self.difference[self.worst])

    @property
    def worst_size(self) -> float:
        """`size` at the worst sample."""
        return nan if self.worst is None else float(self.size[self.worst])

    @cached_property
    def max_difference(self) -> float:
        """Largest |a - b| of all samples, predictable or not."""
        return maximum(self.difference)

    @cached_property
    def rms_difference(self) -> float:
        """Root mean square of a - b over time, of all samples."""
        return rms(self.time, self.difference)

    @property
    def max_scaled(self) -> float:
        """`max_difference` over the scale."""
        return scaled_value(self.max_difference, self.scale)

    @property
    def rms_scaled(self) -> float:
        """`rms_difference` over the scale."""
        return scaled_value(self.rms_difference, self.scale)

    @property
    def largest_predictable(self) -> float:
        """Largest |a - b| of the predictable samples."""
        return maximum(self.difference[self.predictable]) if self.predictable.any() else nan

    @cached_property
    def ratio(self) -> float:
        """The |a - b| / threshold that the required share of the judged samples does not exceed.

        Every report has this number of a channel, under `ratio_name`: at most 1 exactly where the channel
        agrees, nan unless it agrees or differs by its samples. Where later samples dilute a difference it is
        that of the samples up to `differs_from`.
        """
        if self.verdict not in ("agree", "differ") or self.threshold is None or self.basis is Basis.GATE:
            return nan
        largest = self.basis is Basis.LARGEST
        mask = self.nonzero if largest else self.judged
        limit = np.full(self.time.shape, self.worst_threshold) if largest else self.threshold
        ratio = self._ratio_within(mask, limit)
        if ratio <= 1.0 and self.verdict == "differ":
            ratio = self._ratio_within(mask & (self.time <= self.differs_from), limit)
        return ratio

    def _ratio_within(self, mask: BoolArray, limit: Array) -> float:
        """Return the |a - b| over a limit that the required share of the masked samples does not exceed."""
        size, limit = self.size[mask], limit[mask]
        if not size.size:
            return nan
        ratios = np.sort(np.divide(size, limit, out=np.where(size > 0.0, inf, 0.0), where=limit > 0.0))
        enough = np.arange(1, size.size + 1) / size.size >= self.limits.share
        return float(ratios[enough.argmax()])

    @property
    def largest_ratio(self) -> float:
        """The largest |a - b| / threshold of the samples that decide."""
        if self.worst_size == 0.0:
            return 0.0
        return self.worst_size / self.worst_threshold if self.worst_threshold else inf

    @property
    def ratio_name(self) -> str:
        """Name of `ratio`: "|E|/2u (99%)", or "|E|/tolerance"."""
        share = "" if self.limits.share == 1.0 else f" ({100 * self.limits.share:g}%)"
        return f"|E|/{'tolerance' if self.u is None else f'{self.limits.k:g}u'}{share}"

    @cached_property
    def metrics(self) -> Mapping[str, float]:
        """`comparison.metrics.measures` of b against a; none of unexcited channels."""
        if self.verdict == "unexcited":
            return {}
        position = self.definition.rate is not None
        return measures(self.time, self.a, self.b, position=position, extrema=self.extrema)


@dataclass(frozen=True)
class Refinement:
    """Change of one model's settings to the next finer level."""

    label: str
    settings: Mapping[str, float]  # those that change, as before; first the one whose ratio is the factor
    factor: float
    order: float  # at which the error should follow that setting
    observed: float = nan  # the order that three levels show

    @property
    def gain(self) -> float:
        """Expected ratio of the errors of two levels."""
        return float(self.factor**self.order)


@dataclass(frozen=True)
class Attribution:
    """Numbers on the causes of a scene's difference at one tier; unknown values are nan or empty."""

    explained: float = nan  # share of the judged samples of all excited channels that are within k u
    # Share of the difference that remains with the run of "a", "b" or "both" refined
    remaining: dict[str, float] = field(default_factory=dict)
    refinements: tuple[Refinement, ...] = ()  # of both models, where both can be refined
    # Shares of the unpredictable samples of indeterminate channels where u of "a" alone is too large, u of
    # "b" alone, "each" of the two, or only both "together"
    unpredictable: dict[str, float] = field(default_factory=dict)
    outside_from: float = nan  # first judged sample outside the band or the tolerance, s, and its channel
    outside_in: str = ""


@dataclass(frozen=True)
class Cause:
    """A cause of a difference that the data show, see `comparison.verdict.diagnosis`; unknown values are nan.

    ``value`` by kind: "ratio" of the channels, b over a; "offset" and "constant" of b, and one of the
    "turns", in their unit; "shift" by which b is late, s; "friction", "stiffness" and "restitution" b over
    a of the coefficient, of the contact's stiffness and of an impulse; "gravity" the offset of ax, m/s^2.
    """

    kind: Literal[
        "keys", "ratio", "offset", "turns", "constant", "shift",
        "friction", "stiffness", "restitution", "gravity", "contact",
    ]  # fmt: skip
    channels: tuple[str, ...] = ()
    value: float = nan
    uncertainty: float = nan  # of the value, two standard errors
    rest: float = nan  # RMS of the difference without this cause over that with it
    offset: float = 0.0  # beside a ratio, in the channel's unit
    values: tuple[float, float] = (nan, nan)  # the coefficient of each run
    time: float = nan  # start of a contact, s, and where it is
    place: str = ""
    side: str = ""  # "a" or "b", which lacks that contact
    keys: tuple[tuple[str, Any, Any], ...] = ()  # of the scenes, with the values of both


class Doubt(Enum):
    """Reason for which a difference is not confirmed."""

    TOLERANCE = auto()
    RIGID = auto()  # no start can be moved
    SLOW = auto()  # both models are too slow for an ensemble
    NO_STARTS = auto()  # no recorded runs beyond those of the uncertainty
    FEW_RUNS = auto()
    ONE_STATE = auto()  # one state alone was moved
    UNREFINED = auto()  # a run at a finer setting failed
    NO_EFFECT = auto()  # the setting of a solver changes nothing, so its error is not known
    UNMOVED = auto()  # a moved start changes nothing


@dataclass(frozen=True)
class Confirmation:
    """Result of ensembles of runs from moved starts for a verdict "differ"."""

    outcome: str  # "confirmed", "unconfirmed" by a doubt, or "underestimated": the uncertainty was too small
    doubt: Doubt | None = None
    members: tuple[int, int] = (0, 0)  # runs in the ensemble of each model
    shifts: tuple[float, float] = (nan, nan)  # standard deviation of their starts, m
    farther: tuple[int, int] = (0, 0)  # how many of them are as far out as the other model's run
    excess: float = nan  # least distance of a run from the other's ensemble over that of its farthest member
    factor: float = nan  # by which the uncertainty was underestimated
    since: float = nan  # first sample at which the difference exceeded k u, s
    parting: Parting | None = None  # first contact that runs of only one model have

    @property
    def fewest(self) -> int:
        """Runs of the smaller ensemble; 0 without any."""
        return min(filter(None, self.members), default=0)

    @property
    def suspicious(self) -> bool:
        """True if a discontinuous event decides, possibly an intermittent fault of a model."""
        return self.outcome == "underestimated" and self.factor > SUSPICIOUS


@dataclass(frozen=True)
class SceneComparison:
    """Comparison of all channels of one scene at one tier, with the data to interpret and reproduce it."""

    labels: tuple[str, str]
    verdict: str  # "agree", "differ", "indeterminate" or "cannot compare"
    time: Array
    channels: dict[str, ChannelComparison]
    name: str = "compare"
    title: str = "Two tables"
    description: str = ""
    period: float | None = None  # of a crank cycle, s; None if it is neither recorded nor stated
    events: tuple[pd.DataFrame | None, pd.DataFrame | None] = (None, None)
    warnings: tuple[str, ...] = ()
    pulses: tuple[Sequence[Pulse], Sequence[Pulse]] = ((), ())  # contacts of the base runs, for drawings
    provenance: dict[str, dict[str, Any]] = field(default_factory=dict)  # of every run: "exudyn finer", ...
    scene: dict[str, Any] | None = None
    command: str = ""  # that reproduces this comparison
    closer_command: str = ""  # at finer settings, by which it may be decided; of tables, by a tolerance
    run_scene: Scene | None = None  # at the settings of this tier; None for tables
    error: str = ""  # reason for which nothing can be compared: one line, without the scene
    failed_job: Job | None = None  # the run that did not succeed, if that is the reason
    tier: str = "standard"
    refined: int = 0  # levels finer than the scene's settings, see `comparison.verdict.refinement`
    halved: bool = False  # these levels halve steps of five bodies, and do not refine tolerances
    unsettled: bool = False  # indeterminate because refinement still moves the models by their difference
    allowed_shift: float = nan  # time shift that the tolerance allows, s, where it is exceeded
    attribution: Attribution = field(default_factory=Attribution)
    causes: tuple[Cause, ...] = ()  # by the share that they explain
    tight: SceneComparison | None = None  # the same scene at the tight tier
    shift: Shift | None = None  # estimated time shift between the two as they are compared
    reliability: ReliabilityComparison | None = None  # of the slider's motion; independent of all verdicts
    confirmation: Confirmation | None = None  # of a verdict "differ", which it may change
    coverage_error: float = nan  # estimate, by sampling
    window: float = nan  # of u(t), to either side, s
    demand: float | str | None = None  # time until which the two must agree, s, or "any"

    def __repr__(self) -> str:
        """Return name, verdict and times, not the curves."""
        times = f"until={self.until:.3g}, since={self.since:.3g}"
        return f"SceneComparison({self.name!r}, {self.verdict!r}, {times})"

    def report(self, path: str | Path) -> Path:
        """Write the report, one HTML file, and return its path; an `OSError` if it cannot be written."""
        page = import_module("comparison.report.page")  # above this layer, and slow to import
        return Path(page.write_report([self], Path(path), title=self.title, command=self.command))

    @cached_property
    def hash(self) -> str:
        """SHA-256 (hex) of all that a drawing can show of this tier."""
        return hash_of(replace(self, tight=None, reliability=None, failed_job=None))

    @property
    def decisive(self) -> ChannelComparison | None:
        """The channel nearest to its limit, or farthest beyond; None where no sample decides."""
        differs = self.verdict == "differ"
        return decisive(self.with_verdict("differ") if differs else self.channels.values())

    @property
    def worst_channel(self) -> ChannelComparison | None:
        """The channel that decides: the one of least coverage if indeterminate, else `decisive`."""
        same = self.with_verdict(self.verdict)
        if self.verdict == "indeterminate" and same:
            return min(same, key=lambda channel: channel.coverage)
        return self.decisive or next(iter(same), None)

    def with_verdict(self, verdict: str) -> list[ChannelComparison]:
        """Return the channels with a verdict."""
        return [channel for channel in self.channels.values() if channel.verdict == verdict]

    @property
    def excited(self) -> dict[str, ChannelComparison]:
        """The channels in which something happens."""
        return {name: c for name, c in self.channels.items() if c.verdict != "unexcited"}

    @property
    def has_u(self) -> bool:
        """True if there are uncertainties."""
        return any(channel.u is not None for channel in self.channels.values())

    @property
    def coverage(self) -> float:
        """Share of predictable samples (`scene_coverage`); nan where no table carries uncertainties."""
        return scene_coverage(self.channels) if self.has_u else nan

    @property
    def until(self) -> float:
        """Time until which the judged states, else all channels, are predictable, s; nan without u."""
        return nan if (first := self.first_unpredictable) is None else first.until

    @property
    def since(self) -> float:
        """Time from which the two differ, s; nan if they do not, or only by the limits of a gate."""
        return min(
            (c.differs_from for c in self.with_verdict("differ") if not isnan(c.differs_from)), default=nan
        )

    @property
    def first_unpredictable(self) -> ChannelComparison | None:
        """The channel that is first unpredictable, of the judged states, else of all; None without u."""
        channels = [channel for channel in self.excited.values() if not isnan(channel.until)]
        candidates = [channel for channel in channels if channel.judged.sum() >= channel.limits.least_judged]
        states = [channel for channel in candidates if is_state(channel.definition)]
        return min(states or candidates, key=lambda channel: channel.until, default=None)

    @property
    def enough(self) -> bool:
        """True if the two agree until the time demanded.

        That is ``demand``; without one the coverage of a scene, or the end of two tables.
        """
        demand = self.demand
        if demand is None:
            demand = "any" if self.scene is not None or not self.time.size else float(self.time[-1])
        if self.verdict != "agree" or isnan(self.until) or isinstance(demand, str):
            return True
        return self.until >= demand * (1 - 1e-9)  # sums of steps round

    @property
    def exit_code(self) -> int:
        """Exit code of the verdict; that of "indeterminate" where the two agree for less than demanded."""
        return EXIT_CODES[self.verdict if self.enough else "indeterminate"]

    @property
    def tiers(self) -> tuple[SceneComparison, ...]:
        """The comparison itself and that at the tight tier, if there is one."""
        return (self,) if self.tight is None else (self, self.tight)

    @property
    def worst_verdict(self) -> str:
        """The worse of the verdicts at its tiers."""
        return max((tier.verdict for tier in self.tiers), key=rank)

    @property
    def situations(self) -> tuple[Mapping[str, float] | None, Mapping[str, float] | None]:
        """Time shares of the paper's four contact situations in both results."""
        corners = self.scene is None or (
            self.scene["joints"]["slider"] == "clearance" and self.scene["contact"]["law"] != "foundation"
        )
        if not corners or not self.time.size or not {*contact_places(*self.events)} <= {*CONTACTS}:
            return None, None
        span = float(self.time[0]), float(self.time[-1])
        first, second = (None if events is None else time_shares(events, span) for events in self.events)
        return first, second

    @cached_property
    def impacts(self) -> Mapping[str, Impacts] | None:
        """Contacts of b against those of a, see `comparison.metrics.impacts_of`.

        A contact is predictable where its corner's gap is, or x where the tables hold no gaps.
        """
        places = [*CONTACTS, *contact_places(*self.events)]
        gaps = "corner_{}_gap", "{}_gap", "{}.x", "slider_x"
        gap_channels = {place: [self.channels.get(gap.format(place)) for gap in gaps] for place in places}
        deciding = {place: next(filter(None, of_place), None) for place, of_place in gap_channels.items()}
        predictable = {place: c.predictable for place, c in deciding.items() if c and c.u is not None}
        return impacts_of(*self.events, time=self.time, period=self.period, predictable=predictable)


def decisive(channels: Iterable[ChannelComparison]) -> ChannelComparison | None:
    """Return the channel with the largest ratio, of equal ones that with the largest maximum, or None."""
    candidates = [channel for channel in channels if not isnan(channel.ratio)]
    return max(candidates, key=lambda channel: (channel.ratio, channel.largest_ratio), default=None)


def scene_coverage(channels: Mapping[str, ChannelComparison]) -> float:
    """Return a scene's share of predictable samples: the mean over its excited channels; nan without one.

    A channel without a sample to judge counts as zero, however many samples are predictably zero: such as a
    corner that touches only where nothing is predictable.
    """
    shares = [
        0.0
        if isnan(channel.explained) and channel.basis not in (Basis.GATE, Basis.LARGEST)
        else channel.coverage
        for channel in channels.values()
        if channel.verdict != "unexcited"
    ]
    return sum(shares) / len(shares) if shares else nan


def scene_fields(scene: Scene) -> dict[str, Any]:
    """Return the fields of a comparison that its scene determines."""
    names = ["name", "title", "description"]
    if scene.is_linkage:  # judged as two solvers are
        return {name: getattr(scene, name) for name in names}
    return {name: getattr(scene, name) for name in (*names, "period")} | {"scene": scene.data}


def no_comparison(
    scene: Scene, error: str, *, labels: tuple[str, str], command: str, tier: str, job: Job | None = None
) -> SceneComparison:
    """Return the comparison of a scene whose runs cannot be compared: the reason, without channels."""
    return SceneComparison(
        labels,
        "cannot compare",
        np.empty(0),
        {},
        **scene_fields(scene),
        warnings=scene.warnings,
        command=command,
        run_scene=scene,
        error=error,
        failed_job=job,
        tier=tier,
    )


def no_comparison_of_tables(name: str, error: str, labels: tuple[str, str]) -> SceneComparison:
    """Return the comparison of two tables that cannot be compared: the reason, without channels."""
    return SceneComparison(labels, "cannot compare", np.empty(0), {}, name=name, title=name, error=error)


def rank(verdict: str) -> int:
    """Return the severity of a verdict."""
    return _VERDICTS.index(verdict)


def exit_code(codes: Sequence[int], *, allow_indeterminate: bool = False) -> int:
    """Return the worst of several exit codes: 70, 2, 1, 3, 0 in this order; 2 of none."""
    code = next((code for code in _WORST_FIRST if code in codes), 2)  # without any nothing was compared
    return 0 if code == 3 and allow_indeterminate else code
