"""Reliability section of the report: table rows, sentences, figure against the crank angle."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from comparison.formatting import MISSING, number, quantity
from comparison.reliability.assessment import Assessment
from comparison.reliability.difference import Difference
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.report import svg
from comparison.report.gallery import Drawing
from comparison.tables.channels import channels
from comparison.verdict.results import SceneComparison
from comparison.words.reliability import notes, rounded

SIZE = (5.56, 4.6)
"""in, as the style's unit."""


def section(scene: SceneComparison) -> dict[str, Any] | None:
    """Return the template data of a scene at one tier; None if there is no reliability."""
    found = scene.reliability
    if found is None:
        return None
    return {
        "verdict": found.verdict,
        "notes": notes(found),
        "rows": [_row(name, difference) for name, difference in found.quantities.items()],
    }


def drawings(scene: SceneComparison, key: str) -> list[Drawing]:
    """Draw the reliabilities of both models against the crank angle, inside `svg.style`.

    Parameters
    ----------
    key
        Prefix of the figure's ids; unique on the page.

    Returns
    -------
    list of Drawing
        One, or none if the crank cycle has fewer than two intervals.
    """
    found = scene.reliability
    if found is None or not found.quantities or next(iter(found.quantities.values())).curve.size < 2:
        return []
    heading = "Reliability against the crank angle from the start"
    smallest = ", ".join(
        f"{name} {rounded(of.a.minimum)} and {rounded(of.b.minimum)}" for name, of in found.quantities.items()
    )
    caption = (
        f"each point at the end of its interval of the crank cycle; smallest: {smallest}; {scene.tier} tier"
    )
    lines = f"{scene.labels[0]} as a wide and {scene.labels[1]} as a thin line"
    alt = f"{heading}: {', '.join(found.quantities)}, {lines}. "
    figure = against_angle(found.quantities, scene.labels)
    return [
        Drawing(
            heading=heading,
            caption=caption,
            verdict=found.verdict,
            alt=f"{alt}{caption}.",
            svg=Markup(svg.inline_svg(figure, key)),  # matplotlib escapes the text in its drawings
        )
    ]


def against_angle(quantities: dict[str, Difference], labels: tuple[str, str]) -> Figure:
    """Return a figure of each quantity's reliability in both models, inside `svg.style`."""
    figure = Figure(figsize=SIZE)
    panels = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    figure.subplots_adjust(0.16, 0.095, 0.965, 0.93, hspace=0.22)
    for axes, (name, found) in zip(panels, quantities.items(), strict=True):
        axes.axhline(found.a.cap, color=svg.LIMIT, lw=0.8, dashes=(1, 2), label="no error")
        (first,) = axes.plot(
            found.a.angle, found.a.reliability, "o-", ms=5, clip_on=False, **svg.MODEL_LINES[0]
        )
        (second,) = axes.plot(
            found.b.angle, found.b.reliability, "x-", ms=5, clip_on=False, **svg.MODEL_LINES[1]
        )
        values = np.concatenate([found.a.reliability, found.b.reliability, [found.a.cap]])
        margin = 0.08 * float(np.ptp(values)) or 1e-6
        axes.set_ylim(values.min() - margin, values.max() + margin)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.set_ylabel(f"R, {name}")
    panels[-1].set_xlim(0.0, 360.0)
    panels[-1].set_xticks(np.arange(0, 361, 72))
    panels[-1].set_xlabel("crank angle from the start (deg)", labelpad=2)
    figure.align_ylabels(panels)
    legend = panels[0].legend(
        handles=[first, second, panels[0].lines[0]],
        labels=["first", "second", "no error"],
        loc="lower left",
        ncols=3,
        bbox_to_anchor=(0.16, 0.945),
        bbox_transform=figure.transFigure,
    )
    # Set only now: a model may be named "$x" (mathematics to a label).
    for text, label in zip(legend.get_texts()[:2], labels, strict=True):
        text.set_parse_math(False)
        text.set_text(label)
    return figure


def _row(name: str, found: Difference) -> dict[str, Any]:
    unit = unit_of(name)
    limits = found.a.limits
    lower = f"{quantity(limits.lower, unit)} to " if limits.lower else ""
    return {
        "name": name,
        "channel": QUANTITIES[name],
        "label": channels()[QUANTITIES[name]].label,
        "limits": f"{lower}{quantity(limits.upper, unit)}",
        "models": [_model(of) for of in (found.a, found.b)],
        "difference": number(found.minimum, 2),
        "half_width": f"± {number(found.half_width, 2)}" if np.isfinite(found.half_width) else MISSING,
        "sources": f"cycles ± {number(found.sampling, 2)}, numerics ± {number(found.numerical, 2)}, "
        f"quadrature ± {number(found.quadrature, 2)}",
        "verdict": found.verdict,
    }


def _model(of: Assessment) -> dict[str, str]:
    worst, least = of.worst, int(of.within.argmin())
    return {
        "smallest": rounded(of.minimum),
        "where": "the cap" if of.capped[worst] else f"at {of.angle[worst]:g}°",
        "interval": "{:.5f} … {:.5f}".format(*of.interval),
        "within": f"{of.within[least]:.3f}",
        "within_where": "everywhere" if np.all(of.within == of.within[0]) else f"at {of.angle[least]:g}°",
        "within_interval": f"{of.within_low[least]:.3f} … {of.within_high[least]:.3f}",
    }
