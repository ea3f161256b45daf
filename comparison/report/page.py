"""The report: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from markupsafe import Markup

from comparison.files import replacing
from comparison.formatting import MISSING, percent, quantity
from comparison.metrics.contacts import WINDOW
from comparison.reliability.difference import MARGIN
from comparison.report import overview, reliability, svg, tables
from comparison.report.compact import compact
from comparison.report.gallery import Drawing, figures, is_derived, representative
from comparison.report.origin import Origin
from comparison.report.plot_data import plot_data
from comparison.report.schematic import Schematic, schematic
from comparison.report.templates import ASSETS, TEMPLATES, script_hash, style
from comparison.verdict.results import SceneComparison, rank
from comparison.words import verdicts as words


def _script() -> str:
    """Return the page's script: the plotting library with its licence, then ours."""
    library = ASSETS / "uplot"
    licence = (library / "LICENSE").read_text("utf-8")
    parts = [(ASSETS / name).read_text("utf-8") for name in ("animation.js", "plots.js")]
    return "\n".join([f"/* uPlot\n{licence}*/", (library / "uPlot.iife.min.js").read_text("utf-8"), *parts])


def write_report(
    comparisons: Sequence[SceneComparison],
    out: Path,
    *,
    title: str,
    command: str,
    origin: Origin | None = None,
) -> Path:
    """Write ``report.html`` into a folder.

    Parameters
    ----------
    comparisons
        Scenes, shown with the worst verdict first; they may have no channels ("cannot compare").
    out
        The folder, created if missing. An existing report is replaced once the new one is complete.
    title
        Heading of the page.
    command
        Command that reproduces the whole report.
    origin
        Of the report; None: not stated.

    Returns
    -------
    path
        Path of the page. Equal arguments give identical bytes.
    """
    html = render(comparisons, title=title, command=command, origin=origin)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "report.html"
    with replacing(path) as part:
        part.write_text(html, "utf-8")
    return path


def render(
    comparisons: Sequence[SceneComparison],
    *,
    title: str,
    command: str,
    origin: Origin | None = None,
) -> str:
    """Return the page as text; see `write_report`."""
    comparisons = overview.failing_first(comparisons)
    keys = [f"s{n}" for n in range(len(comparisons))]
    script = _script()
    plot_style = Markup((ASSETS / "uplot" / "uPlot.min.css").read_text("utf-8") + "\n")
    with svg.style():
        scenes = [_scene(scene, key, shown=key == "s0") for scene, key in zip(comparisons, keys, strict=True)]
    return TEMPLATES.get_template("report.html.j2").render(
        title=title,
        command=command,
        overall={"verdict": words.overall_verdict(comparisons), "sentence": words.headline(comparisons)},
        failing=overview.failing(comparisons, keys),
        grid=overview.grid(comparisons, keys),
        tiers=overview.tiers(comparisons),
        channel_grid=overview.channel_grid(comparisons, keys),
        ratio=words.ratio(comparisons),
        models=overview.models(comparisons),
        origin=origin,
        schematic=_representative([scene["schematic"] for scene in scenes]),
        scenes=scenes,
        reliability=any(scene.reliability is not None for scene in comparisons),
        margin=MARGIN,
        symbols=words.SYMBOLS,
        definition=words.definition(comparisons),
        contact_headings=tables.CONTACT_HEADINGS,
        information_headings=list(tables.INFORMATION_HEADINGS.values()),
        css=plot_style + style(),
        script=Markup(script),
        script_hash=script_hash(script),
    )


def _representative(drawings: Sequence[Schematic | None]) -> Schematic | None:
    """Return the first drawing with a clearance, else the first of all."""
    found = [drawing for drawing in drawings if drawing is not None]
    return next((drawing for drawing in found if drawing.geometry["magnified"]), found[0] if found else None)


def _scene(scene: SceneComparison, key: str, *, shown: bool) -> dict[str, Any]:
    """Return the template data of one scene; ``key`` is the prefix of its ids."""
    usual = _tier(scene)
    rows = {row["name"]: row for row in usual["channels"]}
    return usual | {
        "key": key,
        "open": shown,
        "name": scene.name,
        "title": scene.title,
        "description": scene.description,
        "shift": words.shift_line(scene),
        "warnings": scene.warnings,
        "schematic": schematic(scene.scene),
        "plots": _plots(scene),
        "figures": _compact(figures(scene, key)),
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
        "reliability_figures": _compact(reliability.drawings(scene, f"{key}-reliability")),
        "tight": scene.tight
        and _tier(scene.tight) | {"figures": _compact(representative(scene.tight, f"{key}-tight"))},
    }


def _compact(drawings: Sequence[Drawing]) -> list[Drawing]:
    return [replace(drawing, svg=Markup(compact(drawing.svg))) for drawing in drawings]


def _plots(scene: SceneComparison) -> list[dict[str, str]]:
    """Return the data of the plots by tier, that with the worst verdict first."""
    tiers = sorted(scene.tiers, key=lambda tier: -rank(tier.verdict))
    packed = [{"tier": tier.tier, "text": plot_data(tier)} for tier in tiers]
    return [data for data in packed if data["text"]]


def _tier(scene: SceneComparison) -> dict[str, Any]:
    """Return the template data of a scene at one tier."""
    return {
        "tier": scene.tier,
        "verdict": scene.verdict,
        "reason": words.scene_reason(scene),
        "card": words.card(scene),
        "confirmation": words.confirmation(scene),
        "suspicious": scene.confirmation is not None and scene.confirmation.suspicious,
        "labels": scene.labels,
        "attribution": words.attribution_lines(scene),
        "coverage": percent(scene.coverage, scene.coverage_error),
        "explained": percent(scene.attribution.explained),
        "channels": [tables.channel_row(channel, scene.time) for channel in scene.channels.values()],
        "runs": tables.run_rows(scene.provenance),
        "versions": tables.version_lines(scene.provenance),
        "reliability": reliability.section(scene),
    }
