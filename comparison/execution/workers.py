"""Isolated worker processes: a task that kills its process affects no other task.

``multiprocessing`` is used directly, since a ``ProcessPoolExecutor`` abandons all of its tasks when one
process dies, without reporting which task it was. The limit of pebble's ``ProcessPool`` counts from when a
worker takes a task, compilation included, and its workers cannot report progress: the queue of events, the
limits and the signal masks would remain here.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from multiprocessing.connection import wait
from typing import Any

from comparison.execution.task_order import Compiling, Kernels
from comparison.execution.worker_process import Attempt, Share, Worker, end, give_back, taken

READY = 10.0
"""Times its limit that a task may take before its own work begins."""


@dataclass(frozen=True)
class Died:
    """The process ended before the task did."""

    exit_code: int | None

    @property
    def words(self) -> str:
        """Description of the end of the process."""
        if self.exit_code is not None and self.exit_code < 0:
            return f"its process was killed by {signal.Signals(-self.exit_code).name}"
        return f"its process ended with code {self.exit_code}"


@dataclass(frozen=True)
class Late:
    """The task was stopped at its time limit, with the share finished by then."""

    share: float


def cpus() -> int:
    """Return the number of CPUs available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def work(
    attempt: Attempt,
    tasks: Sequence[tuple[str, Any]],
    n_workers: int,
    limit: float = inf,
    environment: Mapping[str, str] | None = None,
    until: float = inf,
    kernels: Mapping[str, frozenset[Kernels]] | None = None,
) -> Generator[tuple[str, Any]]:
    """Distribute tasks to worker processes in the given order and yield their events as they occur.

    Close the generator (`contextlib.closing`) to end what its workers do at once; the processes end with it,
    but for `comparison.execution.worker_process.kept_workers`.

    Parameters
    ----------
    attempt
        A function of a module. It must not raise.
    tasks
        Names and what ``attempt`` is called with; must survive pickling.
    n_workers
        How many processes work at a time; they are started when there is work for them, and kept.
    limit
        s; a task that takes longer is terminated with its process. Counted from where it reports a share of
        0; until then, to start a process and to compile, it has `READY` times as long.
    environment
        Variables of the worker processes alone, for what a library reads only while its process starts.
    until
        Reading of `time.monotonic` at which all tasks are terminated; those that wait have no event.
    kernels
        Which code each task compiles, by name. The first that needs some has it compiled once it reports a
        share above 0; until then others that need it wait, and tasks behind them go first.

    Yields
    ------
    name, event
        The event is a `Share`, or else the last of this task: what ``attempt`` returned, `Died` or `Late`.
    """
    waiting = dict(tasks)
    compiling = Compiling(kernels or {})
    variables = dict(environment or {})
    idle = taken(variables)
    busy: dict[Any, tuple[Worker, str]] = {}
    ends: dict[Any, float] = {}
    shares: dict[Any, float] = {}
    try:
        while waiting or busy:
            if time.monotonic() >= until:
                waiting.clear()
                if not busy:
                    break
            while len(busy) < n_workers and (name := compiling.first_free(waiting)) is not None:
                task = waiting.pop(name)
                compiling.begin(name)
                worker = idle.pop() if idle else Worker(variables)
                busy[worker.connection] = (worker, name)
                ends[worker.connection] = min(until, time.monotonic() + READY * limit)
                shares[worker.connection] = 0.0
                with suppress(OSError):  # the worker is dead: its connection reads as ended below
                    worker.connection.send((attempt, task))
            next_end = min(ends[connection] for connection in busy)
            ready = wait(list(busy), None if next_end == inf else max(0.0, next_end - time.monotonic()))
            for connection in [c for c in busy if c not in ready and ends[c] <= time.monotonic()]:
                worker, name = busy.pop(connection)
                worker.process.kill()
                worker.process.join()
                compiling.end(name)
                yield name, Late(shares[connection])
            for connection in ready:
                worker, name = busy[connection]
                try:
                    event = worker.connection.recv()
                except (EOFError, OSError):
                    worker.process.join()
                    event = Died(worker.process.exitcode)
                if not isinstance(event, Share) or event.value > 0.0:
                    compiling.end(name)
                if isinstance(event, Share):
                    shares[connection] = event.value
                    if event.value == 0.0:
                        ends[connection] = min(until, time.monotonic() + limit)
                else:
                    del busy[connection]
                    if not isinstance(event, Died):
                        idle.append(worker)
                yield name, event
    finally:
        give_back(idle)
        end([worker for worker, _ in busy.values()])
