"""Console output: lines of results, progress, warnings, one-line errors."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

import typer

from comparison.cli.layout import printable

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

BETWEEN_LINES = 10.0
"""s; at least so long between two lines of progress in a log."""
SILENCE = 60.0
"""s; a line after this time even if little has changed."""
_STEP = 0.1  # share that is worth a line


class Reporter(Protocol):
    """What a command reports its progress to."""

    def __call__(self, share: float) -> None:
        """Report the finished share, 0 to 1."""

    def finished(self, share: float, what: str) -> None:
        """Report what has just been finished, and the finished share."""


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
    from comparison.execution.cache import cache_folder, cache_warnings
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


@contextmanager
def progress(text: str, *, quiet: bool = False) -> Iterator[Reporter]:
    """Show a progress bar on a terminal, plain lines in a log, and nothing if that is asked."""
    if quiet:
        yield _Silence()
    elif not sys.stderr.isatty():
        yield Lines(text)
    else:
        from rich.console import Console
        from rich.progress import Progress

        # Results are printed to stdout, which must not go where the bar goes.
        with Progress(console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
            yield _Bar(bar, bar.add_task(text, total=1.0), text)


class _Silence:
    def __call__(self, share: float) -> None:
        pass

    def finished(self, share: float, what: str) -> None:
        pass


class _Bar:
    """A bar with what was finished last beside its name."""

    def __init__(self, bar: RichProgress, task: TaskID, text: str) -> None:
        self._bar, self._task, self._text = bar, task, text

    def __call__(self, share: float) -> None:
        self._bar.update(self._task, completed=share)

    def finished(self, share: float, what: str) -> None:
        self._bar.update(self._task, completed=share, description=f"{self._text}, {what}")


class Lines:
    """Progress as plain lines on stderr, for a file or a pipe.

    A line for what was finished, or for another tenth of the work, at most one in `BETWEEN_LINES`; and one
    after a `SILENCE`. Nothing at the end: then the result follows.

    Parameters
    ----------
    text
        What is under way.
    clock
        Time in s.
    """

    def __init__(self, text: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._text, self._clock = text, clock
        self._printed = clock()
        self._share = self._shown = 0.0
        self._finished = ""
        self._first: tuple[float, float] | None = None  # time and share of the first report

    def __call__(self, share: float) -> None:
        """Report the finished share, 0 to 1."""
        self._share, now = share, self._clock()
        self._first = self._first or (now, share)
        since = now - self._printed
        # The small addend undoes the rounding of the difference alone.
        changed = self._finished or share - self._shown >= _STEP - 1e-9
        if share < 1.0 and ((changed and since >= BETWEEN_LINES) or since >= SILENCE):
            self._print(now)

    def finished(self, share: float, what: str) -> None:
        """Report what has just been finished; where it is too early for a line, the next one has it."""
        self._finished = what
        self(share)

    def _print(self, now: float) -> None:
        self._printed, self._shown = now, self._share
        start, before = self._first or (now, self._share)
        said = f"{self._share:.0%}"
        if self._share > before:  # cached runs are there at once, and tell nothing about the others
            rest = (now - start) * (1.0 - self._share) / (self._share - before)
            said += f", about {rest / 60.0:.0f} min left" if rest >= 60.0 else ", less than a minute left"
        if self._finished:
            said += f"; {self._finished}"
        self._finished = ""
        say(f"sixbar: {self._text}: {said}", err=True)


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
    reported = f"internal error: {type(error).__name__}: {error}{place}"
    return f"{reported}; please report this line, the command and the output of sixbar --version", 70


def is_refusal(error: Exception) -> bool:
    """Whether an error says in one line what is wrong with the input."""
    from comparison.accuracy.levels import AccuracyError
    from comparison.engines.registry import EngineError
    from comparison.execution.ledger import LedgerError
    from comparison.files import FolderError
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
