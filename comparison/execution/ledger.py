"""Append-only store of finished work: a file of JSON lines.

One line per task: ``{"key": ..., "row": {...}, "sha256": ...}``, handed to the system in one write. A process
that is killed leaves at most an incomplete last line, which is skipped on reading; the next row starts on a
new line. A line without its checksum is skipped with a warning to this module's logger. Numbers are written
so that reading them gives the same bits.
"""

from __future__ import annotations

import errno
import hashlib
import json
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from comparison.files import check_size, plain

Row = dict[str, Any]
LARGEST = 2_000_000_000
"""Bytes of a store: a million rows take less."""
_LOG = logging.getLogger(__name__)


class LedgerError(ValueError):
    """Store that cannot be read or written; the message is one line."""


def read_rows(path: Path) -> dict[str, Row]:
    """Return the stored rows by key; empty if there is no file.

    Raises
    ------
    LedgerError
        If the file cannot be read.
    """
    try:
        check_size(path, LARGEST)
        lines = path.read_bytes().split(b"\n")
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise LedgerError(f"{path}: {error.strerror or error}") from error
    rows: dict[str, Row] = {}
    damaged = 0
    for line in lines[:-1]:
        if (found := _parsed(line)) is not None:
            rows[found[0]] = found[1]
        else:
            damaged += line.endswith(b"}")  # others were cut off when their writer was killed
    if (last := _parsed(lines[-1])) is not None:  # else empty or cut off
        rows[last[0]] = last[1]
    if damaged:
        _LOG.warning("%s: %d lines are damaged or of another version: measured again", path, damaged)
    return rows


def _parsed(line: bytes) -> tuple[str, Row] | None:
    """Return key and row of a line; None if it is not as it was stored."""
    try:
        entry = json.loads(line)
        key, row = entry["key"], entry["row"]
        sound = entry["sha256"] == _sum(key, row) and isinstance(row, dict)
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return (key, row) if sound else None


def _sum(key: str, row: Mapping[str, Any]) -> str:
    text = json.dumps([key, row], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def append_row(path: Path, key: str, row: Mapping[str, Any]) -> Row:
    """Store a row; return it as it will be read (non-finite numbers as None).

    Raises
    ------
    LedgerError
        If it cannot be written, such as on a full disk; stored rows remain.
    """
    stored = plain(row)
    entry = {"key": key, "row": stored, "sha256": _sum(key, stored)}
    text = json.dumps(entry, allow_nan=False, separators=(",", ":"))
    try:
        _append(path, text.encode() + b"\n")
    except OSError as error:
        raise LedgerError(f"{path}: cannot be written: {error.strerror or error}") from error
    kept: Row = json.loads(text)["row"]
    return kept


def _append(path: Path, line: bytes) -> None:
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        size = os.fstat(handle).st_size
        if size:
            os.lseek(handle, size - 1, os.SEEK_SET)
            if os.read(handle, 1) != b"\n":
                line = b"\n" + line
        if os.write(handle, line) < len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        os.close(handle)
