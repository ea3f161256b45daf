"""Faults of a disk: the n-th change of a file fails."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_CHANGES = ("os.rename", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_hooks: list[Callable[[str, tuple], None]] = []


def _audit(event: str, arguments: tuple) -> None:
    for hook in _hooks:
        hook(event, arguments)


sys.addaudithook(_audit)


def _changed(event: str, arguments: tuple) -> list[str]:
    """Return the paths that an operation creates or changes."""
    if event == "open":
        _, mode, flags = arguments
        writing = (isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or (
            isinstance(mode, str) and set(mode) & set("wax+")
        )
        paths = arguments[:1] if writing else ()
    else:
        paths = arguments[:2] if event in _CHANGES else ()
    return [os.fsdecode(path) for path in paths if isinstance(path, str | bytes)]


@contextmanager
def failing(number: int, code: int, folder: Path) -> Iterator[list[str]]:
    """Let the ``number``-th change below a folder fail, and none after it; yields the changes so far."""
    seen: list[str] = []

    def hook(event: str, arguments: tuple) -> None:
        for path in _changed(event, arguments):
            if folder in (Path.cwd() / path).parents:
                seen.append(f"{event} {path}")
                if len(seen) == number:
                    raise OSError(code, os.strerror(code), path if code == errno.EACCES else None)
                return

    _hooks.append(hook)
    try:
        yield seen
    finally:
        _hooks.clear()


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }
