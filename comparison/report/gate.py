"""Page of the regression gate: what has changed since the baseline, with old, new and their difference."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from comparison.files import write_text
from comparison.formatting import pretty_unit
from comparison.regression.check import Check, Gate
from comparison.report import svg
from comparison.report.page import interactive_page, origin
from comparison.tables.channels import channels
from comparison.words.record import check_message, gate_notes, gate_summary, moved_first, of_gate

_DRAWN = 12
"""Figures at most: those of the channels that deviate first."""


def write_gate(gate: Gate, path: Path, *, command: str, lead: Sequence[str]) -> Path:
    """Write the page of a gate, which ``command`` repeats; ``lead`` is what is said first."""
    moved = moved_first(gate)
    html = interactive_page(
        "gate.html.j2",
        title="Has a model changed since its baseline?",
        verdict="differ" if gate.regressions else "agree",
        summary=gate_summary(gate),
        lead=lead,
        figures=[(check_message(check), _figure(check, f"g{n}")) for n, check in enumerate(moved[:_DRAWN])],
        left=max(0, len(moved) - _DRAWN),
        cases=[case for case in of_gate(gate) if case.status in ("failed", "error")],
        notes=gate_notes(gate),
        origin=origin(),
        command=command,
    )
    write_text(html, path)
    return path


def _figure(check: Check, key: str) -> Markup:
    """Draw the curve of now, the baseline's checkpoints, and below their distance with the threshold."""
    time, values = check.data["curve"]
    at, before, threshold, now = check.data["rows"].T
    distance, unit = np.abs(now - before), pretty_unit(channels()[check.name].unit)
    wide, thin = svg.MODEL_LINES
    with svg.style():
        figure = Figure(layout="constrained")
        figure.set_figheight(3.3)
        upper, lower = figure.subplots(2, 1, sharex=True)
        kept = svg.envelope(values)
        ring: dict[str, Any] = {"ls": "", "marker": "o", "ms": 6, "mfc": "none", "mew": 1.6}
        upper.plot(at, before, color=wide["color"], label="baseline", zorder=3, **ring)
        upper.plot(time[kept], values[kept], label="now", **thin)
        upper.set_ylabel(f"{check.name}\n({unit})" if unit else check.name, parse_math=False)
        floor = min(threshold.min(), distance[distance > 0.0].min()) / 3
        lower.set_yscale("log", nonpositive="clip")
        lower.vlines(
            at, floor, np.maximum(distance, floor), color=svg.DIFFERENCE, lw=2.4, label="|difference|"
        )
        lower.plot(at, threshold, "_", color=svg.THRESHOLD, ms=14, mew=1.6, label="threshold")
        lower.set_ylim(floor, 4 * max(distance.max(), threshold.max()))
        lower.set_ylabel(f"|now − baseline|\n({unit})" if unit else "|now − baseline|", parse_math=False)
        lower.set_xlabel("time (s)", labelpad=2)
        lower.set_xlim(time[0], time[-1])
        for axes in (upper, lower):
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        figure.align_ylabels([upper, lower])
        return Markup(svg.inline_svg(figure, key))  # matplotlib escapes the text in its drawings
