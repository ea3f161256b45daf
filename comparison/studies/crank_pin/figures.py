"""The drawings of the study crank-pin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from comparison.report import svg
from comparison.report.decimate import envelope
from comparison.studies.shared.errors import Peak
from comparison.studies.shared.published import Published
from comparison.tables.arrays import Array

PASSAGE = (0.735, 0.765)
"""s; around the published instants."""


def draw(
    folder: Path,
    time: Array,
    errors: Mapping[str, Array],
    bound: Array,
    printed: Mapping[str, Published],
    by_modulus: Mapping[float, Sequence[Peak]],
) -> None:
    """Write displacement.svg, passage.svg and stiffness.svg.

    Parameters
    ----------
    folder
        Where to.
    time, errors, bound
        s; channel -> error of one run; what a rigid shift of the pin moves the slider by, m; shape (n,).
    printed
        Channel -> published peak.
    by_modulus
        Young's modulus (Pa) -> peaks of the acceleration's error near the published instant, m/s^2.
    """
    with svg.style():
        figure, (axes,) = _axes(1)
        kept = envelope(errors["slider_y"])
        for sign, label in ((1, "a rigid shift of the pin"), (-1, None)):
            axes.plot(time[::40], sign * 1e3 * bound[::40], color=svg.LIMIT, dashes=(1, 2), label=label)
        axes.plot(time[kept], 1e3 * errors["slider_y"][kept], color=svg.FIRST, label="reference")
        _mark(axes, printed["slider_y"], 1e3)
        axes.set_ylabel("error of y (mm)")
        _finish(axes, figure, folder / "displacement.svg")

        figure, (upper, lower) = _axes(2)
        inside = (time >= PASSAGE[0]) & (time <= PASSAGE[1])
        for axes, channel, label in (
            (upper, "slider_vy", "velocity (m/s)"),
            (lower, "slider_ay", "acceleration (m/s²)"),
        ):
            axes.plot(time[inside], errors[channel][inside], color=svg.FIRST, label="reference")
            _mark(axes, printed[channel], 1.0)
            axes.set_ylabel(f"error of {label}")
        upper.set_xlabel("")
        upper.tick_params(labelbottom=False)
        _finish(upper, figure, folder / "passage.svg")

        figure, (axes,) = _axes(1)
        axes.set_xscale("log")
        axes.set_yscale("log")
        moduli = np.array(list(by_modulus))
        sizes = [np.abs([p.value for p in peaks]) for peaks in by_modulus.values()]
        middle = np.array([np.median(values) for values in sizes])
        for modulus, values in zip(moduli, sizes, strict=True):
            axes.plot(np.full(values.size, modulus / 1e9), values, "x", color=svg.THRESHOLD)
        axes.plot(moduli / 1e9, middle, color=svg.FIRST, label="median")
        slope = middle[0] * (moduli / moduli[0]) ** 0.4
        axes.plot(moduli / 1e9, slope, color=svg.LIMIT, dashes=(1, 2), label="modulus to the power 0.4")
        axes.axhline(
            abs(printed["slider_ay"].value), color=svg.SECOND, lw=1.2, dashes=(3.5, 1.8), label="published"
        )
        axes.margins(x=0.03)
        axes.yaxis.set_major_locator(FixedLocator([200, 500, 1000, 2000]))
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("Young's modulus (GPa)")
        axes.set_ylabel("peak of the error (m/s²)")
        _finish(axes, figure, folder / "stiffness.svg")


def _axes(count: int) -> tuple[Figure, list[Axes]]:
    height = 3.0 if count == 1 else 4.4
    figure = Figure(figsize=(5.56, height))
    bottom, top = 0.42 / height, 1 - 0.36 / height
    each = (top - bottom) / count
    places = [(0.135, top - (n + 1) * each, 0.83, each - (0.04 if count > 1 else 0.0)) for n in range(count)]
    drawn = [figure.add_axes(place) for place in places]
    for axes in drawn:
        axes.spines[["top", "right"]].set_visible(False)
        axes.yaxis.set_label_coords(-0.11, 0.5)
        axes.set_xlabel("time (s)")
    return figure, drawn


def _mark(axes: Axes, printed: Published, factor: float) -> None:
    axes.plot(printed.time, factor * printed.value, "o", color=svg.SECOND, ms=5, label="published peak")


def _finish(axes: Axes, figure: Figure, path: Path) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=4)
    svg.write_svg(figure, path)
