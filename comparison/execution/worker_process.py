"""Process of a worker: what it inherits, what it does, and how long it lives."""

from __future__ import annotations

import io
import multiprocessing
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from comparison.execution.garbage import collect_rarely

Attempt = Callable[[Any, Callable[[float], None]], Any]
"""What a worker does with a task: it gets the task and a function to report the finished share to."""


@dataclass(frozen=True)
class Share:
    """Finished share of a task, 0 to 1."""

    value: float


class Worker:
    """A spawned process, the variables added to its environment, and our end of its pipe."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        context = multiprocessing.get_context("spawn")
        self.environment = environment
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with _inherited(environment):
            self.process.start()
        theirs.close()  # so that the end of the process ends the connection


_kept: list[Worker] | None = None


@contextmanager
def kept_workers() -> Iterator[None]:
    """Let workers live on from one call of `work` to the next in this context.

    A process needs seconds to start and to load compiled code. Not the general rule: a worker does not see
    what happens to the sources, or to the environment of this process, after it was started.
    """
    global _kept
    if _kept is not None:
        yield
        return
    _kept = []
    try:
        yield
    finally:
        kept, _kept = _kept, None
        end(kept)


def taken(environment: Mapping[str, str]) -> list[Worker]:
    """Take those of the kept workers that have this environment; the others end."""
    if _kept is None:
        return []
    kept, _kept[:] = list(_kept), []
    fit = [w for w in kept if w.environment == environment and w.process.is_alive()]
    end([worker for worker in kept if worker not in fit])
    return fit


def give_back(workers: Sequence[Worker]) -> None:
    """Keep idle workers for the next one to take, or end them."""
    if _kept is None:
        end(workers)
    else:
        _kept.extend(workers)


def end(workers: Sequence[Worker]) -> None:
    """End workers at once, whatever they are doing."""
    for worker in workers:
        worker.process.terminate()
    for worker in workers:
        worker.process.join()


def _serve(connection: Connection) -> None:
    """Process tasks until the connection ends (in the worker)."""
    collect_rarely()
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # numpy's, of numbers that the checks of the run report
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for systems without a signal mask to inherit
    os.dup2(2, 1)  # what a model prints must not stand between the lines that a script reads from stdout
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)  # and must not be lost with a process that is ended
    with suppress(EOFError, OSError):
        while True:
            attempt, task = connection.recv()
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
