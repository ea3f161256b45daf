"""Progress of a command: a bar on a terminal, plain lines in a log."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from comparison.cli.console import say, warn_about_the_cache

BETWEEN_LINES = 10.0
"""s; at least so long between two lines of progress in a log."""
SILENCE = 60.0
"""s; a line after this time even if little has changed."""
Reporter = Callable[..., None]
"""What a command tells its finished share, 0 to 1, and what has just been finished ("" where nothing)."""


@contextmanager
def progress(text: str, *, quiet: bool = False) -> Iterator[Reporter]:
    """Show a progress bar on a terminal, plain lines in a log, and nothing if that is asked."""
    warn_about_the_cache()
    if quiet:
        yield _silence
    elif not sys.stderr.isatty():
        yield Lines(text)
    else:
        from rich.console import Console
        from rich.progress import Progress

        # Results are printed to stdout, which must not go where the bar goes.
        with Progress(console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
            task = bar.add_task(text, total=1.0)

            def show(share: float, finished: str = "") -> None:
                bar.update(task, completed=share, description=f"{text}, {finished}" if finished else None)

            yield show


def _silence(share: float, finished: str = "") -> None:
    pass


class Lines:
    """Progress as plain lines on stderr, for a file or a pipe, of what is under way by a clock in s.

    A line for what was finished, or for another tenth of the work, at most one in `BETWEEN_LINES`; and one
    after a `SILENCE`. Nothing at the end: then the result follows.
    """

    def __init__(self, text: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._text, self._clock = text, clock
        self._printed, self._shown, self._finished = clock(), 0.0, ""
        self._first: tuple[float, float] | None = None  # time and share of the first report

    def __call__(self, share: float, finished: str = "") -> None:
        """Report the finished share; where it is too early for a line, the next one has what was finished."""
        now = self._clock()
        self._first = start, before = self._first or (now, share)
        self._finished = finished or self._finished
        # The small addend undoes the rounding of the difference alone.
        changed = self._finished or share - self._shown >= 0.1 - 1e-9
        if share >= 1.0 or now - self._printed < (BETWEEN_LINES if changed else SILENCE):
            return
        line = f"{share:.0%}"
        if share > before:  # cached runs are there at once, and tell nothing about the others
            rest = (now - start) * (1.0 - share) / (share - before)
            line += f", about {rest / 60.0:.0f} min left" if rest >= 60.0 else ", less than a minute left"
        if self._finished:
            line += f"; {self._finished}"
        self._printed, self._shown, self._finished = now, share, ""
        say(f"sixbar: {self._text}: {line}", err=True)
