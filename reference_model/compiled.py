"""Compilation of the kernels, with a cache that cannot go stale.

numba's own cache looks only at the file of a function: a cached caller does not notice that a function
it *calls* in another module has changed, and goes on running the old code. So every version of this
package's sources gets a cache folder of its own.
"""

import hashlib
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar, cast

import numba
from platformdirs import user_cache_path

F = TypeVar("F", bound=Callable[..., object])

# `_nrt` is internal to numba and could go without notice. numba refuses an option that it does not know, but
# only when a function is first compiled; so it is looked up where numba itself looks. Without it every
# function counts, with the same results.
_OPTIONS = getattr(getattr(numba.core, "options", None), "DefaultOptions", None)
_COUNTING_IS_OPTIONAL = hasattr(_OPTIONS, "_nrt")


def source_hash() -> str:
    """Return a hash over all sources of this package and the versions of what compiles them."""
    digest = hashlib.sha256(f"{sys.version} {numba.__version__} {version('numpy')}".encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


_FOLDER = str(user_cache_path("sixbar-crossval", appauthor=False) / "numba" / f"reference-{source_hash()}")


def _mangled(record: numba.types.Record) -> tuple[str, tuple[int]]:
    """Name a record type in the symbols of machine code by its fields, the same in every process.

    numba's own name is its number among the types of the process. Two processes that compile a kernel for two
    formulations, each its first record, give both the same symbols, and a third process that loads both from
    the cache runs the code of one in place of the other's: without an error, with other results.
    """
    return "Record", (int.from_bytes(hashlib.sha256(record.name.encode()).digest()[:8]),)


numba.types.Record.mangling_args = property(_mangled)


def kernel(function: F) -> F:
    """Compile `function` to machine code at its first call, cached on disk between processes."""
    return _compile(function, inline=False)


def bare(function: F) -> F:
    """Compile a function that allocates nothing, without counting references.

    numba counts up and down, atomically, the references to every array that is handed to a function which
    calls others: some 15 % of a run went there.
    """
    return _compile(function, inline=False, counts=False)


def inlined(function: F) -> F:
    """Compile a small function into its callers: the constants are many, and passing them on costs more."""
    return _compile(function, inline=True)


def _compile(function: F, inline: bool, counts: bool = True) -> F:
    # Also where it counts: what is compiled within a call of a bare function would take that one's option.
    counting = {"_nrt": counts} if _COUNTING_IS_OPTIONAL else {}
    # The setting is numba's global one; it is in force only while this package's own functions are
    # decorated, so that nobody else's cache moves.
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _FOLDER
    try:
        compiler = numba.njit(cache=True, error_model="numpy", forceinline=inline, **counting)
        return cast(F, compiler(function))
    finally:
        numba.config.CACHE_DIR = before
