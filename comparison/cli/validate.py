"""``sixbar validate``: run both models on scenes, compare them, write the report."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli.console import progress
from comparison.cli.options import REPORTS, Accuracy, AllowIndeterminate, Jobs, Models, OutFolder
from comparison.cli.pairwise import validate_pairs

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
    """Run scenes by two models, with refined and perturbed runs, compare them, and write a report.

    With more than two models each pair is compared, and the report says which model stands alone.
    """
    if models.count(",") > 1:
        from comparison.engines.registry import several

        return validate_pairs(
            several(models),
            out or REPORTS / "pairwise",
            _command(scenes, models, accuracy),
            lambda two, own: validate(scenes, own, jobs, accuracy, two, allow_indeterminate),
        )
    from comparison.agreement.cross_check import validate as validate_scenes
    from comparison.agreement.recorded import departures
    from comparison.engines.registry import pair
    from comparison.execution.run import MODELS
    from comparison.execution.workers import cpus
    from comparison.files import check_folder, write_json
    from comparison.report.text import EXIT_CODES, as_mapping, exit_code, scene_lines
    from comparison.scene import SceneError, load_scene, shipped_scenes
    from comparison.tables.table import write

    both = pair(models)
    loaded = [load_scene(name) for name in dict.fromkeys(scenes or shipped_scenes())]
    names = [scene.name for scene in loaded]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a report must be unique")
    folder = out or REPORTS / (names[0] if len(names) == 1 else "validate")
    check_folder(folder)
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
    command = _command(scenes, models if both != MODELS else "", accuracy)
    page = write_page(comparisons, folder, command)
    for result in results:
        for model in result.comparison.labels:
            path = folder / "tables" / f"{result.comparison.name}-{model}.csv"
            if model in result.runs:
                write(result.runs[model].base, path)
            else:
                path.unlink(missing_ok=True)  # from an earlier call: it would appear to belong to this report
    kept = _write_partial(results, folder / "tables")
    write_json(
        {
            "command": command,
            "exit_code": code,
            "scenes": [as_mapping(comparison) for comparison in comparisons],
        },
        folder / "summary.json",
    )
    _write_for_ci(comparisons, folder, command)
    for line in (*scene_lines(comparisons), *kept):
        typer.echo(line)
    if both == MODELS and accuracy is None and (reported := departures(loaded, comparisons)):
        typer.echo(reported)
    typer.echo(str(page))
    return code


def _command(scenes: list[str] | None, models: str, accuracy: str | None) -> str:
    return shlex.join(
        ["sixbar", "validate", *(scenes or [])]
        + (["--models", models] if models else [])
        + (["--accuracy", accuracy] if accuracy is not None else [])
    )


def _write_partial(results: Sequence[Validation], folder: Path) -> list[str]:
    """Write the tables of unsuccessful runs, return their locations; delete those of an earlier call."""
    from comparison.tables.table import write

    for result in results:
        for path in folder.glob(f"{escape(result.comparison.name)}.*.partial.*"):
            path.unlink()
    reported = []
    for result in results:
        for which, table in result.partial.items():
            name = f"{result.comparison.name}.{which.replace(' ', '-')}.partial.csv"
            kept = write(table, folder / name)
            reported.append(f"{len(table.frame)} samples of the {which} run are in {kept}")
    return reported


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
