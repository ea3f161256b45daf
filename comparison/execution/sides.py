"""Sides of a judgement: runs of a Python function, a command or an FMU at a setting, from a moved start.

The table that a command or an FMU writes is stored by the hash of its words, with setting and start, and of
the files that they name; a function always runs.
"""

import hashlib
import pickle
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib.util import find_spec
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.pool import Death, Share, Timeout, work
from comparison.execution.run import Progress
from comparison.execution.store import fetch_file, keep_file
from comparison.files import json_text
from comparison.scene import digest
from comparison.tables.arguments import as_source
from comparison.tables.channels import Array
from comparison.tables.dialect import Source
from comparison.tables.foreign import open_source
from comparison.tables.mapping import Dialect
from comparison.tables.table import TableError

_LONGEST_NAME = 256  # characters of a file's name
_LONGEST = 300  # characters of an error in a message
_CACHE_NOTE = "stored runs of the same command and files are used"


class SolverError(TableError):
    """Run of a side that failed; the message is one line."""


Function = Callable[[float, Array], pd.DataFrame]
"""Takes the setting and the offsets of the start, one a state; returns a table with its times."""


@dataclass(frozen=True)
class Command:
    """Program that writes a table; of its words ``{tolerance}``, ``{start}`` and the like are replaced."""

    text: str  # as the user has written it
    words: tuple[str, ...]
    folder: Path  # its working directory

    @cached_property
    def files(self) -> dict[str, str]:
        """Hashes of its program, of files and modules that its words name, and of Python files beside.

        For a folder that a word names there are the sizes and times of the files below.
        """
        parts = [part for word in self.words for part in (word, *word.replace("'", " ").split())]
        names = {name for part in parts for name in (part, part.partition("=")[2])}
        names = {name for name in names if name.strip("./") and len(name) < _LONGEST_NAME}
        paths = [self.folder / path for name in names for path in (name, name.replace(".", "/"))]
        program = Path(shutil.which(self.words[0]) or "")
        hashes = {"": str(program)}
        for path in [program, *paths, *self.folder.glob("*.py")]:
            if path.is_file():
                with path.open("rb") as file:
                    hashes[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()
        for path in (path for folder in paths if folder.is_dir() for path in folder.rglob("*")):
            if path.is_file() and path.suffix != ".pyc":
                hashes[str(path)] = f"{path.stat().st_size} {path.stat().st_mtime_ns}"
        return dict(sorted(hashes.items()))

    def run(self, values: Mapping[str, str], limit: float) -> tuple[bytes, bool]:
        """Return the table that it writes within the limit, s, and whether it was stored.

        Without a table it raises a `SolverError`.
        """
        words = [_fill(word, values) for word in self.words]
        key = digest({"words": words, "files": self.files, "folder": str(self.folder)})
        if (result := fetch_file(key)) is not None:
            return result, True
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "run.csv")
            words = [word.replace("{out}", str(out)) for word in words]
            try:
                process = subprocess.run(
                    words,
                    cwd=self.folder,
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    timeout=limit,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise SolverError(f"stopped after {limit:g} s: {self.text}") from None
            except OSError as error:
                missing = isinstance(error, FileNotFoundError) and f"no program {words[0]!r} on the PATH"
                raise SolverError(f"cannot be run: {missing or error.strerror}: {self.text}") from error
            if process.returncode < 0:
                raise SolverError(f"was ended by {signal.Signals(-process.returncode).name}: {self.text}")
            if process.returncode:
                lines = (process.stderr or process.stdout).decode(errors="replace").split("\n")
                last = next((line.strip() for line in reversed(lines) if line.strip()), "no message")
                raise SolverError(f"ended with code {process.returncode}: {last[:_LONGEST]} ({self.text})")
            if not out.is_file():
                raise SolverError(f"has written no table to {{out}}: {self.text}")
            content = out.read_bytes()
        keep_file(key, content)
        return content, False


@dataclass(frozen=True)
class Side:
    """One of two solvers, with the setting that controls its error.

    A level finer divides the setting by ``factor``; the error then falls by factor^order, nan if not stated.
    """

    label: str
    solver: Function | Command | None
    kind: str  # "tolerance" or "step"
    setting: float = nan  # in s if it is a step
    factor: float = nan
    order: float = nan
    files: tuple[Path, ...] = ()  # without a solver: a table and its repetitions

    def at(self, level: int) -> float:
        """Return the setting so many levels finer than the stated one."""
        return float(f"{self.setting / self.factor**level:.12g}")


@dataclass(frozen=True)
class Run:
    """Run of a side at a level, or its file of this number, with the offsets of its start, one a state."""

    side: Side
    level: int
    start: tuple[float, ...]

    def values(self) -> dict[str, str]:
        """Return the values of the names in the words of a command."""
        start = ",".join(map(repr, self.start))
        # A value that begins with a minus would be taken for an option.
        start = f" {start}" if start.startswith("-") else start
        if self.side.files:
            return {"file": self.side.files[self.level].name}
        return {self.side.kind: repr(self.side.at(self.level)), "start": start}


def command_side(text: str, folder: Path, needs: Sequence[str]) -> Command:
    """Return a command, whose words must hold the names that it needs; a `SolverError` if they do not."""
    try:
        words = tuple(shlex.split(text))
    except ValueError as error:
        raise SolverError(f"command = {text!r}: {error}") from error
    if missing := [f"{{{name}}}" for name in (*needs, "out") if f"{{{name}}}" not in text]:
        raise SolverError(f"command = {text!r} must hold {missing[0]}, which a run replaces by its own value")
    if "{start}" in text and "start" not in needs:
        raise SolverError(f"command = {text!r} holds {{start}}, and [start] states names no state")
    return Command(text, words, folder)


def fmu_side(path: Path, folder: Path, setting: str, options: Mapping[str, Any]) -> Command:
    """Return the command that runs an FMU: `comparison.execution.fmu` has the options."""
    if find_spec("fmpy") is None:
        raise SolverError(f"{path}: an FMU needs fmpy: pip install 'sixbar-crossval[fmu]'")
    if not (folder / path).is_file():
        raise SolverError(f"{path}: there is no such file")
    program = (sys.executable, "-P", "-m", "comparison.execution.fmu", str(folder / path))
    words = *program, setting, f"{{{setting}}}", "{start}", "{out}", json_text(options)
    return Command(str(path), words, folder)


def run_sides(
    runs: Sequence[Run],
    dialects: Sequence[Dialect],
    work_limits: tuple[int, float],
    on_progress: Progress,
) -> list[Source | SolverError]:
    """Return the table or the error of each run; ``work_limits``: number at a time, time limit in s.

    With up to one job functions run in this process, without a limit; more are spawned, and a script needs
    ``if __name__ == "__main__":``. Commands are processes of their own in any case.
    """
    results: dict[int, Source | SolverError] = {}
    with closing(_results(runs, *work_limits)) as outcomes:
        for number, result in outcomes:
            results[number] = _source_of(result, runs[number], dialects[number])
            on_progress(len(results) / len(runs))
    return [results[number] for number in range(len(runs))]


def _results(runs: Sequence[Run], n_jobs: int, limit: float) -> Generator[tuple[int, Any]]:
    """Yield number and table, or error, of each run when it ends."""
    calls = {n: (run.side.solver, run.side.at(run.level), np.array(run.start)) for n, run in enumerate(runs)}
    commands = {n: call[0] for n, call in calls.items() if isinstance(call[0], Command)}
    functions = {n: call for n, call in calls.items() if n not in commands}
    pool = ThreadPoolExecutor(max(1, n_jobs))  # they wait for processes
    try:
        futures = {
            pool.submit(_attempt, partial(c.run, runs[n].values(), limit)): n for n, c in commands.items()
        }
        if n_jobs > 1 and functions:
            try:
                pickle.dumps(functions)
            except Exception as error:
                raise SolverError(f"n_jobs = {n_jobs} takes functions of a module alone: {error}") from None
            with closing(
                work(_call, [(str(n), call) for n, call in functions.items()], n_jobs, limit)
            ) as events:
                for name, event in events:
                    if isinstance(event, Death | Timeout):
                        words = event.words if isinstance(event, Death) else f"stopped after {limit:g} s"
                        yield int(name), SolverError(words)
                    elif not isinstance(event, Share):
                        yield int(name), event
        else:
            for n, call in functions.items():
                yield n, _call(call)
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _call(call: tuple[Any, float, Array], report: Progress | None = None) -> Any:
    """Call a function with setting and start; its error becomes a `SolverError` (in the worker)."""
    function, setting, start = call
    if report:
        report(0.0)
    return _attempt(partial(function, setting, start))


def _attempt(run: Callable[[], Any]) -> Any:
    try:
        return run()
    except SolverError as error:
        return error
    except Exception as error:
        return SolverError(" ".join(f"{type(error).__name__}: {error}".split())[:_LONGEST])


def _source_of(result: Any, run: Run, dialect: Dialect) -> Source | SolverError:
    """Return the table of a run under its side's name, or its error."""
    label = run.side.label
    if isinstance(result, SolverError):
        return SolverError(f"{label}, {run.side.kind} {run.side.at(run.level):g}: {result}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, label.replace("/", "-"))
        try:
            if isinstance(result, tuple):
                content, is_stored = result
                path.write_bytes(content)
                source = open_source(path, dialect)
                notes = [*source.notes, *[_CACHE_NOTE] * is_stored]
                return replace(source, path=Path(label), notes=notes)
            frame = as_source(result, label)
        except TableError as error:
            return SolverError(str(error).replace(str(path), label))
    refusal = SolverError(f"{label}: must return a pandas data frame, not a path")
    return refusal if isinstance(frame, Path) else frame


def _fill(word: str, values: Mapping[str, str]) -> str:
    for name, value in values.items():
        word = word.replace(f"{{{name}}}", value)
    return word
