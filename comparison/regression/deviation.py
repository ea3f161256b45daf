"""Comparison of a run with its record in a baseline."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from comparison.agreement.cases import Status
from comparison.regression import checkpoints
from comparison.regression.baseline import Checkpoint, RunRecord
from comparison.tables.channels import channels
from comparison.tables.table import Table

COUNTERS_ELSEWHERE = 0.05  # by which the counters may differ on another platform or with other versions
# Or by so many times what they differ between starts next to each other: the steps of the strict reference at
# 90 rpm do by 6 % if the start moves by 2e-15 m, which is what rounding does.
SPREAD_FACTOR = 2.0


class Finding(NamedTuple):
    """What was checked, and how it changed."""

    name: str
    status: Status
    message: str = ""


def changes(record: RunRecord, table: Table, settings: Mapping[str, Any], *, exact: bool) -> list[Finding]:
    """Compare settings, counters and every channel with a record.

    Parameters
    ----------
    record
        Of the baseline.
    table
        The present run; checked, hence finite.
    settings
        Of the present run, see `comparison.regression.checkpoints.settings`.
    exact
        Whether the counters must be equal: the same platform and versions. Else within 5 %, or their spread.
    """
    findings = [
        _finding("settings", _differing(record.settings, settings, "the setting")),
        _finding("counters", _counters(record, table, exact=exact)),
    ]
    recorded = [*record.channels, *record.unexcited, *record.unpredictable]
    for name in dict.fromkeys([*recorded, *table.channels]):
        if name not in table.channels:
            message = f"the channel {name} is in the baseline and not in the run"
        elif name not in recorded:
            message = f"the channel {name} has no baseline; sixbar gate --update makes one"
        elif name in record.unpredictable:
            message = f"{name} has no predictable sample at which something happens"
            findings.append(Finding(name, "skipped", message))
            continue
        elif name in record.unexcited:
            message = _excited(name, table)
        else:
            message = _moved(name, record.channels[name], table)
        findings.append(_finding(name, message))
    return findings


def _finding(name: str, message: str) -> Finding:
    return Finding(name, "failed" if message else "passed", message)


def _differing(before: Mapping[str, object], now: Mapping[str, object], what: str) -> str:
    """Describe where two mappings differ; empty where they do not."""
    return "; ".join(
        f"{what} {key} is {now.get(key, 'missing')}, in the baseline {before.get(key, 'missing')}"
        for key in {**before, **now}
        if before.get(key) != now.get(key)
    )


def _counters(record: RunRecord, table: Table, *, exact: bool) -> str:
    """Describe which counters differ. On another platform a difference of one is always allowed."""
    before, now = record.counters, checkpoints.counters(table)
    if not exact:
        for key in before.keys() & now.keys():
            spread = SPREAD_FACTOR * record.spread.get(key, 0)
            if abs(now[key] - before[key]) <= max(1.0, COUNTERS_ELSEWHERE * before[key], spread):
                now[key] = before[key]
    return _differing(before, now, "the counter")


def _excited(name: str, table: Table) -> str:
    """Describe the range of a channel that was not excited in the baseline and now is."""
    channel, extent = channels()[name], float(np.ptp(table.values(name)))
    if extent < channel.floor:
        return ""
    return (
        f"in {name} nothing happened in the baseline, its range was below {channel.floor:g} {channel.unit}; "
        f"now it is {extent:.3g} {channel.unit}"
    )


def _moved(name: str, points: list[Checkpoint], table: Table) -> str:
    """Describe the checkpoint furthest outside its threshold; empty where none is."""
    unit, values = channels()[name].unit, table.values(name)
    interval = float(table.time[-1] - table.time[0]) / (table.time.size - 1)
    off = []
    for point in points:
        nearest = int(np.abs(table.time - point.time).argmin())
        if abs(table.time[nearest] - point.time) > 0.01 * interval:  # its time is rounded to nine digits
            return f"{name} has no sample at t = {point.time:g} s, where the baseline has a checkpoint"
        value = float(values[nearest])
        if not abs(value - point.value) <= point.threshold:
            off.append((abs(value - point.value) / point.threshold, value, point))
    if not off:
        return ""
    _, value, worst = max(off)
    return (
        f"{name} at t = {worst.time:g} s is {value:.15g} {unit}, in the baseline {worst.value:.15g} {unit}: "
        f"off by {abs(value - worst.value):.2g} {unit}, the threshold is {worst.threshold:.2g} {unit} "
        f"({len(off)} of {len(points)} checkpoints are off)"
    )
