"""Compilation of the kernels."""

import hashlib
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numba.extending

from reference_model.kernel_cache import FOLDER, Cache

F = TypeVar("F", bound=Callable[..., object])

# `_nrt` is internal to numba and could go without notice. numba refuses an option that it does not know, but
# only when a function is first compiled; so it is looked up where numba itself looks. Without it every
# function counts, with the same results.
_OPTIONS = getattr(getattr(numba.core, "options", None), "DefaultOptions", None)
_COUNTING_IS_OPTIONAL = hasattr(_OPTIONS, "_nrt")


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


def overload(stub: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Choose the implementation of a stub by the types it is compiled for.

    Inlined like `inlined`: numba counts references to every array that it hands to a function which might
    fail, four atomic operations a call that cost a third of the equations themselves.
    """
    options = {"forceinline": True, "error_model": "numpy"}
    decorate: Callable[[Callable[..., Any]], Callable[..., Any]] = numba.extending.overload(
        stub, jit_options=options
    )
    return decorate


def _compile(function: F, inline: bool, counts: bool = True) -> F:
    # Also where it counts: what is compiled within a call of a bare function would take that one's option.
    counting = {"_nrt": counts} if _COUNTING_IS_OPTIONAL else {}
    compiled: Any = numba.njit(error_model="numpy", forceinline=inline, **counting)(function)
    if FOLDER is not None:
        compiled._cache = Cache(function)
    return cast(F, compiled)
