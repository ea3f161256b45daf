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
_REACH = 0.25  # share of the span that is searched, to either side
_ROUNDS = 20

_EVEN = 0.9  # share of equal steps from which times count as equidistant
_COVERED = 0.05  # least share of the span that the equal steps then cover
_EQUAL = 0.1  # by which equal steps differ, as a share of the usual one: times with few digits
_RATIO = 10.0  # least ratio of a hole to the longest other step, where steps vary

Side = Mapping[str, Array]  # channel -> values, shape (n,)


class Hole(NamedTuple):
    """Interval without rows between two times, s."""

    start: float
    end: float
    missing: int  # rows that are missing, at the table's usual interval; 0 where that is unknown


def holes(time: Array) -> list[Hole]:
    """Find the holes in two or more increasing times; where steps vary, one far longer than the others."""
    steps = np.diff(time)
    interval = float(np.median(steps))
    equal = np.abs(steps - interval) <= _EQUAL * interval
    missing = np.zeros(steps.shape)
    # One step may be a hole, however few there are; but not where most steps are equal because they resolve
    # contacts: between those the solver takes long steps.
    if equal.sum() >= _EVEN * (steps.size - 1) and steps[equal].sum() >= _COVERED * (time[-1] - time[0]):
        missing = np.round(steps / interval) - 1
        starts = np.flatnonzero(missing >= 1)
    else:
        *_, second, longest = np.sort(np.append(steps, [0.0, 0.0]))
        starts = np.flatnonzero((steps == longest) & (steps.size > 2) & (longest >= _RATIO * second))
    return [Hole(float(time[n]), float(time[n + 1]), int(missing[n])) for n in starts]


def isolation(time: Array, values: Array, limit: float) -> Array:
    """Return each sample's distance from its neighbours where it exceeds a limit, else 0; for n >= 4.

    The distance is the smaller one from their line and from the cubic spline through every second sample: a
    line misses a smooth curve by its curvature, and a spline overshoots beside steps of other lengths.
    """
    distance = np.zeros(time.shape)
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = values[:-2] + share * (values[2:] - values[:-2])
    distance[1:-1] = np.abs(values[1:-1] - line)
    for samples, others in ((np.s_[::2], np.s_[1::2]), (np.s_[1::2], np.s_[::2])):
        cubic = CubicSpline(time[others], values[others])(time[samples])
        distance[samples] = np.minimum(distance[samples], np.abs(values[samples] - cubic))
    return np.where(distance > limit, distance, 0.0)


@dataclass(frozen=True)
class Shift:
    """Estimated time shift ``s`` between two tables, ``b(t) = a(t - s)``."""

    value: float = float("nan")  # s; positive: b is later. nan if it cannot be estimated
    uncertainty: float = float("nan")
    """s, half of the 95 % interval; at least the difference of times that is regarded as zero."""
    reason: str = ""  # why it cannot be estimated; else empty

    @property
    def significant(self) -> bool:
        """True where the shift exceeds three times its uncertainty, which is six standard errors."""
        return abs(self.value) > 3.0 * self.uncertainty


def estimate(time: Array, a: Side, b: Side, definitions: Mapping[str, Channel]) -> Shift:
    r"""Estimate the time shift between two results on a common grid.

    Gauss-Newton steps, from the lag at which the difference varies least, minimise

    .. math:: \sum_c w_c \sum_i (b_c(t_i) - a_c(t_i - s) - o_c)^2

    with a free offset :math:`o_c` and, as weight, the inverse variance of each channel's residual. Channels
    are positions, or velocities without these, since forces jump; of other mechanisms all. The uncertainty
    is two standard errors by the delete-one jackknife over blocks of time (Kuensch 1989), whatever the
    correlation of the differences within a block.
    """
    # Late times round coarsely: small shifts would be lost.
    rounding, time = float(np.spacing(np.abs(time).max())), time - time[0]
    group = "motion" if any(definitions[name].group == "motion" for name in a) else "own"
    ranges = {name: (np.ptp(a[name]), np.ptp(b[name])) for name in a if definitions[name].group == group}
    candidates = [name for name, both in ranges.items() if min(both) >= definitions[name].floor]
    # Velocities almost jump at impacts; positions only have kinks.
    names = [name for name in candidates if definitions[name].rate is not None] or candidates
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
        rate = definitions[name].rate or ""
        slopes = a[rate] if rate in a else np.gradient(a[name], time)
        cubics[name] = CubicHermiteSpline(time, a[name], slopes)
    samples = np.linspace(0, time.size - 1, min(time.size, _SAMPLES)).astype(np.intp)
    edges = np.arange(_BLOCKS) * samples.size // _BLOCKS
    floor = np.array([np.spacing(np.abs(a[name]).max()) / scale for name, scale in scales.items()])
    weights = np.ones(len(names))
    interval = _interval(time)

    def sums_of(lag: float) -> Array:
        """Sum 1, r, g, r g, g^2, r^2: residual and rate over scale; shape (channels, 6, blocks)."""
        instants = time[samples] - lag
        inside = (instants >= time[0]) & (instants <= time[-1])
        rows = []
        for name, scale in scales.items():
            r, g = (b[name][samples] - cubics[name](instants)) / scale, cubics[name](instants, 1) / scale
            rows.append([np.ones(instants.size), r, g, r * g, g * g, r * r])
        return np.add.reduceat(np.where(inside, rows, 0.0), edges, axis=2)

    for _ in range(_ROUNDS):
        sums = sums_of(lag)
        totals = sums.sum(axis=2)
        step, errors = _solve(totals, weights)
        lag += step
        weights = 1.0 / np.maximum(errors, floor**2)
        if not np.isfinite(lag) or abs(step) <= 0.1 * SAME_GRID * interval:
            break
    replicates = [_solve(totals - sums[..., block], weights)[0] for block in range(_BLOCKS)]
    spread = float(np.sqrt((_BLOCKS - 1) * np.var(replicates)))
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
    grid = np.linspace(time[0], time[-1], n)
    reach = int(_REACH * n)
    lags = np.arange(-reach, reach + 1)
    cost, total = np.zeros(lags.size), 0.0
    for name, scale in scales.items():
        first, second = (np.interp(grid, time, side[name]) / scale for side in (a, b))
        for place, (delay, advance) in enumerate(zip(np.maximum(lags, 0), np.maximum(-lags, 0), strict=True)):
            cost[place] += np.var(second[delay : n - advance] - first[advance : n - delay])
        total += float(np.var(first) + np.var(second)) / 2
    minima = np.flatnonzero((cost[1:-1] <= cost[:-2]) & (cost[1:-1] <= cost[2:])) + 1
    # Between two lags the cost is lower by an eighth of the curvature at most. Without this margin another
    # period of a motion would seem better if it meets a lag. Unrelated signals keep twice their variance.
    margin = (cost[minima - 1] - 2 * cost[minima] + cost[minima + 1]) / 8
    candidates = minima[cost[minima] <= 2 * cost.min() + margin + 1e-6 * total]
    if not candidates.size or cost[candidates].min() > total:
        return None
    return float(lags[candidates[np.abs(lags[candidates]).argmin()]]) * float(grid[1] - grid[0])


def _solve(sums: Array, weights: Array) -> tuple[float, Array]:
    """Return the step of the lag and the residual variance of each channel, shape (channels,)."""
    n, r, g, rg, gg, rr = sums.T
    n = np.maximum(n, 1)
    rg, gg, rr = rg - r * g / n, gg - g * g / n, rr - r * r / n
    # The residual of a uniform rate is round-off.
    gg = np.where(gg > 1e-12 * sums[:, 4], gg, 0.0)
    curvature = float(weights @ gg)
    step = -float(weights @ rg) / curvature if curvature > 0 else float("nan")
    return step, (rr + 2 * step * rg + step * step * gg) / n


# ---- two tables on one grid


@dataclass(frozen=True)
class Alignment:
    """Channels of both tables on a common grid."""

    time: Array
    a: dict[str, Array]
    b: dict[str, Array]
    interpolated: str  # the interpolated table: ``""``, ``"a"`` or ``"b"``
    unknown: dict[str, BoolArray]
    """Channel -> mask of times where no samples determine its value, if any; plots alone use it there."""
    shift: Shift  # estimated time shift between the tables; not applied


def align(a: Table, b: Table, names: list[str]) -> Alignment:
    """Align two tables that passed `comparison.tables.table.check` for these channels.

    The grid is that of the table with the longer mean interval, within the common span, whose ends may differ
    by `slacks`. The other table is interpolated between its contacts, or those of the first if it has none,
    and continued up to such an end. Whole revolutions between two angles are removed at every sample.
    """
    definitions, tables = a.definitions | b.definitions, {"a": a, "b": b}
    sides = {
        side: {name: unwrap(table.values(name), definitions[name]) for name in names}
        for side, table in tables.items()
    }
    unknown: dict[str, BoolArray] = {}
    slack = SAME_GRID * min(_interval(a.time), _interval(b.time))
    # Late times round coarsely: two programs that count them differently are a few last digits apart.
    slack = max(slack, 4 * float(np.spacing(np.abs(a.time).max())))
    if a.time.size == b.time.size and np.abs(a.time - b.time).max() <= slack:
        time, fine_side = a.time, ""
    else:
        # Of grids with equal intervals the earlier one counts as coarser, in either order of the tables.
        order = {side: (_interval(table.time), (-table.time).tolist()) for side, table in tables.items()}
        fine_side, coarse_side = sorted(order, key=lambda side: order[side])
        finer, coarser = tables[fine_side], tables[coarse_side]
        head, tail = slacks(finer.time, coarser.time)
        inside = (coarser.time >= finer.time[0] - head) & (coarser.time <= finer.time[-1] + tail)
        time = coarser.time[inside]
        if time.size < 2:
            times = " against ".join(spans(*a.time[[0, -1]], *b.time[[0, -1]]))
            raise TableError(f"the tables have {time.size} common times: {times}")
        events = coarser.events if finer.events is None else finer.events
        sides[fine_side], unknown = resample(finer.time, sides[fine_side], time, events, definitions)
        sides[coarse_side] = {name: values[inside] for name, values in sides[coarse_side].items()}
    # The side with more samples tells how often an angle has turned.
    target, guide = ("a", "b") if fine_side == "b" else ("b", "a")
    for name in names:
        if definitions[name].angle:
            sides["b"][name] = _turn(sides["b"][name], sides["a"][name], definitions[name], at=0)
            sides[target][name] = _turn(sides[target][name], sides[guide][name], definitions[name])
    shift = estimate(time, sides["a"], sides["b"], definitions)
    return Alignment(time, sides["a"], sides["b"], fine_side, unknown, shift)


def unwrap_like(table: Table, like: Table) -> Table:
    """Return a table whose angles are continuous and start within half a revolution of another table's."""
    angles = {}
    for name, channel in table.definitions.items():
        if channel.angle and name in table.names and name in like.names:
            columns = [each.frame[name] for each in (table, like)]
            if all(len(c) and c.dtype.kind in "fiu" and np.isfinite(c).all() for c in columns):
                values = unwrap(table.values(name), channel)
                angles[name] = _turn(values, like.values(name), channel, at=0)
    return replace(table, frame=table.frame.assign(**angles))


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


def unwrap(values: Array, channel: Channel) -> Array:
    """Unwrap an angle, unless it has no jumps or most of its steps exceed half a revolution."""
    steps = np.abs(np.diff(values))
    if not channel.angle or steps.max(initial=0.0) <= channel.turn / 2 or np.median(steps) > channel.turn / 2:
        return values
    return np.unwrap(values, period=channel.turn)


def _turn(values: Array, towards: Array, channel: Channel, at: int | slice = slice(None)) -> Array:
    """Bring an angle close to another by whole revolutions, at one sample or at every one."""
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
    definitions: Mapping[str, Channel],
) -> tuple[dict[str, Array], dict[str, BoolArray]]:
    """Interpolate channels at other times; return them, and masks of times that no two samples determine.

    Positions whose velocity is among the channels use the cubic of both (error of order h^4), all others
    lines (h^2). Forces and accelerations jump at the start and end of a contact: each interval between two
    such instants, which belong to the following one, is interpolated by itself, with lines to its ends.
    """
    samples, unknown = {}, {}
    for name, values in columns.items():
        rate = definitions[name].rate
        if rate is not None and rate in columns:
            samples[name], _ = hermite(time, values, columns[rate], at)
            continue
        edges = np.empty(0)
        if events is not None:
            jumps = events["corner"].isin(_jumps_with(definitions[name], {*events["corner"]}))
            edges = np.unique(events.loc[jumps, ["start", "end"]].to_numpy(np.float64))
        edges = edges[(edges > time[0]) & (edges <= time[-1])]
        first, undetermined = _brackets(time, at, edges)
        step = (values[first + 1] - values[first]) / (time[first + 1] - time[first])
        line = values[first] + step * (at - time[first])
        samples[name] = np.where(at == time[-1], values[-1], line)
        if undetermined.any():
            unknown[name] = undetermined
    return samples, unknown


def _jumps_with(channel: Channel, places: set[str]) -> set[str]:
    """Return those contacts of a run at whose events a channel jumps."""
    if channel.group in {"corners", "contacts"}:
        name = channel.name.removeprefix("corner_")
        ends = [f"{joint}{force}" for joint in "_." for force in ("normal", "friction")]
        return {place for place in places if name in {f"{place}{end}" for end in ends}}
    return places if channel.group in {"accelerations", "joints"} else set()


def _brackets(time: Array, at: Array, edges: Array) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the first of the two samples that determine each instant, and a mask of instants without any."""
    intervals, targets = (np.searchsorted(edges, instants, side="right") for instants in (time, at))
    last = time.size - 2
    places = np.clip(np.searchsorted(time, at, side="right") - 1, 0, last)
    first = np.full(at.shape, -1, dtype=np.intp)
    for offset in (0, -1, 1):  # the samples around, else the two before, else the two after
        pair = np.clip(places + offset, 0, last)
        fits = (first < 0) & (intervals[pair] == targets) & (intervals[pair + 1] == targets)
        first[fits] = pair[fits]
    outside: BoolArray = (first < 0) & (time[places] != at) & (at != time[-1])
    # At a sample the value is known regardless of its neighbours.
    first = np.where((time[places] == at) | (first < 0), places, first)
    return first, outside
