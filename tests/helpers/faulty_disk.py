"""Faults of a disk: the n-th change of a file fails."""

import errno
import os
import sys
from contextlib import contextmanager
from pathlib import Path

_CHANGES = ("os.rename", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_hooks = []


def _audit(event, arguments):
    for hook in _hooks:
        hook(event, arguments)


sys.addaudithook(_audit)


def _changed(event, arguments):
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
def failing(number, code, folder):
    """Let the ``number``-th change below a folder fail, and none after it; yields the changes so far."""
    seen = []

    def hook(event, arguments):
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


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }
