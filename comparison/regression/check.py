"""Check of all gated runs against their baseline.

After chatter, a run on another machine, which differs by round-off, is one more draw from a distribution over
decades, of which the baseline's thresholds contain few. Values outside their thresholds are therefore
compared with the spread of more neighbours, run by the code and on the machine that failed: what these differ
by as well is no regression, but a threshold too small by chance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Literal, NamedTuple

import numpy as np

from comparison.accuracy.levels import thresholds, thresholds_record
from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.models import platform_name, versions
from comparison.regression.baseline import Baseline, Checkpoint, RunRecord, physics_hash
from comparison.regression.record import (
    CONFIRMING,
    Which,
    counters,
    gated_runs,
    neighbours,
    scatter,
    settings,
)
from comparison.scene import Scene
from comparison.tables.channels import channels
from comparison.tables.table import Table

COUNTERS_ELSEWHERE = 0.05
"""By which the counters may differ on another platform or with other versions."""
SPREAD_FACTOR = 2.0
"""Or by so many times what they differ between starts next to each other: the steps of the strict reference
at 90 rpm do by 6 % if the start moves by 2e-15 m, which is what rounding does."""


class Lack(Enum):
    """What is missing for a comparison."""

    THRESHOLDS = auto()  # those of the verdicts that the baseline was made with
    RECORD = auto()  # of what is there now
    PRESENT = auto()  # what the baseline has
    PREDICTABLE = auto()  # a sample that is, at which something happens


class SceneGone(NamedTuple):
    """A scene of the baseline is neither a shipped one nor a file any more."""

    source: str


class RunFailed(NamedTuple):
    """The run did not succeed."""

    job: Job
    outcome: Outcome


class Changed(NamedTuple):
    """Settings or counters have other values: name -> now and in the baseline, None where it has none."""

    values: dict[str, tuple[object, object]]


class Excited(NamedTuple):
    """A channel in which nothing happened now does: its range, in its unit."""

    extent: float


class NoSample(NamedTuple):
    """There is no sample at a checkpoint's time, s."""

    time: float


class Moved(NamedTuple):
    """Values are outside the thresholds of ``off`` of ``points`` checkpoints, most of all at this one."""

    value: float
    checkpoint: Checkpoint
    off: int
    points: int


Deviation = Lack | SceneGone | RunFailed | Changed | Excited | NoSample | Moved


class Check(NamedTuple):
    """One check of a scene; the deviation is None where there is none.

    ``run`` is None for the scene as a whole; ``name`` is the channel, "settings", "counters", "run", "scene"
    or "thresholds".
    """

    scene: str
    run: Which | None
    name: str
    deviation: Deviation | None

    @property
    def status(self) -> Literal["passed", "failed", "skipped", "error"]:
        """A "failed" check is a regression; "error": a process died, or a model raised what it should not."""
        if self.deviation is None:
            return "passed"
        if isinstance(self.deviation, RunFailed) and self.deviation.outcome.status == "crashed":
            return "error"
        return "skipped" if self.deviation is Lack.PREDICTABLE else "failed"


class Excused(NamedTuple):
    """So many channels of a run deviate no more than so many neighbours of it do."""

    scene: str
    run: Which
    channels: int
    neighbours: int


@dataclass(frozen=True)
class Gate:
    """Results of the gate."""

    checks: list[Check]
    platform: tuple[str, str] | None
    """There and here, where they differ."""
    versions: dict[str, tuple[str | None, str | None]]
    """Library -> there and here, None without it, where they differ."""
    excused: list[Excused]
    """Runs with thresholds too small."""
    rewritten: list[str]
    """Scenes whose numbers are not those of the baseline."""

    @property
    def regressions(self) -> list[Check]:
        """Failed checks."""
        return [check for check in self.checks if check.status in ("failed", "error")]

    @property
    def exit_code(self) -> int:
        """0; 1 with a regression; 70 where a process died or a model raised what it should not."""
        return 70 if any(check.status == "error" for check in self.checks) else int(bool(self.regressions))


def gate(
    baseline: Baseline,
    scenes: Sequence[Scene],
    gone: Sequence[str] = (),
    *,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> Gate:
    """Run scenes and compare them with the baseline, of which other scenes are gone."""
    planned = {
        (scene.name, which): job
        for scene in scenes
        if scene.name in baseline.scenes
        for which, job in gated_runs(scene).items()
    }
    outcomes = run_all(list(planned.values()), n_jobs, on_progress)
    present = dict(zip(planned, zip(planned.values(), outcomes, strict=True), strict=True))
    known = {
        (scene.name, which): record
        for scene in scenes
        if scene.name in baseline.scenes
        for which, record in baseline.scenes[scene.name].runs.items()
    }
    platform = None if baseline.platform == platform_name() else (baseline.platform, platform_name())
    there, here = baseline.versions, versions()
    names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    changed = {name: (there.get(name), here.get(name)) for name in names}
    records, excused = _confirmed(known, present, n_jobs)
    # The verdicts are judged by the numbers whose error rates the baseline holds.
    same = thresholds_record() == baseline.thresholds
    checks = [Check("thresholds", None, "thresholds", None if same else Lack.THRESHOLDS)]
    checks += [Check(name, None, "scene", SceneGone(baseline.scenes[name].source)) for name in gone]
    rewritten = []
    for scene in scenes:
        if scene.name not in baseline.scenes:
            checks.append(Check(scene.name, None, "scene", Lack.RECORD))
            continue
        # What only one of the two sides has is a regression.
        for key in [key for key in {**present, **records} if key[0] == scene.name]:
            deviations: dict[str, Deviation | None]
            if key not in present or key not in records:
                deviations = {"run": Lack.PRESENT if key not in present else Lack.RECORD}
            elif (table := present[key][1].table) is None:
                deviations = {"run": RunFailed(*present[key])}
            else:
                deviations = changes(records[key], present[key][0], table, exact=not (platform or changed))
            checks += [Check(*key, name, deviation) for name, deviation in deviations.items()]
        if physics_hash(scene) != baseline.scenes[scene.name].hash:
            rewritten.append(scene.name)
    return Gate(checks, platform, changed, excused, rewritten)


def changes(record: RunRecord, job: Job, table: Table, *, exact: bool) -> dict[str, Deviation | None]:
    """Compare settings, counters and every channel of a present run with its record.

    Counters are compared exactly on the same platform and with the same versions, else within 5 % or their
    spread; a difference of one is always allowed there.
    """
    now = counters(table)
    for key in record.counters.keys() & now.keys() if not exact else ():
        before, spread = record.counters[key], SPREAD_FACTOR * record.spread.get(key, 0)
        if abs(now[key] - before) <= max(1.0, COUNTERS_ELSEWHERE * before, spread):
            now[key] = before
    deviations = {
        "settings": _differing(record.settings, settings(job.scene.data, table, job.model)),
        "counters": _differing(record.counters, now),
    }
    recorded = [*record.channels, *record.unexcited, *record.unpredictable]
    for name in dict.fromkeys([*recorded, *table.channels]):
        if name not in table.channels:
            deviations[name] = Lack.PRESENT
        elif name not in recorded:
            deviations[name] = Lack.RECORD
        elif name in record.unpredictable:
            deviations[name] = Lack.PREDICTABLE
        elif name in record.unexcited:
            extent = float(np.ptp(table.values(name)))
            deviations[name] = None if extent < channels()[name].floor else Excited(extent)
        else:
            deviations[name] = _moved(name, record.channels[name], table)
    return deviations


def _differing(before: Mapping[str, object], now: Mapping[str, object]) -> Deviation | None:
    names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    return Changed({name: (now.get(name), before.get(name)) for name in names}) if names else None


def _moved(name: str, points: list[Checkpoint], table: Table) -> Deviation | None:
    """Return the checkpoint furthest outside its threshold."""
    values = table.values(name)
    interval = float(table.time[-1] - table.time[0]) / (table.time.size - 1)
    off = []
    for point in points:
        nearest = _nearest(table, point)
        if abs(table.time[nearest] - point.time) > 0.01 * interval:  # its time is rounded to nine digits
            return NoSample(point.time)
        value = float(values[nearest])
        if not abs(value - point.value) <= point.threshold:
            off.append((abs(value - point.value) / point.threshold, value, point))
    if not off:
        return None
    _, value, worst = max(off)
    return Moved(value, worst, len(off), len(points))


def _nearest(table: Table, point: Checkpoint) -> int:
    return int(np.abs(table.time - point.time).argmin())


def _off(record: RunRecord, job: Job, table: Table) -> set[str]:
    """Return the channels that are outside thresholds of their checkpoints."""
    deviations = changes(record, job, table, exact=False)
    return {name for name in record.channels if deviations[name] is not None}


def _confirmed(
    records: Mapping[tuple[str, Which], RunRecord],
    present: Mapping[tuple[str, Which], tuple[Job, Outcome]],
    n_jobs: int,
) -> tuple[dict[tuple[str, Which], RunRecord], list[Excused]]:
    """Return the records, with thresholds raised that neighbours of the present runs show to be too small."""
    doubted = {
        key: (job, outcome.table, neighbours(job, key[1][1], CONFIRMING))
        for key, (job, outcome) in present.items()
        if outcome.table is not None and key in records
        if _off(records[key], job, outcome.table)
    }
    outcomes = iter(run_all([job for *_, jobs in doubted.values() for job in jobs], n_jobs))
    raised, excused = dict(records), []
    for key, (job, table, jobs) in doubted.items():
        tables = [outcome.table for outcome in [next(outcomes) for _ in jobs] if outcome.table is not None]
        before = records[key]
        after = _raised(before, job, table, tables, thresholds(key[1][1]).k)
        if count := len(_off(before, job, table) - _off(after, job, table)):
            raised[key] = after
            excused.append(Excused(*key, count, len(tables)))
    return raised, excused


def _raised(record: RunRecord, gated: Job, table: Table, tables: Sequence[Table], k: float) -> RunRecord:
    """Return a record with its thresholds raised to the differences between neighbours of the present run."""
    raised = dict(record.channels)
    for name in record.channels.keys() & set(table.channels):
        limit = k * scatter(gated, table, tables, name)
        raised[name] = [
            point._replace(threshold=max(point.threshold, float(limit[_nearest(table, point)])))
            for point in record.channels[name]
        ]
    return record.model_copy(update={"channels": raised})
