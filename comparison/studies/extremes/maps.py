"""Maps of what became of the runs: one square a run along the axes, one mark a point of the hypercube."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from comparison.report import svg
from comparison.studies.extremes.cells import BASE_LABEL, HYPERCUBE
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Class, Verdict
from comparison.studies.extremes.ways import BODIES, IMPLICIT, INDEX2, MINIMAL, MULTIPLIERS, NATIVE, TREE

COLOURS = {
    Class.CONVERGED: svg.FIRST,
    Class.DEGRADED: svg.SECOND,
    Class.UNCONFIRMED: svg.THRESHOLD,
    Class.STOPPED: svg.BEYOND,
    Class.REFUSED: svg.LIMIT,
    Class.CRASHED: svg.INK,
    Class.NONSENSE: svg.INK,
}
_ALPHA = {Class.UNCONFIRMED: 0.2}
MARKS = {
    Class.CONVERGED: "o",
    Class.DEGRADED: "s",
    Class.UNCONFIRMED: "d",
    Class.STOPPED: "x",
    Class.REFUSED: "_",
    Class.CRASHED: "*",
    Class.NONSENSE: "*",
}
SHORT = {
    MINIMAL.name: "R minimal",
    IMPLICIT.name: "R LSODA",
    MULTIPLIERS.name: "R multipliers",
    TREE.name: "E tree",
    BODIES.name: "E five bodies",
    INDEX2.name: "E index 2",
    NATIVE.name: "E own contact",
}
_WIDTH = 5.56
_ROW, _SQUARE, _GAP, _HEAD = 0.135, 0.27, 0.07, 0.85
"""Inches: a row, a square's width, between two axes, the heads of the columns."""


def sign(verdict: Verdict) -> str:
    """Return what stands in a square: of a degraded run the power of ten of error over promise."""
    if verdict.kind is Class.DEGRADED:
        ratio = verdict.error / verdict.promise
        return f"{np.log10(ratio):.0f}" if np.isfinite(ratio) else "!"
    return {Class.STOPPED: "×", Class.REFUSED: "–", Class.UNCONFIRMED: "?"}.get(verdict.kind, "")


def draw_axes(found: Sequence[Found], laws: Sequence[str], path: Path) -> None:
    """Draw the cells along the axes: a row a cell, a column a formulation, side by side for the laws."""
    shown = [of for of in found if of.cell.axis != HYPERCUBE and of.cell.law in laws]
    names = list(dict.fromkeys((of.cell.axis, of.cell.label) for of in shown))
    breaks = sum(a[0] != b[0] for a, b in zip(names[1:], names, strict=False))
    columns = {
        law: [name for name in SHORT if any(name in of.verdicts for of in shown if of.cell.law == law)]
        for law in laws
    }
    height = _HEAD + len(names) * _ROW + breaks * _GAP + 0.35
    with svg.style():
        figure = Figure(figsize=(_WIDTH, height))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_xlim(0.0, _WIDTH)
        axes.set_ylim(height, 0.0)
        axes.axis("off")
        left = _WIDTH - sum(len(of) * _SQUARE + 0.12 for of in columns.values())
        starts = {}
        for law, of in columns.items():
            starts[law] = left
            axes.text(left, 0.1, law, va="center")
            for number, name in enumerate(of):
                x = left + (number + 0.5) * _SQUARE
                axes.text(x, _HEAD - 0.05, SHORT[name], rotation=60, ha="left", va="bottom", size=7)
            left += len(of) * _SQUARE + 0.12
        by_name = {(of.cell.axis, of.cell.label, of.cell.law): of for of in shown}
        y, before = _HEAD, names[0][0]
        for number, (axis, label) in enumerate(names):
            if axis != before:
                y += _GAP
            if axis != before or not number:
                axes.text(0.02, y + 0.5 * _ROW, axis, va="center", size=7.5, weight="bold")
            axes.text(min(starts.values()) - 0.06, y + 0.5 * _ROW, label, ha="right", va="center", size=7.5)
            for law, of in columns.items():
                one = by_name.get((axis, label, law))
                for place, name in enumerate(of):
                    if one is not None and name in one.verdicts:
                        _square(axes, starts[law] + place * _SQUARE, y, one.verdicts[name])
            y, before = y + _ROW, axis
        _legend(axes, y + 0.2)
        svg.write_svg(figure, path)


def _square(axes: Axes, x: float, y: float, verdict: Verdict) -> None:
    colour = COLOURS[verdict.kind]
    alpha = _ALPHA.get(verdict.kind, 0.75)
    axes.add_patch(Rectangle((x, y), 0.94 * _SQUARE, 0.9 * _ROW, facecolor=colour, alpha=alpha, lw=0))
    axes.text(x + 0.47 * _SQUARE, y + 0.47 * _ROW, sign(verdict), ha="center", va="center", size=7)


def _legend(axes: Axes, y: float) -> None:
    x = 0.02
    for kind in (Class.CONVERGED, Class.DEGRADED, Class.UNCONFIRMED, Class.STOPPED, Class.REFUSED):
        alpha = _ALPHA.get(kind, 0.75)
        axes.add_patch(Rectangle((x, y - 0.05), 0.14, 0.1, facecolor=COLOURS[kind], alpha=alpha, lw=0))
        words = f"{kind} by 10ⁿ" if kind is Class.DEGRADED else str(kind)
        axes.text(x + 0.19, y, words, va="center", size=7.5)
        x += 0.3 + 0.062 * len(words)


def draw_hypercube(found: Sequence[Found], path: Path) -> None:
    """Draw the points of the hypercube, a panel a formulation: modulus over speed."""
    shown = [of for of in found if of.cell.axis == HYPERCUBE]
    ways = [MINIMAL.name, MULTIPLIERS.name, TREE.name, BODIES.name]
    with svg.style():
        figure = Figure(figsize=(_WIDTH, 5.0))
        for number, name in enumerate(ways):
            row, column = divmod(number, 2)
            axes = figure.add_axes((0.1 + 0.46 * column, 0.6 - 0.46 * row, 0.42, 0.345))
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.margins(x=0.05, y=0.05)
            axes.set_title(SHORT[name], size=9, loc="left")
            for kind in MARKS:
                points = [
                    (of.cell.changes["drive.speed_rpm"], of.cell.changes["contact.youngs_modulus"])
                    for of in shown
                    if name in of.verdicts and of.verdicts[name].kind is kind
                ]
                if points:
                    x, y = np.array(points, dtype=np.float64).T
                    label = f"{kind}" if number == 0 else None
                    axes.plot(
                        x,
                        y,
                        MARKS[kind],
                        color=COLOURS[kind],
                        ms=3.5,
                        mew=0.9,
                        label=label,
                        markerfacecolor="none",
                    )
            if row:
                axes.set_xlabel("speed (rpm)")
            else:
                axes.tick_params(labelbottom=False)
            if column:
                axes.tick_params(labelleft=False)
            else:
                axes.set_ylabel("modulus (Pa)")
            if number == 0:
                handles = axes.get_legend_handles_labels()
        figure.legend(
            *handles,
            loc="lower left",
            bbox_to_anchor=(0.09, 0.0),
            ncols=5,
            handlelength=1.0,
            columnspacing=1.2,
        )
        svg.write_svg(figure, path)


def draw_errors(found: Sequence[Found], path: Path) -> None:
    """Draw error over promise against how much the scene magnifies, a mark a run."""
    with svg.style():
        figure = Figure(figsize=(_WIDTH, 3.2))
        axes = figure.add_axes((0.125, 0.13, 0.84, 0.77))
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.margins(x=0.03, y=0.03)
        for way, mark, colour in (
            (MINIMAL, "o", svg.FIRST),
            (MULTIPLIERS, "+", svg.FIRST),
            (TREE, "^", svg.SECOND),
            (BODIES, "x", svg.SECOND),
        ):
            points = [
                (of.magnification, max(verdict.error / verdict.promise, 1e-6))
                for of in found
                if (verdict := of.verdicts.get(way.name)) is not None
                and of.magnification > 0.0
                and np.isfinite(verdict.error / verdict.promise)
            ]
            x, y = np.array(points).reshape(-1, 2).T
            axes.plot(
                x, y, mark, color=colour, ms=3.5, markerfacecolor="none", mew=0.8, label=SHORT[way.name]
            )
        ends = np.array(axes.get_xlim())
        base = next((of.magnification for of in found if of.cell.label == BASE_LABEL), 1.0) or 1.0
        axes.plot(
            ends, ends / base, color=svg.DIFFERENCE, dashes=(4, 2), lw=0.9, label="as the scene magnifies"
        )
        axes.axhline(1.0, color=svg.THRESHOLD, lw=0.8)
        axes.set_xlabel("distance of two starts after a turn, over that at its start")
        axes.set_ylabel("error / promise")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=3)
        svg.write_svg(figure, path)
