"""Common parts of the commands: lines that fit the terminal, warnings, errors, progress, options."""

import inspect
import json
import logging
import os
import shutil
import signal
import sys
import textwrap
import threading
import time
import unicodedata
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

INTERRUPTED = 130
_COLOURS = {"agree": "green", "differ": "red", "cannot compare": "red", "indeterminate": "yellow"}
_HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories of characters that a terminal obeys instead of showing them."""
_LEAST = 12  # smallest width of a column whose text is cut


@contextmanager
def session(*, program: bool) -> Iterator[None]:
    """Prepare streams and logging; a program hides Python's warnings unless Python's -W shows them."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started us: the next file would take its number
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), "r" if name == "stdin" else "w"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # such as in an ASCII locale
    if program:  # a job that is cancelled ends as by Ctrl-C
        signal.signal(signal.SIGTERM, signal.default_int_handler)
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
    from comparison.files import json_value

    typer.echo(json.dumps(json_value(value), indent=1, ensure_ascii=False, allow_nan=False))
    return 0


def printable(text: str) -> str:
    r"""Escape control characters, as ``\x1b``."""
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
            text = cell if len(cell) <= wide else cell[: max(0, wide - 3)].rstrip() + "..."
            cells.append(text.rjust(wide) if number in right else text.ljust(wide))
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


def complain(text: str, code: int) -> int:
    """Print one line to stderr and return the exit code."""
    with suppress(OSError):  # nobody reads it, or the disk that it goes to is full
        say(f"sixbar: {' '.join(text.split())}", err=True)
    return code


def describe_error(error: Exception) -> tuple[str, int]:
    """Return message and exit code of an error; an internal error asks for a report."""
    from comparison.execution.run import RunError

    if isinstance(error, RunError):
        return str(error), 70 if error.outcome.status == "crashed" else 2
    if is_refusal(error):
        return str(error), 2
    if isinstance(error, OSError):  # a fault of the machine; a full disk may not name its file
        where = "a file" if error.filename is None else os.fsdecode(error.filename)
        return f"{where}: cannot be read or written: {error.strerror or error}", 2
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = f" at {Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
    message = f"internal error: {type(error).__name__}: {error}{place}"
    return f"{message}; please report this line, the command and the output of sixbar --version", 70


def is_refusal(error: Exception) -> bool:
    """Return whether an error is a refusal of the input by this package, with a message of one line."""
    from comparison.execution.run import RunError

    return type(error).__module__.startswith("comparison.") and not isinstance(error, RunError)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let Ctrl-C wait until files are written; it arrives in the main thread, unless it is ignored."""
    handler, interrupts = signal.getsignal(signal.SIGINT), list[int]()
    if threading.current_thread() is not threading.main_thread() or handler is signal.SIG_IGN:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if interrupts:
        raise KeyboardInterrupt


# ---- progress: a bar on a terminal, plain lines in a log

BETWEEN_LINES = 10.0
"""Least time between two lines of progress in a log, s."""
SILENCE = 60.0
"""Time after which a line follows even if little has changed, s."""
Reporter = Callable[..., None]
"""Function of the finished share, 0 to 1, and the name of the part just finished ("" without one)."""


@contextmanager
def progress(text: str, *, quiet: bool = False) -> Iterator[Reporter]:
    """Show a progress bar on a terminal, plain lines in a log, nothing if ``quiet``."""
    from comparison.execution.store import cache_warning

    warn(list(filter(None, [cache_warning()])))
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

            def show(share: float, part: str = "") -> None:
                bar.update(task, completed=share, description=f"{text}, {part}" if part else None)

            yield show


_FORESEEN = 0.1  # share of the work from which on its rest is estimated


def _silence(share: float, part: str = "") -> None:
    pass


class Lines:
    """Progress as plain lines on stderr, for a file or a pipe; ``clock`` returns seconds.

    A line for a finished part or another tenth of the work, at most one in `BETWEEN_LINES`; one after a
    `SILENCE`; none at the end, where the result follows.
    """

    def __init__(self, text: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._text, self._clock = text, clock
        self._last_time, self._last_share, self._part = clock(), 0.0, ""
        self._first: tuple[float, float] | None = None  # time and share of the first report

    def __call__(self, share: float, part: str = "") -> None:
        """Report the finished share; a part that finishes too early for a line is named in the next one."""
        now = self._clock()
        if share < self._last_share:  # further runs are needed
            self._first, self._last_share, part = None, 0.0, "further runs"
        self._first = start, before = self._first or (now, share)
        self._part = part or self._part
        # The small addend undoes the rounding of the difference alone.
        changed = self._part or share - self._last_share >= 0.1 - 1e-9
        if share >= 1.0 or now - self._last_time < (BETWEEN_LINES if changed else SILENCE):
            return
        line = f"{share:.0%}"
        # Not of cached runs alone, which say nothing about the time of others, nor of the first of many.
        if share > before and share >= _FORESEEN:
            rest = (now - start) * (1.0 - share) / (share - before)
            line += f", about {rest / 60.0:.0f} min left" if rest >= 60.0 else ", less than a minute left"
        if self._part:
            line += f"; {self._part}"
        self._last_time, self._last_share, self._part = now, share, ""
        say(f"sixbar: {self._text}: {line}", err=True)


# ---- arguments and options that several commands have

REPORTS = Path("reports/out")
"""Default parent folder of reports."""
MAIN = "150rpm-0.2mm"
"""The paper's central case."""
Options = TypeVar("Options")


def take_options(options: type[Options]) -> Callable[[Callable[[Options], int]], Callable[..., int]]:
    """Let a command take its options as one object of a dataclass, whose fields are annotated for typer."""

    def decorate(command: Callable[[Options], int]) -> Callable[..., int]:
        @wraps(command)
        def with_options(**values: Any) -> int:
            return command(options(**values))

        vars(with_options)["__signature__"] = inspect.signature(options, eval_str=True)
        return with_options

    return decorate


def option(metavar: str | None, text: str, *names: str, **more: Any) -> Any:
    """Return an option with the name of its value, its help, and names other than the parameter's."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


def scene_names() -> list[str]:
    """Return the names of the shipped scenes, for the shell's completion."""
    from comparison.scene import shipped_scenes
    from comparison.scene.loading import shipped_linkages

    return [*shipped_scenes(), *shipped_linkages()]


def check_positive(name: str, value: float | None) -> None:
    """Refuse a number that is not positive and finite."""
    if value is not None and not 0 < value < float("inf"):
        raise typer.BadParameter(f"{name} {value:g} must be a positive number")


def check_output(path: Path, ends: str) -> Path:
    """Return the path of a file that can be written; refuse any ending but ``ends``, ".svg or .png"."""
    from comparison.files import check_file

    if path.suffix.lower() not in ends.replace(" or", ",").split(", "):
        raise typer.BadParameter(f"{path}: the name must end in {ends}")
    return check_file(path)


def check_unique(names: list[str], where: str) -> None:
    """Refuse two scenes with the same name."""
    from comparison.scene import SceneError

    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a {where} must be unique")


# Hidden, since typer shows its type beside it; the text of each command describes it.
_SCENE = typer.Argument(metavar="SCENE", hidden=True, autocompletion=scene_names)
SceneName = Annotated[str, _SCENE]
SceneNames = Annotated[list[str] | None, _SCENE]
OfScene = Annotated[
    str | None,
    option(
        "SCENE", "Scene of the tables; by default the one recorded beside them.", autocompletion=scene_names
    ),
]
Model = Annotated[
    str,
    option(
        "NAME",
        "Model: reference, exudyn, or one of another package.",
        autocompletion=lambda: ["reference", "exudyn"],
    ),
]
Models = Annotated[
    str, option("NAME,NAME[,...]", "Two or more models: reference, exudyn, or those of installed packages.")
]
Overrides = Annotated[
    list[str] | None, option("KEY=VALUE", "Change a scene key, e.g. drive.speed_rpm=210.", "--set")
]
MappingFile = Annotated[
    Path | None, option("FILE", "TOML file that assigns another program's columns to channels.")
]
AtEvents = Annotated[str | None, option("left|right|both", "Which rows of a repeated time count.")]
Finer = Annotated[Path | None, option("FILE", "A run at a finer setting.")]
Until = Annotated[
    str | None, option("SECONDS|any", "Time until which the two have to be predictable and agree.")
]
Accuracy = Annotated[
    str | None, option("NAME|METRES", "draft, standard, strict, or the wanted error of slider_x in metres.")
]
AllowIndeterminate = Annotated[
    bool, option(None, "Exit with 0 where the verdict is indeterminate.", "--allow-indeterminate")
]
Jobs = Annotated[int | None, option("N", "Number of parallel runs; one per processor by default.", min=1)]
OutFolder = Annotated[Path | None, option("FOLDER", "Folder of the report; below reports/out by default.")]
Since = Annotated[
    Path | None, option("FOLDER", "An earlier report of these scenes: state what has moved since.")
]
Verbose = Annotated[bool, option(None, "Also print the reason of every verdict.", "--verbose", "-v")]
Quick = Annotated[
    bool, option(None, f"Standard tier only; of the shipped scenes only the main one, {MAIN}.", "--quick")
]
Quiet = Annotated[bool, option(None, "No progress; only the last lines of the result.", "--quiet", "-q")]
NoProgress = Annotated[bool, option(None, "No progress.", "--quiet", "-q")]
AsJson = Annotated[bool, option(None, "Print all numbers as JSON instead of lines.", "--json")]
