"""Figures 7 to 13, 16 and 17 of the paper, both models side by side, with the printed values marked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from comparison.execution.run import MODELS
from comparison.formatting import pretty_unit
from comparison.reliability.errors import QUANTITIES
from comparison.report import svg
from comparison.report.decimate import envelope, upper_envelope
from comparison.scene import load_scene
from comparison.studies.paper.measures import reliabilities
from comparison.studies.paper.runs import CENTRAL, CHANNELS, PIN, Runs, second
from comparison.studies.shared.published import published
from comparison.tables.channels import channels

LINES: tuple[dict[str, Any], ...] = (
    {"color": svg.FIRST},
    {"color": svg.SECOND, "dashes": (3.5, 1.8)},
    {"color": svg.DIFFERENCE, "dashes": (1, 1)},
)
LEAST = 1e-16
"""m, m/s, m/s^2: what a logarithmic axis shows of zero."""
COLUMNS = 250
"""Of a panel half as wide as the page."""
UNITS = {"slider_y": (1e6, "µm"), "slider_vy": (1e3, "mm/s"), "slider_ay": (1.0, "m/s²")}
WORDS = {"slider_y": "displacement", "slider_vy": "velocity", "slider_ay": "acceleration"}
ERRORS = {
    "figure-9": (("F9-210", CENTRAL), ("F9-69", "69GPa")),
    "figure-10": (("F10-28", CENTRAL), ("F10-33", "poisson-0.33")),
    "figure-11": (("F11-01", "90rpm-0.1mm"), ("F11-05", "90rpm-0.5mm")),
    "figure-12": (("F12-150", CENTRAL), ("F12-300", "300rpm-0.2mm")),
}
"""Figure -> its two conditions, and how the ids of their printed peaks begin."""
RELIABILITY = {
    "figure-16": (("F16-01", "90rpm-0.1mm"), ("F16-05", "90rpm-0.5mm")),
    "figure-17": (("F17-150", CENTRAL), ("F17-300", "300rpm-0.2mm")),
}


def draw(runs: Runs, folder: Path) -> None:
    """Write the figures, inside `svg.style`."""
    _responses(runs, folder / "figure-7.svg")
    for name, conditions in ERRORS.items():
        _errors(runs, conditions, folder / f"{name}.svg")
    _two_codes(runs, folder / "figure-13.svg")
    for name, conditions in RELIABILITY.items():
        _reliability(runs, conditions, folder / f"{name}.svg")


def grid(rows: int, height: float, titles: Sequence[str] = MODELS) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with a column a model, and its axes by row and column."""
    total = 0.86 + rows * height
    figure = Figure(figsize=(5.56, total))
    each = (total - 0.86) / rows / total
    drawn = []
    for row in range(rows):
        bottom = 0.38 / total + (rows - 1 - row) * each
        drawn.append(
            [
                figure.add_axes((0.135 + 0.45 * column, bottom, 0.395, each - 0.17 / total))
                for column in range(len(titles))
            ]
        )
    for column, title in enumerate(titles):
        drawn[0][column].set_title(title, fontsize=9)
    for line in drawn:
        line[0].yaxis.set_label_coords(-0.24, 0.5)
    for line in drawn[:-1]:
        for axes in line:
            axes.tick_params(labelbottom=False)
    return figure, drawn


def share(axes: list[list[Axes]]) -> None:
    """Give each row one vertical axis, so that the models can be compared."""
    for first, *others in axes:
        for each in others:
            each.sharey(first)
            each.tick_params(labelleft=False, which="both")


def finish(figure: Figure, axes: list[list[Axes]], label: str, path: Path) -> None:
    """Name the horizontal axis, put the legend above, write."""
    for each in axes[-1]:
        each.set_xlabel(label)
    axes[0][0].legend(
        loc="upper left", bbox_to_anchor=(0.02, 1.0), bbox_transform=figure.transFigure, ncols=4
    )
    svg.write_svg(figure, path)


def _responses(runs: Runs, path: Path) -> None:
    """Draw the slider's motion itself: ideal, with clearance at the slider, and at the crank pin."""
    figure, axes = grid(3, 1.25)
    share(axes)
    for column, model in enumerate(MODELS):
        ideal = runs.ideal[CENTRAL, model]
        shown = second(ideal)
        time = ideal.time[shown]
        for row, channel in enumerate(CHANNELS):
            panel = axes[row][column]
            zero = ideal.values(channel)[0] if channel == "slider_y" else 0.0
            curves = (
                (runs.short[PIN, model][0], "clearance at A", LINES[1]),
                (runs.short[CENTRAL, model][0], "clearance at the slider", LINES[0]),
                (ideal, "ideal", LINES[2]),
            )
            for run, label, line in curves:
                values = run.values(channel)[shown] - zero
                kept = envelope(values, COLUMNS)
                panel.plot(time[kept], values[kept], label=label, **line)
            panel.set_xlim(time[0], time[-1])
            if not column:
                panel.set_ylabel(f"{WORDS[channel]} ({pretty_unit(channels()[channel].unit)})")
    lowest = published("S4.2-stroke")
    for panel in axes[0]:
        panel.plot(lowest.time, lowest.value, "o", color=svg.BEYOND, ms=4, label="printed")
    finish(figure, axes, "time (s)", path)


def _errors(runs: Runs, conditions: Sequence[tuple[str, str]], path: Path) -> None:
    """Draw the errors of two conditions over the second turn, with the printed peaks."""
    figure, axes = grid(3, 1.25)
    share(axes)
    # Different speeds: the turn is the common scale; the paper has panels of their own.
    for column, model in enumerate(MODELS):
        for (prefix, scene), line in zip(conditions, LINES, strict=False):
            period = load_scene(scene).period
            run = runs.short[scene, model][0]
            shown = second(run)
            turns = run.time[shown] / period
            for row, (channel, letter) in enumerate(zip(CHANNELS, "dva", strict=True)):
                panel = axes[row][column]
                scale, unit = UNITS[channel]
                values = scale * runs.errors(scene, model, channel)[shown]
                kept = envelope(values, COLUMNS)
                panel.plot(turns[kept], values[kept], label=scene, **line)
                printed = published(f"{prefix}-{letter}")
                mark = {"color": line["color"], "ms": 4, "mfc": "none"}
                panel.plot(printed.time / period, scale * printed.value, "o", **mark)
                panel.set_xlim(1, 2)
                if not column:
                    panel.set_ylabel(f"{WORDS[channel]} ({unit})")
    axes[0][0].plot([], [], "o", color=svg.INK, ms=4, mfc="none", label="printed")
    finish(figure, axes, "crank turns", path)


def _two_codes(runs: Runs, path: Path) -> None:
    """Draw both models on top of each other, where the paper has MATLAB and ADAMS, and their difference."""
    figure, axes = grid(3, 1.25, ("errors", "size of the models' difference"))
    for panels, channel in zip(axes, CHANNELS, strict=True):
        scale, unit = UNITS[channel]
        shown = second(runs.short[CENTRAL, MODELS[0]][0])
        time = runs.short[CENTRAL, MODELS[0]][0].time[shown]
        both = [scale * runs.errors(CENTRAL, model, channel)[shown] for model in MODELS]
        for model, values, line in zip(MODELS, both, LINES, strict=False):
            kept = envelope(values, COLUMNS)
            panels[0].plot(time[kept], values[kept], label=model, **line)
        off = np.maximum(np.abs(both[1] - both[0]), LEAST * scale)
        kept = upper_envelope(off, COLUMNS)
        panels[1].semilogy(time[kept], off[kept], color=svg.DIFFERENCE)
        panels[0].set_ylabel(f"{WORDS[channel]} ({unit})")
        for panel, left, width in zip(panels, (0.135, 0.61), (0.35, 0.36), strict=True):
            box = panel.get_position()
            panel.set_position((left, box.y0, width, box.height))
        for panel in panels:
            panel.set_xlim(time[0], time[-1])
    finish(figure, axes, "time (s)", path)


def _reliability(runs: Runs, conditions: Sequence[tuple[str, str]], path: Path) -> None:
    """Draw what is missing to 1 in every part of the turn, with the printed minima."""
    figure, axes = grid(3, 1.25, [f"{model}: 1000 (1 − R)" for model in MODELS])
    share(axes)
    for column, model in enumerate(MODELS):
        for (prefix, scene), line in zip(conditions, LINES, strict=False):
            for row, (quantity, letter) in enumerate(zip(QUANTITIES, "dva", strict=True)):
                panel = axes[row][column]
                assessed = reliabilities(runs, scene, model)[quantity]
                panel.semilogy(
                    assessed.angle, 1e3 * (1 - assessed.reliability), marker=".", ms=3, label=scene, **line
                )
                printed = published(f"{prefix}-{letter}")
                mark = {"color": line["color"], "ms": 4, "mfc": "none"}
                panel.plot(printed.angle, 1e3 * (1 - printed.value), "o", **mark)
                if not column:
                    panel.set_ylabel(quantity)
                panel.set_xlim(18, 378)
                panel.set_xticks(np.arange(36, 361, 72))
                panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                panel.yaxis.set_major_formatter(FormatStrFormatter("%g"))
                panel.yaxis.set_minor_locator(NullLocator())
    axes[0][0].plot([], [], "o", color=svg.INK, ms=4, mfc="none", label="printed")
    finish(figure, axes, "crank angle from the start (deg)", path)
