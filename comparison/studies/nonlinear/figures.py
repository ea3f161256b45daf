"""The drawings of the study nonlinear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from comparison.execution.run import Job, Outcome
from comparison.formatting import prefix, quantity
from comparison.report import svg
from comparison.studies.nonlinear.chains import SAMPLES
from comparison.studies.nonlinear.methods.lyapunov import Exponent
from comparison.studies.nonlinear.methods.perturbed_orbits import PerturbedOrbits
from comparison.studies.nonlinear.press import by_cycle, states
from comparison.studies.nonlinear.scenes import ANGLES, CLEARANCE, SPEED
from comparison.tables.arrays import Array

DRAWN = (0, 7, 15, 34)
"""Samples of a cycle whose sections are drawn."""
MOST_POINTS = 400
SHOWN_CYCLES = 40
"""Of a run with another parameter; those before are left out."""
PARAMETERS = {SPEED: ("speed (rpm)", 1.0), CLEARANCE: ("clearance (mm)", 1e3)}
"""Key of a bifurcation diagram -> label and factor."""
GROWN = (1, 2, 3)
"""Which distances the growth is drawn of."""
STRETCHES = 20
"""Of a cycle, over which the growth is summed."""
ROUND_OFF = 1e-16
"""m; what a logarithmic axis shows of zero."""
SMALLEST_UNIT = 1e-9
"""m, m/s: no axis has a finer one."""
_LINES: tuple[dict[str, Any], ...] = (
    {"marker": "o"},
    {"marker": "s", "dashes": (4, 2)},
    {"marker": "^", "dashes": (1, 1)},
    {"marker": "v", "dashes": (6, 2, 1, 2)},
)


def draw_sections(a: Array, b: Array, path: Path) -> None:
    """Draw x and its rate once a cycle at four angles, of both models, from the reference's median.

    The states of the reference, ``a``, and of Exudyn, ``b``, have the shape (cycles, angles, 4).
    """
    with svg.panels(path, 2, 2, height=4.8) as panels:
        reach = np.ptp(a[:, DRAWN], axis=0).max(axis=0)  # one unit for all panels
        (x_factor, x_unit), (rate_factor, rate_unit) = (
            prefix(max(of, SMALLEST_UNIT), unit) for of, unit in ((reach[0], "m"), (reach[2], "m/s"))
        )
        for axes, angle in zip(panels, DRAWN, strict=True):
            middle = np.median(a[:, angle], axis=0)
            both = ((a, svg.FIRST, "o", "reference"), (b, svg.SECOND, "x", "exudyn"))
            for cycles, colour, marker, label in both:
                x, _, rate, _ = (cycles[:MOST_POINTS, angle] - middle).T
                axes.plot(
                    x / x_factor, rate / rate_factor, marker,
                    color=colour, ms=2.4, mew=0.6, label=label, fillstyle="none",
                )  # fmt: skip
            axes.margins(0.06)
            axes.locator_params(nbins=5)
            axes.ticklabel_format(scilimits=(-2, 3))
            axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
            axes.set(xlabel=f"slider x ({x_unit})", ylabel=f"velocity of x ({rate_unit})")
        svg.legend_above(panels[0])


def draw_bifurcation(
    swept: Mapping[tuple[str, float], Outcome], jobs: Mapping[tuple[str, float], Job], path: Path
) -> None:
    """Draw x at the angle where it scatters most over the parameters; of runs that stopped nothing."""
    with svg.panels(path, len(PARAMETERS), height=4.6) as panels:
        for axes, (key, (label, factor)) in zip(panels, PARAMETERS.items(), strict=True):
            values, points = [], []
            for (of, value), outcome in swept.items():
                if of == key and outcome.table is not None:
                    scene = jobs[of, value].scene
                    x = by_cycle(states(outcome.table, scene), scene)[-SHOWN_CYCLES:, :, 0]
                    values.append(factor * value)
                    points.append(x[:, np.argmax(x.std(axis=0))] / scene.data["clearance"]["slider"])
            # Dashes as wide as there is room stand for points: as one line it is a tenth of the bytes.
            apart = float(np.diff(np.unique(values)).min(initial=np.inf))
            width = min(0.38 * apart, 0.012 * (values[-1] - values[0]))
            x, y = np.repeat(values, len(points[0])), np.ravel(points)
            nothing = np.full(x.size, np.nan)
            dashes = (
                np.column_stack(of).ravel() for of in ([x - width, x + width, nothing], [y, y, nothing])
            )
            axes.plot(*dashes, color=svg.FIRST, lw=1.4, alpha=0.7)
            axes.margins(x=0.01)
            axes.set(xlabel=label, ylabel="slider x / clearance (-)", ylim=(-1.05, 1.05))


def draw_exponents(found: Mapping[str, tuple[Sequence[float], Sequence[Exponent]]], path: Path) -> None:
    """Draw exponents with their intervals over the distance of the perturbed run; hollow: an upper bound.

    What was found is, of each model and tolerance, distances (m) and exponents.
    """
    with svg.panels(path) as (axes,):
        for n, (label, (distances, exponents)) in enumerate(found.items()):
            colour = svg.FIRST if label.startswith("reference") else svg.SECOND
            line = _LINES[n % len(_LINES)]
            shifted = np.array(distances) * 10 ** (0.05 * (n - 0.5 * len(found)))
            value = np.array([e.value for e in exponents])
            bars = np.array([[e.value - e.low, e.high - e.value] for e in exponents]).T
            axes.errorbar(shifted, value, bars, color=colour, lw=0.7, ls="none", capsize=1.5)
            axes.plot(shifted, value, color=colour, lw=0.6, ms=4, mfc="none", label=label, **line)
            firm = np.array([e.measured for e in exponents])
            axes.plot(shifted[firm], value[firm], line["marker"], ms=4, color=colour)
        axes.margins(x=0.05)
        axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
        axes.set(xscale="log", xlabel="distance of the perturbed run (m)", ylabel="exponent (1/cycle)")
        svg.legend_above(axes, columns=2)


def draw_growth(scatter: Array, orbit: PerturbedOrbits | None, path: Path) -> None:
    """Draw how far all cycles scatter, m, shape (angles,), and by how much neighbours part."""
    with svg.panels(path, 2, height=4.2, sharex=True) as (upper, lower):
        cycle = np.arange(scatter.size) / scatter.size
        upper.semilogy(cycle, 1e3 * np.maximum(scatter, ROUND_OFF), color=svg.FIRST)
        upper.set_ylabel("scatter of all cycles (mm)")
        if orbit is not None:
            for which, line in zip(GROWN, _LINES, strict=False):
                grown = np.concatenate([[0.0], _growth(orbit, which)])
                label = f"distance {quantity(orbit.distances[which], 'm')}"
                dashes = line.get("dashes", (None, None))
                lower.plot(np.linspace(0, 1, grown.size), grown, label=label, color=svg.FIRST, dashes=dashes)
        lower.set(ylabel="ln of the growth so far (-)", xlabel="crank cycles from the start angle (-)")
        svg.legend_above(lower)


def _growth(orbit: PerturbedOrbits, which: int) -> Array:
    """Return the mean logarithm of the growth from the start angle to the end of each stretch of a cycle."""
    length = np.diff(orbit.times, axis=1)[:, 0]
    total = np.zeros(STRETCHES)
    for begin, log_rate, count in zip(orbit.times[:, 0], orbit.logs[which] / length, length, strict=True):
        stretches = ((begin + np.arange(count)) % SAMPLES) // (SAMPLES // STRETCHES)
        total += log_rate * np.bincount(stretches, minlength=STRETCHES)
    return np.cumsum(total / max(1, round(float(length.sum()) / SAMPLES)))
