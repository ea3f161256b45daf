"""Times of tables: missing rows, the time shift between two tables, and both on one grid.

That grid is the coarser table's; the channels of the finer one are interpolated to it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from comparison.formatting import spans
from comparison.tables.channels import Array, BoolArray, Channel
from comparison.tables.table import SAME_GRID, Table, TableError, slacks

# ---- missing rows, and the shift between two tables, reported, never applied

_BLOCKS = 20
_SAMPLES = 40_000  # largest number of samples of the two tables that count
_COARSE = 4096  # points of the search over all lags
_REACH = 0.25  # searched share of the span, to either side
_ROUNDS = 20

_EVEN = 0.9  # share of equal steps from which times count as equidistant
_COVERED = 0.05  # share of the span that they then cover at least
_EQUAL = 0.1  # by which equal steps differ, as a share of the usual one: times with few digits
_RATIO = 10.0  # least ratio of a hole to the longest other step, where steps vary

Side = Mapping[str, Array]  # channel -> values, shape (n,)


class Hole(NamedTuple):
    """Interval without rows between two times, s."""

    start: float
    end: float
    missing: int  # rows that are missing, at the table's usual interval; 0 where that is unknown


def holes(time: Array) -> list[Hole]:
    """Find the holes in increasing times, two at least; where steps vary, one far longer than others."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    equal = np.abs(steps - usual) <= _EQUAL * usual
    missing = np.zeros(steps.shape)
    # One step may be a hole, however few there are. Not where most steps are equal because they resolve
    # contacts, between which the solver takes long ones.
    if equal.sum() >= _EVEN * (steps.size - 1) and steps[equal].sum() >= _COVERED * (time[-1] - time[0]):
        missing = np.round(steps / usual) - 1
        long = np.flatnonzero(missing >= 1)
    else:
        *_, second, longest = np.sort(np.append(steps, [0.0, 0.0]))
        long = np.flatnonzero((steps == longest) & (steps.size > 2) & (longest >= _RATIO * second))
    return [Hole(float(time[n]), float(time[n + 1]), int(missing[n])) for n in long]


def isolated(time: Array, values: Array, allowed: float) -> Array:
    """Return each sample's distance from its neighbours where it exceeds a limit, else 0; of four at least.

    That is from their line or the cubic spline through every second sample, whichever is nearer: from a line
    a smooth curve is off by its curvature, and a spline overshoots beside steps of other lengths.
    """
    distance = np.zeros(time.shape)
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = values[:-2] + share * (values[2:] - values[:-2])
    distance[1:-1] = np.abs(values[1:-1] - line)
    for own, others in ((np.s_[::2], np.s_[1::2]), (np.s_[1::2], np.s_[::2])):
        cubic = CubicSpline(time[others], values[others])(time[own])
        distance[own] = np.minimum(distance[own], np.abs(values[own] - cubic))
    return np.where(distance > allowed, distance, 0.0)


@dataclass(frozen=True)
class Shift:
    """Estimated time shift ``s`` between two tables, ``b(t) = a(t - s)``."""

    value: float = float("nan")  # s; positive: b is later. nan if it cannot be estimated
    uncertainty: float = float("nan")
    """s, half of the 95 % interval; at least the difference of times that is regarded as zero."""
    reason: str = ""  # why it cannot be estimated; else empty

    @property
    def significant(self) -> bool:
        """Whether the shift exceeds three times its uncertainty, which is six standard errors."""
        return abs(self.value) > 3.0 * self.uncertainty


def estimate(time: Array, a: Side, b: Side, known: Mapping[str, Channel]) -> Shift:
    r"""Estimate the time shift between two results on a common grid.

    From the lag with the least variance of the difference Gauss-Newton steps minimise

    .. math:: \sum_c w_c \sum_i (b_c(t_i) - a_c(t_i - s) - o_c)^2

    with a free offset :math:`o_c` and, as weight, the inverse variance of the residual of each channel. These
    are positions (velocities where there are none), since forces jump; of other mechanisms all channels. The
    uncertainty is two standard errors by the delete-one jackknife over blocks of time (Kuensch 1989),
    whatever the correlation of the differences within a block.
    """
    # Next to late times, of coarse rounding, small shifts would be lost.
    rounding, time = float(np.spacing(np.abs(time).max())), time - time[0]
    group = "motion" if any(known[name].group == "motion" for name in a) else "own"
    ranges = {name: (np.ptp(a[name]), np.ptp(b[name])) for name in a if known[name].group == group}
    moving = [name for name, both in ranges.items() if min(both) >= known[name].floor]
    # Velocities almost jump at impacts; positions only have kinks.
    names = [name for name in moving if known[name].rate is not None] or moving
    if not names:
        return Shift(reason="no channel of motion is excited in both")
    if time.size < 2 * _BLOCKS:
        return Shift(reason=f"{time.size} common samples; required: at least {2 * _BLOCKS}")
    scales = {name: float(max(ranges[name])) for name in names}
    lag = _search(time, a, b, scales)
    if lag is None:
        return Shift(reason="the two are not correlated closely enough at any lag")
    cubics = {}
    for name in scales:
        rate = known[name].rate or ""
        slopes = a[rate] if rate in a else np.gradient(a[name], time)
        cubics[name] = CubicHermiteSpline(time, a[name], slopes)
    used = np.linspace(0, time.size - 1, min(time.size, _SAMPLES)).astype(np.intp)
    edges = np.arange(_BLOCKS) * used.size // _BLOCKS
    floor = np.array([np.spacing(np.abs(a[name]).max()) / scale for name, scale in scales.items()])
    weights = np.ones(len(names))
    interval = _interval(time)

    def sums_of(lag: float) -> Array:
        """Sum 1, r, g, r g, g^2, r^2: residual and rate over scale; shape (channels, 6, blocks)."""
        at = time[used] - lag
        inside = (at >= time[0]) & (at <= time[-1])
        rows = []
        for name, scale in scales.items():
            r, g = (b[name][used] - cubics[name](at)) / scale, cubics[name](at, 1) / scale
            rows.append([np.ones(at.size), r, g, r * g, g * g, r * r])
        return np.add.reduceat(np.where(inside, rows, 0.0), edges, axis=2)

    for _ in range(_ROUNDS):
        sums = sums_of(lag)
        whole = sums.sum(axis=2)
        step, errors = _solve(whole, weights)
        lag += step
        weights = 1.0 / np.maximum(errors, floor**2)
        if not np.isfinite(lag) or abs(step) <= 0.1 * SAME_GRID * interval:
            break
    without_block = [_solve(whole - sums[..., block], weights)[0] for block in range(_BLOCKS)]
    spread = float(np.sqrt((_BLOCKS - 1) * np.var(without_block)))
    uncertainty = max(2 * spread, abs(step), SAME_GRID * interval, rounding)
    if not np.isfinite(lag) or not uncertainty < 0.05 * np.ptp(time):
        return Shift(reason="the motion is too uniform, or the difference too irregular")
    return Shift(float(lag), uncertainty)


def hermite(time: Array, values: Array, slopes: Array, at: Array) -> tuple[Array, Array]:
    """Return the piecewise cubic with these values and slopes at its nodes, and its derivative."""
    cubic = CubicHermiteSpline(time, values, slopes)
    return np.where(at == time[-1], values[-1], cubic(at)), cubic(at, 1)


def _search(time: Array, a: Side, b: Side, scales: Mapping[str, float]) -> float | None:
    """Return the lag (s) nearest to zero of those at which the difference varies least; None without one."""
    n = min(_COARSE, time.size)
    even = np.linspace(time[0], time[-1], n)
    reach = int(_REACH * n)
    lags = np.arange(-reach, reach + 1)
    cost, total = np.zeros(lags.size), 0.0
    for name, scale in scales.items():
        first, second = (np.interp(even, time, side[name]) / scale for side in (a, b))
        for place, (late, early) in enumerate(zip(np.maximum(lags, 0), np.maximum(-lags, 0), strict=True)):
            cost[place] += np.var(second[late : n - early] - first[early : n - late])
        total += float(np.var(first) + np.var(second)) / 2
    inner = np.flatnonzero((cost[1:-1] <= cost[:-2]) & (cost[1:-1] <= cost[2:])) + 1
    # A lag between two steps leaves an eighth of the curvature at most: without it another period of a
    # motion, one that meets a step, would seem better. Unrelated signals keep twice their variance.
    between = (cost[inner - 1] - 2 * cost[inner] + cost[inner + 1]) / 8
    good = inner[cost[inner] <= 2 * cost.min() + between + 1e-6 * total]
    if not good.size or cost[good].min() > total:
        return None
    return float(lags[good[np.abs(lags[good]).argmin()]]) * float(even[1] - even[0])


def _solve(sums: Array, weights: Array) -> tuple[float, Array]:
    """Return the step of the lag and the residual variance of each channel, shape (channels,)."""
    n, r, g, rg, gg, rr = sums.T
    n = np.maximum(n, 1)
    rg, gg, rr = rg - r * g / n, gg - g * g / n, rr - r * r / n
    # The residual of a uniform rate is round-off.
    gg = np.where(gg > 1e-12 * sums[:, 4], gg, 0.0)
    whole = float(weights @ gg)
    step = -float(weights @ rg) / whole if whole > 0 else float("nan")
    return step, (rr + 2 * step * rg + step * step * gg) / n


# ---- two tables on one grid


@dataclass(frozen=True)
class Aligned:
    """Channels of both tables on a common grid."""

    time: Array
    a: dict[str, Array]
    b: dict[str, Array]
    interpolated: str  # the interpolated table: ``""``, ``"a"`` or ``"b"``
    unknown: dict[str, BoolArray]
    """Channel -> where no samples determine its value, if anywhere; that serves plotting only."""
    shift: Shift  # estimated time shift between the tables; not applied


def align(a: Table, b: Table, names: list[str]) -> Aligned:
    """Align two tables that passed `comparison.tables.table.check` for these channels.

    Of two grids that of the table with the longer mean interval counts, within the common span, whose ends
    may be apart by `slacks`; the other one is interpolated between its own contacts, or the other table's if
    it has none, and continued up to such an end. Whole revolutions between two angles are removed at every
    sample.
    """
    known, tables = a.known | b.known, {"a": a, "b": b}
    sides = {
        side: {name: continuous(table.values(name), known[name]) for name in names}
        for side, table in tables.items()
    }
    unknown: dict[str, BoolArray] = {}
    slack = SAME_GRID * min(_interval(a.time), _interval(b.time))
    # Late times round coarsely: two programs that count them differently are a few last digits apart.
    slack = max(slack, 4 * float(np.spacing(np.abs(a.time).max())))
    if a.time.size == b.time.size and np.abs(a.time - b.time).max() <= slack:
        time, fine = a.time, ""
    else:
        # Of equal intervals the grid that starts earlier is the coarser one, whichever table is the first.
        order = {side: (_interval(table.time), (-table.time).tolist()) for side, table in tables.items()}
        fine, coarse = sorted(order, key=lambda side: order[side])
        finer, coarser = tables[fine], tables[coarse]
        early, late = slacks(finer.time, coarser.time)
        inside = (coarser.time >= finer.time[0] - early) & (coarser.time <= finer.time[-1] + late)
        time = coarser.time[inside]
        if time.size < 2:
            both = " against ".join(spans(*a.time[[0, -1]], *b.time[[0, -1]]))
            raise TableError(f"the tables have {time.size} common times: {both}")
        events = coarser.events if finer.events is None else finer.events
        sides[fine], unknown = resample(finer.time, sides[fine], time, events, known)
        sides[coarse] = {name: own[inside] for name, own in sides[coarse].items()}
    # The side with more samples tells how often an angle has turned.
    turned, guide = ("a", "b") if fine == "b" else ("b", "a")
    for name in names:
        if known[name].angle:
            sides["b"][name] = _turned(sides["b"][name], sides["a"][name], known[name], at=0)
            sides[turned][name] = _turned(sides[turned][name], sides[guide][name], known[name])
    shift = estimate(time, sides["a"], sides["b"], known)
    return Aligned(time, sides["a"], sides["b"], fine, unknown, shift)


def unwound(table: Table, like: Table) -> Table:
    """Return a table whose angles are continuous and start within half a revolution of another table's."""
    changed = {}
    for name, channel in table.known.items():
        if channel.angle and name in table.names and name in like.names:
            columns = [each.frame[name] for each in (table, like)]
            if all(len(c) and c.dtype.kind in "fiu" and np.isfinite(c).all() for c in columns):
                values = continuous(table.values(name), channel)
                changed[name] = _turned(values, like.values(name), channel, at=0)
    return replace(table, frame=table.frame.assign(**changed))


def cut(table: Table, start: float, end: float) -> Table:
    """Return the rows of a span of time (s), and the contacts that reach into it with their pulses."""
    frame = table.frame[(table.time >= start) & (table.time <= end)].reset_index(drop=True)
    events, pulses = table.events, table.pulses
    if events is not None:
        inside = ((events["end"] >= start) & (events["start"] <= end)).to_numpy()
        events = events[inside].reset_index(drop=True)
        if pulses is not None:
            pulses = {name: values[inside[pulses["row"]]] for name, values in pulses.items()}
            pulses["row"] = (np.cumsum(inside) - 1)[pulses["row"]]
    return replace(table, frame=frame, events=events, pulses=pulses)


def continuous(values: Array, channel: Channel) -> Array:
    """Unwrap an angle; one without jumps, or that always turns so far in a step, is returned unchanged."""
    steps = np.abs(np.diff(values))
    if not channel.angle or steps.max(initial=0.0) <= channel.turn / 2 or np.median(steps) > channel.turn / 2:
        return values
    return np.unwrap(values, period=channel.turn)


def _turned(values: Array, towards: Array, channel: Channel, at: int | slice = slice(None)) -> Array:
    """Return an angle brought close to another by whole revolutions, at one sample or at every one."""
    revolutions = np.round((towards[at] - values[at]) / channel.turn)
    return values + channel.turn * revolutions if np.any(revolutions) else values


def _interval(time: Array) -> float:
    """Return the mean sample interval, s."""
    return float(time[-1] - time[0]) / (time.size - 1)


def resample(
    time: Array,
    columns: dict[str, Array],
    at: Array,
    events: pd.DataFrame | None,
    known: Mapping[str, Channel],
) -> tuple[dict[str, Array], dict[str, BoolArray]]:
    """Interpolate channels at other times; return them, and where no two samples determine them.

    Positions whose velocity is among the channels use the cubic of both (error of order h^4), all others
    lines (h^2). Forces and accelerations jump at the start and end of a contact: each interval between two
    such instants, which belong to the following one, is interpolated by itself, with lines to its ends.
    """
    sampled, unknown = {}, {}
    for name, values in columns.items():
        rate = known[name].rate
        if rate is not None and rate in columns:
            sampled[name], _ = hermite(time, values, columns[rate], at)
            continue
        edges = np.empty(0)
        if events is not None:
            own = events["corner"].isin(_jumps_with(known[name], {*events["corner"]}))
            edges = np.unique(events.loc[own, ["start", "end"]].to_numpy(np.float64))
        edges = edges[(edges > time[0]) & (edges <= time[-1])]
        first, undetermined = _determining(time, at, edges)
        step = (values[first + 1] - values[first]) / (time[first + 1] - time[first])
        line = values[first] + step * (at - time[first])
        sampled[name] = np.where(at == time[-1], values[-1], line)
        if undetermined.any():
            unknown[name] = undetermined
    return sampled, unknown


def _jumps_with(channel: Channel, places: set[str]) -> set[str]:
    """Return the contacts, of those in a run, at whose events a channel jumps."""
    if channel.group in {"corners", "contacts"}:
        name = channel.name.removeprefix("corner_")
        ends = [f"{joint}{force}" for joint in "_." for force in ("normal", "friction")]
        return {place for place in places if name in {f"{place}{end}" for end in ends}}
    return places if channel.group in {"accelerations", "joints"} else set()


def _determining(time: Array, at: Array, edges: Array) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the first of the two samples that determine each instant, and where there are none."""
    own, wanted = (np.searchsorted(edges, instants, side="right") for instants in (time, at))
    last = time.size - 2
    here = np.clip(np.searchsorted(time, at, side="right") - 1, 0, last)
    first = np.full(at.shape, -1, dtype=np.intp)
    for offset in (0, -1, 1):  # the samples around, else the two before, else the two after
        pair = np.clip(here + offset, 0, last)
        fits = (first < 0) & (own[pair] == wanted) & (own[pair + 1] == wanted)
        first[fits] = pair[fits]
    outside: BoolArray = (first < 0) & (time[here] != at) & (at != time[-1])
    # At a sample the value is known regardless of its neighbours.
    first = np.where((time[here] == at) | (first < 0), here, first)
    return first, outside
