"""Many pieces of work spread over processes, each kept in a ledger as soon as it is finished."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

from comparison.ledger import Row, append_row, read_rows
from comparison.workers import Attempt, Died, Late, Share, work


@dataclass(frozen=True)
class Lost:
    """The process that worked on a task died."""

    words: str
    """How."""


Finished = Generator[tuple[str, Row | Lost]]
Spread = Callable[[Attempt, Mapping[str, Any]], Finished]
"""Works off tasks by their keys and yields each one's row as it comes, or that its process died."""

CRASHED, LATE = "crashed", "work-limit"


def on_processes(n_jobs: int, limit: float = inf) -> Spread:
    """Return what spreads work over so many processes of this machine.

    A task that takes longer than the limit, s, is broken off (`comparison.workers.work`); that is its row,
    with the share that it had finished.
    """

    def spread(attempt: Attempt, tasks: Mapping[str, Any]) -> Finished:
        with closing(work(attempt, list(tasks.items()), n_jobs, limit)) as events:
            for key, event in events:
                if isinstance(event, Died):
                    yield key, Lost(event.words)
                elif isinstance(event, Late):
                    yield (
                        key,
                        {"status": LATE, "message": f"broken off after {limit:g} s", "share": event.share},
                    )
                elif not isinstance(event, Share):
                    yield key, event

    return spread


def finish(
    attempt: Attempt,
    tasks: Mapping[str, Any],
    ledger: Path,
    spread: Spread,
    on_progress: Callable[[float], None] | None = None,
) -> dict[str, Row]:
    """Do what has not been done yet.

    Parameters
    ----------
    attempt
        A function of a module: it gets a task and returns its row. It must not raise.
    tasks
        By a key that holds all that can change the row; in the order in which to begin.
    ledger
        Where rows are kept. Its folder is there.
    spread
        Who does the work.
    on_progress
        Called with the finished share, 0 to 1.

    Returns
    -------
    dict
        The row of each task, in the order of ``tasks``. That of a process that died says so under
        ``"status"`` and ``"message"``. It is not kept: what the work itself comes to is final, but what
        befell a process is tried again the next time.

    Raises
    ------
    LedgerError
        If rows cannot be read or kept.
    """
    kept = read_rows(ledger)
    rows = {key: kept[key] for key in tasks if key in kept}
    waiting = {key: task for key, task in tasks.items() if key not in rows}
    total = len(tasks) or 1
    with closing(spread(attempt, waiting)) as finished:
        for key, row in finished:
            if isinstance(row, Lost):
                rows[key] = {"status": CRASHED, "message": row.words}
            else:
                rows[key] = append_row(ledger, key, row)
            if on_progress:
                on_progress(len(rows) / total)
    return {key: rows[key] for key in tasks}
