"""Figure of one channel: both models above, the absolute difference and its threshold below."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from comparison.formatting import decade, prefix, pretty_unit
from comparison.report import svg
from comparison.report.decimate import envelope, spans, upper_envelope
from comparison.tables.arrays import Array, BoolArray

_LEFT, _RIGHT = 0.135, 0.965  # of the figure's width
_UPPER = (0.545, 0.335)  # bottom and height, of the figure's height
_LOWER = (0.125, 0.33)
_DECADES = 16  # of the lower axes at most: double precision has no more
_LONGEST = 19  # letters beside axes of 90 pt, and of a name in a legend
_CROSSES = 80  # at most, to remain distinguishable
_MARKED = 100  # up to so many samples each one is marked
_EMPTY = Path(np.empty((0, 2)))


@dataclass(frozen=True)
class Curves:
    """Plotted data of one channel. Arrays have shape (n,), the channel's unit, and n >= 2."""

    label: str
    """Short name for the axis."""
    unit: str
    period: float | None
    """s; None omits the axis of crank cycles."""
    walls: tuple[float, float] | None
    """Two levels to mark."""
    predictable_below: float
    """Limit of the threshold for predictable samples; nan where there is none."""
    time: Array
    """s, increasing."""
    a: Array
    b: Array
    size: Array
    """|difference|."""
    threshold: Array | None
    predictable: BoolArray
    outside: BoolArray

    def between(self, start: float, end: float) -> Curves:
        """Return the samples from start to end (s), and one more on either side."""
        first = max(0, int(np.searchsorted(self.time, start)) - 1)
        part = slice(first, int(np.searchsorted(self.time, end)) + 2)
        return dataclasses.replace(
            self,
            time=self.time[part],
            a=self.a[part],
            b=self.b[part],
            size=self.size[part],
            threshold=None if self.threshold is None else self.threshold[part],
            predictable=self.predictable[part],
            outside=self.outside[part],
        )


class ChannelFigure:
    """Figure that is reused for all channels: creating axes costs more than moving lines.

    To be created and used inside `svg.style`.

    Parameters
    ----------
    labels
        Names of the two models.
    threshold_label
        Name of the threshold of the difference.
    """

    def __init__(self, labels: tuple[str, str], threshold_label: str) -> None:
        self._figure = figure = Figure()
        width = _RIGHT - _LEFT
        self._upper = upper = figure.add_axes((_LEFT, _UPPER[0], width, _UPPER[1]))
        self._lower = lower = figure.add_axes((_LEFT, _LOWER[0], width, _LOWER[1]))
        upper.spines["top"].set_visible(True)
        upper.tick_params(labelbottom=False, labeltop=True, top=True, bottom=False)
        upper.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        lower.set_yscale("log", nonpositive="clip")
        lower.yaxis.set_minor_locator(NullLocator())
        lower.yaxis.set_major_locator(LogLocator(numticks=6))
        # Powers as plain text: laid out as mathematics they took half of the time of a drawing.
        lower.yaxis.set_major_formatter(lambda value, _: decade(value) if value > 0 else "")
        lower.set_xlabel("time (s)", labelpad=2)
        for axes in (upper, lower):
            axes.yaxis.set_label_coords(-0.11, 0.5)

        self._walls = [
            upper.axhline(0.0, color=svg.LIMIT, lw=0.8, dashes=(1, 2), label="wall") for _ in range(2)
        ]
        (self._a,) = upper.plot([], [], label="first", **svg.MODEL_LINES[0])
        (self._b,) = upper.plot([], [], label="second", **svg.MODEL_LINES[1])
        (self._threshold,) = lower.plot(
            [], [], color=svg.THRESHOLD, lw=1.2, dashes=(3.5, 1.2, 1, 1.2), label="threshold"
        )
        (self._size,) = lower.plot([], [], color=svg.DIFFERENCE, label="|difference|")
        self._limit = lower.axhline(1.0, color=svg.LIMIT, lw=0.8, dashes=(1, 2))
        (self._outside,) = lower.plot([], [], "x", color=svg.OUTSIDE, ms=4, label="outside")
        self._shades = []
        for axes in (upper, lower):
            shade = PathPatch(_EMPTY, fc=svg.SHADE, lw=0, zorder=0, transform=axes.get_xaxis_transform())
            axes.add_patch(shade)
            self._shades.append(shade)
        self._shades[1].set_label("not predictable")
        self._cycles = figure.text(_RIGHT, 0.955, "crank cycles", ha="right", va="bottom")
        self._legends = [
            axes.legend(
                handles=handles,
                loc="lower left",
                ncols=4,
                bbox_to_anchor=(_LEFT, bottom),
                bbox_transform=figure.transFigure,
            )
            for axes, bottom, handles in (
                (upper, 0.958, [self._a, self._b, self._walls[0]]),
                (
                    lower,
                    _LOWER[0] + _LOWER[1] + 0.012,
                    [self._size, self._threshold, self._shades[1], self._outside],
                ),
            )
        ]
        # Set only now: a model may be named "$x" (mathematics to a label) or "_x" (left out of legends).
        names = [*labels, threshold_label]
        texts = [*self._legends[0].get_texts()[:2], self._legends[1].get_texts()[1]]
        for text, name in zip(texts, names, strict=True):
            text.set_parse_math(False)
            text.set_text(name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…")

    def svg(self, curves: Curves, key: str) -> str:
        """Return the drawing as inline SVG; ``key`` is unique on the page."""
        self._draw_models(curves)
        self._draw_difference(curves)
        self._set_time(curves)
        edges = spans(~curves.predictable, curves.time)
        self._say(0, 2, said=curves.walls is not None)
        self._say(1, 1, said=curves.threshold is not None)
        self._say(1, 2, said=bool(edges))
        self._say(1, 3, said=bool(curves.outside.any()))
        boxes = [
            Path([(low, 0), (low, 1), (high, 1), (high, 0), (low, 0)], closed=True) for low, high in edges
        ]
        for shade in self._shades:
            shade.set_path(Path.make_compound_path(*boxes) if boxes else _EMPTY)
        return svg.inline_svg(self._figure, key)

    def _say(self, legend: int, entry: int, *, said: bool) -> None:
        """Show or hide an entry of a legend."""
        self._legends[legend].get_texts()[entry].set_visible(said)
        handle = self._legends[legend].legend_handles[entry]
        if handle is not None:
            handle.set_visible(said)

    def _draw_models(self, curves: Curves) -> None:
        """Plot both models, in a unit that needs few digits."""
        low, high = float(min(curves.a.min(), curves.b.min())), float(max(curves.a.max(), curves.b.max()))
        if curves.walls is not None:
            low, high = min(low, curves.walls[0]), max(high, curves.walls[1])
        margin = 0.06 * (high - low) or max(abs(high), 1.0)
        factor, unit = prefix(max(abs(low), abs(high)), curves.unit)
        for line, values, marker in ((self._a, curves.a, "o"), (self._b, curves.b, "x")):
            kept = envelope(values)
            line.set_data(curves.time[kept], values[kept] / factor)
            line.set_marker(marker if len(values) <= _MARKED else "None")
        for line, level in zip(self._walls, curves.walls or (0.0, 0.0), strict=True):
            line.set_ydata([level / factor] * 2)
            line.set_visible(curves.walls is not None)
        self._upper.set_ylim((low - margin) / factor, (high + margin) / factor)
        self._upper.set_ylabel(_with_unit(curves.label, unit), parse_math=False)

    def _draw_difference(self, curves: Curves) -> None:
        """Plot |difference|, the largest of each column, and its threshold."""
        kept = upper_envelope(curves.size)
        self._size.set_data(curves.time[kept], curves.size[kept])
        shown = curves.size[kept]
        self._threshold.set_visible(curves.threshold is not None)
        if curves.threshold is not None:
            edge = envelope(curves.threshold)
            self._threshold.set_data(curves.time[edge], curves.threshold[edge])
            shown = np.concatenate([shown, curves.threshold[edge]])
        marks = upper_envelope(np.where(curves.outside, curves.size, 0.0), _CROSSES)
        marks = marks[curves.outside[marks]]
        self._outside.set_data(curves.time[marks], curves.size[marks])
        limited = bool(curves.predictable_below > 0.0)
        self._limit.set_visible(limited)
        if limited:
            self._limit.set_ydata([curves.predictable_below] * 2)
            shown = np.append(shown, curves.predictable_below)
        positive = shown[shown > 0.0]
        high = float(positive.max()) if positive.size else 1.0
        low = max(float(positive.min()) if positive.size else 0.1, high * 10.0**-_DECADES)
        low = min(low, high / 100)  # at least three ticks
        self._lower.set_ylim(low / 2.5, high * 4)
        self._lower.set_ylabel(_with_unit("|difference|", pretty_unit(curves.unit)), parse_math=False)

    def _set_time(self, curves: Curves) -> None:
        """Set the time span of both axes, in seconds below and in crank cycles above."""
        start, end = float(curves.time[0]), float(curves.time[-1])
        self._lower.set_xticks(_ticks(start, end))
        self._cycles.set_visible(curves.period is not None)
        cycles = _ticks(start / curves.period, end / curves.period) if curves.period else np.array([])
        self._upper.set_xticks(cycles * (curves.period or 1.0), [f"{cycle:g}" for cycle in cycles])
        for axes in (self._upper, self._lower):
            axes.set_xlim(start, end)


def _ticks(start: float, end: float) -> Array:
    """Return round numbers from start to end, both included if they are round, shape (some,)."""
    ticks = np.asarray(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(start, end))
    slack = 1e-9 * (end - start)
    return ticks[(ticks >= start - slack) & (ticks <= end + slack)]


def _with_unit(label: str, unit: str) -> str:
    """Return the text for a vertical axis; the unit alone where both are longer than the axes are high."""
    if not unit:
        return label
    return f"{label} ({unit})" if len(label + unit) <= _LONGEST else f"({unit})"
