"""Figure of one impact: the normal force of both models from their touch on, and the event tables' peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

import pandas as pd
from matplotlib.figure import Figure

from comparison.formatting import prefix
from comparison.metrics.contacts import WINDOW, match
from comparison.report import svg
from comparison.verdict.results import SceneComparison

if TYPE_CHECKING:
    from comparison.metrics.contacts import Pulse

_HEIGHT = 2.2  # inches


@dataclass(frozen=True)
class Impact:
    """A contact of both models, each with its row in the event table."""

    first: tuple[pd.Series, Pulse]
    second: tuple[pd.Series, Pulse]


def representative_impact(
    scene: SceneComparison, pulses: tuple[Sequence[Pulse], Sequence[Pulse]]
) -> Impact | None:
    """Return the last contact before the first difference, else the one with the largest force; or None.

    Of those that both models have, resolved in both.
    """
    a, b = scene.events
    if a is None or b is None or scene.period is None:
        return None
    resolved_a, resolved_b = ({pulse.row: pulse for pulse in each} for each in pulses)
    shared = [
        Impact((a.iloc[row], resolved_a[row]), (b.iloc[other], resolved_b[other]))
        for row, other in match(a, b, WINDOW * scene.period).tolist()
        if row in resolved_a and other in resolved_b
    ]
    outside = scene.attribution.outside_from if scene.attribution else float("nan")
    before = [impact for impact in shared if isfinite(outside) and impact.first[0]["start"] <= outside]
    if before:
        return before[-1]
    return max(shared, key=lambda impact: float(impact.first[0]["peak_force"]), default=None)


def draw_impact(impact: Impact, labels: tuple[str, str], key: str) -> str:
    """Return the drawing as inline SVG, inside `svg.style`; ``key`` is unique on the page."""
    figure = Figure(layout="constrained")
    figure.set_figheight(_HEIGHT)
    axes = figure.subplots()
    end = max(float(pulse.time[-1]) for _, pulse in (impact.first, impact.second))
    factor, unit = prefix(end, "s")
    sides = zip((impact.first, impact.second), labels, svg.MODEL_LINES, ("v", "^"), strict=True)
    for (event, pulse), label, line, marker in sides:
        axes.plot(pulse.time / factor, pulse.force, label=label, **line)
        axes.plot(
            pulse.time[pulse.force.argmax()] / factor,
            event["peak_force"],
            marker,
            color=line["color"],
            ms=5,
            mfc="none",
            label=f"peak in {label}'s event table",
        )
    axes.set_xlabel(f"time from the touch ({unit})")
    axes.set_ylabel("normal force (N)")
    axes.margins(0.02, 0.1)
    axes.set_ylim(bottom=0.0)
    legend = figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper left", ncols=2, borderaxespad=0.4
    )
    for text in legend.get_texts():
        text.set_parse_math(False)
    return svg.inline_svg(figure, key)
