r"""A ball on a vibrating table: an impact oscillator whose answers are known, to test the methods with.

Table height A sin t, gravity 1, restitution e: time in units of the drive's 1/omega, so that A is the table's
peak acceleration over gravity. Between impacts the flight is a parabola, exactly; an impact is the first root
of ball height minus table height.

Known: the motion with one impact a period exists from A = pi (1 - e) / (1 + e) on, where the impact's phase f
has A cos f = pi (1 - e) / (1 + e). With a = -A sin f the map from one impact to the next has

.. math:: \det J = e^2, \qquad \operatorname{tr} J = 1 + e^2 + (1 + e)^2 a .

While its eigenvalues are a complex pair the exponent is exactly ln e a period; the period doubles at
tr J = -(1 + e^2). For e = 0.5 a strange attractor lies at A = 1.74.

Sources: P. J. Holmes, J. Sound and Vibration 84 (1982) 173-189; N. B. Tufillaro, T. Abbott and J. Reilly, An
Experimental Approach to Nonlinear Dynamics and Chaos, 1992, Ch. 1; stability: J. J. Barroso, M. V. Carneiro
and E. E. N. Macau, Phys. Rev. E 79 (2009) 026206.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, log, pi, sin, sqrt

import numpy as np

from comparison.studies.nonlinear.methods import Exponent, chaos_indicator, exponents, follow, recurrence
from comparison.tables.arrays import Array

PERIOD = 2 * pi
RESTITUTION = 0.5
REGULAR, CHAOTIC = 1.18, 1.74
"""Amplitudes: eigenvalues a complex pair; the strange attractor."""
_STEP = 0.02
_MOST_IMPACTS = 1000
_TRANSIENT = 10


@dataclass(frozen=True)
class Control:
    """What the methods give for the ball, beside what is known."""

    known: float
    """Exponent per period: ln e where the motion is regular, else from the exact linear maps."""
    measured: Exponent
    """From perturbed orbits."""
    indicator: float
    """K of the 0-1 test."""
    repeats: int | None
    """Periods."""


def control(amplitude: float, periods: int) -> Control:
    """Apply the methods to the ball at an amplitude of the table, over so many periods."""
    start = on_the_periodic_motion(amplitude) + np.array([1e-2, 0.0])
    for _ in range(_TRANSIENT):
        start = advance(start, amplitude)
    state, series, vector, total = start, np.empty((periods, 2)), np.ones(2), 0.0
    for k in range(periods):
        state, tangent = flight(state, amplitude)
        series[k] = state
        vector = tangent @ vector
        size = float(np.linalg.norm(vector))
        total, vector = total + log(size), vector / size
    orbits = follow(
        lambda state, when: (advance(state, amplitude), when + 1),
        lambda state, _when, _end: advance(state, amplitude),
        start, 0, periods, distances=np.array([1e-8]), round_off=1e-15, scale=np.ones(2),
    )  # fmt: skip
    return Control(
        log(RESTITUTION) if amplitude == REGULAR else total / periods,
        exponents(orbits, 1)[0],
        chaos_indicator(series[:, 0]),
        recurrence(series[-50:], 1e-6),
    )


def on_the_periodic_motion(amplitude: float) -> Array:
    """Return height and speed at table phase 0 on the motion with one impact a period, shape (2,)."""
    table_speed = pi * (1 - RESTITUTION) / (1 + RESTITUTION)
    phase = asin(sqrt(1.0 - (table_speed / amplitude) ** 2))
    left = PERIOD - phase  # the flight from the impact on, at speed pi, to the table's next phase 0
    return np.array([amplitude * sin(phase) + pi * left - 0.5 * left * left, pi - left])


def advance(state: Array, amplitude: float) -> Array:
    """Take height and speed at table phase 0 one period on, shape (2,) to (2,)."""
    return flight(state, amplitude)[0]


def flight(state: Array, amplitude: float) -> tuple[Array, Array]:
    """Take a state one period on; also return its derivative by the state before, shape (2, 2).

    Raises
    ------
    ValueError
        If the ball comes to rest on the table: this solver does not let it stick.
    """
    t, (z, v), tangent, e = 0.0, state, np.eye(2), RESTITUTION
    for _ in range(_MOST_IMPACTS):
        hit = _first_impact(t, z, v, amplitude)
        if hit is None:
            left = PERIOD - t
            return np.array([z + v * left - 0.5 * left * left, v - left]), _free(left) @ tangent
        dt = hit - t
        before, table = v - dt, amplitude * cos(hit)
        after = table - e * (before - table)
        # Jump of a small difference across the impact: height is reflected, and speed picks up what the
        # table's and the ball's accelerations do in the time by which the impacts differ.
        relative = before - table
        bend = (1 + e) * (-amplitude * sin(hit) + 1.0) / relative
        tangent = np.array([[-e, 0.0], [-bend, -e]]) @ _free(dt) @ tangent
        t, z, v = hit, amplitude * sin(hit), after
    raise ValueError(f"the ball comes to rest on the table at amplitude {amplitude:g}")


def _free(dt: float) -> Array:
    return np.array([[1.0, dt], [0.0, 1.0]])


def _first_impact(t: float, z: float, v: float, amplitude: float) -> float | None:
    """Return when ball and table meet next, before the period's end; None: they do not."""

    def gap(at: float) -> float:
        dt = at - t
        return z + v * dt - 0.5 * dt * dt - amplitude * sin(at)

    # Just after an impact the gap is round-off: there its sign is that of what follows.
    low = t + 1e-9
    while low < PERIOD:
        high = min(low + _STEP, PERIOD)
        if gap(high) < 0.0:
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
            return high
        low = high
    return None
