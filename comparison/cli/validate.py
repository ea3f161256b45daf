"""``sixbar validate``: run both models on scenes, compare them, write the report."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from comparison.cli.console import progress, saved, say, warn, warn_about_the_cache
from comparison.cli.layout import wrapped
from comparison.cli.options import (
    REPORTS,
    Accuracy,
    AllowIndeterminate,
    Jobs,
    Models,
    OutFolder,
    Overrides,
    Quiet,
    SceneNames,
    Verbose,
)

if TYPE_CHECKING:
    from comparison.agreement.cross_check import Validation
    from comparison.agreement.results import SceneComparison
    from comparison.report.card import Orders
    from comparison.scene import Scene

INTERRUPTED = 130


def validate(
    scenes: SceneNames = None,
    out: OutFolder = None,
    jobs: Jobs = None,
    accuracy: Accuracy = None,
    models: Models = "reference,exudyn",
    overrides: Overrides = None,
    allow_indeterminate: AllowIndeterminate = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Run scenes by two models, with refined and perturbed runs, compare them, and write a report.

    Stopped by Ctrl-C, it writes the report of the scenes finished by then, marked as incomplete.
    """
    from comparison.agreement.recorded import departures
    from comparison.cli.batches import validate_batches
    from comparison.cli.verdicts import verdict_lines
    from comparison.engines.registry import pair
    from comparison.execution.run import MODELS
    from comparison.execution.workers import cpus
    from comparison.files import check_folder
    from comparison.report.summary import sentence
    from comparison.report.text import EXIT_CODES, exit_code
    from comparison.scene import load_scene, parse_set, shipped_scenes

    both = pair(models)
    changed = parse_set(overrides or [])
    loaded = [load_scene(name, changed) for name in dict.fromkeys(scenes or shipped_scenes())]
    _check(loaded, both, accuracy)
    folder = check_folder(out or REPORTS / (loaded[0].name if len(loaded) == 1 else "validate"))
    warn_about_the_cache()
    options = (
        (["--models", models] if both != MODELS else [])
        + (["--accuracy", accuracy] if accuracy is not None else [])
        + [word for each in overrides or [] for word in ("--set", each)]
    )
    with progress(f"{len(loaded)} scenes" if len(loaded) > 1 else loaded[0].name, quiet=quiet) as report:
        found = validate_batches(loaded, models=both, n_jobs=jobs or cpus(), accuracy=accuracy, report=report)
    results, missing = found.results, [scene.name for scene in found.missing]
    if not results:
        return INTERRUPTED
    comparisons = [_with_command(result.comparison, options) for result in results]
    codes = [
        70 if result.crashed else EXIT_CODES[tier.verdict]
        for result in results
        for tier in result.comparison.tiers
    ]
    code = INTERRUPTED if missing else exit_code(codes, allow_indeterminate=allow_indeterminate)
    command = shlex.join(["sixbar", "validate", *(scenes or []), *options])
    lines = [] if quiet else verdict_lines(comparisons, verbose=verbose)
    said = [sentence(comparisons), _incomplete(comparisons, missing)]
    if both == MODELS and accuracy is None:
        said.append(departures(loaded[: len(results)], comparisons))
    for line in (*lines, *(line for each in said for line in wrapped(each))):
        typer.echo(line)
    results = [replace(one, comparison=of) for one, of in zip(results, comparisons, strict=True)]
    page, kept = saved(lambda folder: _write(results, folder, command, code, missing), folder)
    for line in (*(line for each in kept for line in wrapped(each)), str(page)):
        say(line)
    for scene in loaded[: len(results)]:
        warn([f"scene {scene.name!r}: {warning}" for warning in scene.warnings])
    return code


def _check(scenes: Sequence[Scene], models: tuple[str, str], accuracy: str | None) -> None:
    """Refuse what is known to be wrong before anything runs.

    Raises
    ------
    SceneError
        If two scenes have one name.
    AccuracyError
        If the accuracy is out of reach.
    """
    from comparison.accuracy.levels import solver_values
    from comparison.scene import SceneError

    names = [scene.name for scene in scenes]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a report must be unique")
    if accuracy is not None:
        for scene in scenes:
            for model in models:
                solver_values(model, accuracy, scene)


def _with_command(comparison: SceneComparison, options: Sequence[str]) -> SceneComparison:
    """Return a comparison whose command has all options: its job knows nothing of overrides."""
    if "--set" not in options:
        return comparison
    changes = options[options.index("--set") :]
    of_scene = f"{comparison.command} {shlex.join(changes)}"
    tight = comparison.tight and replace(comparison.tight, command=of_scene)
    return replace(comparison, command=of_scene, tight=tight)


def _incomplete(comparisons: Sequence[SceneComparison], missing: Sequence[str]) -> str:
    """Return which scenes were not compared; nothing if all were."""
    if not missing:
        return ""
    total = len(comparisons) + len(missing)
    return (
        f"Incomplete: interrupted after {len(comparisons)} of {total} scenes. Not compared: "
        f"{', '.join(missing)}."
    )


def _write(
    results: Sequence[Validation], folder: Path, command: str, code: int, missing: Sequence[str]
) -> tuple[Path, list[str]]:
    """Write the report with its tables and summaries; return its path, and where partial results are.

    Tables of an earlier call are deleted where there is none now: they would appear to belong to this report.
    """
    from comparison.agreement.observed_order import observed_orders
    from comparison.files import replacing_in, write_json, write_text
    from comparison.report.text import as_mapping
    from comparison.tables.table import write

    comparisons = [result.comparison for result in results]
    kept = []
    with replacing_in(folder) as part:
        page = write_page(comparisons, part, command, observed_orders(results), missing)
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
                "not_compared": list(missing),
                "scenes": [as_mapping(comparison) for comparison in comparisons],
            },
            part / "summary.json",
        )
        _write_for_ci(comparisons, part, command, missing)
        new = {path.name for path in part.rglob("*")}
    for name in (*missing, *(comparison.name for comparison in comparisons)):
        stale = [*(folder / "tables").glob(f"{escape(name)}.*.partial.*")]
        stale += folder.glob(f"{escape(name)}.*.traceback.txt")
        for model in comparisons[0].labels:
            stale += [folder / "tables" / f"{name}-{model}{end}" for end in (".csv", ".events.csv", ".json")]
        for path in stale:
            if path.name not in new:
                path.unlink(missing_ok=True)
    return folder / page.name, kept


def write_page(
    comparisons: Sequence[SceneComparison],
    folder: Path,
    command: str,
    orders: Orders | None = None,
    missing: Sequence[str] = (),
) -> Path:
    """Write the report of one or more scenes into a folder and return its path.

    Its title says so where scenes are missing.
    """
    from comparison.report import write_report
    from comparison.report.origin import origin

    total = len(comparisons) + len(missing)
    title = comparisons[0].title if total == 1 else "Cross-validation of the two models"
    if missing:
        title += f" (incomplete: {len(comparisons)} of {total} scenes)"
    return write_report(comparisons, folder, title=title, command=command, origin=origin(), orders=orders)


def _write_for_ci(
    comparisons: Sequence[SceneComparison], folder: Path, command: str, missing: Sequence[str]
) -> None:
    """Write the files for continuous integration: JUnit XML and a Markdown summary."""
    from comparison.agreement.cases import Case, of_comparisons
    from comparison.report.job_summary import write_job_summary
    from comparison.report.junit import write_junit
    from comparison.report.summary import sentence

    cases = [
        *of_comparisons(comparisons),
        *(Case(name, "standard", "verdict", "error", "not compared: interrupted") for name in missing),
    ]
    write_junit(cases, folder / "junit.xml", name="sixbar validate")
    said = [sentence(comparisons), _incomplete(comparisons, missing), f"Made by: {command}"]
    write_job_summary(
        folder / "summary.md",
        title="Cross-validation of the two models",
        reported=[line for line in said if line],
        headings=("scene", "tier", "verdict", "why"),
        rows=[(c.name, tier.tier, tier.verdict, tier.why) for c in comparisons for tier in c.tiers],
        cases=cases,
    )
