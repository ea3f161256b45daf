"""Checks of the times of two tables: their ends, holes, samples between the compared times, a shift."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from comparison.accuracy.uncertainty import Runs
from comparison.agreement.results import ChannelComparison
from comparison.formatting import instant
from comparison.tables.align import Aligned, continuous
from comparison.tables.table import Table, TableError
from comparison.tables.times import holes, isolated


def kinds(runs: Runs) -> Iterator[tuple[str, Table]]:
    """Yield the runs of a model with the words that follow its name in messages."""
    yield "", runs.base
    if runs.finer is not None:
        yield " finer", runs.finer
    if runs.perturbed is not None:
        yield " perturbed", runs.perturbed
    if runs.other_perturbed is not None:
        yield " other perturbed", runs.other_perturbed
    if runs.coarser is not None:
        yield " coarser", runs.coarser


def check_times(both: tuple[tuple[str, Runs], ...]) -> None:
    """Reject runs of one model on different grids, and tables of which one ends early.

    Raises
    ------
    TableError
        If so. One sample of the coarser table is allowed at either end: two grids rarely end together.
    """
    for label, runs in both:
        for kind, table in kinds(runs):
            if not np.array_equal(table.time, runs.base.time):
                raise TableError(f"{label}{kind}: its times differ from those of {label}")
    (label_a, a), (label_b, b) = ((label, runs.base.time) for label, runs in both)
    slack = max(float(np.median(np.diff(a))), float(np.median(np.diff(b)))) * (1 + 1e-6)
    if abs(a[0] - b[0]) > slack or abs(a[-1] - b[-1]) > slack:
        ends = a[0], a[-1], b[0], b[-1]
        (start_a, end_a, start_b, end_b) = (instant(end, *ends) for end in ends)
        raise TableError(
            f"{label_a} spans {start_a} to {end_a} s and {label_b} {start_b} to {end_b} s: "
            "one of them is truncated"
        )


def check_holes(both: tuple[tuple[str, Runs], ...]) -> tuple[str, ...]:
    """Reject a table with a hole in its times; one missing row, or a hole in both, is a warning.

    Raises
    ------
    TableError
        If rows are missing in one of the tables.
    """
    shared = np.array_equal(both[0][1].base.time, both[1][1].base.time)
    warnings = []
    for label, runs in both[:1] if shared else both:
        found = holes(runs.base.time)
        if not found:
            continue
        first = max(found, key=lambda hole: hole.end - hole.start)
        missing = sum(hole.missing for hole in found)
        message = "both tables have" if shared else f"{label} has"
        start, end = instant(first.start, first.end), instant(first.end, first.start)
        message += f" no row between {start} and {end} s"
        message += f" (and {len(found) - 1} more such holes)" if len(found) > 1 else ""
        message += f": {missing} {'row is' if missing == 1 else 'rows are'} missing" if missing else ""
        if not shared and missing != 1:
            raise TableError(message)
        warnings.append(message)
    return tuple(warnings)


def between(
    table: Table, label: str, aligned: Aligned, results: Mapping[str, ChannelComparison], tolerance: float
) -> tuple[str, ...]:
    """Report single samples of the interpolated table that stand out between the compared times."""
    time = table.time
    used = np.isin(time, aligned.time)
    if time.size < 3 or used.all():
        return ()
    found = []
    for name, result in results.items():
        values = continuous(table.values(name), result.definition)
        distance = np.where(used, 0.0, isolated(time, values, tolerance * result.scale))
        if distance.any():
            found.append((float(distance.max()) / (result.scale or 1.0), name, distance))
    if not found:
        return ()
    _, name, distance = max(found, key=lambda item: item[0])
    worst = int(distance.argmax())
    return (
        f"{label}: samples between the compared times are not judged; some stand out from their neighbours "
        f"by more than the tolerance, in {len(found)} channels, most of all {name} at "
        f"t = {instant(time[worst], time[worst - 1], time[worst + 1])} s by {distance[worst]:.3g} "
        f"{results[name].unit}".rstrip(),
    )


def too_late(
    results: Mapping[str, ChannelComparison],
    aligned: Aligned,
    labels: tuple[str, str],
    tolerance: float | None,
) -> str:
    """Describe a time shift outside the tolerance; empty if it is within, or if uncertainties decide.

    Under a shift most samples of a slow channel stay within a share of its range, so samples alone would
    accept it. The limit is the tolerance times the time in which a position traverses its scale at the scale
    of its rate, the least of all positions: with a scene a hundredth of a crank cycle.
    """
    times = []
    for position in results.values():
        rate = position.definition.rate
        if rate is None or position.verdict == "unexcited" or position.u is not None:
            continue
        if rate in results:
            scale = results[rate].scale
        else:
            slopes = [np.gradient(values, aligned.time) for values in (position.a, position.b)]
            scale = max(float(np.ptp(slope)) for slope in slopes)
        if not scale:  # of a constant rate
            scale = float(np.abs(np.diff(position.a) / np.diff(aligned.time)).max())
        if scale:
            times.append(position.scale / scale)
    limit = (tolerance or 0.0) * min(times, default=0.0)
    shift = aligned.shift
    if not limit or shift.reason or abs(shift.value) - shift.uncertainty <= limit:
        return ""
    return f"{shift.sentence(labels)} The tolerance allows {limit:.2g} s"
