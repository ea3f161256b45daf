"""Results on disk, by keys that hash everything that can change them: nothing is computed twice.

A result is one file, named by its key: a run below ``runs`` of the cache folder, a row of a study in a folder
of its own. It is written elsewhere, then renamed: complete or absent, whoever else writes. It begins with its
checksum: a damaged one is reported to this module's logger and computed again.
"""

import hashlib
import io
import json
import logging
import os
import shutil
import stat
import tempfile
import time
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from comparison.files import FolderError, check_size, json_text, replacing
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import read, write

KEEP_DAYS = 30
RUNS, ROWS, TABLE = "runs", "rows", "run.parquet"
LARGEST = 1_000_000_000
"""Bytes of a stored result."""
Row = dict[str, Any]
_LOG = logging.getLogger(__name__)
_SUM = hashlib.sha256().digest_size


def _cache_folders() -> Iterator[Path]:
    """Yield ``$SIXBAR_CACHE_DIR`` or our folder in the user's cache, then a temporary one of this user."""
    named = os.environ.get("SIXBAR_CACHE_DIR")
    with suppress(RuntimeError):  # no home folder
        usual = Path(named) if named else user_cache_path("sixbar-crossval", appauthor=False)
        if named or usual.is_absolute():
            yield usual
    with suppress(OSError):
        user = os.getuid() if hasattr(os, "getuid") else 0
        temporary = Path(tempfile.gettempdir()) / f"sixbar-crossval-{user}"
        temporary.mkdir(mode=0o700, exist_ok=True)
        status = temporary.lstat()
        if stat.S_ISDIR(status.st_mode) and (
            os.name != "posix" or (status.st_uid == user and not status.st_mode & 0o077)
        ):
            yield temporary


def cache_folder() -> Path:
    """Return the first folder for results that can be written, made if missing; else a `FolderError`."""
    for folder in _cache_folders():
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
    raise FolderError("no cache folder can be written; SIXBAR_CACHE_DIR names one")


def cache_warnings() -> list[str]:
    """Say in one line where results and compiled code are stored, if not where they should be."""
    tried = list(_cache_folders())
    try:
        folder = cache_folder()
    except FolderError:
        return ["no cache folder can be written: nothing is cached; SIXBAR_CACHE_DIR names one"]
    if folder == tried[0] and folder.name.rpartition("-")[0] != "sixbar-crossval":
        return []
    unusable = "there is no home folder" if folder == tried[0] else f"{tried[0]} cannot be written"
    return [f"{unusable}: the cache is in {folder}; SIXBAR_CACHE_DIR names another"]


def fetch(key: str, channels: list[str], span: tuple[float, float]) -> Table | None:
    """Return the stored run, or None if none is sound and passes `check`."""
    folders = list(_cache_folders())
    with suppress(FolderError):  # down to the folder that is written: one before it may be readable
        folders = folders[: folders.index(cache_folder()) + 1]
    for path in (folder / RUNS / key for folder in folders):
        if (content := _content(path)) is None:
            continue
        with tempfile.TemporaryDirectory() as part:
            zipfile.ZipFile(io.BytesIO(content)).extractall(part)
            table = read(Path(part, TABLE))
        with suppress(TableError):
            check(table, channels, span)
            return table
    return None


def keep(key: str, table: Table) -> None:
    """Store a run; do nothing if that is impossible."""
    with suppress(FolderError, OSError, TableError), tempfile.TemporaryDirectory() as part:
        write(table, Path(part, TABLE))
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for path in sorted(Path(part).iterdir()):
                archive.write(path, path.name)
        _store(cache_folder() / RUNS / key, packed.getvalue())


def fetch_row(folder: Path, key: str) -> Row | None:
    """Return the stored row; None if there is none that is sound."""
    content = _content(folder / key)
    row: Row | None = None if content is None else json.loads(content)
    return row


def keep_row(folder: Path, key: str, row: Mapping[str, Any]) -> Row:
    """Store a row, or raise an `OSError`; return it as it will be read: non-finite numbers as None."""
    text = json_text(row)
    _store(folder / key, text.encode())
    stored: Row = json.loads(text)
    return stored


def drop_unused() -> None:
    """Delete what was not used for a month; do nothing if that is impossible."""
    with suppress(FolderError):
        folder, oldest = cache_folder(), time.time() - KEEP_DAYS * 86400
        # Version 0.2 stored a run in a folder and the rows of a study in one file.
        for path in (*folder.glob(f"{RUNS}/*"), *folder.glob(f"{ROWS}/*/*"), *folder.glob("*.jsonl")):
            with suppress(OSError):
                if path.stat().st_mtime < oldest:
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


def _store(path: Path, content: bytes) -> None:
    with replacing(path) as part:
        part.write_bytes(hashlib.sha256(content).digest() + content)


def _content(path: Path) -> bytes | None:
    """Return the content of a stored result, which is now a used one; delete a damaged one."""
    try:
        check_size(path, LARGEST)
        stored = path.read_bytes()
    except OSError:  # there is none, or none that can be read
        return None
    if hashlib.sha256(stored[_SUM:]).digest() != stored[:_SUM]:
        _LOG.warning("the stored result %s is damaged and is computed again", path)
        with suppress(OSError):
            path.unlink()
        return None
    with suppress(OSError):  # the folder may be read-only
        os.utime(path)
    return stored[_SUM:]
