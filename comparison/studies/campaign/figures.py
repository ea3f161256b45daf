"""The drawings of the campaign: distances between the models, coverage, and where the scenes lie."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis

from comparison.accuracy.levels import thresholds
from comparison.report import svg
from comparison.studies.campaign import stages
from comparison.studies.campaign.population import CLEARANCE, SPEED_RPM
from comparison.studies.campaign.screening import LIMIT, TIER, clearance
from comparison.studies.campaign.tables import Found
from comparison.tables.arrays import Array

_DECADES = np.arange(-15.0, -2.9, 0.5)
_SHARES = np.linspace(0.0, 1.0, 21)
_MARKS: dict[str, dict[str, Any]] = {
    stages.AGREE: {"marker": ".", "color": svg.SERIES[0], "ms": 3},
    stages.NOT_DECIDED: {"marker": "o", "color": svg.THRESHOLD, "mfc": "none", "ms": 4},
    stages.FAILED: {"marker": "x", "color": svg.INK, "ms": 4},
    stages.UNDERESTIMATED: {"marker": "s", "color": svg.DIFFERENCE, "mfc": "none", "ms": 5},
    stages.BROKEN: {"marker": "^", "color": svg.OUTSIDE, "ms": 5},
    stages.DIFFER: {"marker": "D", "color": svg.SERIES[3], "ms": 5},
}
"""By outcome; the rare ones last, so that they lie on top."""


def draw_distances(found: Found, path: Path) -> None:
    """Draw how many scenes have which largest distance between the single runs, and which coverage."""
    groups = (
        ("agree", svg.SERIES[0], {stages.AGREE, stages.UNDERESTIMATED}),
        ("differ or broken", svg.SERIES[3], {stages.DIFFER, stages.BROKEN}),
        ("not decided", svg.THRESHOLD, {stages.NOT_DECIDED}),
    )
    screened = [(row["outcome"], row["screening"]) for _, row in found if row["screening"] is not None]
    with svg.panels(path, 1, 2) as (left, right):
        for label, colour, outcomes in groups:
            own = [screening for outcome, screening in screened if outcome in outcomes]
            distances = np.log10(np.maximum([one["distance"] for one in own], 10.0 ** _DECADES[0]))
            _outline(left, distances, _DECADES, label, colour)
            _outline(right, np.array([one["coverage"] for one in own]), _SHARES, label, colour)
        left.axvline(np.log10(LIMIT), color=svg.LIMIT, dashes=(4, 2))
        right.axvline(thresholds(TIER).coverage, color=svg.LIMIT, dashes=(4, 2))
        ticks = np.arange(-15, -2, 3)
        left.set_xticks(ticks, [f"$10^{{{tick}}}$" for tick in ticks])
        left.set(xlabel="largest distance, scaled to x (m)", ylabel="number of scenes")
        right.set_xlabel("share of samples predictable (-)")
        for axes in (left, right):
            axes.set(yscale="log", ylim=(0.7, 1.2 * len(found)))
            _plain(axes.yaxis, (1, 10, 100, 1000))
        svg.legend_above(left)


def _outline(axes: Axes, values: Array, edges: Array, label: str, colour: str) -> None:
    if values.size:
        axes.hist(
            np.clip(values, edges[0], edges[-1]), edges.tolist(), histtype="step", color=colour, label=label
        )


def draw_places(found: Found, path: Path) -> None:
    """Draw where the scenes lie in speed, clearance and restitution, by what was found."""
    with svg.panels(path, 1, 2, sharex=True) as (left, right):
        for outcome, mark in _MARKS.items():
            own = [case.scene for case, row in found if row["outcome"] == outcome]
            speeds = [abs(scene.data["drive"]["speed_rpm"]) for scene in own]
            clearances = [1e3 * clearance(scene) for scene in own]
            restitutions = [scene.data["contact"]["restitution"] for scene in own]
            for axes, of in ((left, clearances), (right, restitutions)):
                axes.plot(speeds, of, linestyle="none", label=outcome, **mark)
        left.set(yscale="log", ylim=(0.8e3 * CLEARANCE[0], 1.2e3 * CLEARANCE[1]), ylabel="clearance (mm)")
        _plain(left.yaxis, (0.05, 0.1, 0.2, 0.5, 1.0))
        right.set(ylim=(-0.03, 1.03), ylabel="coefficient of restitution (-)")
        for axes in (left, right):
            axes.set(xscale="log", xlim=(0.9 * SPEED_RPM[0], 1.1 * SPEED_RPM[1]), xlabel="speed (rpm)")
            _plain(axes.xaxis, (10, 30, 100, 300, 1000))
        svg.legend_above(left, columns=3)


def _plain(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis with plain numbers, those within its limits."""
    low, high = axis.get_view_interval()
    shown = [tick for tick in ticks if low <= tick <= high]
    axis.set_ticks(shown, [f"{tick:g}" for tick in shown])
    axis.set_ticks([], minor=True)
