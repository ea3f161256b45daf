"""Drawings by matplotlib: a scene's static figure, pictures of tables, reliability, work and precision."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from comparison.files import replacing
from comparison.formatting import decade, prefix, pretty_unit
from comparison.models import MODELS
from comparison.reliability.assessment import Difference
from comparison.report import svg
from comparison.report.plots import Line, common_extremes, guide_of, least_range, scene_lines, table_line
from comparison.tables.channels import UNCERTAINTY
from comparison.tables.table import Table, TableError
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

if TYPE_CHECKING:
    from comparison.accuracy.work_precision import WorkPrecision

_CROSSES = 80  # most crosses that a reader can distinguish
_LONGEST = 24  # most letters of a name in a legend
_COLUMNS = 1200  # columns of a picture's curve: enough to be enlarged three times


def channel_figure(scene: SceneComparison, channel: ChannelComparison, key: str) -> Markup:
    """Draw a channel with at least two samples: both models, and below them their difference."""
    with svg.style():
        figure = Figure(layout="constrained")
        figure.set_figheight(3.3)
        upper, lower = figure.subplots(2, 1, sharex=True)
        zero = guide_of(channel.channel, scene.scene)
        title = "x − guide" if zero else channel.label.partition(",")[0].removeprefix("slider ")
        curves = [each.less(zero) for each in scene_lines(scene, channel)]
        min_range = least_range(channel.definition, scene.scene, common_extremes(curves))
        _curves(upper, curves, title, channel.unit, min_range)
        upper.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        _difference(lower, channel)
        shades = svg.spans(~channel.predictable, channel.time)
        for axes in (upper, lower):
            for n, (low, high) in enumerate(shades):
                label = "" if n or axes is upper else "not predictable"
                axes.axvspan(low, high, color=svg.SHADE, lw=0, zorder=0, label=label)
            place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 4}
            legend = axes.legend(borderaxespad=0.2, **place)
            if axes is upper:
                names = [s if len(s) <= _LONGEST else f"{s[: _LONGEST - 1]}…" for s in scene.labels]
                svg.name_curves(legend, names)
        lower.set_xlim(channel.time[0], channel.time[-1])
        lower.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
        lower.set_xlabel("time (s)", labelpad=2)
        figure.align_ylabels([upper, lower])
        return Markup(svg.inline_svg(figure, key))  # matplotlib escapes the text in its drawings


def _curves(
    axes: Axes, curves: Sequence[Line], name: str, unit: str, min_range: float, columns: int = svg.COLUMNS
) -> float:
    """Draw one curve or two, on an axis of at least a range; return the divisor of the values."""
    low, high = common_extremes(curves)
    factor, scaled_unit = prefix(max(abs(low), abs(high), min_range), unit)
    for n, (each, style) in enumerate(zip(curves, svg.MODEL_LINES, strict=False)):
        rows = svg.envelope(each.values, columns)
        axes.plot(each.time[rows], each.values[rows] / factor, label=f"model {n}", **style)
        if each.peak.size:  # one path with gaps for all contacts
            stems = svg.upper_envelope(each.peak, columns)
            time, gap = each.peak_time[stems], np.full(stems.size, np.nan)
            heights = np.column_stack([np.zeros(stems.size), each.peak[stems] / factor, gap])
            axes.plot(np.column_stack([time, time, gap]).ravel(), heights.ravel(), **style)
    axes.margins(y=0.06)
    if high - low < min_range:
        axes.set_ylim(*((low + high + side * 1.12 * min_range) / (2 * factor) for side in (-1, 1)))
    axes.set_ylabel(f"{name}\n({scaled_unit})" if scaled_unit else name, parse_math=False)
    return factor


def _difference(axes: Axes, channel: ChannelComparison) -> None:
    """Plot |difference|, the largest of each column, its threshold, and crosses beyond the threshold."""
    time, size, threshold = channel.time, channel.size, channel.threshold
    name = "|difference| within time tolerance" if channel.time_tolerance else "|difference|"
    edge = svg.envelope(size if threshold is None else threshold)
    rows = svg.upper_envelope(size)
    values = size[rows] if threshold is None else np.concatenate([size[rows], threshold[edge]])
    # At least two decades, and at most the sixteen of double precision.
    positive = values[values > 0.0]
    high = float(positive.max(initial=channel.definition.floor)) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, high * 1e-16)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(min(low, high / 100) / 2.5, high * 4)
    axes.plot(time[rows], size[rows], color=svg.DIFFERENCE, label=name)
    if threshold is not None:
        line: dict[str, Any] = {"color": svg.THRESHOLD, "lw": 1.2, "dashes": (3.5, 1.2, 1, 1.2)}
        axes.plot(time[edge], threshold[edge], label=threshold_name(channel), **line)
    if (beyond := channel.beyond).any():
        marks = svg.upper_envelope(np.where(beyond, size, 0.0), _CROSSES)
        marks = marks[beyond[marks]]
        axes.plot(time[marks], size[marks], "x", color=svg.OUTSIDE, ms=4, label="beyond")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    # Powers are plain text: as mathematics they take half of the time of a drawing.
    axes.yaxis.set_major_formatter(lambda value, _: decade(value) if value > 0 else "")
    unit = pretty_unit(channel.unit)
    axes.set_ylabel(f"|difference|\n({unit})" if unit else "|difference|", parse_math=False)


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
) -> Picture:
    """Draw channels of one table or two (by label) from start to end (s), a panel each, errors shaded."""
    low, high = -np.inf if start is None else start, np.inf if end is None else end
    sections = {
        label: replace(table, frame=table.frame[table.frame["time"].between(low, high)])
        for label, table in tables.items()
    }
    for label, part in sections.items():
        if len(part.frame) < 2:
            time = tables[label].time
            span = f"{time.min(initial=np.inf):g} s to {time.max(initial=-np.inf):g} s"
            raise TableError(f"{label}: fewer than two samples are shown; its time is {span}")
    with svg.style():
        figure = Picture(layout="constrained")
        figure.set_figheight(max(2.2, 1.35 * len(names) + 0.8))
        axes = list(figure.subplots(len(names), 1, sharex=True, squeeze=False).flat)
        for panel, name in zip(axes, names, strict=True):
            _panel(panel, name, sections, (low, high))
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels(axes)
        if len(tables) > 1:
            svg.legend_above(axes[0])
            svg.name_curves(figure.legends[0], list(tables))
    return figure


def _panel(panel: Axes, name: str, tables: Mapping[str, Table], span: tuple[float, float]) -> None:
    for label, table in tables.items():
        if name not in table.frame:
            others = ", ".join(table.channels)
            raise TableError(f"{label}: channel {name!r} is missing; --channels names others: {others}")
    first = next(iter(tables.values()))
    definition, table_scene = first.definitions.get(name.removesuffix(UNCERTAINTY)), first.scene
    scene = None if table_scene is None else table_scene.data
    title = definition.label.replace(", ", ",\n") if definition else name
    if definition and definition.name != name:
        title = f"estimated error of {title}"
    if zero := guide_of(name, scene):
        title = "slider x − guide"
    curves = [table_line(table, name).within(*span).less(zero) for table in tables.values()]
    min_range = least_range(first.definitions.get(name), scene, common_extremes(curves))
    factor = _curves(panel, curves, title, definition.unit if definition else "", min_range, _COLUMNS)
    for table, style in zip(tables.values(), svg.MODEL_LINES, strict=False):
        if name + UNCERTAINTY in table.frame:
            values, u = table.values(name) - zero, table.values(name + UNCERTAINTY)
            low, high = (values - u) / factor, (values + u) / factor
            rows = np.union1d(svg.envelope(low, _COLUMNS), svg.envelope(high, _COLUMNS))
            panel.fill_between(
                table.time[rows], low[rows], high[rows], color=style["color"], alpha=0.25, lw=0
            )


def write_picture(figure: Figure, path: Path) -> None:
    """Write a picture in the format of its name."""
    with svg.style():
        if path.suffix.lower() == ".svg":
            svg.write_svg(figure, path)
            return
        with replacing(path) as part:
            figure.savefig(part, format=path.suffix[1:].lower(), dpi=200, facecolor="white")


def against_angle(quantities: dict[str, Difference], labels: tuple[str, str]) -> Figure:
    """Return a figure of each quantity's reliability in both models, inside `svg.style`."""
    figure = Figure(figsize=(5.56, 4.6), layout="constrained")
    panels = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, difference) in zip(panels, quantities.items(), strict=True):
        cap = difference.a.cap
        models = zip((difference.a, difference.b), labels, "ox", svg.MODEL_LINES, strict=True)
        for model, label, mark, line in models:
            axes.plot(model.angle, model.reliability, f"{mark}-", ms=5, clip_on=False, label=label, **line)
        axes.axhline(cap, color=svg.LIMIT, lw=0.8, dashes=(1, 2), label="no error")
        values = np.concatenate([difference.a.reliability, difference.b.reliability, [cap]])
        margin = 0.08 * float(np.ptp(values)) or 1e-6
        axes.set_ylim(values.min() - margin, values.max() + margin)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.set_ylabel(f"R, {name}")
    panels[-1].set_xlim(0.0, 360.0)
    panels[-1].set_xticks(np.arange(0, 361, 72))
    panels[-1].set_xlabel("crank angle from the start (deg)", labelpad=2)
    figure.align_ylabels(panels)
    svg.legend_above(panels[0])
    return figure


def draw_work_precision(result: "WorkPrecision", path: Path) -> Path:
    """Draw processor time over error for each formulation, and the Pareto front; omit runs without error."""

    def points(rows: Sequence[Any]) -> list[tuple[float, float]]:
        return [(result.error(row), row.seconds) for row in rows if result.error(row) > 0.0]

    with svg.panels(path) as (axes,):
        axes.set(
            xscale="log", yscale="log", xlabel="largest error of slider x (m)", ylabel="processor time (s)"
        )
        if front := points(result.front):
            axes.plot(*zip(*front, strict=True), color=svg.SHADE, lw=5, label="Pareto front")
        for formulation, mark in {"minimal": "o", "multiplier": "s", "tree": "^", "full": "D"}.items():
            rows = [row for row in result.rows if row.candidate.formulation == formulation]
            if coordinates := sorted(points(rows), key=lambda point: point[1]):
                model = rows[0].candidate.model
                colour = svg.FIRST if model == MODELS[0] else svg.SECOND
                style: dict[str, Any] = {"color": colour, "marker": mark, "mfc": "none", "ms": 4}
                axes.plot(*zip(*coordinates, strict=True), label=f"{model}, {formulation}", **style)
        axes.margins(0.04)  # the outermost marks whole
        axes.xaxis.set_major_locator(LogLocator(numticks=6))
        axes.invert_xaxis()
        svg.legend_above(axes, columns=2)
    return path
