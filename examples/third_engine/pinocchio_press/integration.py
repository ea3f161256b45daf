"""DOP853 from one switching instant to the next, located on its dense output."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

Vector = NDArray[np.float64]
Dense = Callable[[float], Vector]
Surface = tuple[str, int]
"""Surface that is passed, and by which contact."""
CHECKS = 8
"""Points of a step at which the surfaces are looked at; a dip between two of them is found by its rate."""
TINY = 1e-16
"""Uncertainty of an instant, s: the last digit of a time within a cycle."""


class System(Protocol):
    """System that is integrated."""

    def rates(self, t: float, y: Vector) -> Vector:
        """Right-hand side between two switches."""

    def surfaces(self, t: float, y: Vector) -> dict[Surface, tuple[float, float]]:
        """Values that are positive until a switch, with their rates (nan: not watched for dips)."""

    def switch(self, surface: Surface, t: float, y: Vector) -> None:
        """Change the right-hand side."""


class Piece(NamedTuple):
    """Solution over a step, or over the part of it before a switch."""

    start: float
    end: float
    at: Dense
    check_times: list[float]
    surface: Surface | None


class StepError(RuntimeError):
    """The tolerance requires smaller steps than the arithmetic allows."""


def integrate(
    system: System, y: Vector, end: float, tolerance: Vector, largest_step: float
) -> Iterator[Piece]:
    """Integrate from 0 to an end (s) within a local error of each component, piece by piece.

    The system switches after the caller had the piece. Steps that become too small are a `StepError`.
    """
    t, relative = 0.0, 100 * np.finfo(float).eps  # the least that scipy accepts
    while t < end:
        settings: dict[str, Any] = {"max_step": largest_step, "rtol": relative, "atol": tolerance}
        solver = DOP853(system.rates, t, y, end, **settings)
        surface = None
        while surface is None and solver.status == "running":
            # A trial step that goes far into a wall may overflow; it is rejected like any other.
            with np.errstate(over="ignore", invalid="ignore"):
                message = solver.step()
            if message is not None:
                raise StepError(f"at {solver.t:g} s")
            dense = solver.dense_output()
            check_times = list(np.linspace(solver.t_old, solver.t, CHECKS + 1))
            t, y, surface = solver.t, solver.y, None
            if first := _first_switch(system, dense, check_times):
                t, surface = first
                y = dense(t)
            yield Piece(solver.t_old, t, dense, [at for at in check_times if at < t], surface)
        if surface is not None:
            system.switch(surface, t, y)


def _first_switch(system: System, dense: Dense, times: list[float]) -> tuple[float, Surface] | None:
    """Return the first instant of a step at which a surface is passed, and which."""

    def value(t: float, surface: Surface, part: int = 0) -> float:
        return system.surfaces(t, dense(t))[surface][part]

    before = system.surfaces(times[0], dense(times[0]))
    for left, right in pairwise(times):
        after, roots = system.surfaces(right, dense(right)), []
        for surface, (low, falling) in before.items():
            high, rising = after[surface]
            until = right
            if high >= 0.0 and low > 0.0 and falling < 0.0 < rising:
                until = brentq(value, left, right, args=(surface, 1), xtol=TINY)
                high = value(until, surface)
            if high < 0.0:
                at = brentq(value, left, until, args=(surface,), xtol=TINY) if low > 0.0 else left
                roots.append((at, surface))
        if roots:
            return min(roots, key=lambda root: root[0])
        before = after
    return None
