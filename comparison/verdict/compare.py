"""Comparison of two models' runs of a scene, or of any two tables, channel by channel.

Coverage and RMS depend on where the samples are: most contacts are shorter than the distance of two. Their
errors are estimated as those of a quadrature of first order, from the same runs judged on every second and
every fourth sample: three times the larger change, where that on every fourth counts half (two grids after
Roache).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any

import numpy as np

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import FIRST, SAFETY_FACTOR, WINDOW, Runs, model_uncertainty
from comparison.execution.run import contact_warnings
from comparison.formatting import holes_line, instant, spans
from comparison.metrics import pulses_of
from comparison.scene import Scene, SceneError, scene_from_mapping
from comparison.tables.align import Alignment, align, cut, holes, isolation, unwrap
from comparison.tables.channels import Array, expected
from comparison.tables.table import Table, TableError, check, slacks
from comparison.verdict.channel import NO_CRITERIA, Criteria, Samples, apply_gate, compare_channel, extrema_of
from comparison.verdict.diagnosis import attribute, diagnose, differing_keys
from comparison.verdict.results import Basis, ChannelComparison, SceneComparison, scene_coverage, scene_fields
from comparison.verdict.until import is_state, pace

_BESIDES = ("crank", "own")  # groups of channels that no scene asks for
_FEW = 16  # samples; below it every fourth one shows nothing


def compare(
    a: Runs,
    b: Runs,
    *,
    scene: Scene | None = None,
    criteria: Criteria = NO_CRITERIA,
    labels: tuple[str, str] = ("a", "b"),
    warnings: tuple[str, ...] = (),
    tier: str = "standard",
    ensembles: tuple[Sequence[Table], Sequence[Table]] = ((), ()),
    before: SceneComparison | None = None,
) -> SceneComparison:
    """Compare two models' runs of a scene, or any two tables.

    Parameters
    ----------
    a, b
        Judged by their numerical uncertainty if each has a finer run, else by the criteria.
    scene
        Determines the required channels, time span and scales. Without it both must hold the same channels
        over the same time, and scales are ranges.
    criteria
        Their ``channels`` are among those that the scene requests; ``common_time`` is only for runs without
        uncertainties.
    tier
        One of `comparison.accuracy.levels.TIERS`, whose thresholds apply.
    ensembles
        Additional runs of each model at its base's setting and times, see `comparison.verdict.confirmation`.
    before
        Comparison of runs a level before, at the same times: a difference counts where both show it.

    Raises
    ------
    TableError
        If the tables cannot be compared: a channel missing or unexpected, a number that is not finite, time
        that does not increase, a truncated run.
    """
    names = _names(a.base, b.base, scene, criteria.channels)
    a, b, aligned, notes = _align_runs(a, b, labels, names, scene, criteria.common_time)
    warnings += notes
    sides = (labels[0], a), (labels[1], b)
    limits = thresholds(tier)
    period = criteria.period if scene is None else scene.period
    definitions = a.base.definitions | b.base.definitions
    channels = [name for name in names if criteria.channels is None or name in criteria.channels]
    cycle = nan if period is None else period
    if period is None and a.finer is not None:
        candidates = [n for n in channels if np.ptp([aligned.a[n], aligned.b[n]]) >= definitions[n].floor]
        states = [name for name in candidates if is_state(definitions[name])] or candidates or channels
        cycle = pace(aligned.time, [side[name] for name in states for side in (aligned.a, aligned.b)])
    if other := [name for name in criteria.tolerances if name not in channels]:
        raise TableError(f"tolerances: {other[0]!r} is not among the compared channels")

    def judge(stride: int) -> dict[str, ChannelComparison]:
        learnt = FIRST if scene is None else None
        results: dict[str, ChannelComparison] = {}
        for channel in map(definitions.__getitem__, channels):  # positions come before what follows from them
            unknown, position = aligned.unknown.get(channel.name), results.get(channel.follows or "")
            masks = [] if unknown is None else [~unknown[::stride]]
            masks += [] if position is None else [position.predictable]
            position_u = (None, None) if position is None else (position.u_a, position.u_b)
            uncertainties = (
                model_uncertainty(runs, channel.name, cycle, ensemble, stride, learnt, gap_u=of_position)
                for runs, ensemble, of_position in zip((a, b), ensembles, position_u, strict=True)
            )
            results[channel.name] = compare_channel(
                channel,
                Samples(
                    aligned.time[::stride],
                    aligned.a[channel.name][::stride],
                    aligned.b[channel.name][::stride],
                    *uncertainties,
                ),
                scene=None if scene is None else scene.data,
                within=np.logical_and.reduce(masks) if masks else None,
                before=None if before is None else before.channels[channel.name].outlying[::stride],
                criteria=criteria,
                limits=limits,
                window=WINDOW * cycle,
                learnt=learnt,
            )
        return results

    grids = [judge(stride) for stride in (1, 2, 4)] if aligned.time.size >= _FEW else [judge(1)]
    results = {
        name: replace(
            channel,
            coverage_error=_sampling_error([grid[name].coverage for grid in grids]),
            rms_error=_sampling_error([grid[name].rms_difference for grid in grids]),
            extrema=extrema_of(channel, (a.base, b.base)),
        )
        for name, channel in grids[0].items()
    }
    if criteria.gate:
        results = {name: apply_gate(channel, criteria.gate) for name, channel in results.items()}
    warnings += _interpolation_warnings(dict(zip("ab", sides, strict=True)), aligned, results)
    uncertain = any(channel.u is not None for channel in results.values())
    verdict = scene_verdict(results, None if scene is None and uncertain else limits.coverage)
    allowed_shift = nan
    if verdict != "differ":
        allowed_shift = _exceeded_shift(results, aligned, criteria.time_tolerance)
        verdict = verdict if isnan(allowed_shift) else "differ"
    attribution = attribute((a, b), results, verdict=verdict, labels=labels, scene=scene)
    return SceneComparison(
        labels,
        verdict,
        aligned.time,
        results,
        **({"period": period} if scene is None else scene_fields(scene)),
        warnings=(() if scene is None else scene.warnings) + warnings,
        events=(a.base.events, b.base.events),
        pulses=(pulses_of(a.base), pulses_of(b.base)),
        provenance={
            _run_name(label, kind): table.provenance
            for label, runs in sides
            for kind, table in runs.tables.items()
        },
        tier=tier,
        shift=aligned.shift,
        allowed_shift=allowed_shift,
        window=WINDOW * cycle,
        demand=criteria.until,
        coverage_error=_sampling_error([scene_coverage(grid) for grid in grids]) if uncertain else nan,
        attribution=attribution,
        causes=diagnose(
            results,
            (a.base, b.base),
            shift=aligned.shift,
            period=period,
            outside_from=attribution.outside_from,
            agree=verdict == "agree",
        ),
    )


def _align_runs(
    a: Runs, b: Runs, labels: tuple[str, str], names: list[str], scene: Scene | None, common_time: bool
) -> tuple[Runs, Runs, Alignment, tuple[str, ...]]:
    """Return the runs within the compared times, their aligned samples, and warnings; errors as `compare`."""
    sides = (labels[0], a), (labels[1], b)
    span = None if scene is None or common_time else (0.0, scene.duration)
    for label, runs in sides:
        for kind, table in runs.tables.items():
            check(table, names, span, name=_run_name(label, kind))
    if common_time and a.finer is not None:
        raise TableError("further runs require equal times: a common time does not apply to them")
    _check_grids(sides)
    if not common_time:
        alone = a.finer is None and b.finer is None
        remedy = "--common-time compares where both have rows" if alone else "write both over the same time"
        _check_ends(labels, a.base.time, b.base.time, remedy)
    aligned = align(a.base, b.base, names)
    warnings: list[str] = []
    if common_time:
        first, second, warnings = _cut_to_common(a.base, b.base, aligned.time)
        a, b = replace(a, base=first), replace(b, base=second)
    warnings += _check_rows(labels, (a.base.time, b.base.time))
    for label, runs in zip(labels, (a, b), strict=True):
        warnings += [f"{label}: {line}" for line in contact_warnings(runs.base)]
    if aligned.interpolated and a.finer is not None and b.finer is not None:
        raise TableError(
            f"{labels[0]} and {labels[1]}: with uncertainties both must have the same times, to a billionth "
            "of the interval: write both with one output step and 15 digits; or compare one table of each by "
            "sixbar compare --tolerance, which interpolates"
        )
    return a, b, aligned, tuple(warnings)


def scene_verdict(results: Mapping[str, ChannelComparison], floor: float | None) -> str:
    """Return the verdict of a scene: "differ" if a channel does; else its coverage must reach the floor.

    Tables have no floor, as nobody states how much must be predictable: half of the states must agree. A
    scene without an excited channel is indeterminate: nothing was compared. So is one with a channel without
    any limit: it may be off by any amount.
    """
    verdicts = {result.verdict for result in results.values()}
    if "differ" in verdicts:
        return "differ"
    if any(result.basis is Basis.NO_LIMIT for result in results.values()):
        return "indeterminate"
    if floor is None:
        excited = [result for result in results.values() if result.verdict != "unexcited"]
        candidates = [result for result in excited if is_state(result.definition)] or excited
        agreeing = sum(result.verdict == "agree" for result in candidates)
        return "agree" if agreeing and 2 * agreeing >= len(candidates) else "indeterminate"
    return "agree" if "agree" in verdicts and scene_coverage(results) >= floor else "indeterminate"


def recorded_scene(a: Table, b: Table) -> tuple[Scene | None, tuple[str, ...]]:
    """Find the scene that both tables record, with warnings; settings of solvers and output may differ.

    Of two different scenes it is the first, or None where channels or times differ. Without a record: None.
    """
    record_a, record_b = (table.provenance.get("scene") for table in (a, b))
    if not isinstance(record_a, dict) or not isinstance(record_b, dict) or "body" in record_a:
        return None, ()
    warnings: tuple[str, ...] = ()
    if sections := list(dict.fromkeys(key.partition(".")[0] for key, *_ in differing_keys(a, b))):
        fault = f"the tables are of different scenes ({', '.join(sections)})"
        if a.scene is None or b.scene is None or {"drive", "joints"} & {*sections}:
            return None, (f"{fault}: the scales are ranges",)
        warnings = (f"{fault}: scales and drawing are of the first",)
    solvers: dict[str, Any] = {}  # of the model that wrote each table
    for table, record in ((a, record_a), (b, record_b)):
        model = table.provenance.get("model")
        if isinstance(model, str) and model in record.get("solver", {}):
            solvers[model] = record["solver"][model]
    # Scales and channels do not depend on settings, and the model of a table need not be installed here.
    for solver in (solvers, {}):
        try:
            return scene_from_mapping(record_a | {"solver": solver}), warnings
        except SceneError as error:
            reason = error
    return None, (f"the scene recorded beside the tables is not used: {reason}",)


def _sampling_error(values: Sequence[float]) -> float:
    """Estimate the error of a number from its values on all, every second and every fourth sample."""
    if len(values) < 3:
        return nan
    fine, half, quarter = values
    return SAFETY_FACTOR * float(np.maximum(abs(half - fine), abs(quarter - fine) / 2))


def _run_name(label: str, kind: str) -> str:
    """Return the name of a model's run in messages."""
    return label if kind == "base" else f"{label} {kind.replace('_', ' ')}"


def _names(a: Table, b: Table, scene: Scene | None, selection: Sequence[str] | None) -> list[str]:
    """Return the channels that both must have: the scene's, or else all of either."""
    definitions, columns = a.definitions | b.definitions, {*a.names, *b.names}
    names = [name for name in definitions if name in columns or name in (selection or ())]
    if scene is not None:
        # Besides what every run of the scene holds there may be channels that no model writes.
        extras = [name for name in names if definitions[name].group in _BESIDES and name in columns]
        names = [*expected(scene.data), *extras]
    if other := [name for name in selection or () if name not in names]:
        where = "the tables have no common" if scene is None else f"scene {scene.name!r}: has no"
        raise TableError(f"{where} channel {other[0]} to compare")
    if selection is None:
        return names
    # Positions are interpolated by their rates, where both have them.
    rates = {definitions[name].rate for name in selection} & {*a.names} & {*b.names}
    return [name for name in names if name in selection or name in rates]


def _cut_to_common(a: Table, b: Table, time: Array) -> tuple[Table, Table, list[str]]:
    """Return the rows within the compared times, and a warning where a table has others."""
    ends = time[[0, -1]]
    head, tail = slacks(a.time, b.time)
    if all(abs(t.time[0] - ends[0]) <= head and abs(t.time[-1] - ends[1]) <= tail for t in (a, b)):
        return a, b, []
    start, end = instant(ends[0], ends[1]), instant(ends[1], ends[0])
    note = f"compared from {start} to {end} s: only there both tables have rows"
    return cut(a, ends[0] - head, ends[1] + tail), cut(b, ends[0] - head, ends[1] + tail), [note]


def _check_grids(sides: Sequence[tuple[str, Runs]]) -> None:
    """Reject runs of one model on different grids."""
    for label, runs in sides:
        for kind, table in runs.tables.items():
            if not np.array_equal(table.time, runs.base.time):
                raise TableError(f"{_run_name(label, kind)}: its times differ from those of {label}")


def _check_ends(labels: tuple[str, str], a: Array, b: Array, remedy: str) -> None:
    """Reject tables of which one has rows before or after those of the other."""
    head, tail = slacks(a, b)
    if abs(a[0] - b[0]) > head or abs(a[-1] - b[-1]) > tail:
        span_a, span_b = spans(*a[[0, -1]], *b[[0, -1]])
        raise TableError(
            f"{labels[0]} spans {span_a} and {labels[1]} {span_b}: one of them is truncated, or has another "
            f"unit or zero of time; {remedy}"
        )


def _check_rows(labels: tuple[str, str], times: tuple[Array, Array]) -> list[str]:
    """Reject two tables if one has a hole, or two rows of an event, that the other lacks.

    One missing row, or a hole in both tables, gives a warning.
    """
    shared, warnings = np.array_equal(*times), []
    for label, time in list(zip(labels, times, strict=True))[: 1 if shared else 2]:
        if not (gaps := holes(time)):
            continue
        message = holes_line("both tables have" if shared else f"{label} has", gaps)
        if not shared and sum(hole.missing for hole in gaps) != 1:
            raise TableError(message)
        warnings.append(message)
    events = [time[:-1][np.diff(time) <= 2 * np.spacing(np.abs(time).max())] for time in times]
    count = max(row.size for row in events)
    pairs = np.array([np.pad(row, (0, count - row.size), constant_values=np.inf) for row in events])
    reach = 0.5 * min(float(np.median(np.diff(time))) for time in times)
    for n in np.flatnonzero(~(np.ptp(pairs, axis=0) <= reach))[:1]:
        side = int(pairs[0, n] > pairs[1, n])
        raise TableError(
            f"{labels[side]} has two rows at {instant(pairs[side, n])} s, an event, and "
            f"{labels[1 - side]} has not: compare one row of each time (--at-events left or right)"
        )
    return warnings


def _interpolation_warnings(
    sides: Mapping[str, tuple[str, Runs]],
    aligned: Alignment,
    results: Mapping[str, ChannelComparison],
) -> tuple[str, ...]:
    """Return warnings of what the interpolation omits, such as peaks between the compared times."""
    if not aligned.interpolated:
        return ()
    label, runs = sides[aligned.interpolated]
    warnings: tuple[str, ...] = (
        f"{label} was interpolated to the times of the other: events shorter than a sample are not resolved",
    )
    if aligned.unknown:
        count = sum(int(part.sum()) for part in aligned.unknown.values())
        warnings += (
            f"{count} samples of {len(aligned.unknown)} channels are not judged: a contact starts or ends "
            "between them and the nearest samples of the interpolated table",
        )
    time, peaks = runs.base.time, []
    if time.size < 4:
        return warnings
    mask = ~np.isin(time, aligned.time)
    for name, result in results.items():
        if result.tolerance is None:
            continue
        values = unwrap(runs.base.values(name), result.definition)
        excess = mask * isolation(time, values, result.tolerance)
        n = int(excess.argmax())
        if excess[n]:
            when, size = instant(time[n], time[n - 1], time[n + 1]), f"{excess[n]:.3g} {result.unit}"
            peaks.append((excess[n] / (result.scale or 1.0), f"{name} at t = {when} s by {size}"))
    if peaks:
        where = f"{len(peaks)} channels" if len(peaks) > 1 else "1 channel"
        warnings += (
            f"{label}: samples between the compared times are not judged; some stand out from their "
            f"neighbours by more than the tolerance, in {where}, most of all "
            f"{max(peaks, key=lambda one: one[0])[1].rstrip()}",
        )
    return warnings


def _exceeded_shift(
    results: Mapping[str, ChannelComparison],
    aligned: Alignment,
    time_tolerance: float,
) -> float:
    """Return the time shift that a tolerance allows, s, where it is exceeded; else nan.

    Under a shift most samples of a slow channel stay within a share of its range, so samples alone would
    accept it. The limit is the least time in which a position traverses its tolerance at the scale of its
    rate, with a scene a share of a hundredth of a crank cycle; or the time tolerance. Uncertainties have no
    such limit.
    """
    times = []
    for position in results.values():
        rate = position.definition.rate
        if rate is None or position.verdict == "unexcited" or position.tolerance is None:
            continue
        sides = position.a, position.b
        scale = (
            results[rate].scale
            if rate in results
            else max(float(np.ptp(np.gradient(values, aligned.time))) for values in sides)
        )
        if not scale:  # of a constant rate
            scale = float(np.abs(np.diff(position.a) / np.diff(aligned.time)).max())
        times += [position.tolerance / scale] if scale else []
    limit, shift = min(times, default=0.0), aligned.shift
    limit = max(limit, time_tolerance) if limit else limit
    exceeded = limit and shift.significant and abs(shift.value) - shift.uncertainty > limit
    return limit if exceeded else nan
