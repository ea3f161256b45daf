"""Compile this package's kernels; `kernel_files` keeps the machine code."""

import hashlib
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numba

from exudyn_model.kernel_files import KernelCache, folder

P = ParamSpec("P")
R = TypeVar("R")

# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]


def _symbol_of_record(record: numba.types.Record) -> tuple[str, tuple[int]]:
    """Return what stands for a record type in the symbols of compiled functions.

    By default numba numbers the types of a process. Functions that different processes have compiled for
    different records then get the same symbols, and whoever loads them from the cache calls the wrong one.
    """
    return "Record", (int(hashlib.sha256(record.name.encode()).hexdigest()[:16], 16),)


numba.types.Record.mangling_args = property(_symbol_of_record)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` with numba and cache the machine code.

    numba's setting of its own folder is left alone: other packages of the process keep theirs.
    """
    # No callback of C is made of any.
    compiled: Any = numba.njit(error_model="numpy", no_cfunc_wrapper=True)(function)
    if folder() is not None:
        compiled._cache = KernelCache(function)
    done: Callable[P, R] = compiled
    return done


def direct(function: Callable[..., R], *examples: Any) -> Callable[..., R]:
    """Return the machine code of a kernel for arguments of the same types as ``examples``.

    For what Exudyn calls in every step: a kernel itself first dispatches on the types of its arguments, which
    takes as long as the smaller kernels run. This does not: what is not of these types is read wrongly.
    """
    compiled: Any = function
    entry: Callable[..., R] = compiled.compile(tuple(numba.typeof(example) for example in examples))
    return entry
