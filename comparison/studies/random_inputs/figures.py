"""The drawings of the study random-inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from comparison.formatting import prefix
from comparison.report import svg
from comparison.studies.random_inputs.second_moment import Plane, counted_probability, failure_probability
from comparison.tables.arrays import Array

_LINES: tuple[dict[str, Any], ...] = (
    {"color": svg.FIRST},
    {"color": svg.SECOND, "dashes": (4, 2)},
    {"color": svg.BEYOND, "dashes": (1, 1)},
)
_STEPS = 120


def draw_probabilities(responses: Mapping[str, tuple[str, Array, Plane]], path: Path) -> None:
    """Draw the probability of exceeding a limit over the limit: counted, and by first order.

    Parameters
    ----------
    responses
        Name -> unit, values of the many runs, shape (n,), and plane.
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 5.0))
        for axes, (name, (unit, values, plane)) in zip(
            figure.subplots(2, 2).flat, responses.items(), strict=True
        ):
            factor, scaled = prefix(float(np.median(values)), unit)
            low, high = np.quantile(values, (0.002, 0.9995))
            reach = (high - low) or 1.0  # a response that nothing moves
            limits = np.linspace(low, high + 0.1 * reach, _STEPS)
            counted = np.array([counted_probability(values > limit) for limit in limits])
            axes.fill_between(
                limits / factor, np.maximum(counted[:, 1], 1e-5), counted[:, 2], color=svg.SHADE, lw=0
            )
            curves = (
                ("Monte Carlo", counted[:, 0]),
                ("first order", _first_order(plane, limits, with_rest=False)),
                ("with the rest", _first_order(plane, limits, with_rest=True)),
            )
            for (label, curve), line in zip(curves, _LINES, strict=True):
                axes.semilogy(limits / factor, np.where(curve > 0, curve, np.nan), label=label, **line)
            axes.set_ylim(1e-4, 1.2)
            axes.set_xlim(limits[0] / factor, limits[-1] / factor)
            head, _, tail = name.partition(", ")
            axes.set_title(head if not tail else f"{head},\n{tail}", fontsize=9)
            axes.set_xlabel(f"limit ({scaled})")
            axes.locator_params(axis="x", nbins=5)
        for axes in figure.axes[::2]:
            axes.set_ylabel("probability beyond it")
        figure.axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.16), ncols=3)
        figure.subplots_adjust(left=0.12, right=0.97, bottom=0.09, top=0.89, hspace=0.62, wspace=0.26)
        svg.write_svg(figure, path)


def _first_order(plane: Plane, limits: Array, *, with_rest: bool) -> Array:
    return np.array([failure_probability(plane, float(limit), with_rest=with_rest)[0] for limit in limits])


def draw_gradients(
    factors: Sequence[float], slopes: Mapping[str, tuple[str, Array, Array]], path: Path
) -> None:
    """Draw gradients with their standard errors over the scale at which they are measured.

    Parameters
    ----------
    factors
        Scatter of the runs over that of the inputs.
    slopes
        Name of response and input -> unit, gradients and standard errors over the factors, shape (n,).
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 2.8 * len(slopes) - 0.8))
        every: Sequence[Axes] = figure.subplots(len(slopes), 1, sharex=True)
        for axes, (name, (unit, gradients, errors)) in zip(every, slopes.items(), strict=True):
            factor, scaled = prefix(float(np.abs(gradients).max()), unit)
            axes.errorbar(
                factors, gradients / factor, 2 * errors / factor,
                color=svg.FIRST, marker="o", ms=4, capsize=2, lw=0.8,
            )  # fmt: skip
            axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
            axes.set_xscale("log")
            axes.margins(x=0.06)
            axes.set_ylabel(f"slope per deviation ({scaled})")
            axes.yaxis.set_label_coords(-0.1, 0.5)
            axes.set_title(name, fontsize=9)
        every[-1].set_xlabel("scatter of the runs over that of the inputs")
        figure.subplots_adjust(left=0.16, right=0.97, bottom=0.12, top=0.93, hspace=0.3)
        svg.write_svg(figure, path)


def draw_precision(
    tolerances: Sequence[float],
    milliseconds: Sequence[float],
    changes: Mapping[str, Array],
    path: Path,
) -> None:
    """Draw how far the failure probability moves when the solver is coarser, over what a run costs.

    Parameters
    ----------
    tolerances
        Of the reference, the last is what the others are compared with.
    milliseconds
        Processor time of a run at each.
    changes
        Response -> change of the probability with its interval, shape (n, 3), for all but the last.
    path
        Where to.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 3.4))
        axes = figure.add_axes((0.14, 0.15, 0.83, 0.68))
        x = np.arange(len(tolerances) - 1)
        for n, ((label, change), line) in enumerate(zip(changes.items(), _LINES, strict=False)):
            bars = np.abs(change[:, 1:].T - change[:, 0])
            axes.errorbar(
                x + 0.12 * (n - 1), 100 * change[:, 0], 100 * bars, color=line["color"],
                marker="os^"[n], ms=4, ls="none", lw=0.9, capsize=2, label=label,
            )  # fmt: skip
        axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
        axes.set_xticks(
            x,
            [f"{t:.0e}\n{ms:.1f} ms" for t, ms in zip(tolerances[:-1], milliseconds[:-1], strict=True)],
        )
        axes.set_xlim(-0.5, len(x) - 0.5)
        axes.set_xlabel("tolerance (rad) and processor time of a run")
        axes.set_ylabel("change of the probability (%)")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=3)
        svg.write_svg(figure, path)
