"""The figures of the study random-inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.formatting import prefix
from comparison.report import svg
from comparison.studies.random_inputs.draws import RESPONSES
from comparison.studies.random_inputs.second_moment import Plane, counted_probability, failure_probability
from comparison.tables.arrays import Array

_STEPS = 120


def draw_probabilities(responses: pd.DataFrame, planes: Mapping[str, Plane], path: Path) -> None:
    """Draw the probability of exceeding a limit over the limit, a panel a response: counted, first order."""
    with svg.panels(path, 2, 2, height=4.8) as four:
        for axes, (name, unit) in zip(four, RESPONSES.items(), strict=True):
            values, plane = responses[name].to_numpy(), planes[name]
            factor, scaled = prefix(float(np.median(values)), unit)
            first, last = np.quantile(values, (0.002, 0.9995))
            reach = (last - first) or 1.0  # a response that nothing moves
            limits = np.linspace(first, last + 0.1 * reach, _STEPS)
            counted = np.array([counted_probability(values > limit) for limit in limits])
            value, low, up = counted.T
            axes.fill_between(limits / factor, np.maximum(low, 1e-5), up, color=svg.SHADE, lw=0)
            curves = {"Monte Carlo": value} | {
                label: np.array([failure_probability(plane, limit, with_rest=rest)[0] for limit in limits])
                for label, rest in (("first order", False), ("first order with residual", True))
            }
            for (label, curve), line in zip(curves.items(), svg.SERIES_LINES, strict=False):
                axes.semilogy(limits / factor, np.where(curve > 0, curve, np.nan), label=label, **line)
            axes.set_ylim(1e-4, 1.2)
            axes.set_title(name.replace(", ", ",\n"), fontsize=9)
            axes.set_xlabel(f"limit ({scaled})")
            axes.locator_params(axis="x", nbins=5)
        for axes in four[::2]:
            axes.set_ylabel("probability of exceeding it")
        svg.legend_above(four[0])


def draw_gradients(slopes: Mapping[str, tuple[str, pd.DataFrame]], path: Path) -> None:
    """Draw gradients with their standard errors over the scale at which they are measured.

    By response and input: unit, and ``gradient`` and ``error`` by the scatter of the runs over that of the
    inputs.
    """
    with svg.panels(path, len(slopes), height=2.4 * len(slopes), sharex=True) as every:
        for axes, (name, (unit, found)) in zip(every, slopes.items(), strict=True):
            factor, scaled = prefix(float(found["gradient"].abs().max()), unit)
            axes.errorbar(
                found.index, found["gradient"] / factor, 2 * found["error"] / factor,
                color=svg.FIRST, marker="o", ms=4, capsize=2, lw=0.8,
            )  # fmt: skip
            axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
            axes.set_xscale("log")
            axes.margins(x=0.06)
            axes.set_ylabel(f"slope per\nstandard deviation ({scaled})")
            axes.set_title(name, fontsize=9)
        every[-1].set_xlabel("scatter of the runs over that of the inputs")


def draw_precision(labels: Sequence[str], changes: Mapping[str, Array], path: Path) -> None:
    """Draw how far the failure probability changes when the solver is coarser.

    With a label for each tolerance but the finest, and by response the changes with their intervals, shape
    (n, 3).
    """
    x = np.arange(len(labels))
    with svg.panels(path, height=3.4) as (axes,):
        for n, ((label, change), line) in enumerate(zip(changes.items(), svg.SERIES_LINES, strict=False)):
            axes.errorbar(
                x + 0.12 * (n - 1), 100 * change[:, 0], 100 * np.abs(change[:, 1:].T - change[:, 0]),
                color=line["color"], marker="os^"[n], ms=4, ls="none", lw=0.9, capsize=2, label=label,
            )  # fmt: skip
        axes.axhline(0.0, color=svg.LIMIT, lw=0.8)
        axes.set_xticks(x, labels)
        axes.set_xlim(-0.5, len(x) - 0.5)
        axes.set(xlabel="tolerance (rad) and processor time of a run", ylabel="change of the probability (%)")
        svg.legend_above(axes)
