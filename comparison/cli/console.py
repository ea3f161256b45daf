"""Console output besides results: progress, warnings, one-line errors."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer

BETWEEN_LINES = 60.0
"""s; between two lines of progress in a log."""


@contextmanager
def progress(text: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on a terminal, and a line a minute in a log."""
    if not sys.stderr.isatty():
        yield _lines(text)
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(text, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def _lines(text: str) -> Callable[[float], None]:
    """Return what prints the finished share to stderr, at most once in `BETWEEN_LINES`."""
    started = printed = time.monotonic()

    def report(share: float) -> None:
        nonlocal printed
        now = time.monotonic()
        if now - printed < BETWEEN_LINES or share >= 1.0:
            return
        printed = now
        left = f", about {(now - started) * (1.0 / share - 1.0) / 60.0:.0f} min left" if share > 0.0 else ""
        typer.echo(f"sixbar: {text}: {share:.0%}{left}", err=True)

    return report


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to stderr."""
    for warning in warnings:
        typer.echo(f"sixbar: warning: {warning}", err=True)


def fail(error: Exception) -> int:
    """Print a one-line error message and return its exit code; an internal error asks for a report."""
    from comparison.accuracy.levels import AccuracyError
    from comparison.engines.registry import EngineError
    from comparison.execution.ledger import LedgerError
    from comparison.execution.run import RunError
    from comparison.files import FolderError
    from comparison.regression.baseline import BaselineError
    from comparison.scene import SceneError
    from comparison.tables.table import TableError

    if isinstance(error, RunError):
        return complain(str(error), 70 if error.outcome.status == "crashed" else 2)
    ours = SceneError | TableError | AccuracyError | BaselineError | FolderError | EngineError | LedgerError
    if isinstance(error, ours):
        return complain(str(error), 2)
    if isinstance(error, OSError) and error.filename is not None:
        return complain(f"{error.filename}: {error.strerror}", 2)
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = (
        f" at {Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace is not None else ""
    )
    reported = f"internal error: {type(error).__name__}: {error}{place}"
    return complain(
        f"{reported}; please report this line, the command and the output of sixbar --version", 70
    )


def complain(text: str, code: int) -> int:
    """Print one line to stderr and return the exit code."""
    typer.echo(f"sixbar: {' '.join(text.split())}", err=True)
    return code
