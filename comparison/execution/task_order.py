"""Order in which workers take tasks: all are busy to the end, and no two of them compile the same code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

Kernels = tuple[str, ...]
"""Identifier of code that is compiled at its first use."""


class Work(Protocol):
    """Properties of a task that determine its position in the queue."""

    @property
    def cost(self) -> float:
        """Expected time, s."""

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code it compiles if no task before it did."""


def execution_order(tasks: Mapping[str, Work]) -> list[str]:
    """Order tasks so that all workers are busy to the end, and seldom wait for what another one compiles.

    Which takes longer than most tasks. So for each kind of kernels one task goes before all others, those
    that need the fewest kinds first; the rest follows, the longest first.
    """
    longest = sorted(tasks, key=lambda name: (-tasks[name].cost, name))
    ahead: list[str] = []
    known: frozenset[Kernels] = frozenset()
    while new := {name: tasks[name].kernels - known for name in longest if tasks[name].kernels - known}:
        ahead.append(min(new, key=lambda name: len(tasks[name].kernels)))  # of equal ones the longest
        known |= new[ahead[-1]]
    return list(dict.fromkeys([*ahead, *longest]))


class Compiling:
    """Which code is being compiled, by which task."""

    def __init__(self, kernels: Mapping[str, frozenset[Kernels]]) -> None:
        self._kernels = kernels
        self._known: set[Kernels] = set()
        self._by: dict[str, frozenset[Kernels]] = {}

    def first_free(self, names: Iterable[str]) -> str | None:
        """Return the first task that needs none of the code that is being compiled."""
        busy = frozenset[Kernels]().union(*self._by.values())
        return next((name for name in names if busy.isdisjoint(self._kernels.get(name, ()))), None)

    def begin(self, name: str) -> None:
        """Take what a task needs, and no task before it did, for being compiled."""
        new = self._kernels.get(name, frozenset()) - self._known
        if new:
            self._by[name] = new

    def end(self, name: str) -> None:
        """Take the code of a task for compiled, even of one that died: the next must not wait for ever."""
        self._known |= self._by.pop(name, frozenset())
