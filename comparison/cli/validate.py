"""``sixbar validate``: run two models, or more in pairs, on scenes, compare them, write the report.

Scenes are validated in batches: what is finished survives an interruption, or the fault of one scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from comparison.cli.console import (
    described,
    is_refusal,
    print_json,
    saved,
    say,
    warn,
    warn_about_the_cache,
    wrapped,
)
from comparison.cli.options import (
    MAIN,
    REPORTS,
    Accuracy,
    AllowIndeterminate,
    AsJson,
    Jobs,
    Models,
    OutFolder,
    Overrides,
    Quick,
    Quiet,
    SceneNames,
    Verbose,
)
from comparison.cli.progress import Reporter, progress

if TYPE_CHECKING:
    from comparison.scene import Scene
    from comparison.verdict.validate import Validation

INTERRUPTED = 130


@dataclass(frozen=True)
class _Request:
    """What a user asks to be validated."""

    scenes: Sequence[str]
    changes: dict[str, object]
    accuracy: str | None
    tiers: Sequence[str]
    jobs: int
    allow_indeterminate: bool

    def command(self, models: Sequence[str]) -> str:
        """Return the command that does the same."""
        from comparison.scene import command_line
        from comparison.verdict.validate import options

        return command_line("validate", self.scenes, self.changes, options(models, self.accuracy, self.tiers))


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
    json: AsJson = False,
) -> int:
    """Run scenes by two models, compare them, and write a report.

    SCENE: shipped names or TOML files; all shipped scenes by default. Each model runs with refined and
    perturbed runs, which give its uncertainty. With more than two models each pair is compared, and the
    report identifies the outlier among them. Stopped by Ctrl-C, it writes the report of the scenes finished
    by then, marked as incomplete.
    """
    from comparison.accuracy.levels import TIERS
    from comparison.execution.pool import cpus, kept_workers
    from comparison.models import pair, several
    from comparison.scene import name_with, parse_set

    changes, tiers = parse_set(overrides or []), TIERS[:1] if quick else TIERS
    request = _Request(scenes or [], changes, accuracy, tiers, jobs or cpus(), allow_indeterminate)
    with kept_workers():
        if models.count(",") > 1:
            folder = out or REPORTS / name_with("pairwise", changes)
            return _validate_pairs(request, several(models), folder, verbose=verbose, quiet=quiet, json=json)
        code, summary = _validate_pair(request, pair(models), out, verbose=verbose, quiet=quiet, err=json)
    if json and summary:
        print_json(summary)
    return code


def _validate_pair(
    request: _Request,
    models: tuple[str, str],
    out: Path | None,
    *,
    verbose: bool,
    quiet: bool,
    err: bool,
) -> tuple[int, dict[str, Any]]:
    """Validate two models, print the verdicts, write the report; return the exit code and the summary.

    The summary is empty if Ctrl-C came before a scene was finished. ``err``: lines go to stderr.
    """
    from comparison.cli.pages import validation_summary, write_validation
    from comparison.cli.verdicts import verdict_lines
    from comparison.files import check_folder
    from comparison.models import MODELS
    from comparison.scene import load_scene, name_with, shipped_scenes
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.verdict.shipped import departures, verdicts_record
    from comparison.words import verdicts as words

    names = request.scenes or ([MAIN] if "tight" not in request.tiers else shipped_scenes())
    loaded = [load_scene(name, request.changes) for name in dict.fromkeys(names)]
    _check(loaded, models, request.accuracy)
    usual = loaded[0].name if len(loaded) == 1 else name_with("validate", request.changes)
    folder, command = check_folder(out or REPORTS / usual), request.command(models)
    warn_about_the_cache()
    with progress(f"{len(loaded)} scenes" if len(loaded) > 1 else loaded[0].name, quiet=quiet) as report:
        results = _validate_batches(loaded, models, request, report)
    if not results:
        return INTERRUPTED, {}
    missing = [scene.name for scene in loaded[len(results) :]]
    comparisons = [result.comparison for result in results]
    codes = [
        70 if result.crashed else EXIT_CODES[tier.verdict]
        for result in results
        for tier in result.comparison.tiers
    ]
    code = exit_code(codes, allow_indeterminate=request.allow_indeterminate)
    code = INTERRUPTED if missing else code
    lines = [words.headline(comparisons), words.incomplete(comparisons, missing)]
    if models == MODELS and request.accuracy is None:
        record = verdicts_record()
        departed = departures(loaded[: len(results)], comparisons, record)
        lines.append(words.departures(departed, record["made"]))
    for line in () if quiet else verdict_lines(comparisons, verbose=verbose):
        typer.echo(line, err=err)  # with colours
    say(*(line for text in lines for line in wrapped(text)), err=err)
    summary = validation_summary(comparisons, command, code, missing)
    page, kept = saved(lambda folder: write_validation(results, folder, summary), folder)
    say(*(line for text in kept for line in wrapped(text)), str(page), err=err)
    for scene in loaded[: len(results)]:
        warn([f"scene {scene.name!r}: {warning}" for warning in scene.warnings])
    return code, summary


def _check(scenes: Sequence[Scene], models: tuple[str, str], accuracy: str | None) -> None:
    """Refuse what is known to be wrong before anything runs.

    Raises
    ------
    SceneError
        If two scenes have one name, or a gate names what is no metric.
    AccuracyError
        If the accuracy is out of reach.
    """
    from comparison.accuracy.levels import solver_values
    from comparison.scene import SceneError
    from comparison.tables.table import TableError
    from comparison.verdict.compare import check_gate

    names = [scene.name for scene in scenes]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a report must be unique")
    for scene in scenes:
        try:
            check_gate(scene.gate)
        except TableError as error:
            raise SceneError(f"scene {scene.name!r}: compare.{error}") from None
    if accuracy is not None:
        for scene in scenes:
            for model in models:
                solver_values(model, accuracy, scene)


def _validate_batches(
    scenes: Sequence[Scene], models: tuple[str, str], request: _Request, report: Reporter
) -> list[Validation]:
    """Validate scenes in their order, as many at a time as keep the workers busy.

    Returns
    -------
    results
        Ctrl-C leaves out the scenes that were not finished; an error while one is compared makes it "cannot
        compare", crashed unless it is a refusal of the input.

    Raises
    ------
    Exception
        A refusal of the input before any scene is finished.
    """
    from comparison.verdict.validate import validate as validate_scenes

    # One scene has some twenty runs, but two or three of them take most of its time.
    size = max(1, request.jobs // 2)
    waiting = [scenes[first : first + size] for first in range(0, len(scenes), size)]
    total, done = sum(_cost(scene, models) for scene in scenes), 0.0
    results: list[Validation] = []
    with suppress(KeyboardInterrupt):
        while waiting:
            batch = waiting.pop(0)
            cost = sum(_cost(scene, models) for scene in batch)
            try:
                finished = validate_scenes(
                    batch,
                    models=models,
                    n_jobs=request.jobs,
                    accuracy=request.accuracy,
                    tiers=request.tiers,
                    on_progress=_Within(report, done / total, cost / total),
                )
            except Exception as error:
                if len(batch) > 1:  # their runs are cached: it costs little to find out which one it is
                    waiting = [[scene] for scene in batch] + waiting
                    continue
                if is_refusal(error) and not results:
                    raise
                finished = [_refused(batch[0], error, models, request)]
            results += finished
            done += cost
            last = finished[-1].comparison
            verdicts = ", ".join(dict.fromkeys(tier.verdict for tier in last.tiers))
            text = f"{len(results)} of {len(scenes)} scenes; {last.name}: {verdicts}"
            report.finished(done / total, text)
    return results


class _Within:
    """Progress of a part of the work; an ensemble that starts anew from 0 does not turn it back."""

    def __init__(self, report: Reporter, start: float, part: float) -> None:
        self._report, self._start, self._part, self._most = report, start, part, 0.0

    def __call__(self, share: float) -> None:
        self._most = max(self._most, share)
        self._report(self._start + self._part * self._most)


def _cost(scene: Scene, models: tuple[str, str]) -> float:
    from comparison.accuracy.refine import family

    return sum(job.cost for model in models for _, job in family(scene, model))


def _refused(scene: Scene, error: Exception, models: tuple[str, str], request: _Request) -> Validation:
    from comparison.verdict.results import no_comparison
    from comparison.verdict.validate import Validation, options

    message, code = described(error)
    command = scene.command("validate", *options(models, request.accuracy, request.tiers))
    refusal = no_comparison(scene, " ".join(message.split()), labels=models, command=command, tier="standard")
    return Validation(refusal, crashed=code == 70)


# Three or more models


def _validate_pairs(
    request: _Request, models: Sequence[str], folder: Path, *, verbose: bool, quiet: bool, json: bool
) -> int:
    """Validate all pairs of models, write the page of all of them, and return the worst exit code.

    The runs of a model are the same in each of its pairs: all but the first time they come from the cache.
    Ctrl-C ends with the report of the pair under way: no page of all models is written.
    """
    from comparison.files import check_folder, write_json
    from comparison.report.pairwise import write_pairwise
    from comparison.verdict.results import exit_code
    from comparison.verdict.several import pairs
    from comparison.words.verdicts import standing as sentence

    folder = check_folder(folder)
    codes, results = [], {}
    for pair in pairs(models):
        say(f"{pair[0]} and {pair[1]}:", err=json)
        own = folder / "-".join(pair)
        code, summary = _validate_pair(request, pair, own, verbose=verbose, quiet=quiet, err=json)
        if code == INTERRUPTED:
            return INTERRUPTED
        codes.append(code)
        results[pair] = summary["scenes"]
    rows = _rows(models, results)
    code, command = exit_code(codes), request.command(models)
    page = write_pairwise(rows, folder, models=models, command=command)
    scenes = [
        {
            "name": row.name,
            "outcome": row.standing.outcome,
            "outlier": row.standing.outlier,
            "sentence": sentence(row.standing),
            "verdicts": {" and ".join(result.pair): result.record["verdict"] for result in row.results},
        }
        for row in rows
    ]
    summary = {"command": command, "exit_code": code, "models": models, "scenes": scenes}
    write_json(summary, folder / "summary.json")
    width = max(len(row.name) for row in rows)
    lines = [line for row in rows for line in wrapped(sentence(row.standing), first=f"{row.name:<{width}}  ")]
    say("all together:", *lines, str(page), err=json)
    if json:
        print_json(summary)
    return code


def _rows(models: Sequence[str], results: dict[tuple[str, str], list[dict[str, Any]]]) -> list[Any]:
    from comparison.report.pairwise import PairResult, Row
    from comparison.verdict.several import standing

    rows = []
    for scenes in zip(*results.values(), strict=True):
        pair_results = [PairResult(pair, scene) for pair, scene in zip(results, scenes, strict=True)]
        verdicts = {result.pair: result.record["verdict"] for result in pair_results}
        rows.append(Row(scenes[0]["name"], scenes[0]["title"], standing(models, verdicts), pair_results))
    return rows
