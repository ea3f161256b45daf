"""Kernels: functions compiled by numba, and the folder on disk that keeps their code between processes.

The folder is named after a hash of this package's sources and of the compiler's version: numba's own cache
does not notice that a function which a kernel *calls* has changed. Nor does it notice damage: a file that is
cut short ends every later run with an error, one with a changed byte might be executed. So `seal` lists the
stored files with their checksums; a file that differs from the list is removed before numba looks for it.
"""

import atexit
import hashlib
import json
import os
import sys
import tempfile
import warnings
import zlib
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from platformdirs import user_cache_path

F = TypeVar("F", bound=Callable[..., object])

_LIST = "checksums.json"


def source_hash() -> str:
    """Return a hash over all sources of this package and the versions of Python, numba and numpy."""
    digest = hashlib.sha256(f"{sys.version} {numba.__version__} {version('numpy')}".encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


def _base_folder() -> Path | None:
    """Return the folder for all versions: ``NUMBA_CACHE_DIR``, ``SIXBAR_CACHE_DIR`` or the user's."""
    if folder := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(folder) / "sixbar-crossval"
    if folder := os.environ.get("SIXBAR_CACHE_DIR"):
        return Path(folder)
    try:
        cache = user_cache_path("sixbar-crossval", appauthor=False)
    except RuntimeError:  # no HOME, and a user without an entry in the password file
        return None
    return cache if cache.is_absolute() else None


def _cache_folder() -> Path | None:
    """Return the folder of this version's kernels; None: every process compiles them anew."""
    base = _base_folder()
    if base is not None:
        folder = base / "numba" / f"reference-{source_hash()}"
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
            return folder
    warnings.warn(
        f"{base or 'no home folder'}: cannot be written; every process compiles its code anew. Set "
        "SIXBAR_CACHE_DIR to a folder that can be written",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


def _checksums(folder: Path) -> dict[str, int]:
    """Return the checksum of each stored file, by its path in the folder."""
    sums = {}
    for path in sorted(folder.rglob("*.nb[ic]")):
        with suppress(OSError):
            sums[str(path.relative_to(folder))] = zlib.crc32(path.read_bytes())
    return sums


def _remove_damaged(folder: Path) -> None:
    """Remove the files that are not as they were sealed."""
    try:
        checksums = json.loads((folder / _LIST).read_text("utf-8"))
    except (OSError, ValueError):
        checksums = {}
    for name, checksum in _checksums(folder).items():
        if checksums.get(name) != checksum:
            with suppress(OSError):
                (folder / name).unlink()


def seal() -> None:
    """List the kernels that this process has compiled and stored, so that later ones trust them."""
    count = sum(sum(each.stats.cache_misses.values()) for each in _KERNELS)
    if FOLDER is None or count == _sealed["kernels"]:
        return
    with suppress(OSError):
        with tempfile.NamedTemporaryFile("w", dir=FOLDER, delete=False, encoding="utf-8") as file:
            json.dump(_checksums(FOLDER), file)
        Path(file.name).replace(FOLDER / _LIST)
        _sealed["kernels"] = count


FOLDER = _cache_folder()
_KERNELS: list[Any] = []
_sealed = {"kernels": 0}
if FOLDER is not None:
    _remove_damaged(FOLDER)
    atexit.register(seal)


def kernel(function: F) -> F:
    """Compile a function that Python calls to machine code at its first call, kept on disk."""
    cache_dir, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(FOLDER or "")
    try:
        compiled = numba.njit(cache=FOLDER is not None, error_model="numpy", no_cfunc_wrapper=True)(function)
    finally:
        numba.config.CACHE_DIR = cache_dir
    _KERNELS.append(compiled)
    return cast(F, compiled)


ONLY_FROM_KERNELS = {
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "no_cpython_wrapper": True,
    # With numba's reference counts of all arrays that are passed on, a run takes 1.9 times as long.
    "_nrt": False,
}


def inner(function: F) -> F:
    """Compile a function that only kernels call, and that allocates nothing."""
    return cast(F, numba.njit(**ONLY_FROM_KERNELS)(function))


def inlined(function: F) -> F:
    """Compile such a function into the code of its callers.

    A call passes each field of a NamedTuple separately, and each array as seven numbers: for a small function
    that takes as long as its own work.
    """
    return cast(F, numba.njit(forceinline=True, **ONLY_FROM_KERNELS)(function))


def merged(function: F) -> F:
    """Compile such a function as a part of its caller, of which there are one or two.

    A function of its own is optimized with all that it calls, and its caller then with all that again. Many
    or repeated calls of merged functions take longer to compile instead.
    """
    return cast(F, numba.njit(inline="always", **ONLY_FROM_KERNELS)(function))


def constant(value: int) -> int:
    """Return an integer to pass to kernels by name: numba compiles them once more for each of Python's."""
    return cast(int, np.int64(value))
