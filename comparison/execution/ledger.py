"""Append-only store of finished work: a file of JSON lines.

One line per task: ``{"key": ..., "row": {...}}``, handed to the system in one write. A process that is killed
leaves at most an incomplete last line, which is skipped on reading; the next row starts on a new line.
Numbers are written so that reading them gives the same bits.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from comparison.files import plain

Row = dict[str, Any]


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
        lines = path.read_bytes().split(b"\n")
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise LedgerError(f"{path}: {error.strerror or error}") from error
    rows: dict[str, Row] = {}
    for line in lines:
        try:
            entry = json.loads(line)
            rows[entry["key"]] = entry["row"]
        except (ValueError, KeyError, TypeError):
            continue  # empty, or cut off when its writer was killed
    return rows


def append_row(path: Path, key: str, row: Mapping[str, Any]) -> Row:
    """Store a row; return it as it will be read (non-finite numbers as None).

    Raises
    ------
    LedgerError
        If it cannot be written, such as on a full disk; stored rows remain.
    """
    text = json.dumps({"key": key, "row": plain(row)}, allow_nan=False, separators=(",", ":"))
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
