"""The verdicts of all shipped scenes in one table, and the picture of the README."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from comparison.files import replacing
from comparison.report.gallery import figures
from comparison.report.markdown import table
from comparison.report.quantity import MISSING
from comparison.report.svg import standalone, style
from comparison.run import Progress
from comparison.scene import load_scene, shipped_scenes
from comparison.validation import validate
from comparison.verdict import SceneComparison

PICTURE_OF = ("150rpm-0.2mm", "slider_x")
HEADINGS = (
    "scene",
    "verdict",
    "channels that agree",
    "samples predictable",
    "largest difference of x, first cycle",
    "largest difference of x, whole run",
)


def row(scene: SceneComparison) -> list[str]:
    """Return a scene's line of the table."""
    start = [scene.title, f"**{scene.verdict}**"]
    if not scene.channels:
        return start + [MISSING] * (len(HEADINGS) - len(start))
    excited = [c for c in scene.channels.values() if c.verdict != "unexcited"]
    agreeing = sum(c.verdict == "agree" for c in excited)
    coverage = float(np.mean([c.coverage for c in excited])) if excited else 0.0
    x = np.abs(scene.channels["slider_x"].difference)
    first = x[scene.time <= (scene.period or np.inf)].max()
    return [*start, f"{agreeing} of {len(excited)}", f"{coverage:.0%}", f"{first:.1e} m", f"{x.max():.1e} m"]


def picture(scene: SceneComparison, channel: str) -> str:
    """Return the report's figure of one channel as an SVG file of its own."""
    with style():
        drawings = figures(scene, "readme")
    label = scene.channels[channel].label
    return standalone(next(drawing.svg for drawing in drawings[1:] if drawing.heading.startswith(label)))


def text(comparisons: Sequence[SceneComparison]) -> str:
    """Return the study's README."""
    verdicts = table(HEADINGS, [row(comparison) for comparison in comparisons])
    return f"# Verdicts\n\nBoth models on every shipped scene, each at its standard setting.\n\n{verdicts}\n"


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Validate all shipped scenes and write the table and the picture."""
    scenes = [load_scene(name) for name in shipped_scenes()]
    comparisons = [result.comparison for result in validate(scenes, n_jobs=n_jobs, on_progress=on_progress)]
    drawn = next(comparison for comparison in comparisons if comparison.name == PICTURE_OF[0])
    for name, content in (
        ("slider_x.svg", picture(drawn, PICTURE_OF[1])),
        ("README.md", text(comparisons)),
    ):
        with replacing(folder / name) as part:
            part.write_text(content, "utf-8")
