"""The verdicts of all shipped scenes in one table, and the picture of the README."""

from collections.abc import Sequence
from datetime import UTC, datetime
from math import isnan
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from comparison.execution.run import Progress
from comparison.files import write_text
from comparison.formatting import MISSING, percent
from comparison.models import machine_and_versions
from comparison.report.figures import channel_figure
from comparison.report.svg import standalone
from comparison.scene import load_scene, shipped_scenes
from comparison.scene.keys import toml
from comparison.studies.shared.study import Study, markdown
from comparison.verdict.results import SceneComparison
from comparison.verdict.validate import validate
from comparison.words.verdicts import headline, mark

TARGET = 1e-9  # m; of the difference of x at the tight tier, on the predictable samples
DAGGER = "†"  # marks a larger one
RECORD = "verdicts.toml"
"""Of each scene the verdicts of the README, and the hash of the numbers that they belong to."""
X_HEADING = "largest difference of x"


class Results(NamedTuple):
    """Comparisons of scenes, and their origin: ``"machine"`` and ``"date"``."""

    comparisons: Sequence[SceneComparison]
    origin: dict[str, str]


def measure(scenes: Sequence[str], n_jobs: int, on_progress: Progress | None) -> Results:
    """Validate scenes at both tiers."""
    results = validate([load_scene(name) for name in scenes], n_jobs=n_jobs, on_progress=on_progress)
    origin = {"machine": machine_and_versions(), "date": datetime.now(UTC).date().isoformat()}
    return Results([result.comparison for result in results], origin)


def page(results: Results) -> dict[str, str]:
    """Return the variables of the template."""
    rows = pd.DataFrame(map(row, results.comparisons))
    texts = {"finding": headline(results.comparisons), "table": markdown(rows)}
    return texts | results.origin | {"above": DAGGER, "target": f"{TARGET:.0e}"}


def row(scene: SceneComparison) -> dict[str, str]:
    """Return a scene's line of the table."""
    tight = scene.tight
    cells = {"scene": scene.title, "standard tier": _verdict(scene), **_tier(scene, "")}
    cells |= {"tight tier": _verdict(tight), **_tier(tight, ", tight")}
    if tight and tight.channels and tight.channels["slider_x"].largest_predictable > TARGET:
        cells[f"{X_HEADING}, tight"] += f" {DAGGER}"
    return cells


def _verdict(scene: SceneComparison | None) -> str:
    if scene is None:
        return "not run"
    return f"**{scene.verdict}**" + (f" ({mark(scene)})" if mark(scene) else "")


def _tier(scene: SceneComparison | None, tier: str) -> dict[str, str]:
    agree = predictable = x = MISSING
    if scene is not None and scene.channels:
        verdicts = [each.verdict for each in scene.channels.values() if each.verdict != "unexcited"]
        agree = f"{verdicts.count('agree')} of {len(verdicts)}"
        predictable = percent(scene.coverage, scene.coverage_error)
        largest = scene.channels["slider_x"].largest_predictable
        x = MISSING if isnan(largest) else f"{largest:.1e} m"
    return {
        f"channels that agree{tier}": agree,
        f"samples predictable{tier}": predictable,
        f"{X_HEADING}{tier}": x,
    }


def draw(results: Results, folder: Path) -> None:
    """Write the picture of the README and the verdicts to be recorded."""
    comparisons = {comparison.name: comparison for comparison in results.comparisons}
    central = comparisons["150rpm-0.2mm"]
    figure = channel_figure(central, central.channels["slider_x"], "readme")
    write_text(standalone(figure), folder / "slider_x.svg")
    lines = ["[made]", *(f"{key} = {toml(value)}" for key, value in results.origin.items())]
    for name, comparison in comparisons.items():
        lines += ["", f"[scenes.{toml(name)}]", f"hash = {toml(load_scene(name).hash)}"]
        lines += [f"{tier.tier} = {toml(tier.verdict)}" for tier in comparison.tiers]
    write_text("\n".join(lines) + "\n", folder / RECORD)


# The table of the README has all of them in any case.
STUDY = Study(
    "verdicts", small=shipped_scenes(), full=shipped_scenes(), measure=measure, page=page, draw=draw
)
