"""Console output: lines that fit the terminal, warnings, one-line errors."""

import json
import logging
import os
import shutil
import sys
import textwrap
import unicodedata
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import typer

INTERRUPTED = 130
_COLOURS = {"agree": "green", "differ": "red", "cannot compare": "red", "indeterminate": "yellow"}
_HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories of what a terminal would obey instead of showing it."""
_LEAST = 12  # columns of a text that is cut


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
    logger, handler = logging.getLogger("comparison"), logging.Handler(logging.WARNING)
    handler.emit = lambda record: warn([record.getMessage()])  # type: ignore[method-assign]
    logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            if program and not sys.warnoptions:
                warnings.simplefilter("ignore")
            yield
    finally:
        logger.removeHandler(handler)


def say(*lines: str, err: bool = False) -> None:
    """Print lines; control characters of names and headers are shown, not obeyed."""
    for line in lines:
        typer.echo(printable(line), err=err)


def say_wrapped(*texts: str, rest: str = "", err: bool = False) -> None:
    """Print texts, each wrapped to the terminal's width."""
    for text in texts:
        say(*wrapped(text, rest=rest), err=err)


def print_json(value: object) -> int:
    """Print a value as JSON (numbers that are not finite as null) and return 0."""
    from comparison.files import plain

    typer.echo(json.dumps(plain(value), indent=1, ensure_ascii=False, allow_nan=False))
    return 0


def printable(text: str) -> str:
    r"""Escape what is not shown by itself: ``\x1b``, but for the colours of this module."""
    return "".join(
        character.encode("unicode_escape").decode()
        if character not in "\n\t" and unicodedata.category(character) in _HIDDEN
        else character
        for character in text
    )


def coloured(text: str) -> str:
    """Return a verdict in its colour; plain where ``$NO_COLOR`` is set. A file gets no colours."""
    colour = None if os.environ.get("NO_COLOR") else _COLOURS.get(text.strip())
    return text if colour is None else typer.style(text, fg=colour)


def _width() -> int:
    """Return the columns of the terminal, or ``$COLUMNS``; 80 where stdout is a file or a pipe."""
    return shutil.get_terminal_size((80, 24)).columns


def columns(
    rows: Sequence[Sequence[str]], *, right: Collection[int] = (), verdict: int | None = None
) -> list[str]:
    """Return rows, the headings first, as aligned lines; text too long for the last column is cut."""
    rows = [[printable(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    last = len(widths) - 1
    if last not in right:
        widths[last] = min(widths[last], max(_width() - sum(widths[:-1]) - 2 * last, _LEAST))
    lines = []
    for row in rows:
        cells = []
        for number, (cell, wide) in enumerate(zip(row, widths, strict=True)):
            cut = cell if len(cell) <= wide else cell[: max(0, wide - 3)].rstrip() + "..."
            cells.append(cut.rjust(wide) if number in right else cut.ljust(wide))
        while cells and not cells[-1].strip():
            cells.pop()
        if cells:
            cells[-1] = cells[-1].rstrip()
        lines.append("  ".join(coloured(cell) if n == verdict else cell for n, cell in enumerate(cells)))
    return lines


def wrapped(text: str, *, first: str = "", rest: str | None = None) -> list[str]:
    """Return a text as lines that fit, indented by ``first`` and ``rest``; no name is broken."""
    return textwrap.wrap(
        printable(text),
        max(_width(), 40),
        initial_indent=first,
        subsequent_indent=" " * len(first) if rest is None else rest,
        break_long_words=False,
        break_on_hyphens=False,
    )


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to stderr."""
    say(*(f"sixbar: warning: {' '.join(warning.split())}" for warning in warnings), err=True)


def warn_about_the_cache() -> None:
    """Warn once per command where nothing, or not the usual folder, is the cache."""
    from comparison.execution.store import cache_folder, cache_warnings
    from comparison.files import FolderError

    messages = cache_warnings()
    warn(messages)
    with suppress(FolderError):
        if messages:  # nor could matplotlib keep its fonts in the usual place
            os.environ.setdefault("MPLCONFIGDIR", str(cache_folder() / "matplotlib"))


def complain(text: str, code: int) -> int:
    """Print one line to stderr and return the exit code."""
    with suppress(OSError):  # nobody reads it, or the disk that it goes to is full
        say(f"sixbar: {' '.join(text.split())}", err=True)
    return code


def described(error: Exception) -> tuple[str, int]:
    """Return the message and the exit code of an error; an internal one asks for a report."""
    from comparison.execution.run import RunError

    if isinstance(error, RunError):
        return str(error), 70 if error.outcome.status == "crashed" else 2
    if is_refusal(error):
        return str(error), 2
    if isinstance(error, OSError):  # of the machine, not of this program; a full disk may not name its file
        where = "a file" if error.filename is None else os.fsdecode(error.filename)
        return f"{where}: cannot be read or written: {error.strerror or error}", 2
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = f" at {Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
    message = f"internal error: {type(error).__name__}: {error}{place}"
    return f"{message}; please report this line, the command and the output of sixbar --version", 70


def is_refusal(error: Exception) -> bool:
    """Whether an error is one of this package, which says in one line what is wrong with the input."""
    from comparison.execution.run import RunError

    return type(error).__module__.startswith("comparison.") and not isinstance(error, RunError)
