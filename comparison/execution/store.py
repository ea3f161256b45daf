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
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path

from comparison.files import FolderError, check_folder, check_size, json_text, replacing
from comparison.tables.table import Table

KEEP_DAYS = 30
RUNS, ROWS = "runs", "rows"
LARGEST = 1_000_000_000
"""Largest size of a stored result, bytes."""
Row = dict[str, Any]
_COLUMNS, _TEXTS = ("pulses", "cycle_extrema"), {"corner": "U3"}
_LOG = logging.getLogger(__name__)
_SUM = hashlib.sha256().digest_size


def cache_folder() -> Path:
    """Return the folder of stored results: ``$SIXBAR_CACHE_DIR``, or ours in the user's cache."""
    if named := os.environ.get("SIXBAR_CACHE_DIR"):
        return Path(named)
    with suppress(RuntimeError):
        folder = user_cache_path("sixbar-crossval", appauthor=False)
        if folder.is_absolute():
            return folder
    return Path(os.devnull)  # there is no home folder: nothing can be stored


def cache_warning() -> str:
    """Return in one line why no result can be stored; empty where it can."""
    try:
        check_folder(cache_folder())
    except FolderError as error:
        return f"{error}: no result is stored; SIXBAR_CACHE_DIR names another folder"
    return ""


def fetch(key: str) -> Table | None:
    """Return the stored run, which was checked before; None without one that is sound."""
    if (content := _content(cache_folder() / RUNS / key)) is None:
        return None
    with np.load(io.BytesIO(content)) as file:
        parts: dict[str, Any] = dict(file)
    record = json.loads(parts.pop("record").tobytes())
    for name, rows in parts.items():
        parts[name] = {field: np.ascontiguousarray(rows[field]) for field in rows.dtype.names}
    return Table(**parts, extrema=record.pop("extrema"), provenance=record)


def keep(key: str, table: Table) -> None:
    """Store a run; do nothing if that is impossible."""
    import pandas as pd

    packed = io.BytesIO()
    record = json_text({**table.provenance, "extrema": table.extrema}).encode()
    parts: dict[str, Any] = {
        name: pd.DataFrame(part).to_records(index=False, column_dtypes=_TEXTS)
        for name in ("frame", "events", "dense", *_COLUMNS)
        if (part := getattr(table, name)) is not None
    }
    np.savez(packed, **parts, record=np.frombuffer(record, np.uint8))
    with suppress(OSError):
        _store(cache_folder() / RUNS / key, packed.getvalue())


def fetch_file(key: str) -> bytes | None:
    """Return a stored file that a program has written; None if there is none that is sound."""
    return _content(cache_folder() / RUNS / key)


def keep_file(key: str, content: bytes) -> None:
    """Store a file that a program has written; do nothing if that is impossible."""
    with suppress(OSError):
        _store(cache_folder() / RUNS / key, content)


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
    """Delete results that were not used for a month; do nothing if that is impossible."""
    folder, oldest = cache_folder(), time.time() - KEEP_DAYS * 86400
    # Version 0.2 stored a run in a folder and the rows of a study in one file.
    for path in (*folder.glob(f"{RUNS}/*"), *folder.glob(f"{ROWS}-*/*"), *folder.glob("*.jsonl")):
        with suppress(OSError):
            if path.stat().st_mtime < oldest:
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def _store(path: Path, content: bytes) -> None:
    """Store a result; a cache folder created for it is accessible to the user alone."""
    path.parent.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_bytes(hashlib.sha256(content).digest() + content)


def _content(path: Path) -> bytes | None:
    """Return the content of a stored result and mark it as used; delete a damaged one."""
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
