"""Compile this package's kernels; `kernel_files` keeps the machine code."""

import hashlib
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, ParamSpec, TypeVar, cast

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


class Kernel:
    """A function with its machine code: for calls from Python, and apart from that for calls by kernels.

    The wrapper that takes arguments from Python takes longer to compile than many a function itself, and most
    kernels are called by others alone. Each of both codes is made where it is first needed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Any:
        """What Python calls."""
        return _dispatcher(self.py_func, entry=True)

    @cached_property
    def _inner(self) -> Any:
        return _dispatcher(self.py_func, entry=False)

    @property
    def _numba_type_(self) -> Any:
        # That is what numba looks up where it compiles a call of this kernel
        return self._inner._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code."""
        return self.compiled(*arguments)


def _dispatcher(function: Callable[..., Any], *, entry: bool) -> Any:
    """Return numba's dispatcher of a function; its setting of a folder for all packages is left alone."""
    # No callback of C is made of any
    wrappers = {"no_cpython_wrapper": not entry, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(error_model="numpy", **wrappers)(function)
    if folder() is not None:
        compiled._cache = KernelCache(function, "" if entry else "-inner")
    return compiled


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` with numba when it is called, and cache the machine code."""
    return cast(Callable[P, R], Kernel(function))


def direct(function: Callable[..., R], *examples: Any) -> Callable[..., R]:
    """Return the machine code of a kernel for arguments of the same types as ``examples``.

    For what Exudyn calls in every step: a kernel itself first dispatches on the types of its arguments, which
    takes as long as the smaller kernels run. This does not: what is not of these types is read wrongly.
    """
    types = tuple(numba.typeof(example) for example in examples)
    machine_code: Callable[..., R] = cast(Kernel, function).compiled.compile(types)
    return machine_code
