"""Drawings by matplotlib: the static figure of a scene, reliability by crank angle, work and precision."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from comparison.formatting import decade, prefix, pretty_unit
from comparison.models import MODELS
from comparison.reliability.difference import Difference
from comparison.report import svg
from comparison.tables.arrays import Array
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

if TYPE_CHECKING:
    from comparison.accuracy.work_precision import WorkPrecision

_HEIGHT = 3.3  # inches, of a scene's figure
_LEFT, _RIGHT = 0.175, 0.965  # of its width
_DECADES = 16  # of a logarithmic axis at most: double precision has no more
_CROSSES = 80  # at most, to remain distinguishable
_LONGEST = 24  # letters of a name in a legend


def relative_to_guide(scene: SceneComparison, channel: ChannelComparison) -> float:
    """Return what is subtracted from a channel to be drawn: from x the guide's centre line (m), else 0.

    A clearance of 0.2 mm is invisible on an axis of half a metre.
    """
    guided = channel.channel == "slider_x" and scene.scene is not None
    return float(scene.scene["mechanism"]["guide_x"]) if guided and scene.scene is not None else 0.0


def channel_figure(scene: SceneComparison, channel: ChannelComparison, key: str) -> Markup:
    """Draw a channel, both models above, the size of their difference and its threshold below.

    Parameters
    ----------
    scene, channel
        The scene at one tier, and its channel of n >= 2 samples.
    key
        Unique on the page, see `svg.inline_svg`.
    """
    with svg.style():
        figure = Figure()
        figure.set_figheight(_HEIGHT)
        width = _RIGHT - _LEFT
        upper = figure.add_axes((_LEFT, 0.56, width, 0.345))
        lower = figure.add_axes((_LEFT, 0.13, width, 0.335), sharex=upper)
        upper.tick_params(labelbottom=False)
        _models(upper, scene, channel)
        _difference(lower, channel)
        shades = svg.spans(~channel.predictable, channel.time)
        for axes in (upper, lower):
            for n, (low, high) in enumerate(shades):
                label = "" if n else "not predictable"
                axes.axvspan(low, high, color=svg.SHADE, lw=0, zorder=0, label=label)
        lower.set_xlim(channel.time[0], channel.time[-1])
        lower.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
        lower.set_xlabel("time (s)", labelpad=2)
        _legend(figure, upper, 0.915, 2, list(scene.labels))
        _legend(figure, lower, 0.475, 4, [])
        return Markup(svg.inline_svg(figure, key))  # matplotlib escapes the text in its drawings


def _models(axes: Axes, scene: SceneComparison, channel: ChannelComparison) -> None:
    """Plot both models, in a unit that needs few digits."""
    zero = relative_to_guide(scene, channel)
    values = channel.a - zero, channel.b - zero
    factor, unit = prefix(max(float(np.abs(curve).max()) for curve in values), channel.unit)
    for n, (curve, line) in enumerate(zip(values, svg.MODEL_LINES, strict=True)):
        kept = svg.envelope(curve)
        axes.plot(channel.time[kept], curve[kept] / factor, label=f"model {n}", **line)
    axes.margins(y=0.06)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    name = "x − guide" if zero else channel.label.partition(",")[0].removeprefix("slider ")
    _name_axis(axes, name, unit)


def _difference(axes: Axes, channel: ChannelComparison) -> None:
    """Plot |difference|, the largest of each column, its threshold, and crosses where it is beyond."""
    time, size, threshold = channel.time, channel.size, channel.threshold
    name = "|difference| within time tolerance" if channel.time_tolerance else "|difference|"
    edge = svg.envelope(size if threshold is None else threshold)
    kept = svg.upper_envelope(size)
    shown = size[kept] if threshold is None else np.concatenate([size[kept], threshold[edge]])
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(*_decades(shown))
    axes.plot(time[kept], size[kept], color=svg.DIFFERENCE, label=name)
    if threshold is not None:
        axes.plot(
            time[edge],
            threshold[edge],
            color=svg.THRESHOLD,
            lw=1.2,
            dashes=(3.5, 1.2, 1, 1.2),
            label=threshold_name(channel),
        )
    if (beyond := channel.beyond).any():
        marks = svg.upper_envelope(np.where(beyond, size, 0.0), _CROSSES)
        marks = marks[beyond[marks]]
        axes.plot(time[marks], size[marks], "x", color=svg.OUTSIDE, ms=4, label="beyond")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    # Powers as plain text: laid out as mathematics they took half of the time of a drawing.
    axes.yaxis.set_major_formatter(lambda value, _: decade(value) if value > 0 else "")
    _name_axis(axes, "|difference|", pretty_unit(channel.unit))


def _decades(values: Array) -> tuple[float, float]:
    """Return limits of a logarithmic axis that hold the positive values, two decades at least."""
    positive = values[values > 0.0]
    high = float(positive.max()) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, high * 10.0**-_DECADES)
    return min(low, high / 100) / 2.5, high * 4


def _name_axis(axes: Axes, name: str, unit: str) -> None:
    axes.yaxis.set_label_coords(-0.135, 0.5)
    axes.set_ylabel(f"{name}\n({unit})" if unit else name, parse_math=False)


def _legend(figure: Figure, axes: Axes, bottom: float, columns: int, names: list[str]) -> None:
    """Place a legend above axes; names stand for the first labels, as they are."""
    handles, labels = axes.get_legend_handles_labels()
    if names:
        handles, labels = handles[: len(names)], labels[: len(names)]
    legend = figure.legend(handles, labels, loc="lower left", ncols=columns, bbox_to_anchor=(_LEFT, bottom))
    shortened = [name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…" for name in names]
    svg.name_curves(legend, shortened or labels)


def against_angle(quantities: dict[str, Difference], labels: tuple[str, str]) -> Figure:
    """Return a figure of each quantity's reliability in both models, inside `svg.style`."""
    figure = Figure(figsize=(5.56, 4.6))
    panels = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    figure.subplots_adjust(0.16, 0.095, 0.965, 0.93, hspace=0.22)
    for axes, (name, difference) in zip(panels, quantities.items(), strict=True):
        cap = difference.a.cap
        axes.axhline(cap, color=svg.LIMIT, lw=0.8, dashes=(1, 2), label="no error")
        for model, mark, line in zip((difference.a, difference.b), "ox", svg.MODEL_LINES, strict=True):
            axes.plot(model.angle, model.reliability, f"{mark}-", ms=5, clip_on=False, **line)
        values = np.concatenate([difference.a.reliability, difference.b.reliability, [cap]])
        margin = 0.08 * float(np.ptp(values)) or 1e-6
        axes.set_ylim(values.min() - margin, values.max() + margin)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.set_ylabel(f"R, {name}")
    panels[-1].set_xlim(0.0, 360.0)
    panels[-1].set_xticks(np.arange(0, 361, 72))
    panels[-1].set_xlabel("crank angle from the start (deg)", labelpad=2)
    figure.align_ylabels(panels)
    cap_line, first, second = panels[0].lines
    legend = panels[0].legend(
        handles=[first, second, cap_line],
        labels=["first", "second", "no error"],
        loc="lower left",
        ncols=3,
        bbox_to_anchor=(0.16, 0.945),
        bbox_transform=figure.transFigure,
    )
    svg.name_curves(legend, [*labels, "no error"])
    return figure


def draw_work_precision(measured: WorkPrecision, path: Path) -> Path:
    """Draw processor time over error, both logarithmic: a line a formulation, and the Pareto front behind.

    Runs without a result, or without an error, are not drawn.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with svg.panels(path) as (axes,):
        axes.set(
            xscale="log", yscale="log", xlabel="largest error of slider x (m)", ylabel="processor time (s)"
        )
        front = [(measured.error(row), row.seconds) for row in measured.front if measured.error(row) > 0.0]
        if front:
            axes.plot(*zip(*front, strict=True), color=svg.SHADE, lw=5, label="Pareto front")
        marks = {"minimal": "o", "multiplier": "s", "tree": "^", "full": "D"}
        for formulation, mark in marks.items():
            rows = [row for row in measured.rows if row.candidate.formulation == formulation]
            points = [(measured.error(row), row.seconds) for row in rows if measured.error(row) > 0.0]
            if points:
                points.sort(key=lambda point: point[1])
                model = rows[0].candidate.model
                colour = svg.FIRST if model == MODELS[0] else svg.SECOND
                label = f"{model}, {formulation}"
                axes.plot(
                    *zip(*points, strict=True), color=colour, marker=mark, mfc="none", ms=4, label=label
                )
        axes.margins(0.04)  # the outermost marks whole
        axes.xaxis.set_major_locator(LogLocator(numticks=6))
        axes.invert_xaxis()
        svg.legend_above(axes, columns=2)
    return path
