"""Kernels: functions that are compiled at their first call.

Their decorators import nothing: a run of the ideal mechanism needs no compiler, and of the kernels a run
needs some.
"""

import functools
import math
import threading
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., object])

_chosen_later: list[tuple[Callable[..., object], Callable[..., object]]] = []
"""Stubs, and what chooses their implementations, that the compiler does not know yet."""
_by_law: dict[Callable[..., object], bool] = {}
"""Stubs, and whether the contact law alone, not the formulation, decides what stands for them."""
_one_at_a_time = threading.Lock()


class Kernel:
    """A function, and the machine code that stands for it once it is called, or compiled into another."""

    def __init__(self, function: Callable[..., object], *, inline: bool, counts: bool) -> None:
        self.function = function
        self._options = {"inline": inline, "counts": counts}
        functools.update_wrapper(self, function)

    @functools.cached_property
    def compiled(self) -> Any:
        """What numba calls a dispatcher, for calls from Python."""
        return self._dispatcher(entry=True)

    @functools.cached_property
    def _nested(self) -> Any:
        return self._dispatcher(entry=False)

    def _dispatcher(self, *, entry: bool) -> Any:
        with _one_at_a_time:
            from reference_model import compiler

            while _chosen_later:
                compiler.implement(*_chosen_later.pop(0))
            decided_by = _decisive(self.function)
            return compiler.dispatcher(self.function, entry=entry, decided_by=decided_by, **self._options)

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102
        return self.compiled(*arguments)

    def prepare(self, *arguments: Any) -> None:
        """Compile what a call with these arguments runs, or load it, without the call."""
        self.compiled.compile(tuple(map(self.compiled.typeof_pyval, arguments)))

    @property
    def _numba_type_(self) -> Any:
        # Numba asks for it where the code of another kernel calls this one.
        return self._nested._numba_type_

    def __getattr__(self, name: str) -> Any:
        if name in ("compiled", "_nested"):  # an error within it
            raise AttributeError(name)
        return getattr(self.compiled, name)


def kernel(function: F) -> F:
    """Compile `function` to machine code at its first call, cached on disk between processes."""
    return cast(F, Kernel(function, inline=False, counts=True))


def bare(function: F) -> F:
    """Compile a function that allocates nothing, without counting references.

    numba counts up and down, atomically, the references to every array that is handed to a function which
    calls others: some 15 % of a run went there.
    """
    return cast(F, Kernel(function, inline=False, counts=False))


def inlined(function: F) -> F:
    """Compile a small function into its callers: the constants are many, and passing them on costs more.

    Like `bare` it allocates nothing and counts nothing.
    """
    return cast(F, Kernel(function, inline=True, counts=False))


def overload(stub: Callable[..., Any], *, by_law: bool = False) -> Callable[[F], F]:
    """Choose the implementation of a stub by the types it is compiled for: the formulation, or `by_law`.

    Inlined like `inlined`: numba counts references to every array that it hands to a function which might
    fail, four atomic operations a call that cost a third of the equations themselves.
    """

    def later(chosen: F) -> F:
        _chosen_later.append((stub, chosen))
        _by_law[stub] = by_law
        return chosen

    return later


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _decisive(function: Callable[..., object]) -> set[str]:
    """Return what the code of a kernel and of all that it calls depends on: "formulation", "law", or neither.

    What stands for a stub of the formulation may depend on the law, too; that is not said.
    """
    found, seen, left = set(), set(), [cast(Any, function)]
    while left:
        now = left.pop()
        seen.add(now)
        for called in map(now.__globals__.get, _names(now.__code__)):
            if isinstance(called, Kernel):
                left += {called.function} - seen
            elif isinstance(called, FunctionType) and called in _by_law:
                found.add("law" if _by_law[called] else "formulation")
    return found


def _atan2(y: Any, x: Any) -> Any:
    """Return what compiled code does to the last bit, which `numpy.atan2` does not on every processor."""
    return np.fromiter(map(math.atan2, y, x), np.float64, len(y))


_OF_ARRAYS = SimpleNamespace(cos=np.cos, sin=np.sin, sqrt=np.sqrt, atan2=_atan2)
"""What stands for `math`."""


@functools.cache
def over_arrays(function: F) -> F:
    """Return a kernel for arrays of numbers in place of numbers: its source as it stands, not compiled.

    For kernels without a branch on these numbers.
    """
    source = cast(Any, function).function
    scope = dict(source.__globals__)
    for name in source.__code__.co_names:
        if isinstance(scope.get(name), Kernel):
            scope[name] = over_arrays(scope[name])
        elif scope.get(name) is math:
            scope[name] = _OF_ARRAYS
    return cast(F, FunctionType(source.__code__, scope, source.__name__))
