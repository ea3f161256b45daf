"""Faults of a disk: the n-th change of a file fails, or files cannot grow beyond some bytes."""

from __future__ import annotations

import errno
import os
import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_CHANGES = ("os.rename", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_state: dict[str, Callable[[str, tuple], None] | None] = {"hook": None}


def _audit(event: str, arguments: tuple) -> None:
    if _state["hook"] is not None:
        _state["hook"](event, arguments)


def _changed(event: str, arguments: tuple) -> list[str]:
    """Return the paths that an operation creates or changes."""
    if event == "open":
        path, mode, flags = arguments
        writing = (isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or (
            isinstance(mode, str) and set(mode) & set("wax+")
        )
        return [os.fsdecode(path)] if writing and isinstance(path, str | bytes) else []
    if event in _CHANGES:
        return [os.fsdecode(path) for path in arguments[:2] if isinstance(path, str | bytes)]
    return []


@contextmanager
def failing(number: int, code: int, folder: Path) -> Iterator[list[str]]:
    """Let the ``number``-th change below a folder fail, and none after it; yields the changes so far."""
    if _audit not in _INSTALLED:
        sys.addaudithook(_audit)
        _INSTALLED.append(_audit)
    seen: list[str] = []

    def hook(event: str, arguments: tuple) -> None:
        for path in _changed(event, arguments):
            if folder in (Path.cwd() / path).parents:
                seen.append(f"{event} {path}")
                if len(seen) == number:
                    raise OSError(code, os.strerror(code), path if code == errno.EACCES else None)
                return

    _state["hook"] = hook
    try:
        yield seen
    finally:
        _state["hook"] = None


_INSTALLED: list[Callable[[str, tuple], None]] = []


@contextmanager
def small_files(size: int) -> Iterator[None]:
    """Let no file grow beyond a size: writes end in the middle, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }
