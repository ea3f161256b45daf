"""Console output: lines of results, warnings, one-line errors."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import typer

from comparison.cli.layout import printable

T = TypeVar("T")


class _Warnings(logging.Handler):
    """Prints the warnings of this package's loggers."""

    def emit(self, record: logging.LogRecord) -> None:
        warn([record.getMessage()])


@contextmanager
def session(*, program: bool) -> Iterator[None]:
    """Prepare the streams; a program shows Python's warnings only if it was asked for them."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started us: the next file would take its number
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), "r" if name == "stdin" else "w"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # such as in an ASCII locale
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it warns of a home that cannot be written
    logger, handler = logging.getLogger("comparison"), _Warnings(logging.WARNING)
    logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            if program and not sys.warnoptions:
                warnings.simplefilter("ignore")
            yield
    finally:
        logger.removeHandler(handler)


def say(text: str, *, err: bool = False) -> None:
    """Print lines; control characters of names and headers are shown, not obeyed."""
    typer.echo(printable(text), err=err)


def warn_about_the_cache() -> None:
    """Warn once per command where nothing, or not the usual folder, is the cache."""
    from comparison.execution.store import cache_folder, cache_warnings
    from comparison.files import FolderError

    found = cache_warnings()
    warn(found)
    with suppress(FolderError):
        if found:  # nor could matplotlib keep its fonts in the usual place
            os.environ.setdefault("MPLCONFIGDIR", str(cache_folder() / "matplotlib"))


def saved(write: Callable[[Path], T], folder: Path) -> T:
    """Write results into a folder; if that fails, into a temporary one, so that no run was for nothing.

    Raises
    ------
    FolderError
        If the folder cannot be written, with the place of the results.
    """
    from comparison.files import FolderError
    from comparison.tables.table import TableError

    try:
        return write(folder)
    except (OSError, TableError) as error:
        reason = _line(error)
        try:
            instead = Path(tempfile.mkdtemp(prefix="sixbar-"))
            write(instead)
        except (OSError, TableError):
            raise FolderError(reason) from error
        raise FolderError(f"{reason}; the results are in {instead}") from error


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to stderr."""
    for warning in warnings:
        say(f"sixbar: warning: {' '.join(warning.split())}", err=True)


def fail(error: Exception) -> int:
    """Print a one-line error message and return its exit code."""
    return complain(*described(error))


def described(error: Exception) -> tuple[str, int]:
    """Return the message and the exit code of an error; an internal one asks for a report."""
    from comparison.execution.run import RunError

    if isinstance(error, RunError):
        return str(error), 70 if error.outcome.status == "crashed" else 2
    if is_refusal(error):
        return str(error), 2
    if isinstance(error, OSError):  # of the machine, not of this program
        return _line(error), 2
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = (
        f" at {Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace is not None else ""
    )
    message = f"internal error: {type(error).__name__}: {error}{place}"
    return f"{message}; please report this line, the command and the output of sixbar --version", 70


def is_refusal(error: Exception) -> bool:
    """Whether an error says in one line what is wrong with the input."""
    from comparison.accuracy.levels import AccuracyError
    from comparison.execution.store import LedgerError
    from comparison.files import FolderError
    from comparison.models import EngineError
    from comparison.regression.baseline import BaselineError
    from comparison.scene import SceneError
    from comparison.tables.table import TableError

    ours = SceneError | TableError | AccuracyError | BaselineError | FolderError | EngineError | LedgerError
    return isinstance(error, ours)


def complain(text: str, code: int) -> int:
    """Print one line to stderr and return the exit code."""
    with suppress(OSError):  # nobody reads it, or the disk that it goes to is full
        say(f"sixbar: {' '.join(text.split())}", err=True)
    return code


def _line(error: Exception) -> str:
    """Return where and what; an error of writing, such as on a full disk, may not name its file."""
    if not isinstance(error, OSError):
        return str(error)
    where = "a file" if error.filename is None else os.fsdecode(error.filename)
    return f"{where}: cannot be read or written: {error.strerror or error}"
