"""Whether a failed check is a regression, or its threshold too small by chance.

After chatter, a run on another machine, which differs by round-off, is one more draw from a distribution over
decades, of which the baseline's thresholds contain few. Values outside their thresholds are therefore
compared with the spread of more neighbours, run by the code and on the machine that failed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.execution.run import Job, Outcome, run_all
from comparison.regression.baseline import Checkpoint, RunRecord
from comparison.regression.checkpoints import settings
from comparison.regression.deviation import changes
from comparison.regression.neighbours import CONFIRMING, neighbours, scatter
from comparison.tables.table import Table

Which = tuple[str, str]
"""A model and a tier."""


def confirm(
    ran: Mapping[str, Mapping[Which, tuple[Job, Outcome]]],
    records: Mapping[str, dict[Which, RunRecord]],
    n_jobs: int,
) -> list[str]:
    """Raise the thresholds that neighbours of the present runs show to be too small.

    Parameters
    ----------
    ran
        Scene -> its present runs.
    records
        Scene -> those of the baseline; entries are replaced.
    n_jobs
        Worker processes.

    Returns
    -------
    notes
        One line for each run with such thresholds.
    """
    doubted = {
        (name, which): (job, outcome.table, list(neighbours(job, which[1], CONFIRMING).values()))
        for name, runs in ran.items()
        for which, (job, outcome) in runs.items()
        if outcome.table is not None and which in records[name]
        if _off(records[name][which], job, outcome.table)
    }
    outcomes = iter(run_all([one for *_, jobs in doubted.values() for one in jobs], n_jobs))
    notes = []
    for (name, which), (job, table, jobs) in doubted.items():
        tables = [outcome.table for outcome in [next(outcomes) for _ in jobs] if outcome.table is not None]
        before = records[name][which]
        after = _raised(before, job, table, tables, which[1])
        if (count := len(_off(before, job, table) - _off(after, job, table))) > 0:
            records[name][which] = after
            notes.append(
                f"{' '.join(which)}, scene {name!r}: {count} channels deviate no more than "
                f"{len(tables)} runs from neighbouring starts do here; their thresholds are too small"
            )
    return notes


def _off(record: RunRecord, job: Job, table: Table) -> set[str]:
    """Return the channels that are outside thresholds of their checkpoints."""
    found = changes(record, table, settings(job.scene.data, table, job.model), exact=False)
    return {finding.name for finding in found if finding.status == "failed"} & record.channels.keys()


def _raised(record: RunRecord, gated: Job, table: Table, tables: Sequence[Table], tier: str) -> RunRecord:
    """Return a record with its thresholds raised to the differences between neighbours of the present run."""
    factor = thresholds(tier).k

    def confirmed(channel: str, points: list[Checkpoint]) -> list[Checkpoint]:
        if channel not in table.channels:
            return points
        u = scatter(gated, table, tables, channel)
        at = [int(np.abs(table.time - point.time).argmin()) for point in points]
        limits = [max(point.threshold, factor * float(u[i])) for point, i in zip(points, at, strict=True)]
        return [point._replace(threshold=limit) for point, limit in zip(points, limits, strict=True)]

    channels = {name: confirmed(name, points) for name, points in record.channels.items()}
    return record.model_copy(update={"channels": channels})
