"""Cache of the compiled kernels on disk, which cannot go stale and does no harm when damaged.

numba's own cache looks only at the file of a function: a cached caller does not notice that a function
it *calls* in another module has changed, and goes on running the old code. So every version of this
package's sources gets a cache folder of its own.

Nor does numba notice damage: a file cut short by a power failure would end every later run with an error, one
with a changed byte might be executed. Files here end with their checksum; without a valid one the kernel is
compiled anew. A cache that cannot be read or written costs time only.
"""

import hashlib
import io
import os
import stat
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
)
from platformdirs import user_cache_path


def source_hash() -> str:
    """Return a hash over all sources of this package and the versions of what compiles them."""
    digest = hashlib.sha256(f"{sys.version} {numba.__version__} {version('numpy')}".encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


def _wanted() -> Path | None:
    """Return the folder for all versions: ``NUMBA_CACHE_DIR``, ``SIXBAR_CACHE_DIR`` or the user's."""
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(named) / "sixbar-crossval"
    if named := os.environ.get("SIXBAR_CACHE_DIR"):
        return Path(named)
    try:
        usual = user_cache_path("sixbar-crossval", appauthor=False)
    except RuntimeError:  # no HOME, and a user without an entry in the password file
        return None
    return usual if usual.is_absolute() else None


def _temporary() -> Path | None:
    """Return this user's own temporary folder; None if another user could have written to it."""
    try:
        folder = Path(tempfile.gettempdir()) / f"sixbar-crossval-{getattr(os, 'getuid', int)()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    private = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    return folder if stat.S_ISDIR(found.st_mode) and private else None


def _usable(folder: Path) -> bool:
    """Whether kernels can be stored in a folder, or are there already (as in a container's image)."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        with suppress(OSError):
            return next(folder.rglob("*.nbi"), None) is not None
        return False
    return True


def _cache_folder() -> Path | None:
    """Choose the folder of this version's kernels; None: they are compiled anew by every process."""
    wanted, own = _wanted(), Path("numba") / f"reference-{source_hash()}"
    if wanted is not None and _usable(wanted / own):
        return wanted / own
    temporary = _temporary()
    found = temporary / own if temporary is not None and _usable(temporary / own) else None
    instead = f"compiled code is stored in {found}" if found else "every process compiles its code anew"
    warnings.warn(f"{wanted or 'no home folder'}: cannot be written; {instead}", RuntimeWarning, stacklevel=2)
    return found


FOLDER = _cache_folder()


class _Files(IndexDataCacheFile):  # type: ignore[misc] # numba is not typed
    """The files of one function, each with its checksum at the end."""

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[BinaryIO]:
        with super()._open_for_write(filepath) as file:
            content = io.BytesIO()
            yield content
            file.write(content.getvalue() + hashlib.sha256(content.getvalue()).digest())

    def _load_index(self) -> Any:
        return super()._load_index() if _sound(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        if not _sound(self._data_path(name)):
            raise OSError(f"{name} is damaged")  # to numba: not there
        return super()._load_data(name)


def _sound(path: str) -> bool:
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content[:-32]).digest() == content[-32:]


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc]
    """Tells numba our folder, whether or not it can be written."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(FOLDER)

    @classmethod
    def from_function(cls, function: Any, file: str) -> "_Locator":
        return cls(function, file)


class _Results(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class Cache(FunctionCache):  # type: ignore[misc]
    """numba's cache of one function, which may fail."""

    _impl_class = _Results

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)

    def save_overload(self, signature: Any, data: Any) -> None:
        """Store compiled code if the disk permits it."""
        with suppress(OSError):  # disk full, read-only
            super().save_overload(signature, data)
