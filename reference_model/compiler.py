"""numba, and how it compiles the kernels; imported where the first of them is called.

Importing and preparing numba takes longer than most runs.
"""

import contextlib
import functools
import hashlib
from collections.abc import Callable
from typing import Any

import numba
import numba.extending
import numba.np.linalg
import numpy as np

from reference_model.constants import less_marked
from reference_model.kernel_cache import FOLDER, Cache

# It extends what is internal to numba; without it everything is compiled to its end, with the same results.
try:
    from reference_model.nested_code import NestedCompiler
except (ImportError, AttributeError):
    _NESTED = {}
else:
    _NESTED = {"pipeline_class": NestedCompiler}

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


@functools.cache
def _less_marked(argument: numba.types.Type, *, with_law: bool) -> numba.types.Type:
    """Return the type of an argument for kernels whose code does not depend on all marks of the constants."""
    if not isinstance(argument, numba.types.Record):
        return argument
    names = less_marked(argument.fields, with_law=with_law)
    return numba.from_dtype(np.dtype([(name, np.float64) for name in names]))


def _same_record(*arguments: Any) -> Any:
    """Take a record for one with fewer marks: its memory, the last argument, is the same."""
    return arguments[-1]


numba.extending.lower_cast(numba.types.Record, numba.types.Record)(_same_record)


def dispatcher(
    function: Callable[..., object], *, inline: bool, counts: bool, entry: bool, decided_by: set[str]
) -> Any:
    """Return what compiles a function at its first call, cached on disk between processes.

    Only an `entry` can be called from Python, and is cached. What other kernels alone call needs no way in
    from there: to compile those took longer than many a function itself. And it is compiled once for all
    records of constants that differ in nothing that its code is `decided_by`.
    """
    # Also where it counts: what is compiled within a call of a bare function would take that one's option.
    counting = {"_nrt": counts} if _COUNTING_IS_OPTIONAL else {}
    wrappers = {"no_cpython_wrapper": not entry, "no_cfunc_wrapper": True}
    options = {"error_model": "numpy", "forceinline": inline, **wrappers, **counting}
    compiled: Any = numba.njit(**options, **({} if entry else _NESTED))(function)
    if entry and FOLDER is not None:
        compiled._cache = Cache(function)
    if not entry and "formulation" not in decided_by:
        compiled.get_call_template = _for_less_marked(compiled.get_call_template, "law" in decided_by)
    return compiled


def _for_less_marked(template: Callable[..., Any], with_law: bool) -> Callable[..., Any]:
    """Return what numba asks for the types of a call, which it converts its arguments to."""

    def of(arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        fewer = tuple(_less_marked(each, with_law=with_law) for each in arguments)
        return template(fewer, {name: _less_marked(each, with_law=with_law) for name, each in named.items()})

    return of


def implement(stub: Callable[..., object], chosen: Callable[..., object]) -> None:
    """Have `chosen` choose the implementation of a stub by the types it is compiled for."""
    uncounted = {"_nrt": False} if _COUNTING_IS_OPTIONAL else {}
    options = {"forceinline": True, "error_model": "numpy", "no_cfunc_wrapper": True, **uncounted}
    numba.extending.overload(stub, jit_options=options)(chosen)
