"""The tools on the ball on a vibrating table, whose answers are known."""

from __future__ import annotations

from math import log

import numpy as np

from comparison.studies.nonlinear.methods import bouncing_ball as ball
from comparison.studies.nonlinear.methods.lyapunov import Exponent, exponents
from comparison.studies.nonlinear.methods.perturbed_orbits import follow
from comparison.studies.nonlinear.methods.recurrence import period
from comparison.studies.nonlinear.methods.zero_one import chaos_indicator
from comparison.studies.shared.frames import rows_table
from comparison.tables.arrays import Array

TRANSIENT = 10


def controls(periods: int) -> str:
    """Return what the tools say of the ball where it moves regularly and where it does not."""
    regular = _row("one impact a period", ball.REGULAR, log(ball.RESTITUTION), "ln e", periods)
    chaotic = _row("strange attractor", ball.CHAOTIC, None, "product of the exact linear maps", periods)
    return rows_table([regular, chaotic])


def _row(words: str, amplitude: float, known: float | None, source: str, periods: int) -> dict[str, str]:
    start = ball.on_the_periodic_motion(amplitude) + np.array([1e-2, 0.0])
    for _ in range(TRANSIENT):
        start = ball.advance(start, amplitude)
    series, mean = _tangent(start, amplitude, periods)
    measured = _measured(start, amplitude, periods)
    repeats = period(series[-50:], 1e-6)
    return {
        "ball on a vibrating table, e = 0.5": f"{words}, table's peak acceleration {amplitude:g} g",
        "exponent, known": f"{mean if known is None else known:.3f} ({source})",
        "exponent from perturbed runs": f"{measured.value:.3f} ({measured.low:.3f} … {measured.high:.3f})",
        "K": f"{chaos_indicator(series[:, 0]):.2f}",
        "repeats after": "never" if repeats is None else f"{repeats} period",
    }


def _tangent(state: Array, amplitude: float, periods: int) -> tuple[Array, float]:
    """Return the section, shape (periods, 2), and the mean growth under the exact linear maps."""
    series, vector, total = np.empty((periods, 2)), np.ones(2), 0.0
    for k in range(periods):
        state, tangent = ball.flight(state, amplitude)
        series[k] = state
        vector = tangent @ vector
        size = float(np.linalg.norm(vector))
        total, vector = total + log(size), vector / size
    return series, total / periods


def _measured(start: Array, amplitude: float, periods: int) -> Exponent:
    def orbit(state: Array, when: int) -> tuple[Array, int]:
        return ball.advance(state, amplitude), when + 1

    def perturbed(state: Array, _when: int, _end: int) -> Array:
        return ball.advance(state, amplitude)

    near = np.array([1e-8])
    found = follow(orbit, perturbed, start, 0, periods, distances=near, round_off=1e-15, scale=np.ones(2))
    return exponents(found, 1)[0]
