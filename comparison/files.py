"""Atomic writing of files: a file is complete or absent."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np


class FolderError(ValueError):
    """A folder that cannot be written to; the message is one line."""


def check_folder(folder: Path) -> None:
    """Reject a folder that cannot be written to, before the work begins whose result it is to hold.

    Raises
    ------
    FolderError
        If it, or the first of its parents that exists, is not a folder with write permission.
    """
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    if not existing.is_dir():
        raise FolderError(f"{existing}: is not a folder")
    if not os.access(existing, os.W_OK):
        raise FolderError(f"{existing}: no permission to write here")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary name in the same folder; it replaces ``path`` if the block succeeds."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_json(value: Mapping[str, Any], path: Path) -> None:
    """Write strict JSON atomically."""
    write_text(json_text(value), path)


def write_text(text: str, path: Path) -> None:
    """Write text atomically."""
    with replacing(path) as part:
        part.write_text(text, "utf-8")


def json_text(value: Mapping[str, Any]) -> str:
    """Return strict JSON; numbers that are not finite become null.

    Raises
    ------
    TypeError
        If a value has no JSON equivalent.
    """
    return json.dumps(plain(value), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def plain(value: Any) -> Any:
    """Replace values that JSON lacks: non-finite numbers become null, numpy's become Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value
