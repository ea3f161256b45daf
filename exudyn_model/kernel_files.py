"""Files of the compiled kernels: a folder for every version of this package, a checksum in every file.

numba's own cache looks only at the file of the function it loads: a caller compiled before an edit of a
*called* module would go on with the old callee. The folder is therefore named by a hash of all sources of the
package and of the versions that shape the machine code. numba would also load, or fail at, what a power
failure left of a file; here a damaged file counts as missing, and one that cannot be written is not needed.
"""

import hashlib
import os
import platform
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import caching
from platformdirs import user_cache_path

SEAL = hashlib.blake2b().digest_size
"""Bytes of the checksum at the end of each file."""


def source_hash() -> str:
    """Hash this package's sources and the Python, numba and numpy versions (16 hex digits)."""
    digest = hashlib.sha256(f"{platform.python_version()} {numba.__version__} {np.__version__}".encode())
    package = Path(__file__).parent
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def folder() -> Path | None:
    """Return the folder of this version's kernels, or None where nothing can be stored.

    Below ``NUMBA_CACHE_DIR`` or ``SIXBAR_CACHE_DIR`` where one is set, else in the user's cache folder; if
    that cannot be written, in a temporary folder of this user alone. A read-only folder that already holds
    kernels of this version is used as it is.
    """
    name = f"exudyn_model-{source_hash()}"
    first = _usual()
    if first is not None and _accepts_files(first / name):
        return first / name
    try:
        private = _private_temporary() / name
        found = private if _accepts_files(private) else None
    except OSError:
        found = None
    where = "nowhere, and every process compiles them" if found is None else f"in {found}"
    warnings.warn(
        f"the Exudyn model's kernels cannot be stored in {first or 'the home folder, which is unknown'}; "
        f"they are stored {where}",
        RuntimeWarning,
        stacklevel=2,
    )
    return found


def _usual() -> Path | None:
    for variable, below in (("NUMBA_CACHE_DIR", "sixbar-crossval"), ("SIXBAR_CACHE_DIR", "")):
        if os.environ.get(variable):
            return Path(os.environ[variable]) / below
    try:
        path = user_cache_path("sixbar-crossval", appauthor=False)
    except RuntimeError:  # without HOME and without a name
        return None
    return path if path.is_absolute() else None


def _private_temporary() -> Path:
    """Make a folder below the temporary one; refuse what is another user's, who could place code there."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    path = Path(tempfile.gettempdir(), f"sixbar-crossval-{user}")
    path.mkdir(0o700, exist_ok=True)
    status = path.lstat()
    if os.name == "posix" and (status.st_uid != user or stat.S_IMODE(status.st_mode) != 0o700):
        raise PermissionError(f"{path} is accessible to other users")
    if not stat.S_ISDIR(status.st_mode):
        raise NotADirectoryError(f"{path} is not a folder")
    return path


def _accepts_files(path: Path) -> bool:
    try:
        path.mkdir(0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return True
    except OSError:
        return any(path.glob("*/*.nbc"))


class _SealedFiles(caching.IndexDataCacheFile):  # type: ignore[misc] # numba has no types
    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        hashed = hashlib.blake2b()
        with super()._open_for_write(filepath) as file:
            write = file.write

            class Hashing:
                def write(self, part: bytes) -> int:
                    hashed.update(part)
                    return int(write(part))

            yield Hashing()
            write(hashed.digest())

    def load(self, key: Any) -> Any:
        data = None if _broken(self._index_path) else self._load_index().get(key)
        return None if data is None or _broken(self._data_path(data)) else self._load_data(data)

    def save(self, key: Any, data: Any) -> None:
        if _broken(self._index_path):
            self.flush()
        super().save(key, data)


def _broken(path: str) -> bool:
    """Whether a file is missing, unreadable or does not end in the checksum of what precedes it."""
    try:
        content = memoryview(Path(path).read_bytes())
    except OSError:
        return True
    return hashlib.blake2b(content[:-SEAL]).digest() != content[-SEAL:]


class _Place(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    def __init__(self, function: Any, source: str) -> None:
        super().__init__(function, source)
        self._cache_path = str(Path(str(folder()), self.get_suitable_cache_subpath(source)))

    @classmethod
    def from_function(cls, function: Any, source: str) -> "_Place":
        return cls(function, source)  # numba itself would insist on writing here


class _Placed(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Place,)


class KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """The cache of one function; what fails in it is as if nothing were stored.

    ``variant`` names the files of one of its machine codes.
    """

    _impl_class = _Placed

    def __init__(self, function: Any, variant: str = "") -> None:
        super().__init__(function)
        place, name = self._impl.locator, self._impl.filename_base + variant
        self._cache_file = _SealedFiles(place.get_cache_path(), name, place.get_source_stamp())

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store compiled code if the disk permits it."""
        try:
            super().save_overload(sig, data)
        except OSError:
            return
