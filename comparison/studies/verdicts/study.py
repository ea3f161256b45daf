"""The verdicts of all shipped scenes in one table, and the picture of the README."""

from collections.abc import Sequence
from datetime import UTC, datetime
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.files import write_text
from comparison.formatting import MISSING, percent
from comparison.models import made_on
from comparison.report.figures import channel_figure
from comparison.report.svg import standalone
from comparison.scene import load_scene, shipped_scenes
from comparison.studies.shared.study import Study, markdown, write_csv
from comparison.verdict.overall import as_toml
from comparison.verdict.results import SceneComparison
from comparison.verdict.validate import validate
from comparison.words.verdicts import headline, mark

TARGET = 1e-9  # m; of the difference of x at the tight tier, on the predictable samples
ABOVE = "†"  # marks a larger one
RECORD = "verdicts.toml"
"""What `comparison.verdict.validate` reads, in the study's folder; ``make reports`` packages it."""
X = "largest difference of x"
SHOWN = [
    "scene", "standard tier", "channels that agree", "samples predictable", X,
    "tight tier", "channels that agree, tight", "samples predictable, tight", f"{X}, tight",
]  # fmt: skip
"""Columns of `row` on the page; all are in ``verdicts.csv``."""


class Results(NamedTuple):
    """Comparisons of scenes, and on which ``"machine"`` and ``"date"`` they were made."""

    comparisons: Sequence[SceneComparison]
    made: dict[str, str]


def measure(scenes: Sequence[str], n_jobs: int, on_progress: Progress | None) -> Results:
    """Validate scenes at both tiers."""
    results = validate([load_scene(name) for name in scenes], n_jobs=n_jobs, on_progress=on_progress)
    made = {"machine": made_on(), "date": datetime.now(UTC).date().isoformat()}
    return Results([result.comparison for result in results], made)


def page(results: Results) -> dict[str, str]:
    """Return what stands in the page."""
    rows = pd.DataFrame(map(row, results.comparisons))
    texts = {"finding": headline(results.comparisons), "table": markdown(rows[SHOWN])}
    return texts | results.made | {"above": ABOVE, "target": f"{TARGET:.0e}"}


def row(scene: SceneComparison) -> dict[str, str]:
    """Return a scene's line of the table."""
    tight, all_samples = scene.tight, nan
    if scene.channels:
        all_samples = scene.channels["slider_x"].max_difference
    both = _tier(scene, "") | _tier(tight, ", tight")
    if tight and tight.channels and tight.channels["slider_x"].largest_predictable > TARGET:
        both[f"{X}, tight"] += f" {ABOVE}"
    return {
        "scene": scene.title,
        "standard tier": _verdict(scene),
        "tight tier": _verdict(tight),
        **both,
        f"{X}, all samples": _metres(all_samples),
    }


def _verdict(scene: SceneComparison | None) -> str:
    if scene is None:
        return "not run"
    return f"**{scene.verdict}**" + (f" ({mark(scene)})" if mark(scene) else "")


def _tier(scene: SceneComparison | None, tier: str) -> dict[str, str]:
    agree = predictable = explained = x = MISSING
    if scene is not None and scene.channels:
        excited = [each.verdict for each in scene.channels.values() if each.verdict != "unexcited"]
        agree = f"{excited.count('agree')} of {len(excited)}"
        predictable = percent(scene.coverage, scene.coverage_error)
        explained = percent(scene.attribution.explained) if scene.attribution else MISSING
        x = _metres(scene.channels["slider_x"].largest_predictable)
    return {
        f"channels that agree{tier}": agree,
        f"samples predictable{tier}": predictable,
        f"of these explained{tier}": explained,
        f"{X}{tier}": x,
    }


def _metres(value: float) -> str:
    return MISSING if np.isnan(value) else f"{value:.1e} m"


def draw(results: Results, folder: Path) -> None:
    """Write the picture of the README, the verdicts to be recorded and the whole table."""
    named = {comparison.name: comparison for comparison in results.comparisons}
    shown = named["150rpm-0.2mm"]
    figure = channel_figure(shown, shown.channels["slider_x"], "readme")
    write_text(standalone(figure), folder / "slider_x.svg")
    record = as_toml([load_scene(name) for name in named], results.comparisons, results.made)
    write_text(record, folder / RECORD)
    table = pd.DataFrame(map(row, results.comparisons)).replace(r"\*\*", "", regex=True)
    write_csv({"verdicts": table}, folder)


# The table of the README has all of them in any case.
STUDY = Study(
    "verdicts", small=shipped_scenes(), full=shipped_scenes(), measure=measure, page=page, draw=draw
)
