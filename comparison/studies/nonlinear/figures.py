"""The drawings of the study nonlinear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from comparison.formatting import prefix
from comparison.report import svg
from comparison.studies.nonlinear.methods.lyapunov import Exponent
from comparison.tables.arrays import Array

_LINES: tuple[dict[str, Any], ...] = (
    {"color": svg.FIRST, "marker": "o"},
    {"color": svg.SECOND, "marker": "s", "dashes": (4, 2)},
    {"color": svg.BEYOND, "marker": "^", "dashes": (1, 1)},
    {"color": svg.DIFFERENCE, "marker": "v", "dashes": (6, 2, 1, 2)},
)
MOST_POINTS = 400
ROUND_OFF = 1e-16
"""m; what a logarithmic axis shows of zero."""


def draw_sections(a: Array, b: Array, angles: Sequence[int], per_turn: int, path: Path) -> None:
    """Draw x and its rate once a turn at four angles, of both models, from the reference's median.

    Parameters
    ----------
    a, b
        States of the reference and of Exudyn, shape (turns, angles, 4).
    angles
        Which four, in samples.
    per_turn
        Samples a turn.
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 4.8))
        for axes, angle in zip(figure.subplots(2, 2).flat, angles, strict=True):
            middle = np.median(a[:, angle], axis=0)
            reach = np.ptp(a[:, angle], axis=0)
            (x_factor, x_unit), (rate_factor, rate_unit) = prefix(reach[0], "m"), prefix(reach[2], "m/s")
            both = ((a, svg.FIRST, "o", "reference"), (b, svg.SECOND, "x", "Exudyn"))
            for turns, colour, marker, label in both:
                x, _, rate, _ = (turns[:MOST_POINTS, angle] - middle).T
                axes.plot(
                    x / x_factor, rate / rate_factor, marker,
                    color=colour, ms=2.4, mew=0.6, label=label, fillstyle="none",
                )  # fmt: skip
            axes.margins(0.06)
            axes.locator_params(nbins=5)
            axes.set_title(f"{360 * angle / per_turn:.0f}° after the start", fontsize=9)
            axes.set_xlabel(f"x ({x_unit})", labelpad=1)
            axes.set_ylabel(f"rate of x ({rate_unit})", labelpad=1)
        figure.axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.13), ncols=2)
        figure.subplots_adjust(left=0.12, right=0.97, bottom=0.1, top=0.9, hspace=0.5, wspace=0.3)
        svg.write_svg(figure, path)


def draw_bifurcation(panels: Sequence[tuple[str, str, Array, Array]], path: Path) -> None:
    """Draw the section over parameters.

    Parameters
    ----------
    panels
        Label of the axis below and on the left, values of the parameter, shape (n,), and x over the
        clearance, shape (n, points).
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 4.6))
        for axes, (below, left, values, section) in zip(figure.subplots(len(panels), 1), panels, strict=True):
            # Dashes a hundredth of the axis wide stand for points: as one line it is a tenth of the bytes.
            width = 0.003 * (values[-1] - values[0])
            x = np.repeat(values, section.shape[1])
            nothing = np.full(x.size, np.nan)
            y = section.ravel()
            axes.plot(
                np.column_stack([x - width, x + width, nothing]).ravel(),
                np.column_stack([y, y, nothing]).ravel(),
                color=svg.FIRST,
                lw=0.5,
            )
            axes.set_xlabel(below)
            axes.set_ylabel(left)
            axes.set_ylim(-1.05, 1.05)
        figure.subplots_adjust(left=0.12, right=0.97, bottom=0.1, top=0.98, hspace=0.36)
        svg.write_svg(figure, path)


def draw_exponents(found: Mapping[str, tuple[Sequence[float], Sequence[Exponent]]], path: Path) -> None:
    """Draw exponents with their intervals over the distance of the twins; hollow: an upper bound.

    Parameters
    ----------
    found
        Label -> distances (m) and exponents.
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 3.2))
        axes = figure.add_axes((0.11, 0.15, 0.86, 0.68))
        for n, (label, (distances, exponents)) in enumerate(found.items()):
            line = _LINES[n % len(_LINES)]
            shifted = np.array(distances) * 10 ** (0.05 * (n - 0.5 * len(found)))
            value = np.array([e.value for e in exponents])
            bars = np.array([[e.value - e.low, e.high - e.value] for e in exponents]).T
            axes.errorbar(shifted, value, bars, color=line["color"], lw=0.7, ls="none", capsize=1.5)
            axes.plot(shifted, value, color=line["color"], lw=0.6, dashes=line.get("dashes", (None, None)))
            for measured, fill in ((True, line["color"]), (False, "none")):
                which = [k for k, e in enumerate(exponents) if e.measured == measured]
                axes.plot(
                    shifted[which], value[which], line["marker"], ms=4, mec=line["color"], mfc=fill,
                    label=label if measured else None,
                )  # fmt: skip
        axes.set_xscale("log")
        axes.margins(x=0.05)
        axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
        axes.set_xlabel("distance of the twins (m)")
        axes.set_ylabel("exponent per turn")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=3)
        svg.write_svg(figure, path)


def draw_growth(angles: Array, scatter: Array, steps: Array, growth: Mapping[str, Array], path: Path) -> None:
    """Draw how far all turns scatter, and by how much neighbours part, over the crank angle.

    Parameters
    ----------
    angles
        Turns from the start, shape (n,).
    scatter
        m, shape (n,).
    steps
        Edges of the stretches of a turn, shape (k + 1,).
    growth
        Label -> logarithm of the growth up to the end of each stretch, shape (k,).
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 4.2))
        upper, lower = figure.subplots(2, sharex=True)
        upper.semilogy(angles, 1e3 * np.maximum(scatter, ROUND_OFF), color=svg.FIRST)
        upper.set_ylabel("scatter of all turns (mm)")
        for (label, values), line in zip(growth.items(), _LINES, strict=False):
            lower.plot(steps, np.concatenate([[0.0], values]), label=label, lw=1.1,
                       color=line["color"], dashes=line.get("dashes", (None, None)))  # fmt: skip
        lower.set_ylabel("ln of the growth so far")
        lower.set_xlabel("crank turns from the start angle")
        lower.legend(loc="upper left", bbox_to_anchor=(0.0, 1.2), ncols=3)
        for axes in (upper, lower):
            axes.yaxis.set_label_coords(-0.11, 0.5)
        figure.subplots_adjust(left=0.14, right=0.97, bottom=0.11, top=0.97, hspace=0.3)
        svg.write_svg(figure, path)
