"""The verdicts of all shipped scenes in one table, and the picture of the README."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from comparison.agreement.cross_check import validate
from comparison.agreement.recorded import as_toml
from comparison.agreement.results import SceneComparison
from comparison.engines.platform import made_on
from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.formatting import MISSING, percent, table
from comparison.report.gallery import figures
from comparison.report.summary import largest_predictable
from comparison.report.svg import standalone, style
from comparison.scene import load_scene, shipped_scenes

WANTED = 1e-9
"""m; of x between the models at the tight tier, on the predictable samples."""
ABOVE = "†"
"""Marks a difference that is not as small as wanted."""
RECORD = "verdicts.toml"
"""What `comparison.agreement.recorded` reads, in the study's folder; ``make reports`` packages it."""
PICTURE_OF = ("150rpm-0.2mm", "slider_x")
HEADINGS = (
    "scene",
    "standard tier",
    "channels that agree",
    "samples predictable",
    "of these explained",
    "largest difference of x, first cycle",
    "largest difference of x, whole run",
    "tight tier",
    "samples predictable, tight",
    "of these explained, tight",
    "largest difference of x, tight, predictable samples",
)
TEXT = """# Verdicts

Both models on every shipped scene at two tiers. Standard: each model at the scene's setting. Tight: the
reference at its strict setting against Exudyn on what the drive leaves free, with error control; a scene
without clearance runs all five bodies as it says. Explained are the samples whose difference is within twice
the numerical uncertainty of both runs; wanted are at least 99 %. Predictable are the samples where this
uncertainty is small against the channel's scale; the share of a scene is the mean over its excited channels,
of which one without a sample to judge counts as zero, and is what its verdict holds against the floor.

{table}

{notes}
"""
NOTE = (
    f"{ABOVE} above the {WANTED:.0e} m that is wanted of x at the tight tier; the verdict holds the "
    "difference against the numerical uncertainty of both runs instead, which is not that small there."
)


def row(scene: SceneComparison) -> list[str]:
    """Return a scene's line of the table."""
    cells = [scene.title, _verdict(scene)]
    if scene.channels:
        excited = [c for c in scene.channels.values() if c.verdict != "unexcited"]
        agreeing = sum(c.verdict == "agree" for c in excited)
        x = np.abs(scene.channels["slider_x"].difference)
        first = x[scene.time <= (scene.period or np.inf)].max()
        cells += [f"{agreeing} of {len(excited)}", *_shares(scene), f"{first:.1e} m", f"{x.max():.1e} m"]
    else:
        cells += [MISSING] * 5
    if scene.tight is None:
        return cells + ["not run"] + [MISSING] * 3
    cells.append(_verdict(scene.tight))
    if not scene.tight.channels:
        return cells + [MISSING] * 3
    x_tight = largest_predictable(scene.tight.channels["slider_x"])
    mark = f" {ABOVE}" if x_tight > WANTED else ""
    return [*cells, *_shares(scene.tight), MISSING if np.isnan(x_tight) else f"{x_tight:.1e} m{mark}"]


def _verdict(scene: SceneComparison) -> str:
    told = f"**{scene.verdict}**"
    return told if scene.confirmation is None else f"{told} ({scene.confirmation.mark})"


def _shares(scene: SceneComparison) -> tuple[str, str]:
    explained = np.nan if scene.attribution is None else scene.attribution.explained
    return percent(scene.coverage), percent(explained)


def picture(scene: SceneComparison, channel: str) -> str:
    """Return the report's figure of one channel as an SVG file of its own."""
    with style():
        drawings = figures(scene, "readme")
    label = scene.channels[channel].label
    return standalone(next(drawing.svg for drawing in drawings[1:] if drawing.heading.startswith(label)))


def text(comparisons: Sequence[SceneComparison], made: Mapping[str, str]) -> str:
    """Return the study's README; `made` says on which "machine" and on which "date"."""
    rows = [row(comparison) for comparison in comparisons]
    notes = [NOTE] if any(ABOVE in row[-1] for row in rows) else []
    notes.append(f"Made on {made['machine']}; {made['date']}.")
    return TEXT.format(table=table(HEADINGS, rows), notes="\n\n".join(notes))


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Validate all shipped scenes and write the table, the picture, and the verdicts to be recorded."""
    scenes = [load_scene(name) for name in shipped_scenes()]
    comparisons = [result.comparison for result in validate(scenes, n_jobs=n_jobs, on_progress=on_progress)]
    drawn = next(comparison for comparison in comparisons if comparison.name == PICTURE_OF[0])
    made = {"machine": made_on(), "date": datetime.now(UTC).date().isoformat()}
    for name, content in (
        ("slider_x.svg", picture(drawn, PICTURE_OF[1])),
        ("README.md", text(comparisons, made)),
        (RECORD, as_toml(scenes, comparisons, made)),
    ):
        with replacing(folder / name) as part:
            part.write_text(content, "utf-8")
