"""Progress of a command: a bar on a terminal, plain lines in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from comparison.cli.console import say

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
        line = f"{self._share:.0%}"
        if self._share > before:  # cached runs are there at once, and tell nothing about the others
            rest = (now - start) * (1.0 - self._share) / (self._share - before)
            line += f", about {rest / 60.0:.0f} min left" if rest >= 60.0 else ", less than a minute left"
        if self._finished:
            line += f"; {self._finished}"
        self._finished = ""
        say(f"sixbar: {self._text}: {line}", err=True)
