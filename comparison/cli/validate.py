"""``sixbar validate``: run both models on scenes, compare them, write the report."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli.console import progress, saved, say, warn_about_the_cache
from comparison.cli.options import REPORTS, Accuracy, AllowIndeterminate, Jobs, Models, OutFolder

if TYPE_CHECKING:
    from comparison.agreement.cross_check import Validation
    from comparison.agreement.results import SceneComparison


def validate(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCENE]...", help="Shipped names or TOML files.", show_default="all"),
    ] = None,
    out: OutFolder = None,
    jobs: Jobs = None,
    accuracy: Accuracy = None,
    models: Models = "reference,exudyn",
    allow_indeterminate: AllowIndeterminate = False,
) -> int:
    """Run scenes by two models, with refined and perturbed runs, compare them, and write a report."""
    from comparison.agreement.cross_check import validate as validate_scenes
    from comparison.agreement.recorded import departures
    from comparison.engines.registry import pair
    from comparison.execution.run import MODELS
    from comparison.execution.workers import cpus
    from comparison.files import check_folder
    from comparison.report.text import EXIT_CODES, exit_code, scene_lines
    from comparison.scene import SceneError, load_scene, shipped_scenes

    both = pair(models)
    loaded = [load_scene(name) for name in dict.fromkeys(scenes or shipped_scenes())]
    names = [scene.name for scene in loaded]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a report must be unique")
    folder = out or REPORTS / (names[0] if len(names) == 1 else "validate")
    folder = check_folder(folder)
    warn_about_the_cache()
    with progress(f"{len(names)} scenes by both models" if len(names) > 1 else names[0]) as report:
        results = validate_scenes(
            loaded, models=both, n_jobs=jobs or cpus(), accuracy=accuracy, on_progress=report
        )
    comparisons = [result.comparison for result in results]
    codes = [
        70 if result.crashed else EXIT_CODES[tier.verdict]
        for result in results
        for tier in result.comparison.tiers
    ]
    code = exit_code(codes, allow_indeterminate=allow_indeterminate)
    command = shlex.join(
        ["sixbar", "validate", *(scenes or [])]
        + (["--models", models] if both != MODELS else [])
        + (["--accuracy", accuracy] if accuracy is not None else [])
    )
    for line in scene_lines(comparisons):
        say(line)
    page, kept = saved(lambda folder: _write(results, folder, command, code), folder)
    for line in kept:
        say(line)
    if both == MODELS and accuracy is None and (reported := departures(loaded, comparisons)):
        say(reported)
    say(str(page))
    return code


def _write(results: Sequence[Validation], folder: Path, command: str, code: int) -> tuple[Path, list[str]]:
    """Write the report with its tables and summaries; return its path, and where partial results are.

    Tables of an earlier call are deleted: they would appear to belong to this report.
    """
    from comparison.files import replacing_in, write_json, write_text
    from comparison.report.text import as_mapping
    from comparison.tables.table import write

    comparisons = [result.comparison for result in results]
    kept = []
    with replacing_in(folder) as part:
        page = write_page(comparisons, part, command)
        for result in results:
            for model, run in result.runs.items():
                write(run.base, part / "tables" / f"{result.comparison.name}-{model}.csv")
            for which, table in result.partial.items():
                name = f"{result.comparison.name}.{which.replace(' ', '-')}.partial.csv"
                write(table, part / "tables" / name)
                kept.append(
                    f"{len(table.frame)} samples of the {which} run are in {folder / 'tables' / name}"
                )
            for which, text in result.tracebacks.items():
                name = f"{result.comparison.name}.{which.replace(' ', '-')}.traceback.txt"
                write_text(text, part / name)
                kept.append(f"the traceback of the {which} run is in {folder / name}")
        write_json(
            {
                "command": command,
                "exit_code": code,
                "scenes": [as_mapping(comparison) for comparison in comparisons],
            },
            part / "summary.json",
        )
        _write_for_ci(comparisons, part, command)
        new = {path.name for path in part.rglob("*")}
    for result in results:
        name = result.comparison.name
        stale = [*(folder / "tables").glob(f"{escape(name)}.*.partial.*")]
        stale += folder.glob(f"{escape(name)}.*.traceback.txt")
        for model in result.comparison.labels:
            stale += [folder / "tables" / f"{name}-{model}{end}" for end in (".csv", ".events.csv", ".json")]
        for path in stale:
            if path.name not in new:
                path.unlink(missing_ok=True)
    return folder / page.name, kept


def write_page(comparisons: Sequence[SceneComparison], folder: Path, command: str) -> Path:
    """Write the report of one or more scenes into a folder and return its path."""
    from comparison.report import write_report

    title = comparisons[0].title if len(comparisons) == 1 else "Cross-validation of the two models"
    return write_report(comparisons, folder, title=title, command=command)


def _write_for_ci(comparisons: Sequence[SceneComparison], folder: Path, command: str) -> None:
    """Write the files for continuous integration: JUnit XML and a Markdown summary."""
    from comparison.agreement.cases import of_comparisons
    from comparison.report.job_summary import write_job_summary
    from comparison.report.junit import write_junit
    from comparison.report.summary import sentence

    cases = of_comparisons(comparisons)
    write_junit(cases, folder / "junit.xml", name="sixbar validate")
    write_job_summary(
        folder / "summary.md",
        title="Cross-validation of the two models",
        reported=[sentence(comparisons), f"Made by: {command}"],
        headings=("scene", "tier", "verdict", "why"),
        rows=[(c.name, tier.tier, tier.verdict, tier.why) for c in comparisons for tier in c.tiers],
        cases=cases,
    )
