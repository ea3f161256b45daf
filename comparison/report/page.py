"""The report: one self-contained HTML file."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from comparison.agreement.results import SceneComparison
from comparison.files import replacing
from comparison.formatting import MISSING, percent, quantity
from comparison.metrics.impacts import WINDOW
from comparison.reliability.difference import MARGIN
from comparison.report import reliability, rule, summary, svg, tables
from comparison.report.gallery import figures, is_derived, representative
from comparison.report.text import attribution_words, shift_line

_ASSETS = Path(__file__).with_name("assets")
# Collapsed sections are opened for printing where style sheets cannot do it.
_SCRIPT = (
    'addEventListener("beforeprint",()=>document.querySelectorAll("details:not([open])")'
    '.forEach(d=>{d.open=true;d.dataset.closed=""}));'
    'addEventListener("afterprint",()=>document.querySelectorAll("[data-closed]")'
    ".forEach(d=>{d.open=false;delete d.dataset.closed}));"
)


def write_report(comparisons: Sequence[SceneComparison], out: Path, *, title: str, command: str) -> Path:
    """Write ``report.html`` into a folder.

    Parameters
    ----------
    comparisons
        Scenes in display order; they may have no channels ("cannot compare").
    out
        The folder, created if missing. An existing report is replaced once the new one is complete.
    title
        Heading of the page.
    command
        Command that reproduces the whole report.

    Returns
    -------
    path
        Path of the page. Equal comparisons give identical bytes.
    """
    html = render(comparisons, title=title, command=command)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "report.html"
    with replacing(path) as part:
        part.write_text(html, "utf-8")
    return path


def render(comparisons: Sequence[SceneComparison], *, title: str, command: str) -> str:
    """Return the page as text."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    worst = max(
        range(len(comparisons)),
        key=lambda n: summary.rank(summary.worst_verdict(comparisons[n])),
        default=None,
    )
    with svg.style():
        scenes = [_scene(scene, f"s{n}", shown=n == worst) for n, scene in enumerate(comparisons)]
    return environment.get_template("report.html.j2").render(
        title=title,
        command=command,
        overall={"verdict": summary.overall_verdict(comparisons), "sentence": summary.sentence(comparisons)},
        scenes=scenes,
        tiers=any(scene.tight is not None for scene in comparisons),
        reliability=any(scene.reliability is not None for scene in comparisons),
        margin=MARGIN,
        symbols=summary.SYMBOLS,
        definition=rule.definition(comparisons),
        contact_headings=tables.CONTACT_HEADINGS,
        information_headings=list(tables.INFORMATION_HEADINGS.values()),
        css=Markup((_ASSETS / "report.css").read_text("utf-8")),
        script=Markup(_SCRIPT),
        script_hash=base64.b64encode(hashlib.sha256(_SCRIPT.encode()).digest()).decode(),
    )


def _scene(scene: SceneComparison, key: str, *, shown: bool) -> dict[str, Any]:
    """Return the template data of one scene; ``key`` is the prefix of its figures' ids."""
    worst = summary.worst_channel(scene)
    usual = _tier(scene)
    rows = {row["name"]: row for row in usual["channels"]}
    judged = [channel.coverage for channel in scene.channels.values() if channel.verdict != "unexcited"]
    return usual | {
        "key": key,
        "open": shown,
        "name": scene.name,
        "title": scene.title,
        "description": scene.description,
        "shift": shift_line(scene),
        "warnings": scene.warnings,
        "worst": rows[worst.channel] if worst else None,
        "lowest_coverage": percent(float(np.min(judged))) if judged else MISSING,
        "figures": figures(scene, key),
        "not_drawn": ", ".join(name for name, channel in scene.channels.items() if is_derived(channel)),
        "unexcited": ", ".join(name for name, row in rows.items() if row["verdict"] == "unexcited"),
        "without_contact": all(events is not None and events.empty for events in scene.events),
        "contacts": tables.contact_rows(scene),
        "impacts": tables.impact_rows(scene),
        "impact_window": quantity(WINDOW * scene.period, "s") if scene.period else MISSING,
        "information": tables.information_rows(scene),
        "situations": tables.situation_rows(scene),
        "numbers": tables.scene_values(scene.scene),
        "command": scene.command,
        "reliability_figures": reliability.drawings(scene, f"{key}-reliability"),
        "tight": scene.tight
        and _tier(scene.tight) | {"figures": representative(scene.tight, f"{key}-tight")},
    }


def _tier(scene: SceneComparison) -> dict[str, Any]:
    """Return the template data of a scene at one tier."""
    explained = scene.attribution.explained if scene.attribution else float("nan")
    return {
        "tier": scene.tier,
        "verdict": scene.verdict,
        "reason": scene.reason,
        "why": scene.why,
        "confirmation": scene.confirmation,
        "labels": scene.labels,
        "attribution": attribution_words(scene.attribution) if scene.attribution else [],
        "coverage": percent(scene.coverage),
        "explained": percent(explained),
        "channels": [
            tables.channel_row(channel, scene.time, rule.outside(channel))
            for channel in scene.channels.values()
        ],
        "runs": tables.run_rows(scene.provenance),
        "versions": tables.version_lines(scene.provenance),
        "reliability": reliability.section(scene),
    }
