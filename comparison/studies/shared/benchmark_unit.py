"""Unit of processor time for limits that do not depend on the machine: what a fixed computation takes.

The benchmark ``bouncing-mass``: a mass between two walls of Hertz's law, by the classical Runge-Kutta method.
Its arithmetic is like that of the models, and no change of theirs changes it.
"""

import time
from collections.abc import Callable
from functools import cache
from math import cos, sin, sqrt

BENCHMARK = "bouncing-mass"
STEPS = 330_000
"""Of four right-hand sides each: 20 ms on the machine of reports/extremes (AMD EPYC 26/2)."""
REPEATS = 7  # the least counts: others are disturbed


@cache
def unit_seconds() -> float:
    """Return the processor time of one unit in this process, s; measured at the first call."""
    from numba import njit  # imported where it is first needed

    def acceleration(x: float, v: float, t: float) -> float:
        depth, push = abs(x) - 1e-4, 20.0 * cos(15.0 * t) * sin(x + 0.3)
        if depth <= 0.0:
            return push
        side = 1.0 if x > 0.0 else -1.0
        return push - side * 2e10 * depth * sqrt(depth) * (1.0 + 0.1 * side * v)

    pushed = njit(acceleration)

    def motion(steps: int) -> float:
        x, v, t, h = 0.0, 0.1, 0.0, 1e-6
        for _ in range(steps):
            a1 = pushed(x, v, t)
            a2 = pushed(x + 0.5 * h * v, v + 0.5 * h * a1, t + 0.5 * h)
            a3 = pushed(x + 0.5 * h * (v + 0.5 * h * a1), v + 0.5 * h * a2, t + 0.5 * h)
            a4 = pushed(x + h * (v + 0.5 * h * a2), v + h * a3, t + h)
            x += h * (v + h * (a1 + a2 + a3) / 6.0)
            v += h * (a1 + 2.0 * (a2 + a3) + a4) / 6.0
            t += h
        return x

    bounces: Callable[[int], float] = njit(motion)
    bounces(1)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        bounces(STEPS)
        times.append(time.process_time() - start)
    return min(times)
