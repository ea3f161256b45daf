"""Systems of the study `foreign`: equations of textbooks, starts, spans, and the solvers of each side.

The list, the seeds and the rule that stops (so many starts of each pair) are older than the first run. A
right-hand side takes the functions of ``m``: of `math` for the solvers, of heyoka for the true trajectory.
"""

# ruff: noqa: ARG001, ARG005 - all right-hand sides and events have the same arguments

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

from comparison.tables.channels import Array

SAMPLES = 2001
NONSTIFF = (("DOP853", 1e-8, "LSODA", 1e-8), ("DOP853", 1e-6, "RK45", 1e-5), ("LSODA", 1e-7, "BDF", 1e-5))
STIFF = (("Radau", 1e-7, "LSODA", 1e-8), ("BDF", 1e-6, "Radau", 1e-6), ("LSODA", 1e-7, "BDF", 1e-5))
EVENTS = (("DOP853", 1e-8, "LSODA", 1e-8), ("DOP853", 1e-7, "step", 2e-3), ("step", 1e-3, "step", 1.5e-3))
"""Method and tolerance of both sides; "step" is Runge and Kutta's method of fixed steps (s), which notices
an event at the end of the step in which it happens."""
STEP = "step"

Parameters = Mapping[str, float]
Side = Callable[[float, Array], pd.DataFrame]


class Event(NamedTuple):
    """Zero of a function of time and states: where it falls the states jump, or the regime changes."""

    surface: Callable[[Any, Any, Parameters], Any]
    jump: Callable[[Sequence[Any], Parameters], list[Any]] | None = None
    """New states; None: the regime is 1 where the function is positive, else 0."""


@dataclass(frozen=True)
class System:
    """Initial value problem with at most one event."""

    name: str
    end: float  # s
    start: tuple[float, ...]
    parameters: dict[str, float]  # a fault changes the first
    rates: Callable[[Any, Any, Any, Parameters, Any], list[Any]]
    """Of m, time, states, parameters and regime."""
    solvers: tuple[tuple[str, float, str, float], ...] = NONSTIFF
    event: Event | None = None
    largest_step: float = math.inf  # of the adaptive solvers, s: they step over shorter pulses

    @property
    def names(self) -> list[str]:
        """Names of the states."""
        return [f"y{n}" for n in range(len(self.start))]

    @property
    def times(self) -> Array:
        """Times of the samples, s."""
        return np.linspace(0.0, self.end, SAMPLES)

    def table(self, states: Array) -> pd.DataFrame:
        """Return states of shape (samples, states) with their times."""
        return pd.DataFrame({"time": self.times, **dict(zip(self.names, states.T, strict=True))})

    def side(self, method: str, start: Sequence[float], parameters: Parameters) -> Side:
        """Return the solver that `sixbar.judge` calls with a tolerance and offsets of the start."""
        solve = _steps if method == STEP else _scipy

        def run(tolerance: float, offsets: Array) -> pd.DataFrame:
            return self.table(solve(self, method, tolerance, np.add(start, offsets).tolist(), parameters))

        return run

    def regime(self, states: Sequence[float], parameters: Parameters) -> int:
        """Return the regime at the start."""
        changes = self.event is not None and self.event.jump is None
        return int(changes and self.event is not None and self.event.surface(0.0, states, parameters) > 0)


def _scipy(system: System, method: Any, tolerance: float, states: list[float], p: Parameters) -> Array:
    """Return the states at the samples by scipy, each event located."""
    event, t, regime = system.event, 0.0, system.regime(states, p)
    samples = np.empty((SAMPLES, len(states)))
    while True:
        part: Any = solve_ivp(
            lambda t, y, regime: system.rates(math, t, y.tolist(), p, regime),
            (t, system.end),
            states,
            method,
            dense_output=True,
            events=None if event is None else _terminal(event, p, regime),
            args=(regime,),
            rtol=tolerance,
            atol=tolerance,
            max_step=system.largest_step,
        )
        if not part.success:
            raise ArithmeticError(part.message)
        mask = (system.times >= t) & (system.times <= part.t[-1])
        samples[mask] = part.sol(system.times[mask]).T
        if part.status == 0 or event is None:
            return samples
        t, states = float(part.t[-1]), part.y[:, -1].tolist()
        states, regime = (states, 1 - regime) if event.jump is None else (event.jump(states, p), regime)


def _terminal(event: Event, p: Parameters, regime: int) -> Any:
    def surface(t: float, y: Array, _: int) -> float:
        return float(event.surface(t, y, p))

    rising = event.jump is None and not regime
    surface.terminal, surface.direction = True, 1 if rising else -1  # type: ignore[attr-defined]
    return surface


def _steps(system: System, _: str, step: float, states: list[float], p: Parameters) -> Array:
    """Return the states at the samples by fixed steps; a sample within one by a shorter step of its own."""
    event, regime, samples, times = system.event, system.regime(states, p), [states], system.times.tolist()
    for n in range(math.ceil(system.end / step)):
        t = n * step
        while len(samples) < SAMPLES and times[len(samples)] <= t + step:
            samples.append(_step(system, t, states, times[len(samples)] - t, p, regime))
        after = _step(system, t, states, step, p, regime)
        if event is not None:
            old, new = (event.surface(at, y, p) for at, y in ((t, states), (t + step, after)))
            if event.jump is None:
                regime = int(new > 0)
            elif new < 0 <= old or (new < 0 and new < old):
                after = event.jump(after, p)
        states = after
    return np.array(samples)


def _step(system: System, t: float, y: list[float], h: float, p: Parameters, regime: int) -> list[float]:
    def rates(part: float, slope: list[float]) -> list[float]:
        return system.rates(
            math, t + part * h, [a + part * h * b for a, b in zip(y, slope, strict=True)], p, regime
        )

    first = system.rates(math, t, y, p, regime)
    second = rates(0.5, first)
    third = rates(0.5, second)
    slopes = zip(y, first, second, third, rates(1.0, third), strict=True)
    return [a + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4) for a, k1, k2, k3, k4 in slopes]


# ---- the list


def _double_pendulum(m: Any, t: Any, y: Sequence[Any], p: Parameters, r: Any) -> list[Any]:
    a, b, u, v = y
    s, c, mu = m.sin(a - b), m.cos(a - b), 1 + p["mass"]
    below = mu - c * c
    return [
        u,
        v,
        (p["g"] * (m.sin(b) * c - mu * m.sin(a)) - (v * v + u * u * c) * s) / below,
        (mu * (u * u * s - p["g"] * (m.sin(b) - m.sin(a) * c)) + v * v * s * c) / below,
    ]


def _cart(m: Any, t: Any, y: Sequence[Any], p: Parameters, r: Any) -> list[Any]:
    _, angle, v, w = y
    s, c = m.sin(angle), m.cos(angle)
    a = (p["mass"] * s * (w * w + p["g"] * c)) / (1 + p["mass"] * s * s)
    return [v, w, a, -(a * c + p["g"] * s)]


def _gravity(m: Any, t: Any, y: Sequence[Any], p: Parameters, r: Any) -> list[Any]:
    """Return the rates of bodies in a plane: all x, all y, then their velocities."""
    n = len(y) // 4
    x, z, rates = y[:n], y[n : 2 * n], [*y[2 * n :], *[0.0] * (2 * n)]
    masses = list(p.values())
    for i, j in combinations(range(n), 2):
        dx, dz = x[j] - x[i], z[j] - z[i]
        cube = m.sqrt(dx * dx + dz * dz) * (dx * dx + dz * dz)
        for body, partner, sign in ((i, j, 1), (j, i, -1)):
            rates[2 * n + body] = rates[2 * n + body] + sign * masses[partner] * dx / cube
            rates[3 * n + body] = rates[3 * n + body] + sign * masses[partner] * dz / cube
    return rates


def _impact(y: Sequence[Any], p: Parameters) -> list[Any]:
    return [y[0], -p["restitution"] * y[1]]


_PLEIADES = (
    *(3.0, 3.0, -1.0, -3.0, 2.0, -2.0, 2.0, 3.0, -3.0, 2.0, 0.0, 0.0, -4.0, 4.0),
    *(0.0, 0.0, 0.0, 0.0, 0.0, 1.75, -1.5, 0.0, 0.0, 0.0, -1.25, 1.0, 0.0, 0.0),
)

SYSTEMS = (
    System(
        "Lorenz",
        25.0,
        (1.0, 1.0, 20.0),
        {"rho": 28.0, "sigma": 10.0, "beta": 8 / 3},
        lambda m, t, y, p, r: [
            p["sigma"] * (y[1] - y[0]),
            y[0] * (p["rho"] - y[2]) - y[1],
            y[0] * y[1] - p["beta"] * y[2],
        ],
    ),
    System(
        "Chua, cubic",
        60.0,
        (0.2, 0.1, -0.1),
        {"alpha": 10.0, "beta": 16.0},
        lambda m, t, y, p, r: [
            p["alpha"] * (y[1] - y[0] * y[0] * y[0] + 0.143 * y[0]),
            y[0] - y[1] + y[2],
            -p["beta"] * y[1],
        ],
    ),
    System(
        "Roessler",
        120.0,
        (1.0, 1.0, 0.0),
        {"c": 5.7},
        lambda m, t, y, p, r: [-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - p["c"])],
    ),
    System("Double pendulum", 20.0, (2.0, 2.5, 0.0, 0.0), {"mass": 1.0, "g": 9.81}, _double_pendulum),
    System("Pendulum on a cart", 20.0, (0.0, 3.0, 0.5, 0.0), {"mass": 0.5, "g": 9.81}, _cart),
    System(
        "Three bodies",
        30.0,
        (0.0, 1.0, -1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -0.8),
        {"star": 1.0, "inner": 0.05, "outer": 0.03},
        _gravity,
    ),
    System(
        "Kepler",
        60.0,
        (0.5, 0.0, 0.0, 1.7),
        {"mu": 1.0},
        lambda m, t, y, p, r: [
            y[2],
            y[3],
            *(
                -p["mu"] * q / (m.sqrt(y[0] * y[0] + y[1] * y[1]) * (y[0] * y[0] + y[1] * y[1]))
                for q in y[:2]
            ),
        ],
    ),
    System(
        "Henon and Heiles",
        150.0,
        (0.0, 0.1, 0.49, 0.05),
        {"lambda": 1.0},
        lambda m, t, y, p, r: [
            y[2],
            y[3],
            -y[0] - 2 * p["lambda"] * y[0] * y[1],
            -y[1] - p["lambda"] * (y[0] * y[0] - y[1] * y[1]),
        ],
    ),
    System(
        "Duffing",
        100.0,
        (0.1, 0.0),
        {"force": 0.3, "damping": 0.2},
        lambda m, t, y, p, r: [
            y[1],
            y[0] - y[0] * y[0] * y[0] - p["damping"] * y[1] + p["force"] * m.cos(1.0 * t),
        ],
    ),
    System(
        "Relaxation to a sine",
        50.0,
        (0.5,),
        {"rate": 5.0},
        lambda m, t, y, p, r: [-p["rate"] * (y[0] - m.sin(1.0 * t))],
    ),
    System(
        "van der Pol",
        60.0,
        (2.0, 0.0),
        {"mu": 8.0},
        lambda m, t, y, p, r: [y[1], p["mu"] * (1 - y[0] * y[0]) * y[1] - y[0]],
        STIFF,
    ),
    System(
        "Robertson",
        40.0,
        (1.0, 0.0, 0.0),
        {"k1": 0.04, "k2": 3e7, "k3": 1e4},
        lambda m, t, y, p, r: [
            p["k3"] * y[1] * y[2] - p["k1"] * y[0],
            p["k1"] * y[0] - p["k3"] * y[1] * y[2] - p["k2"] * y[1] * y[1],
            p["k2"] * y[1] * y[1],
        ],
        STIFF,
    ),
    System("Pleiades", 3.0, _PLEIADES, {f"body {n}": float(n) for n in range(1, 8)}, _gravity),
    System(
        "Bouncing ball",
        4.0,
        (1.0, 0.0),
        {"g": 9.81, "restitution": 0.9},
        lambda m, t, y, p, r: [y[1], -p["g"] + 0.0 * y[0]],
        EVENTS,
        Event(lambda t, y, p: y[0], _impact),
    ),
    System(
        "Oscillator at a wall",
        40.0,
        (0.5, 0.0),
        {"force": 1.0, "frequency": 2.8, "restitution": 0.8},
        lambda m, t, y, p, r: [y[1], -y[0] - 0.1 * y[1] + p["force"] * m.cos(p["frequency"] * t)],
        EVENTS,
        Event(lambda t, y, p: y[0], _impact),
    ),
    System(
        "Relay",
        60.0,
        (1.0, 0.3),
        {"force": 0.8, "damping": 0.1},
        lambda m, t, y, p, r: [y[1], 1 - 2 * r - p["damping"] * y[1] + p["force"] * m.cos(0.7 * t)],
        EVENTS,
        Event(lambda t, y, p: y[0]),
    ),
    System(
        "One-sided spring",
        40.0,
        (-0.5, 0.0),
        {"stiffness": 200.0, "force": 1.0},
        lambda m, t, y, p, r: [
            y[1],
            -y[0] - 0.1 * y[1] - p["stiffness"] * r * y[0] + p["force"] * m.cos(1.3 * t),
        ],
        EVENTS,
        Event(lambda t, y, p: y[0]),
    ),
    System(
        "Pulse of 50 ms",
        10.0,
        (1.0, 0.0),
        {"force": 30.0, "stiffness": 25.0},
        lambda m, t, y, p, r: [y[1], -p["stiffness"] * y[0] - 0.4 * y[1] + p["force"] * r],
        EVENTS,
        Event(lambda t, y, p: (t - 3.0) * (3.05 - t)),
        largest_step=0.02,
    ),
)
