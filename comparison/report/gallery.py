"""Selection of a scene's figures and their captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.formatting import percent, quantity
from comparison.report import rule
from comparison.report.figures import ChannelFigure, Curves
from comparison.report.impact_figure import Impact, draw_impact, representative_impact
from comparison.report.summary import worst_channel
from comparison.tables.arrays import Array
from comparison.tables.channels import CONTACTS, channels

if TYPE_CHECKING:
    from comparison.metrics.contacts import Pulse

_ENLARGED = 0.02  # of a crank cycle (or of the run) to either side of the worst sample


@dataclass(frozen=True)
class Drawing:
    """Figure with its texts."""

    heading: str
    caption: str
    verdict: str
    alt: str
    svg: Markup


def figures(
    scene: SceneComparison, key: str, pulses: tuple[Sequence[Pulse], Sequence[Pulse]] = ((), ())
) -> list[Drawing]:
    """Draw the scene's worst sample and one impact enlarged, and its channels, inside `svg.style`.

    Unexcited channels, which are constant, and derived ones are omitted.

    Parameters
    ----------
    key
        Starts the ids of the figures; unique on the page.
    pulses
        Contacts of either model resolved in time.
    """
    order = {name: n for n, name in enumerate(channels())}
    shown = [c for c in scene.channels.values() if c.verdict != "unexcited" and not is_derived(c)]
    shown.sort(key=lambda channel: order.get(channel.channel, len(order)))
    pages: dict[str, ChannelFigure] = {}  # by the name of the threshold, which stands in the legend
    drawings = []
    worst = worst_channel(scene)
    if worst is not None and np.isfinite(worst.worst_time) and worst.verdict != "unexcited":
        drawings.append(_draw(scene, worst, pages, f"{key}-worst", enlarged=True))
    if (impact := representative_impact(scene, pulses)) is not None:
        drawings.append(_draw_impact(scene, impact, f"{key}-impact"))
    return drawings + [_draw(scene, channel, pages, f"{key}-{n}") for n, channel in enumerate(shown)]


def representative(scene: SceneComparison, key: str) -> list[Drawing]:
    """Draw slider_x alone, or where it is unexcited the first channel that is not, inside `svg.style`."""
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    excited.sort(key=lambda channel: channel.channel != "slider_x")
    return [_draw(scene, channel, {}, key) for channel in excited[:1]]


def is_derived(channel: ChannelComparison) -> bool:
    """Return whether a channel is left to the table: a corner's gap or friction force that does not differ.

    These follow from positions and normal forces, which are drawn, and would triple the corners' figures.
    """
    corner = channel.channel.startswith("corner_") and not channel.channel.endswith("_normal")
    return corner and channel.verdict not in {"differ", "unexcited"}


def _draw(
    scene: SceneComparison,
    channel: ChannelComparison,
    pages: dict[str, ChannelFigure],
    key: str,
    *,
    enlarged: bool = False,
) -> Drawing:
    limit, limit_name = rule.threshold(channel)
    if limit_name not in pages:
        pages[limit_name] = ChannelFigure(scene.labels, limit_name)
    curves = _curves(scene, channel, limit)
    sign = channel.definition.sign
    heading = f"{channel.label} ({sign})" if sign else channel.label
    if enlarged:
        curves = curves.between(*_around(scene, channel.worst_time))
        heading = f"The worst predictable sample, at {channel.worst_time:.4f} s, enlarged: {heading}"
    caption = f"{channel.channel}: largest difference {quantity(channel.max_difference, channel.unit)}"
    caption += f", coverage {percent(channel.coverage)}, explained {percent(channel.explained)}"
    if channel.u is not None:
        caption += f"; {scene.tier} tier"
    alt = (
        f"{heading} over time, {scene.labels[0]} as a wide and {scene.labels[1]} as a thin line; below it "
        f"the size of their difference against {limit_name}, logarithmic. "
        f"Verdict {channel.verdict}: {channel.reason}. {caption}."
    )
    svg = Markup(pages[limit_name].svg(curves, key))  # matplotlib escapes the text in its drawings
    return Drawing(heading=heading, caption=caption, verdict=channel.verdict, alt=alt, svg=svg)


def _draw_impact(scene: SceneComparison, impact: Impact, key: str) -> Drawing:
    (a, first), (b, second) = impact.first, impact.second
    heading = f"An impact resolved: {CONTACTS[a['corner']]} corner, from {a['start']:.6f} s"
    caption = (
        f"Peak {quantity(a['peak_force'], 'N')} and {quantity(b['peak_force'], 'N')}, lasting "
        f"{quantity(a['end'] - a['start'], 's')} and {quantity(b['end'] - b['start'], 's')}; touches "
        f"{quantity(abs(a['start'] - b['start']), 's')} apart, drawn over each other; {scene.tier} tier"
    )
    alt = (
        f"{heading}: normal force of {scene.labels[0]} ({first.time.size} points) and {scene.labels[1]} "
        f"({second.time.size} points) over the time from the touch. {caption}."
    )
    svg = Markup(draw_impact(impact, scene.labels, key))
    return Drawing(heading=heading, caption=caption, verdict=scene.verdict, alt=alt, svg=svg)


def _curves(scene: SceneComparison, channel: ChannelComparison, limit: Array | None) -> Curves:
    curves = Curves(
        label=channel.label.partition(",")[0].removeprefix("slider "),
        unit=channel.unit,
        period=scene.period,
        walls=None,
        time=scene.time,
        a=channel.a,
        b=channel.b,
        size=np.abs(channel.difference),
        threshold=limit,
        predictable_below=rule.limit_of_predictability(channel),
        predictable=channel.predictable,
        outside=channel.beyond,
    )
    if channel.channel != "slider_x" or scene.scene is None:
        return curves
    # A clearance of 0.2 mm is invisible on an axis of half a metre: x is drawn relative to the guide's centre
    # line.
    guide = float(scene.scene["mechanism"]["guide_x"])
    clearance = float(scene.scene["clearance"]["slider"])
    walls = (-clearance, clearance) if scene.scene["joints"]["slider"] == "clearance" else None
    return replace(curves, label="x − guide", a=channel.a - guide, b=channel.b - guide, walls=walls)


def _around(scene: SceneComparison, instant: float) -> tuple[float, float]:
    reach = _ENLARGED * (scene.period if scene.period is not None else float(scene.time[-1] - scene.time[0]))
    return instant - reach, instant + reach
