"""Check of all gated runs against their baseline.

After chatter, a run on another machine, which differs by round-off, is one more draw from a distribution over
decades, of which the baseline's thresholds contain few. Values outside their thresholds are therefore
compared with the spread of more neighbours, run by the code and on the machine that failed: a difference
that these have as well is no regression, but a threshold too small by chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Literal, NamedTuple

import numpy as np

from comparison.accuracy.levels import thresholds, thresholds_record
from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.metrics import scaled_value
from comparison.models import platform_name, versions
from comparison.regression.record import (
    CONFIRMING,
    Baseline,
    Checkpoint,
    RunRecord,
    Which,
    counters,
    gated_runs,
    neighbours,
    physics_hash,
    scatter,
    settings,
)
from comparison.scene import Scene
from comparison.tables.channels import Channel
from comparison.tables.table import Table

COUNTERS_ELSEWHERE = 0.05
"""Share by which the counters may differ on another platform or with other versions."""
SPREAD_FACTOR = 2.0
"""Factor on a counter's spread between neighbouring starts, by which it may differ too: the steps of the
strict reference at 90 rpm change by 6 % if the start moves by 2e-15 m, as by rounding."""


class Kind(Enum):
    """Kinds of findings, with the names of their data."""

    THRESHOLDS = auto()  # of the verdicts are not those that the baseline was made with
    SCENE_GONE = auto()  # source
    NEW_SCENE = auto()
    RUN_GONE = auto()
    NEW_RUN = auto()
    FAILED = auto()  # job, outcome
    CHANGED = auto()  # values: name -> now and in the baseline, None where it has none
    CHANNEL_GONE = auto()
    NEW_CHANNEL = auto()
    UNPREDICTABLE = auto()  # no sample at which something happens is predictable
    EXCITED = auto()  # extent, of a channel that was constant
    NO_SAMPLE = auto()  # time of a checkpoint, s
    # Of the first checkpoint outside: time, value, before, off, threshold, share of the scale. Of all: count
    # outside of points, largest share and its time peak, rows of time, before, threshold, value; curve now
    MOVED = auto()


Finding = tuple[Kind | None, dict[str, Any]]
Records = Mapping[tuple[str, Which], RunRecord]
_NOTHING: Finding = (None, {})


class Check(NamedTuple):
    """One check of a scene or of one of its runs; ``kind`` is None where it found nothing."""

    scene: str
    run: Which | None
    name: str  # the channel, "settings", "counters", "run", "scene" or "thresholds"
    kind: Kind | None
    data: dict[str, Any]

    @property
    def status(self) -> Literal["passed", "failed", "skipped", "error"]:
        """A "failed" check is a regression; "error": a process died, or a model failed unexpectedly."""
        if self.kind is None:
            return "passed"
        if self.kind is Kind.FAILED and self.data["outcome"].status == "crashed":
            return "error"
        return "skipped" if self.kind is Kind.UNPREDICTABLE else "failed"


class Excuse(NamedTuple):
    """A run of which ``channels`` (number) deviate no more than its ``neighbours`` (number) do."""

    scene: str
    run: Which
    channels: int
    neighbours: int


@dataclass(frozen=True)
class Gate:
    """Results of the gate."""

    checks: list[Check]
    platform: tuple[str, str] | None  # there and here, where they differ
    versions: dict[str, tuple[str | None, str | None]]  # the same of libraries, None without it
    excuses: list[Excuse]  # runs with thresholds too small
    rewritten: list[str]  # scenes whose numbers are not those of the baseline
    valueless: int  # constant channels without a value in the baseline

    @property
    def regressions(self) -> list[Check]:
        """Failed checks."""
        return [check for check in self.checks if check.status in ("failed", "error")]

    @property
    def exit_code(self) -> int:
        """0; 1 with a regression; 70 where a process died or a model raised an unexpected error."""
        return 70 if any(check.status == "error" for check in self.checks) else int(bool(self.regressions))


def gate(
    baseline: Baseline,
    scenes: Sequence[Scene],
    missing: Sequence[str] = (),
    *,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> Gate:
    """Run scenes and compare them with the baseline; ``missing`` names its scenes that no longer exist."""
    base = baseline.scenes
    common = [scene for scene in scenes if scene.name in base]
    jobs = {(scene.name, which): job for scene in common for which, job in gated_runs(scene).items()}
    outcomes = dict(zip(jobs, run_all(list(jobs.values()), n_jobs, on_progress), strict=True))
    there, here = baseline.versions, versions()
    platform = None if baseline.platform == platform_name() else (baseline.platform, platform_name())
    changes = {
        name: (there.get(name), here.get(name))
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    }
    runs = {(scene.name, which): run for scene in common for which, run in base[scene.name].runs.items()}
    records, excuses = _excuse(runs, jobs, outcomes, n_jobs)
    # The verdicts are judged by the numbers whose error rates the baseline holds.
    is_same = thresholds_record() == baseline.thresholds
    checks = [Check("thresholds", None, "thresholds", None if is_same else Kind.THRESHOLDS, {})]
    checks += [Check(name, None, "scene", Kind.SCENE_GONE, {"source": base[name].source}) for name in missing]
    for scene in scenes:
        if scene.name not in base:
            checks.append(Check(scene.name, None, "scene", Kind.NEW_SCENE, {}))
        # What only one of the two sides has is a regression.
        for key in [key for key in {**jobs, **records} if key[0] == scene.name]:
            findings: dict[str, Finding]
            if key not in jobs or key not in records:
                findings = {"run": (Kind.RUN_GONE if key not in jobs else Kind.NEW_RUN, {})}
            elif (table := outcomes[key].table) is None:
                findings = {"run": (Kind.FAILED, {"job": jobs[key], "outcome": outcomes[key]})}
            else:
                findings = _changes(records[key], jobs[key], table, exact=not (platform or changes))
            checks += [Check(*key, name, *deviation) for name, deviation in findings.items()]
    rewritten = [scene.name for scene in common if physics_hash(scene) != base[scene.name].hash]
    valueless = sum(len({*run.unexcited} - run.channels.keys()) for run in runs.values())
    return Gate(checks, platform, changes, excuses, rewritten, valueless)


def _changes(record: RunRecord, job: Job, table: Table, *, exact: bool) -> dict[str, Finding]:
    """Compare settings, counters and every channel of a present run with its record.

    Counters are compared exactly on the same platform and with the same versions, else within 5 % or their
    spread; a difference of one is always allowed there.
    """
    now = counters(table)
    for key in record.counters.keys() & now.keys() if not exact else ():
        before, spread = record.counters[key], SPREAD_FACTOR * record.spread.get(key, 0)
        if abs(now[key] - before) <= max(1.0, COUNTERS_ELSEWHERE * before, spread):
            now[key] = before
    findings = {
        "settings": _difference(record.settings, settings(job.scene.data, table, job.model)),
        "counters": _difference(record.counters, now),
    }
    names = [*record.channels, *record.unexcited, *record.unpredictable]
    for name in dict.fromkeys([*names, *table.channels]):
        if name not in table.channels:
            findings[name] = Kind.CHANNEL_GONE, {}
        elif name not in names:
            findings[name] = Kind.NEW_CHANNEL, {}
        elif name in record.unpredictable:
            findings[name] = Kind.UNPREDICTABLE, {}
        else:
            channel, extent = table.definitions[name], float(np.ptp(table.values(name)))
            if name in record.unexcited and extent >= channel.floor:
                numbers = {"extent": extent, "floor": channel.floor, "unit": channel.unit}
                findings[name] = Kind.EXCITED, numbers
            else:
                findings[name] = _deviation(channel, record.channels.get(name, ()), table, job.scene)
    return findings


def _difference(before: Mapping[str, object], now: Mapping[str, object]) -> Finding:
    names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    values = {name: (now.get(name), before.get(name)) for name in names}
    return (Kind.CHANGED, {"values": values}) if values else _NOTHING


def _deviation(channel: Channel, points: Sequence[Checkpoint], table: Table, scene: Scene) -> Finding:
    """Find the first checkpoint outside its threshold, and the largest difference."""
    if not points:  # of a constant channel, in a baseline that does not hold its value
        return _NOTHING
    time, before, threshold = np.reshape(points, (-1, 3)).T
    at = _nearest(table, points)
    # A checkpoint's time is rounded to nine digits.
    missing = np.abs(table.time[at] - time) > 0.01 * np.ptp(table.time) / (table.time.size - 1)
    if missing.any():
        return Kind.NO_SAMPLE, {"time": time[missing.argmax()]}
    curve = table.values(channel.name)
    value = curve[at]
    distance = np.abs(value - before)
    outside = distance > threshold
    if not outside.any():
        return _NOTHING
    first, largest = int(outside.argmax()), int(np.where(outside, distance, 0.0).argmax())
    columns = {"time": time, "value": value, "before": before, "off": distance, "threshold": threshold}
    numbers: dict[str, Any] = {key: float(column[first]) for key, column in columns.items()}
    extent = float(np.ptp([*curve, *before]))
    if np.ptp(curve) < channel.floor:  # a constant has no range
        extent = max(extent, float(np.abs(before).max()))
    shares = [
        scaled_value(float(distance[n]), channel.scale_value(scene.data, extent)) for n in (first, largest)
    ]
    numbers |= {"share": shares[0], "largest": shares[1], "peak": float(time[largest])}
    numbers["unit"] = channel.unit
    numbers |= {"count": int(outside.sum()), "points": len(points)}
    rows = np.column_stack([time, before, threshold, value])
    return Kind.MOVED, numbers | {"rows": rows, "curve": (table.time, curve)}


def _nearest(table: Table, points: Sequence[Checkpoint]) -> list[int]:
    return [int(np.abs(table.time - point.time).argmin()) for point in points]


def _excuse(
    records: Records,
    jobs: Mapping[tuple[str, Which], Job],
    outcomes: Mapping[tuple[str, Which], Outcome],
    n_jobs: int,
) -> tuple[Records, list[Excuse]]:
    """Return the records, with thresholds raised where neighbours of the present runs differ by more."""

    def deviations(record: RunRecord, job: Job, table: Table) -> set[str]:
        findings = _changes(record, job, table, exact=False)
        return {name for name in record.channels if findings[name][0] is Kind.MOVED}

    suspects = {
        key: (jobs[key], table, neighbours(jobs[key], key[1][1], CONFIRMING))
        for key in jobs
        if key in records
        and (table := outcomes[key].table) is not None
        and deviations(records[key], jobs[key], table)
    }
    nearby = iter(run_all([job for *_, others in suspects.values() for job in others], n_jobs))
    results, excuses = dict(records), []
    for key, (job, table, others) in suspects.items():
        tables = [outcome.table for outcome in [next(nearby) for _ in others] if outcome.table is not None]
        before, k = records[key], thresholds(key[1][1]).k
        wider = dict(before.channels)
        for name in wider.keys() & set(table.channels):
            limits = k * scatter(job, table, tables, name)[_nearest(table, wider[name])]
            wider[name] = [
                point._replace(threshold=max(point.threshold, limit))
                for point, limit in zip(wider[name], limits.tolist(), strict=True)
            ]
        after = before.model_copy(update={"channels": wider})
        if count := len(deviations(before, job, table) - deviations(after, job, table)):
            results[key] = after
            excuses.append(Excuse(*key, count, len(tables)))
    return results, excuses
