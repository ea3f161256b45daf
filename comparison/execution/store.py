"""Results on disk, by keys that hash everything that can change them: nothing is computed twice.

A result is one file, named by its key: a run or a comparison below ``runs`` of the cache folder, a row of a
study in a folder of its own. It is written elsewhere, then renamed: complete or absent, whoever else writes.
It begins with its checksum: a damaged one is reported to this module's logger and computed again.
"""

import hashlib
import json
import logging
import os
import shutil
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path
from pydantic import BaseModel

from comparison.files import FolderError, check_folder, check_size, json_text, replacing

KEEP_DAYS = 30
RUNS, ROWS = "runs", "rows"
LARGEST = 1_000_000_000
"""Largest size of a stored result, bytes."""
Row = dict[str, Any]
_LOG = logging.getLogger(__name__)
_SUM = hashlib.sha256().digest_size


def cache_folder() -> Path:
    """Return the folder of stored results: ``$SIXBAR_CACHE_DIR``, or ours in the user's cache."""
    if location := os.environ.get("SIXBAR_CACHE_DIR"):
        return Path(location)
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


def fetch(key: str) -> Any:
    """Return a stored run or comparison, which was checked before; None without a sound one."""
    content = _content(cache_folder() / RUNS / key)
    return None if content is None else unpack(content)


def keep(key: str, value: object) -> None:
    """Store a run or a comparison; do nothing if that is impossible."""
    with suppress(OSError):
        _store(cache_folder() / RUNS / key, pack(value))


def fetch_file(key: str) -> bytes | None:
    """Return a stored file that a program has written; None without a sound one."""
    return _content(cache_folder() / RUNS / key)


def keep_file(key: str, content: bytes) -> None:
    """Store a file that a program has written; do nothing if that is impossible."""
    with suppress(OSError):
        _store(cache_folder() / RUNS / key, content)


def fetch_row(folder: Path, key: str) -> Row | None:
    """Return the stored row; None without a sound one."""
    content = _content(folder / key)
    row: Row | None = None if content is None else json.loads(content)
    return row


def keep_row(folder: Path, key: str, row: Mapping[str, Any]) -> Row:
    """Store a row, or raise an `OSError`; return it as it will be read: non-finite numbers as None."""
    text = json_text(row)
    _store(folder / key, text.encode())
    result: Row = json.loads(text)
    return result


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
        data = path.read_bytes()
    except OSError:  # there is none, or none that can be read
        return None
    if hashlib.sha256(data[_SUM:]).digest() != data[:_SUM]:
        _LOG.warning("the stored result %s is damaged and is computed again", path)
        with suppress(OSError):
            path.unlink()
        return None
    with suppress(OSError):  # the folder may be read-only
        os.utime(path)
    return data[_SUM:]


# ---- results as bytes
#
# JSON, then the arrays, equal ones once. An object of the JSON is a value that JSON lacks: type and content.

_ALIGNMENT = 8  # bytes


def pack(value: Any) -> bytes:
    """Return a result as bytes; equal results give equal bytes.

    It consists of JSON's types, of tuples, arrays and data frames, and of this package's dataclasses, named
    tuples, enumerations and models of pydantic; a `TypeError` for anything else.
    """
    import pandas as pd  # which a run that is only written does without

    places: dict[bytes, int] = {}
    end = 0

    def array(values: NDArray[Any]) -> list[Any]:
        nonlocal end
        values = values.astype("U") if values.dtype.kind == "O" else values
        content = values.tobytes()
        content += bytes(-len(content) % _ALIGNMENT)
        if (place := places.setdefault(content, end)) == end:
            end += len(content)
        return [values.dtype.str, values.shape, place]

    def encode(part: Any) -> Any:
        kind = type(part)
        if _is_record(kind):
            return {f"{kind.__module__}:{kind.__name__}": encode(_fields(part))}
        if part is None or isinstance(part, bool | int | float | str):
            return part
        if isinstance(part, np.generic):
            return part.item()
        if isinstance(part, list):
            return [encode(each) for each in part]
        if isinstance(part, tuple):
            return {"tuple": [encode(each) for each in part]}
        if isinstance(part, Mapping):
            return {"dict": [[encode(name), encode(each)] for name, each in part.items()]}
        if isinstance(part, np.ndarray):
            return {"array": array(part)}
        if isinstance(part, pd.DataFrame):
            return {"frame": [[name, array(part[name].to_numpy())] for name in part]}
        raise TypeError(f"{kind.__name__} cannot be stored")

    head = json.dumps(encode(value), separators=(",", ":")).encode()
    head += b" " * (-len(head) % _ALIGNMENT)
    return b"".join([len(head).to_bytes(_ALIGNMENT), head, *places])


def hash_of(value: Any) -> str:
    """Return the SHA-256 (hex) of a value that `pack` can take."""
    return hashlib.sha256(pack(value)).hexdigest()


def _is_record(kind: Any) -> bool:
    """Return whether a class is of this package and has nothing but data."""
    is_ours = isinstance(kind, type) and kind.__module__.startswith("comparison.")
    return is_ours and (issubclass(kind, Enum | BaseModel | tuple) or is_dataclass(kind))


def _fields(record: Any) -> Any:
    if isinstance(record, Enum):
        return record.name
    if isinstance(record, BaseModel):
        return record.model_dump(exclude_unset=True)
    if isinstance(record, tuple):
        return dict(zip(record._fields, record, strict=True))  # type: ignore[attr-defined]
    return {field.name: getattr(record, field.name) for field in fields(record)}


def unpack(content: bytes) -> Any:
    """Return the result of bytes from `pack`; its arrays are read-only."""
    import pandas as pd

    begin = _ALIGNMENT + int.from_bytes(content[:_ALIGNMENT])

    def array(dtype: str, shape: list[int], place: int) -> NDArray[Any]:
        return np.frombuffer(content, dtype, prod(shape), begin + place).reshape(shape)

    def part(item: dict[str, Any]) -> Any:
        ((kind, value),) = item.items()
        if kind in ("tuple", "dict"):
            return tuple(value) if kind == "tuple" else dict(value)
        if kind == "array":
            return array(*value)
        if kind == "frame":
            return pd.DataFrame({name: array(*column) for name, column in value})
        module, _, name = kind.partition(":")
        record: Any = getattr(import_module(module), name) if module.startswith("comparison.") else None
        if not _is_record(record):  # nothing else may be called
            raise TypeError(f"{kind} cannot be stored")
        return record[value] if issubclass(record, Enum) else record(**value)

    return json.loads(content[_ALIGNMENT:begin], object_hook=part)
