"""Bounded reading and atomic writing of files: after an error a file is as it was before."""

import errno
import json
import math
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

LONGEST_NAME = 200
"""Longest file name, bytes: file systems allow 255, and the companions of a table have longer names."""
LARGEST_TEXT = 10_000_000
"""Largest size, bytes, of a file without samples: a mapping, the record of a run, a baseline."""


class FolderError(ValueError):
    """A file or folder that cannot be written; the message is one line."""


def contents(path: Path, most: int = LARGEST_TEXT) -> str:
    """Read a UTF-8 text, with or without its mark; raise an `OSError` if it exceeds ``most`` bytes."""
    with path.open("rb") as file:
        content = file.read(most + 1)  # a pipe has no size to ask for
    if len(content) > most:
        raise _too_large(path, most)
    return content.decode("utf-8-sig")


@contextmanager
def reading(where: str | Path, refusal: type[ValueError], kind: str = "") -> Iterator[None]:
    """Convert errors of reading a file of this ``kind``, such as TOML, to a ``refusal`` of one line."""
    try:
        yield
    except refusal as error:
        raise refusal(f"{where}: {error}") from error.__cause__
    except OSError as error:
        raise refusal(f"{where}: {error.strerror or error}") from error
    except RecursionError as error:
        raise refusal(f"{where}: is nested too deeply") from error
    # pandas' parser errors, pyarrow's, JSON's, TOML's and UnicodeDecodeError are ValueErrors
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise refusal(f"{where}: cannot be read{f' as {kind}' if kind else ''}: {reason}") from error


def check_size(path: Path, most: int) -> None:
    """Raise an `OSError` unless the path is a regular file of at most ``most`` bytes."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        kind = "is a folder" if stat.S_ISDIR(status.st_mode) else "is not a file"
        raise OSError(errno.EINVAL, kind, str(path))
    if status.st_size > most:
        raise _too_large(path, most)


def _too_large(path: Path, most: int) -> OSError:
    return OSError(errno.EFBIG, f"is larger than {most} bytes", str(path))


def expand_home(path: Path) -> Path:
    """Replace a leading ``~``, which a shell leaves in ``--out=~/a``; `FolderError` without such a user."""
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise FolderError(f"{path}: there is no such home folder") from error


def check_folder(folder: Path) -> Path:
    """Return a folder with ``~`` expanded; raise a `FolderError` if it cannot be written to."""
    folder = expand_home(folder)
    try:
        ancestor = next(path for path in (folder, *folder.parents) if path.exists() or path.is_symlink())
        if not ancestor.is_dir():
            kind = "is not a folder" if ancestor.exists() else "is a link to nothing"
            raise FolderError(f"{ancestor}: {kind}")
        with tempfile.TemporaryFile(dir=ancestor):
            pass
    except PermissionError as error:
        raise FolderError(f"{ancestor}: no permission to write here") from error
    except OSError as error:
        raise FolderError(f"{folder}: cannot be written: {error.strerror or error}") from error
    return folder


def check_file(path: Path) -> Path:
    """Return a path with ``~`` expanded; raise a `FolderError` if the file cannot be written."""
    path = expand_home(path)
    if len(os.fsencode(path.name)) > LONGEST_NAME:
        raise FolderError(f"{path}: the name is longer than {LONGEST_NAME} bytes")
    check_folder(path.parent)
    if path.is_symlink() and not path.exists():
        raise FolderError(f"{path}: is a link to nothing")
    if path.exists() and not path.is_file():
        raise FolderError(f"{path}: is not a file")
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary name that replaces a file if the block succeeds; an `OSError` names the file."""
    try:
        with replacing_in(path.parent) as part:
            yield part / path.name
    except OSError as error:
        error.filename, error.filename2 = str(path), None
        raise


@contextmanager
def replacing_in(folder: Path) -> Iterator[Path]:
    """Yield an empty folder; if the block succeeds, replace files of ``folder`` by its files, one by one."""
    is_new = not folder.exists()
    part = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder))
        yield part
        _move(part, folder)
        is_new = False
    except OSError as error:
        name = str(error.filename or folder)
        if part is not None:
            name = name.replace(str(part), str(folder))
        error.filename, error.filename2 = name, None
        raise
    finally:
        if part is not None:
            shutil.rmtree(part, ignore_errors=True)
        if is_new:
            with suppress(OSError):
                folder.rmdir()


def _move(part: Path, folder: Path) -> None:
    """Move all files below one folder into another, once nothing stands in their way."""
    moves = [(path, folder / path.relative_to(part)) for path in sorted(part.rglob("*")) if path.is_file()]
    for _, target in moves:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
        target.parent.mkdir(parents=True, exist_ok=True)
    for path, target in moves:
        path.replace(target)


def write_json(value: Mapping[str, Any], path: Path) -> None:
    """Write strict JSON atomically; missing folders are created."""
    write_text(json_text(value), path)


def write_text(text: str, path: Path) -> None:
    """Write text atomically; missing folders are created."""
    with replacing(path) as part:
        part.write_text(text, "utf-8")


def json_text(value: Mapping[str, Any]) -> str:
    """Return strict JSON, with null for non-finite numbers; a value without equivalent is a `TypeError`."""
    return json.dumps(json_value(value), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def json_value(value: Any) -> Any:
    """Replace values that JSON lacks: non-finite numbers by None, numpy's by Python's."""
    if isinstance(value, Mapping):
        return {str(key): json_value(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(part) for part in value]
    if isinstance(value, np.generic):
        return json_value(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value
