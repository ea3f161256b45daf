"""Isolated worker processes: a task that kills its process affects no other task.

``multiprocessing`` is used directly: a ``ProcessPoolExecutor`` and loky abandon all of their tasks when one
process dies; pebble's limit counts compilation, and its workers cannot report progress.
"""

import io
import multiprocessing
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from math import inf
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from threading import Thread
from typing import Any

Attempt = Callable[[Any, Callable[[float], None]], Any]
"""Work of a worker: takes the task and a function that reports the finished share."""
READY = 10.0
"""Multiple of its limit that a task may take before its own work begins."""


@dataclass(frozen=True)
class Share:
    """Finished share of a task, 0 to 1."""

    value: float


@dataclass(frozen=True)
class Death:
    """The process of a task ended before the task."""

    words: str
    """The end of the process, as a clause."""


@dataclass(frozen=True)
class Timeout:
    """The task was stopped at its time limit, with the share finished by then."""

    share: float


class _Worker:
    """A spawned process, our end of its pipe, its task, and the time at which that is terminated."""

    task: str
    share: float
    end: float

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, remote = context.Pipe()
        self.process = context.Process(target=_serve, args=(remote,), daemon=True)
        with _inherited():
            self.process.start()
        remote.close()  # so that the end of the process ends the connection

    def event(self) -> Any:
        """Wait for its next event: of its task, or its death."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
        code = self.process.exitcode or 0
        end = f"ended with code {code}" if code >= 0 else f"was killed by {signal.Signals(-code).name}"
        return Death(f"its process {end}")


_idle: list[_Worker] = []
_keep_idle = False


def cpus() -> int:
    """Return the number of CPUs available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def work(
    attempt: Attempt,
    tasks: Sequence[tuple[str, Any]],
    n_workers: int,
    limit: float = inf,
    until: float = inf,
    groups: Mapping[str, object] | None = None,
) -> Generator[tuple[str, Any]]:
    """Distribute (name, task) pairs to worker processes in this order and yield their events as they occur.

    An event is a `Share`, or the last of its task: the result of ``attempt`` (a function of a module that
    must not raise), `Death` or `Timeout`. Closing the generator (`contextlib.closing`) ends its workers at
    once, except within `kept_workers`. At most ``n_workers`` work at a time. Of the tasks of one kind (by
    name, in ``groups``) one works alone until the first event of any, to compile what the others load.

    A task that takes longer than the limit (s) is terminated with its process: counted from where it reports
    a share of 0; until then, to start a process and to compile, it has `READY` times as long. At ``until``,
    by `time.monotonic`, all are terminated; tasks not yet begun have no event.
    """
    queue, group, reported = list(tasks), groups or {}, set[object]()
    busy: dict[Any, _Worker] = {}  # by connection

    def place() -> int | None:
        """Return the place of the first task that may start; None without one or without a worker."""
        alone = {group[worker.task] for worker in busy.values() if worker.task in group} - reported
        places = (
            n for n, (name, _) in enumerate(queue) if len(busy) < n_workers and group.get(name) not in alone
        )
        return next(places, None)

    try:
        while queue or busy:
            if time.monotonic() >= until:
                queue.clear()
            while (n := place()) is not None:
                worker = _take()
                worker.share, (worker.task, task) = 0.0, queue.pop(n)
                worker.end = min(until, time.monotonic() + READY * limit)
                busy[worker.connection] = worker
                with suppress(OSError):  # the worker is dead: its connection reads as ended below
                    worker.connection.send((attempt, task))
            if not busy:
                break
            next_end = min(worker.end for worker in busy.values())
            ready = wait(list(busy), None if next_end == inf else max(0.0, next_end - time.monotonic()))
            for worker in [w for c, w in busy.items() if c not in ready and w.end <= time.monotonic()]:
                del busy[worker.connection]
                _end([worker])
                yield worker.task, Timeout(worker.share)
            for connection in ready:
                worker = busy[connection]
                event = worker.event()
                reported.add(group.get(worker.task))
                if isinstance(event, Share):
                    worker.share = event.value
                    if event.value == 0.0:
                        worker.end = min(until, time.monotonic() + limit)
                else:
                    del busy[connection]
                    if not isinstance(event, Death):
                        _idle.append(worker)
                yield worker.task, event
    finally:
        _end(busy.values())
        if not _keep_idle:
            _end_idle()


@contextmanager
def kept_workers(ahead: int = 0) -> Iterator[None]:
    """Let workers live on from one call of `work` to the next, since they take seconds to start.

    So many are started ``ahead``, to import the modules of runs while this process does. This is not the
    rule, since a worker does not see later changes of sources or variables.
    """
    global _keep_idle
    before, _keep_idle = _keep_idle, True
    try:
        _idle.extend(_Worker() for _ in range(ahead - len(_idle)))
        yield
    finally:
        _keep_idle = before
        if not _keep_idle:
            _end_idle()


def _take() -> _Worker:
    """Take an idle worker that is alive, else start one."""
    while _idle:
        if (worker := _idle.pop(0)).process.is_alive():
            return worker
    return _Worker()


def _end(workers: Iterable[_Worker]) -> None:
    workers = list(workers)
    for worker in workers:
        worker.process.kill()
    for worker in workers:
        worker.process.join()


def _end_idle() -> None:
    _end(_idle)
    _idle.clear()


@contextmanager
def _inherited() -> Iterator[None]:
    """Let processes started here inherit one thread for numpy, and no Ctrl-C.

    A terminal sends Ctrl-C to all processes; while Python starts, it would end in a traceback.
    """
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    before = dict(os.environ)
    mask = None
    if hasattr(signal, "pthread_sigmask"):
        # multiprocessing's own process first: whoever starts it has its mask cleared.
        resource_tracker.ensure_running()
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        os.environ.update(one_thread)
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _end_with_parent() -> None:
    """End this process, with its task, as soon as its parent has ended."""
    if parent := multiprocessing.parent_process():
        parent.join()
    os._exit(1)


def _serve(connection: Connection) -> None:
    """Process tasks until the connection ends (in the worker)."""
    Thread(target=_end_with_parent, daemon=True).start()
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # numpy's, of numbers that the checks of the run report
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for systems without a signal mask to inherit
    os.dup2(2, 1)  # a model's prints must not mix with the lines that a script reads from stdout
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # and must not be lost with a process that is ended

    def report(share: float) -> None:  # a share that is no number is the model's own error
        connection.send(Share(min(1.0, max(0.0, float(share)))))

    import_module("comparison.execution.run")
    with suppress(EOFError, OSError):
        while True:
            attempt, task = connection.recv()
            connection.send(attempt(task, report))
