"""The drawings of the study crank-pin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.report import svg
from comparison.report.svg import envelope
from comparison.studies.crank_pin.peaks import PRINTED, WORDS
from comparison.studies.crank_pin.runs import MODULUS, Runs
from comparison.studies.shared.errors import error
from comparison.studies.shared.published import Published

PASSAGE = (0.735, 0.765)
"""s; around the published instants."""


def draw(runs: Runs, folder: Path) -> None:
    """Draw the errors of the shown run, and the peaks over the modulus."""
    still = runs.still[runs.config.samples]
    time, bound = still.time, runs.bound
    errors = {channel: error(runs.shown, still, channel) for channel in WORDS}
    with svg.panels(folder / "displacement.svg") as (axes,):
        kept = envelope(errors["slider_y"])
        for sign, label in ((1, "a rigid shift of the pin"), (-1, None)):
            axes.plot(time[::40], sign * 1e3 * bound[::40], color=svg.LIMIT, dashes=(1, 2), label=label)
        axes.plot(time[kept], 1e3 * errors["slider_y"][kept], color=svg.FIRST, label="reference")
        _mark(axes, PRINTED["slider_y"], 1e3)
        axes.set(xlabel="time (s)", ylabel="error of slider y (mm)")
        svg.legend_above(axes)
    with svg.panels(folder / "passage.svg", 2, height=4.4, sharex=True) as both:
        inside = (time >= PASSAGE[0]) & (time <= PASSAGE[1])
        labels = {"slider_vy": "velocity (m/s)", "slider_ay": "acceleration (m/s²)"}
        for axes, (channel, label) in zip(both, labels.items(), strict=True):
            axes.plot(time[inside], errors[channel][inside], color=svg.FIRST, label="reference")
            _mark(axes, PRINTED[channel], 1.0)
            axes.set_ylabel(f"error of {label}")
        both[1].set_xlabel("time (s)")
        svg.legend_above(both[0])
    with svg.panels(folder / "stiffness.svg") as (axes,):
        _stiffness(axes, runs)


def _stiffness(axes: Axes, runs: Runs) -> None:
    by_modulus = {E: case.peaks["slider_ay", True] for E, case in runs.by_value(MODULUS).items()}
    axes.set(xscale="log", yscale="log", xlabel="Young's modulus (GPa)", ylabel="peak of the error (m/s²)")
    moduli = np.array(list(by_modulus))
    sizes = [np.abs([p.value for p in peaks]) for peaks in by_modulus.values()]
    middle = np.array([np.median(values) for values in sizes])
    for modulus, values in zip(moduli, sizes, strict=True):
        axes.plot(np.full(values.size, modulus / 1e9), values, "x", color=svg.THRESHOLD)
    axes.plot(moduli / 1e9, middle, color=svg.FIRST, label="median")
    slope = middle[0] * (moduli / moduli[0]) ** 0.4
    axes.plot(moduli / 1e9, slope, color=svg.LIMIT, dashes=(1, 2), label="modulus to the power 0.4")
    printed = abs(PRINTED["slider_ay"].value)
    axes.axhline(printed, color=svg.OUTSIDE, lw=1.2, dashes=(3.5, 1.8), label="published")
    axes.margins(x=0.03)
    axes.yaxis.set_major_locator(FixedLocator([200, 500, 1000, 2000]))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_locator(NullLocator())
    svg.legend_above(axes)


def _mark(axes: Axes, printed: Published, factor: float) -> None:
    axes.plot(printed.time, factor * printed.value, "o", color=svg.OUTSIDE, ms=5, label="published peak")
