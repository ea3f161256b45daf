"""Figures 7, 9 to 13, 16 and 17 of the paper: both models in each panel, printed values marked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from comparison.formatting import pretty_unit
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES
from comparison.report import svg
from comparison.report.svg import envelope, upper_envelope
from comparison.studies.paper.measures import reliabilities, scene_of
from comparison.studies.paper.runs import CENTRAL, CHANNELS, PIN, Runs, second
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

LINES: dict[str, dict[str, Any]] = dict(zip(MODELS, svg.MODEL_LINES, strict=True))
PRINTED: dict[str, Any] = {"color": svg.OUTSIDE, "marker": "o", "ms": 4, "mfc": "none", "ls": "", "zorder": 3}
IDEAL: dict[str, Any] = {"color": svg.DIFFERENCE, "lw": 0.5}
LEAST = 1e-16
"""m, m/s, m/s^2: what a logarithmic axis shows of zero."""
COLUMNS = 250
"""Of a panel half as wide as the page."""
UNITS = {"slider_y": (1e6, "µm"), "slider_vy": (1e3, "mm/s"), "slider_ay": (1.0, "m/s²")}
WORDS = {channel: word for word, channel in QUANTITIES.items()}
ERRORS = {
    "figure-9": ("F9-210", "F9-69"),
    "figure-10": ("F10-28", "F10-33"),
    "figure-11": ("F11-01", "F11-05"),
    "figure-12": ("F12-150", "F12-300"),
}
"""Figure -> how the ids of the printed peaks of its two conditions begin."""
RELIABILITY = {"figure-16": ("F16-01", "F16-05"), "figure-17": ("F17-150", "F17-300")}


def draw(runs: Runs, folder: Path) -> None:
    """Write the figures."""
    _responses(runs, folder / "figure-7.svg")
    for name, conditions in ERRORS.items():
        _errors(runs, conditions, folder / f"{name}.svg")
    _two_codes(runs, folder / "figure-13.svg")
    for name, conditions in RELIABILITY.items():
        _reliability(runs, conditions, folder / f"{name}.svg")


@contextmanager
def grid(
    path: Path, rows: int, titles: Sequence[str], height: float, **options: Any
) -> Iterator[list[list[Axes]]]:
    """Draw a figure with a column a title as `svg.panels` does; yield its panels by row and column.

    The legend is that of the first panel.
    """
    with svg.panels(path, rows, len(titles), height=height, **options) as panels:
        for panel, title in zip(panels, titles, strict=False):
            panel.set_title(title, fontsize=9)
        yield [panels[k : k + len(titles)] for k in range(0, len(panels), len(titles))]
        svg.legend_above(panels[0])


def _both(panel: Axes, x: Array, values: Mapping[str, Array]) -> None:
    """Draw what both models give."""
    for model, y in values.items():
        kept = envelope(y, COLUMNS)
        panel.plot(x[kept], y[kept], label=model, **LINES[model])


def _responses(runs: Runs, path: Path) -> None:
    """Draw the slider's motion with clearance at the slider, at the crank pin, and the ideal one."""
    titles = ("clearance at the slider", "clearance at the crank pin A")
    with grid(path, 3, titles, 4.9, sharex=True, sharey="row") as axes:
        ideal = runs.ideal[CENTRAL, MODELS[0]]
        shown = second(ideal)
        time = ideal.time[shown]
        for row, channel in zip(axes, CHANNELS, strict=True):
            still = ideal.values(channel)
            zero = still[0] if channel == "slider_y" else 0.0
            for panel, scene in zip(row, (CENTRAL, PIN), strict=True):
                moving = {m: runs.short[scene, m][0].values(channel)[shown] - zero for m in MODELS}
                _both(panel, time, moving)
                panel.plot(time, still[shown] - zero, label="ideal", **IDEAL)
            row[0].set_ylabel(f"{WORDS[channel]} ({pretty_unit(channels()[channel].unit)})")
        lowest = published("S4.2-stroke")
        for panel in axes[0]:
            panel.plot(lowest.time, lowest.value, label="printed", **PRINTED)
        for panel in axes[-1]:
            panel.set(xlabel="time (s)", xlim=(time[0], time[-1]))


def _errors(runs: Runs, conditions: Sequence[str], path: Path) -> None:
    """Draw the errors of two conditions over the second cycle, with the printed peaks."""
    scenes = [scene_of(f"{prefix}-d") for prefix in conditions]
    with grid(path, 3, scenes, 4.9, sharex=True, sharey="row") as axes:
        for row, channel, letter in zip(axes, CHANNELS, "dva", strict=True):
            scale, unit = UNITS[channel]
            for panel, prefix, scene in zip(row, conditions, scenes, strict=True):
                run = runs.short[scene, MODELS[0]][0]
                shown, period = second(run), run.time[-1] / 2
                found = {m: scale * runs.errors(scene, m, channel)[shown] for m in MODELS}
                _both(panel, run.time[shown] / period, found)
                printed = published(f"{prefix}-{letter}")
                panel.plot(printed.time / period, scale * printed.value, label="printed", **PRINTED)
            row[0].set_ylabel(f"error of the\n{WORDS[channel]} ({unit})")
        for panel in axes[-1]:
            panel.set(xlabel="crank cycles (-)", xlim=(1, 2), xticks=(1.2, 1.4, 1.6, 1.8))


def _two_codes(runs: Runs, path: Path) -> None:
    """Draw both models, where the paper has MATLAB and ADAMS, and their difference."""
    with grid(path, 3, ("both models", "their difference"), 4.9, sharex=True) as axes:
        run = runs.short[CENTRAL, MODELS[0]][0]
        shown = second(run)
        time = run.time[shown]
        for (left, right), channel in zip(axes, CHANNELS, strict=True):
            scale, unit = UNITS[channel]
            found = {m: scale * runs.errors(CENTRAL, m, channel)[shown] for m in MODELS}
            _both(left, time, found)
            apart = np.maximum(np.abs(found[MODELS[1]] - found[MODELS[0]]), LEAST * scale)
            kept = upper_envelope(apart, COLUMNS)
            right.semilogy(time[kept], apart[kept], color=svg.DIFFERENCE)
            left.set_ylabel(f"error of the\n{WORDS[channel]} ({unit})")
            right.set_ylabel(f"|difference| ({unit})")
        for panel in axes[-1]:
            panel.set(xlabel="time (s)", xlim=(time[0], time[-1]))


def _reliability(runs: Runs, conditions: Sequence[str], path: Path) -> None:
    """Draw what is missing to 1 in every part of the cycle, with the printed minima."""
    scenes = [scene_of(f"{prefix}-d") for prefix in conditions]
    with grid(path, 3, scenes, 4.9, sharex=True, sharey="row") as axes:
        for column, (prefix, scene) in enumerate(zip(conditions, scenes, strict=True)):
            assessed = {model: reliabilities(runs, scene, model) for model in MODELS}
            for row, quantity, letter in zip(axes, QUANTITIES, "dva", strict=True):
                for model, by_quantity in assessed.items():
                    of = by_quantity[quantity]
                    lacking = 1e3 * (1 - of.reliability)
                    row[column].semilogy(of.angle, lacking, ".-", label=model, **LINES[model])
                printed = published(f"{prefix}-{letter}")
                row[column].plot(printed.angle, 1e3 * (1 - printed.value), label="printed", **PRINTED)
        for row, quantity in zip(axes, QUANTITIES, strict=True):
            row[0].set_ylabel(f"1000 (1 − R)\n{quantity}")
            row[0].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            row[0].yaxis.set_major_formatter(FormatStrFormatter("%g"))
            row[0].yaxis.set_minor_locator(NullLocator())
        for panel in axes[-1]:
            panel.set(xlabel="crank angle from the start (deg)", xlim=(18, 378), xticks=range(36, 361, 72))
