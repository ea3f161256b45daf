"""numba, and how it compiles the kernels; imported where the first of them is called.

Importing and preparing numba takes longer than most runs.
"""

import contextlib
import hashlib
from collections.abc import Callable
from typing import Any

import numba
import numba.extending
import numba.np.linalg

from reference_model.kernel_cache import FOLDER, Cache

# `_nrt` is internal to numba and could go without notice. numba refuses an option that it does not know, but
# only when a function is first compiled; so it is looked up where numba itself looks. Without it every
# function counts, with the same results.
_OPTIONS = getattr(getattr(numba.core, "options", None), "DefaultOptions", None)
_COUNTING_IS_OPTIONAL = hasattr(_OPTIONS, "_nrt")


def _import_without_blas() -> None:
    """Import numba's functions of arrays, but not scipy's BLAS, which takes some 0.2 s.

    They import it only to know that it is there. Code that calls it imports it, by numba's own means.
    """
    linalg: Any = numba.np.linalg
    ensure = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath
    finally:
        linalg.ensure_blas = ensure
    arraymath.ensure_blas = ensure


# Internal to numba; where it is not as expected, only the time is lost.
with contextlib.suppress(AttributeError):
    _import_without_blas()


def _mangled(record: numba.types.Record) -> tuple[str, tuple[int]]:
    """Name a record type in the symbols of machine code by its fields, the same in every process.

    numba's own name is its number among the types of the process. Two processes that compile a kernel for two
    formulations, each its first record, give both the same symbols, and a third process that loads both from
    the cache runs the code of one in place of the other's: without an error, with other results.
    """
    return "Record", (int.from_bytes(hashlib.sha256(record.name.encode()).digest()[:8]),)


numba.types.Record.mangling_args = property(_mangled)


def dispatcher(function: Callable[..., object], *, inline: bool, counts: bool, entry: bool) -> Any:
    """Return what compiles a function at its first call, cached on disk between processes.

    Only an `entry` can be called from Python. What other kernels alone call needs no way in from there: to
    compile those took longer than many a function itself.
    """
    # Also where it counts: what is compiled within a call of a bare function would take that one's option.
    counting = {"_nrt": counts} if _COUNTING_IS_OPTIONAL else {}
    wrappers = {"no_cpython_wrapper": not entry, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(error_model="numpy", forceinline=inline, **wrappers, **counting)(function)
    if FOLDER is not None:
        compiled._cache = Cache(function, entry=entry)
    return compiled


def implement(stub: Callable[..., object], chosen: Callable[..., object]) -> None:
    """Have `chosen` choose the implementation of a stub by the types it is compiled for."""
    uncounted = {"_nrt": False} if _COUNTING_IS_OPTIONAL else {}
    options = {"forceinline": True, "error_model": "numpy", "no_cfunc_wrapper": True, **uncounted}
    numba.extending.overload(stub, jit_options=options)(chosen)
