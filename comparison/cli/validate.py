"""``sixbar validate``: run both models on scenes, compare them, write the report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from comparison.cli.console import saved, say, warn, warn_about_the_cache
from comparison.cli.layout import wrapped
from comparison.cli.options import (
    REPORTS,
    Accuracy,
    AllowIndeterminate,
    Jobs,
    Models,
    OutFolder,
    Overrides,
    Quick,
    Quiet,
    SceneNames,
    Verbose,
)
from comparison.cli.pages import write_validation
from comparison.cli.pairwise import validate_pairs
from comparison.cli.progress import progress

if TYPE_CHECKING:
    from comparison.scene import Scene

INTERRUPTED = 130
MAIN = "150rpm-0.2mm"
"""The paper's central case."""


def validate(
    scenes: SceneNames = None,
    out: OutFolder = None,
    jobs: Jobs = None,
    accuracy: Accuracy = None,
    models: Models = "reference,exudyn",
    overrides: Overrides = None,
    allow_indeterminate: AllowIndeterminate = False,
    quick: Quick = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> int:
    """Run scenes by two models, with refined and perturbed runs, compare them, and write a report.

    With more than two models each pair is compared, and the report says which model stands alone.
    Stopped by Ctrl-C, it writes the report of the scenes finished by then, marked as incomplete.
    """
    from comparison.accuracy.tiers import TIERS
    from comparison.engines.registry import pair, several
    from comparison.execution.job import MODELS
    from comparison.scene import command_line, load_scene, name_with, parse_set, shipped_scenes
    from comparison.verdict.validate import options

    changed, tiers = parse_set(overrides or []), TIERS[:1] if quick else TIERS
    names = models.split(",")
    command = command_line("validate", scenes or [], changed, options(names, accuracy, tiers))
    if len(names) > 2:
        return validate_pairs(
            several(models),
            out or REPORTS / name_with("pairwise", changed),
            command,
            lambda two, own: validate(
                scenes, own, jobs, accuracy, two, overrides, allow_indeterminate, quick, verbose, quiet
            ),
        )
    from comparison.cli.batches import validate_batches
    from comparison.cli.verdicts import verdict_lines
    from comparison.execution.worker_process import kept_workers
    from comparison.execution.workers import cpus
    from comparison.files import check_folder
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.verdict.shipped import departures, verdicts_record
    from comparison.words.verdicts import departures as departure_line
    from comparison.words.verdicts import headline, incomplete

    both = pair(models)
    loaded = [
        load_scene(name, changed) for name in dict.fromkeys(scenes or ([MAIN] if quick else shipped_scenes()))
    ]
    _check(loaded, both, accuracy)
    folder = check_folder(
        out or REPORTS / (loaded[0].name if len(loaded) == 1 else name_with("validate", changed))
    )
    warn_about_the_cache()
    with kept_workers():
        with progress(f"{len(loaded)} scenes" if len(loaded) > 1 else loaded[0].name, quiet=quiet) as report:
            found = validate_batches(
                loaded,
                models=both,
                n_jobs=jobs or cpus(),
                accuracy=accuracy,
                tiers=tiers,
                report=report,
            )
        results, missing = found.results, [scene.name for scene in found.missing]
        if not results:
            return INTERRUPTED
        comparisons = [result.comparison for result in results]
        codes = [
            70 if result.crashed else EXIT_CODES[tier.verdict]
            for result in results
            for tier in result.comparison.tiers
        ]
        code = INTERRUPTED if missing else exit_code(codes, allow_indeterminate=allow_indeterminate)
        lines = [] if quiet else verdict_lines(comparisons, verbose=verbose)
        said = [headline(comparisons), incomplete(comparisons, missing)]
        if both == MODELS and accuracy is None:
            record = verdicts_record()
            departed = departures(loaded[: len(results)], comparisons, record)
            said.append(departure_line(departed, record["made"]))
        for line in (*lines, *(line for each in said for line in wrapped(each))):
            typer.echo(line)
    page, kept = saved(lambda folder: write_validation(results, folder, command, code, missing), folder)
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
