"""Drawings by matplotlib: a scene's static figure, pictures of tables, reliability, work and precision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from comparison.files import replacing
from comparison.formatting import decade, prefix, pretty_unit
from comparison.models import MODELS
from comparison.reliability.difference import Difference
from comparison.report import svg
from comparison.tables.arrays import BoolArray
from comparison.tables.channels import UNCERTAINTY, channels
from comparison.tables.table import Table, TableError
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

if TYPE_CHECKING:
    from comparison.accuracy.work_precision import WorkPrecision

_LEFT, _RIGHT = 0.175, 0.965  # of the width of a scene's figure
_CROSSES = 80  # at most, to remain distinguishable
_LONGEST = 24  # letters of a name in a legend
_COLUMNS = 1200  # of a picture's curve: enough to be enlarged three times


def relative_to_guide(scene: SceneComparison, channel: ChannelComparison) -> float:
    """Return what is subtracted to draw a channel: from x the guide's centre line (m), else 0.

    A clearance of 0.2 mm is invisible on an axis of half a metre.
    """
    if channel.channel != "slider_x" or scene.scene is None:
        return 0.0
    return float(scene.scene["mechanism"]["guide_x"])


def channel_figure(scene: SceneComparison, channel: ChannelComparison, key: str) -> Markup:
    """Draw a channel of two samples or more: both models, and below them their difference."""
    with svg.style():
        figure = Figure()
        figure.set_figheight(3.3)
        width = _RIGHT - _LEFT
        upper = figure.add_axes((_LEFT, 0.56, width, 0.345))
        lower = figure.add_axes((_LEFT, 0.13, width, 0.335), sharex=upper)
        upper.tick_params(labelbottom=False)
        _models(upper, channel, relative_to_guide(scene, channel))
        _difference(lower, channel)
        shades = svg.spans(~channel.predictable, channel.time)
        for axes in (upper, lower):
            for n, (low, high) in enumerate(shades):
                label = "" if n else "not predictable"
                axes.axvspan(low, high, color=svg.SHADE, lw=0, zorder=0, label=label)
        lower.set_xlim(channel.time[0], channel.time[-1])
        lower.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
        lower.set_xlabel("time (s)", labelpad=2)
        names = [name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…" for name in scene.labels]
        for axes, bottom, columns, own in ((upper, 0.915, 2, names), (lower, 0.475, 4, [])):
            handles, labels = axes.get_legend_handles_labels()
            shown = own or labels
            legend = figure.legend(
                handles[: len(shown)],
                labels[: len(shown)],
                loc="lower left",
                ncols=columns,
                bbox_to_anchor=(_LEFT, bottom),
            )
            svg.name_curves(legend, shown)
        return Markup(svg.inline_svg(figure, key))  # matplotlib escapes the text in its drawings


def _models(axes: Axes, channel: ChannelComparison, zero: float) -> None:
    values = channel.a - zero, channel.b - zero
    factor, unit = prefix(max(float(np.abs(curve).max()) for curve in values), channel.unit)
    for n, (curve, line) in enumerate(zip(values, svg.MODEL_LINES, strict=True)):
        kept = svg.envelope(curve)
        axes.plot(channel.time[kept], curve[kept] / factor, label=f"model {n}", **line)
    axes.margins(y=0.06)
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    _name_axis(axes, "x − guide" if zero else channel.label.partition(",")[0].removeprefix("slider "), unit)


def _difference(axes: Axes, channel: ChannelComparison) -> None:
    """Plot |difference|, the largest of each column, its threshold, and crosses where it is beyond."""
    time, size, threshold = channel.time, channel.size, channel.threshold
    name = "|difference| within time tolerance" if channel.time_tolerance else "|difference|"
    edge = svg.envelope(size if threshold is None else threshold)
    kept = svg.upper_envelope(size)
    shown = size[kept] if threshold is None else np.concatenate([size[kept], threshold[edge]])
    # Two decades at least, and no more than the sixteen of double precision.
    positive = shown[shown > 0.0]
    high = float(positive.max(initial=0.0)) or 1.0
    low = max(float(positive.min()) if positive.size else 0.1, high * 1e-16)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(min(low, high / 100) / 2.5, high * 4)
    axes.plot(time[kept], size[kept], color=svg.DIFFERENCE, label=name)
    if threshold is not None:
        line: dict[str, Any] = {"color": svg.THRESHOLD, "lw": 1.2, "dashes": (3.5, 1.2, 1, 1.2)}
        axes.plot(time[edge], threshold[edge], label=threshold_name(channel), **line)
    if (beyond := channel.beyond).any():
        marks = svg.upper_envelope(np.where(beyond, size, 0.0), _CROSSES)
        marks = marks[beyond[marks]]
        axes.plot(time[marks], size[marks], "x", color=svg.OUTSIDE, ms=4, label="beyond")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    # Powers as plain text: laid out as mathematics they took half of the time of a drawing.
    axes.yaxis.set_major_formatter(lambda value, _: decade(value) if value > 0 else "")
    _name_axis(axes, "|difference|", pretty_unit(channel.unit))


def _name_axis(axes: Axes, name: str, unit: str) -> None:
    axes.yaxis.set_label_coords(-0.135, 0.5)
    axes.set_ylabel(f"{name}\n({unit})" if unit else name, parse_math=False)


class Picture(Figure):
    """A figure that notebooks show."""

    def _repr_svg_(self) -> str:
        text = StringIO()
        self.savefig(text, format="svg")
        return text.getvalue()


def picture(
    tables: Mapping[str, Table],
    names: Sequence[str] = ("slider_x",),
    *,
    start: float | None = None,
    end: float | None = None,
    colours: Mapping[str, str] | None = None,
) -> Picture:
    """Draw channels of one table or two (by label) from start to end (s), a panel each, errors shaded.

    The roles of `comparison.report.svg` have these colours, by default those of a light page. `TableError` if
    a table lacks a channel, or has no two samples between start and end.
    """
    shown = svg.light_colours() if colours is None else colours
    parts = {label: _between(table, label, start, end) for label, table in tables.items()}
    with svg.style(shown):
        figure = Picture(layout="constrained")
        figure.set_figheight(max(2.2, 1.35 * len(names) + 0.8))
        axes = list(figure.subplots(len(names), 1, sharex=True, squeeze=False).flat)
        for panel, name in zip(axes, names, strict=True):
            _draw(panel, name, tables, parts, shown)
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels(axes)
        if len(tables) > 1:
            svg.legend_above(axes[0])
            svg.name_curves(figure.legends[0], list(tables))
    return figure


def _between(table: Table, label: str, start: float | None, end: float | None) -> BoolArray:
    time = table.time
    low, high = -np.inf if start is None else start, np.inf if end is None else end
    kept: BoolArray = (time >= low) & (time <= high)
    if kept.sum() < 2:
        its = f"{time.min(initial=np.inf):g} s to {time.max(initial=-np.inf):g} s"
        raise TableError(f"{label}: fewer than two samples are shown; its time is {its}")
    return kept


def _draw(
    panel: Axes,
    name: str,
    tables: Mapping[str, Table],
    parts: Mapping[str, BoolArray],
    colours: Mapping[str, str],
) -> None:
    for label, table in tables.items():
        if name not in table.frame:
            raise TableError(f"{label}: channel {name!r} is missing; it has {', '.join(table.channels)}")
    known = channels().get(name.removesuffix(UNCERTAINTY))
    title = known.label if known else name
    if known and known.name != name:
        title = f"estimated error of {title}"
    zero = _guide(next(iter(tables.values()))) if name == "slider_x" else None
    if zero is not None:
        title = "slider x − guide"
    curves = {label: table.values(name)[parts[label]] - (zero or 0.0) for label, table in tables.items()}
    largest = max(float(np.nanmax(np.abs(values))) for values in curves.values())
    factor, unit = prefix(largest, known.unit if known else "")
    for number, ((label, values), line) in enumerate(zip(curves.items(), svg.MODEL_LINES, strict=False)):
        table, part, time = tables[label], parts[label], tables[label].time[parts[label]]
        own = line | {"color": colours.get(str(line["color"]), line["color"])}
        kept = svg.envelope(values, _COLUMNS)
        panel.plot(time[kept], values[kept] / factor, label=f"table {number}", **own)
        if name + UNCERTAINTY in table.frame:
            u = table.values(name + UNCERTAINTY)[part]
            low, high = ((values + sign * u) / factor for sign in (-1.0, 1.0))
            kept = np.union1d(svg.envelope(low, _COLUMNS), svg.envelope(high, _COLUMNS))
            panel.fill_between(time[kept], low[kept], high[kept], color=own["color"], alpha=0.25, lw=0)
    title = title.replace(", ", ",\n")
    panel.set_ylabel(f"{title}\n({unit})" if unit else title, parse_math=False)
    panel.margins(y=0.06)


def _guide(table: Table) -> float | None:
    """Return the x of the guide's centre line (m) as recorded; what a file records may be anything."""
    scene = table.provenance.get("scene")
    try:
        return float(scene["mechanism"]["guide_x"]) if scene else None
    except (KeyError, TypeError, ValueError):
        return None


def write_picture(figure: Figure, path: Path) -> None:
    """Write a picture in the format of its name; one that is to be an SVG has the colours of roles."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() == ".svg":
        with svg.style():
            svg.write_svg(figure, path)
        return
    with replacing(path) as part, mpl.rc_context({"savefig.facecolor": "white"}):
        figure.savefig(part, format=path.suffix[1:].lower(), dpi=200, facecolor="white")


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
    """Draw processor time over error, a line a formulation, and the Pareto front behind; runs with both."""

    def points(rows: Sequence[Any]) -> list[tuple[float, float]]:
        return [(measured.error(row), row.seconds) for row in rows if measured.error(row) > 0.0]

    with svg.panels(path) as (axes,):
        axes.set(
            xscale="log", yscale="log", xlabel="largest error of slider x (m)", ylabel="processor time (s)"
        )
        if front := points(measured.front):
            axes.plot(*zip(*front, strict=True), color=svg.SHADE, lw=5, label="Pareto front")
        for formulation, mark in {"minimal": "o", "multiplier": "s", "tree": "^", "full": "D"}.items():
            rows = [row for row in measured.rows if row.candidate.formulation == formulation]
            if found := sorted(points(rows), key=lambda point: point[1]):
                model = rows[0].candidate.model
                colour = svg.FIRST if model == MODELS[0] else svg.SECOND
                style: dict[str, Any] = {"color": colour, "marker": mark, "mfc": "none", "ms": 4}
                axes.plot(*zip(*found, strict=True), label=f"{model}, {formulation}", **style)
        axes.margins(0.04)  # the outermost marks whole
        axes.xaxis.set_major_locator(LogLocator(numticks=6))
        axes.invert_xaxis()
        svg.legend_above(axes, columns=2)
    return path
