"""Compile this package's kernels, with a cache on disk that notices every change of the package.

numba's own cache looks only at the file of the function it loads: a caller compiled before an edit of a
*called* module would go on with the old callee. The folder of our kernels is therefore named by a hash
of all sources of the package and of the versions that shape the machine code.
"""

import hashlib
import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from platformdirs import user_cache_path

P = ParamSpec("P")
R = TypeVar("R")

# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]


def source_hash() -> str:
    """Hash this package's sources and the Python, numba and numpy versions (16 hex digits)."""
    digest = hashlib.sha256(f"{platform.python_version()} {numba.__version__} {np.__version__}".encode())
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of this package's compiled kernels: below ``NUMBA_CACHE_DIR`` where that is set."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(chosen) / "sixbar-crossval" if chosen else user_cache_path("sixbar-crossval", appauthor=False)
    return base / f"exudyn_model-{source_hash()}"


_FOLDER = str(cache_folder())


def _symbol_of_record(record: numba.types.Record) -> tuple[str, tuple[int]]:
    """Return what stands for a record type in the symbols of compiled functions.

    By default numba numbers the types of a process. Functions that different processes have compiled for
    different records then get the same symbols, and whoever loads them from the cache calls the wrong one.
    """
    return "Record", (int(hashlib.sha256(record.name.encode()).hexdigest()[:16], 16),)


numba.types.Record.mangling_args = property(_symbol_of_record)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` with numba and cache the machine code in :func:`cache_folder`.

    numba reads the folder's name while it decorates; the setting is put back at once, so that other
    packages of the process keep theirs. Where no folder can be written, the code is compiled anew in
    each process.
    """
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _FOLDER
    try:
        compiled: Callable[P, R] = numba.njit(cache=True, error_model="numpy")(function)
    except (RuntimeError, OSError):
        compiled = numba.njit(error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled


def direct(function: Callable[..., R], *examples: Any) -> Callable[..., R]:
    """Return the machine code of a kernel for arguments of the same types as ``examples``.

    For what Exudyn calls in every step: a kernel itself first dispatches on the types of its arguments, which
    takes as long as the smaller kernels run. This does not: what is not of these types is read wrongly.
    """
    compiled: Any = function
    entry: Callable[..., R] = compiled.compile(tuple(numba.typeof(example) for example in examples))
    return entry
