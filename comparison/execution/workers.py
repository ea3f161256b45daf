"""Isolated worker processes: a task that kills its process affects no other task.

``multiprocessing`` is used directly, since a ``ProcessPoolExecutor`` abandons all of its tasks when one
process dies, without reporting which task it was. The limit of pebble's ``ProcessPool`` counts from when a
worker takes a task, compilation included, and its workers cannot report progress: the queue of events, the
limits and the signal masks would remain here.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import inf
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any

from comparison.execution.task_order import Compiling, Kernels

Attempt = Callable[[Any, Callable[[float], None]], Any]
"""What a worker does with a task: it gets the task and a function to report the finished share to."""


READY = 10.0
"""Times its limit that a task may take before its own work begins."""


@dataclass(frozen=True)
class Share:
    """Finished share of a task, 0 to 1."""

    value: float


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

    Close the generator (`contextlib.closing`) to end the workers at once.

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
    idle: list[_Worker] = []
    busy: dict[Any, tuple[_Worker, str]] = {}
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
                worker = idle.pop() if idle else _Worker(attempt, environment or {})
                busy[worker.connection] = (worker, name)
                ends[worker.connection] = min(until, time.monotonic() + READY * limit)
                shares[worker.connection] = 0.0
                with suppress(OSError):  # the worker is dead: its connection reads as ended below
                    worker.connection.send(task)
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
        workers = [*idle, *(worker for worker, _ in busy.values())]
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join()


class _Worker:
    """A spawned process and our end of its pipe."""

    def __init__(self, attempt: Attempt, environment: Mapping[str, str]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(attempt, theirs), daemon=True)
        with _inherited(environment):
            self.process.start()
        theirs.close()  # so that the end of the process ends the connection


def _serve(attempt: Attempt, connection: Connection) -> None:
    """Process tasks until the connection ends (in the worker)."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # numpy's, of numbers that the checks of the run report
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for systems without a signal mask to inherit
    os.dup2(2, 1)  # what a model prints must not stand between the lines that a script reads from stdout
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # and must not be lost with a process that is ended
    with suppress(EOFError, OSError):
        while True:
            task = connection.recv()
            connection.send(attempt(task, lambda share: connection.send(Share(_bounded(share)))))


def _bounded(share: float) -> float:
    """Return a share of 0 to 1, whatever a model reports; what is no number is its own error."""
    return min(1.0, max(0.0, float(share)))


@contextmanager
def _inherited(environment: Mapping[str, str]) -> Iterator[None]:
    """Set what a process that is started here inherits: variables, one thread for numpy, and no Ctrl-C.

    A terminal sends Ctrl-C to all processes, but to end workers is their parent's business. The signal is
    held back from the very start: while Python starts, it would end in a traceback.
    """
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    variables = {**environment, **one_thread}
    before = {name: os.environ.get(name) for name in variables}
    can_mask = hasattr(signal, "pthread_sigmask")
    if can_mask:
        # multiprocessing's own process first: whoever starts it has its mask cleared.
        resource_tracker.ensure_running()
    os.environ.update(variables)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]) if can_mask else set()
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        if can_mask:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
