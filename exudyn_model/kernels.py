"""Compile this package's kernels with numba, and keep the machine code in a folder of this very version.

numba's own cache looks only at the file of the function it loads: a caller compiled before an edit of a
*called* module would go on with the old callee. The folder is therefore named by a hash of all sources of the
package and of the versions that shape the machine code. numba would also run, or fail at, a file that a power
failure damaged: `seal` stores a checksum of each file after a run, and the next process removes a file that
does not agree with it. A lost file costs its compilation, nothing else.
"""

import hashlib
import json
import os
import platform
import tempfile
import warnings
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

P = ParamSpec("P")
R = TypeVar("R")

_SUMS = "checksums.json"


def source_hash() -> str:
    """Hash this package's sources and the Python, numba and numpy versions (16 hex digits)."""
    digest = hashlib.sha256(f"{platform.python_version()} {numba.__version__} {np.__version__}".encode())
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _root_folder() -> Path | None:
    for variable, subfolder in (("NUMBA_CACHE_DIR", "sixbar-crossval"), ("SIXBAR_CACHE_DIR", "")):
        if os.environ.get(variable):
            return Path(os.environ[variable]) / subfolder
    try:
        path = user_cache_path("sixbar-crossval", appauthor=False)
    except RuntimeError:  # without HOME and without a name
        return None
    return path if path.is_absolute() else None


def _folder() -> Path | None:
    """Return the folder of this version's kernels, without its damaged files; None: nothing can be stored."""
    root = _root_folder()
    if root is not None:
        path = root / f"exudyn_model-{source_hash()}"
        with suppress(OSError):
            path.mkdir(0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=path):
                pass
            _remove_damaged(path)
            return path
    warnings.warn(
        f"the Exudyn model's kernels have no place in {root or 'the home folder, which is unknown'}: every "
        "process compiles them; a SIXBAR_CACHE_DIR that can be written avoids that",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


def _remove_damaged(path: Path) -> None:
    try:
        sums = json.loads((path / _SUMS).read_text())
    except (OSError, ValueError):
        sums = {}
    for name, checksum in _checksums(path).items():
        if sums.get(name) != checksum:
            (path / name).unlink(missing_ok=True)


def _checksums(path: Path) -> dict[str, int]:
    return {
        file.relative_to(path).as_posix(): zlib.crc32(file.read_bytes())
        for file in sorted(path.glob("*/*.nb[ic]"))
    }


FOLDER = _folder()
"""Folder of this process's kernels."""


def seal() -> None:
    """Store the checksums of all kernels in the folder; to be called after a run."""
    if FOLDER is None:
        return
    # numba leaves the index as it is where it compiles a removed file anew
    newest = max((file.stat().st_mtime_ns for file in FOLDER.glob("*/*.nb[ic]")), default=0)
    with suppress(OSError):
        if newest and not ((FOLDER / _SUMS).exists() and (FOLDER / _SUMS).stat().st_mtime_ns >= newest):
            with tempfile.NamedTemporaryFile("w", dir=FOLDER, delete=False) as file:
                json.dump(_checksums(FOLDER), file)
            Path(file.name).replace(FOLDER / _SUMS)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that only kernels call, without a wrapper for Python."""
    return cast(
        Callable[P, R],
        numba.njit(error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=True)(function),
    )


def entry(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that Python calls; its machine code, callees included, is stored on disk."""
    outer_folder = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(FOLDER or "")
    try:
        options: dict[str, Any] = {"cache": FOLDER is not None, "no_cfunc_wrapper": True}
        return cast(Callable[P, R], numba.njit(error_model="numpy", **options)(function))
    finally:
        numba.config.CACHE_DIR = outer_folder


def machine_code(function: Callable[..., R], *examples: Any) -> Callable[..., R]:
    """Return the machine code of an entry for arguments of the same types as ``examples``.

    It serves functions that Exudyn calls in every step: an entry first dispatches on the types of its
    arguments, which takes as long as a small one runs. The machine code does not, and misreads other types.
    """
    types = tuple(numba.typeof(example) for example in examples)
    compiled: Callable[..., R] = cast(Any, function).compile(types)
    return compiled


def record(values: Any) -> NDArray[Any]:
    """Return the numbers of a NamedTuple, which may contain others, as an array of one record of that shape.

    A kernel reads ``record(values)[0].name`` as Python reads ``values.name``. A NamedTuple itself would be
    passed number by number, which takes as long as a smaller kernel runs.
    """
    return np.array([values], dtype=_layout(values))


def _layout(values: Any) -> np.dtype[Any]:
    types = [_layout(value) if isinstance(value, tuple) else np.float64 for value in values]
    return np.dtype(list(zip(values._fields, types, strict=True)))
