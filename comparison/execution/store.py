"""Results on disk, by keys that hash everything that can change them: nothing is computed twice.

A run is a folder ``runs/<key>`` with one table and its companions; a row of a study is a line of a ledger, a
file to which rows are appended. What is stored is complete or absent, and is used only with the checksum that
it was stored with: what is damaged is reported to this module's logger and computed again.
"""

import errno
import hashlib
import json
import logging
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from comparison.files import FolderError, check_size, plain, write_json
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import read, write

KEEP_DAYS = 30
RUNS, TABLE, SUMS = "runs", "run.parquet", "sha256.json"
LARGEST_LEDGER = 2_000_000_000  # bytes: a million rows take less
Row = dict[str, Any]
_LOG = logging.getLogger(__name__)


class LedgerError(ValueError):
    """Ledger that cannot be read or written; the message is one line."""


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
    """Return the stored run, or None if none is sound and passes `check`; delete a damaged one."""
    folders = list(_cache_folders())
    with suppress(FolderError):  # down to the folder that is written: one before it may be readable
        folders = folders[: folders.index(cache_folder()) + 1]
    for path in (folder / RUNS / key for folder in folders):
        try:
            if path.is_dir():
                table = _sound_run(path)
                check(table, channels, span)
                with suppress(OSError):  # it is not unused; the folder may be read-only
                    os.utime(path)
                return table
        except (OSError, ValueError) as error:  # of JSON and of tables: ValueErrors
            reason = " ".join(str(error).split())
            _LOG.warning("the cached run %s is damaged and is run again: %s", path, reason)
            shutil.rmtree(path, ignore_errors=True)
    return None


def _sound_run(folder: Path) -> Table:
    if _sums(folder) != json.loads((folder / SUMS).read_text("utf-8")):
        raise ValueError("its files are not as they were stored")
    return read(folder / TABLE)


def keep(key: str, table: Table) -> None:
    """Store a run and delete what was not used for a month; do nothing if that is impossible."""
    with suppress(FolderError, OSError, TableError):
        folder = cache_folder()
        oldest = time.time() - KEEP_DAYS * 86400
        for path in (*folder.glob("*.jsonl"), *(folder / RUNS).glob("*")):
            with suppress(OSError):
                if path.stat().st_mtime < oldest:
                    shutil.rmtree(path) if path.is_dir() else path.unlink()
        (folder / RUNS).mkdir(mode=0o700, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder / RUNS))
        try:
            write(table, part / TABLE)
            write_json(_sums(part), part / SUMS)
            part.rename(folder / RUNS / key)  # fails if another process was first
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _sums(folder: Path) -> dict[str, str]:
    paths = [path for path in sorted(folder.iterdir()) if path.name != SUMS]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def read_rows(ledger: Path) -> dict[str, Row]:
    """Return the sound rows of a ledger by their keys; a `LedgerError` if it cannot be read."""
    try:
        check_size(ledger, LARGEST_LEDGER)
        lines = ledger.read_bytes().split(b"\n")
        with suppress(OSError):  # it is not unused
            os.utime(ledger)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise LedgerError(f"{ledger}: {error.strerror or error}") from error
    rows, damaged = {}, 0
    for line in lines:
        try:
            entry = json.loads(line)
            key, row = entry["key"], entry["row"]
            sound = entry["sha256"] == _row_sum(key, row) and isinstance(row, dict) and isinstance(key, str)
        except (ValueError, KeyError, TypeError, RecursionError):
            sound = False
        if sound:
            rows[key] = row
        else:  # a line that does not end like one was cut off when its writer was killed
            damaged += line.endswith(b"}")
    if damaged:
        _LOG.warning("%s: %d lines are damaged or of another version: measured again", ledger, damaged)
    return rows


def append_row(ledger: Path, key: str, row: Mapping[str, Any]) -> Row:
    """Store a row, or raise a `LedgerError`; return it as it will be read: non-finite numbers as None."""
    stored = plain(row)
    entry = {"key": key, "row": stored, "sha256": _row_sum(key, stored)}
    text = json.dumps(entry, allow_nan=False, separators=(",", ":"))
    try:
        _append(ledger, text.encode() + b"\n")
    except OSError as error:
        raise LedgerError(f"{ledger}: cannot be written: {error.strerror or error}") from error
    kept: Row = json.loads(text)["row"]
    return kept


def _append(path: Path, line: bytes) -> None:
    """Append a line in one write: those of two processes do not mix."""
    with path.open("ab+", buffering=0) as file:
        if file.tell():
            file.seek(-1, os.SEEK_END)
            if file.read(1) != b"\n":  # its last writer was killed
                line = b"\n" + line
        if file.write(line) < len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _row_sum(key: str, row: Mapping[str, Any]) -> str:
    text = json.dumps([key, row], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]
