"""True trajectories of the systems: Taylor series in 34 digits, by heyoka, installed for this study alone."""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from comparison.studies.foreign.systems import System
from comparison.tables.channels import Array

TOLERANCE = 1e-30
OFFSET = 1e-20
"""Offset of the start by which the largest exponent is measured."""
SMALL_DISTANCE = 1e-6
"""Share of the range up to which a distance counts as small."""


class Truth:
    """A system, compiled once; its parameters are the true ones."""

    def __init__(self, system: System) -> None:
        self._heyoka = hy = import_module("heyoka")
        self.system, self.number = system, hy.real128
        parameters = {name: hy.real128(value) for name, value in system.parameters.items()}
        states = hy.make_vars(*system.names)
        states = states if isinstance(states, list) else [states]
        rates = system.rates(hy, hy.time, states, parameters, hy.par[0])
        events, event = [], system.event
        if event is not None:

            def switch(integrator: Any, sign: int) -> bool:
                if event.jump is None:
                    integrator.pars[:] = self.number(int(sign > 0))
                else:
                    integrator.state[:] = event.jump(list(integrator.state), parameters)
                return True

            either = hy.event_direction.any if event.jump is None else hy.event_direction.negative
            surface = event.surface(hy.time, states, parameters)
            events = [hy.t_event(surface, fp_type=hy.real128, callback=switch, direction=either)]
        self.taylor = hy.taylor_adaptive(
            list(zip(states, [rate + 0.0 * states[0] for rate in rates], strict=True)),
            np.array([hy.real128(0)] * len(states)),
            t_events=events,
            tol=hy.real128(TOLERANCE),
            fp_type=hy.real128,
            compact_mode=True,
        )

    def states(self, start: Sequence[float], offset: float = 0.0) -> Array:
        """Return the states at the samples, shape (samples, states), each moved by an offset at the start."""
        states: Array = self._propagate(start, offset).astype(np.float64)
        return states

    def exponent(self, start: Sequence[float]) -> float:
        """Return the largest exponent, 1/s: mean growth of a small distance from a moved start."""
        first = self._propagate(start, 0.0)
        differences = np.abs(self._propagate(start, OFFSET) - first).astype(np.float64)
        distance = (differences / np.ptp(first.astype(np.float64), axis=0)).max(axis=1)
        last = np.flatnonzero(np.maximum.accumulate(distance) <= SMALL_DISTANCE)[-1]
        return max(float(np.log(distance[last] / distance[0]) / self.system.times[last]), 0.0)

    def _propagate(self, start: Sequence[float], offset: float) -> Any:
        self.taylor.time, shift = self.number(0), self.number(offset)
        self.taylor.state[:] = [self.number(value) + shift for value in start]
        self.taylor.pars[:] = self.number(self.system.regime(start, self.system.parameters))
        if self.system.event is not None:
            self.taylor.reset_cooldowns()
        samples = np.array([self.number(time) for time in self.system.times])
        result = self.taylor.propagate_grid(samples)
        if result[0] != self._heyoka.taylor_outcome.time_limit:
            raise ArithmeticError(f"{self.system.name}: the true trajectory ends with {result[0]}")
        return result[-1]
