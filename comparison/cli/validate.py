"""``sixbar validate``: run two models, or more in pairs, on scenes, compare them, write the report.

Scenes are validated in batches: what is finished survives an interruption, or the fault of one scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from comparison.cli import options
from comparison.cli.console import (
    INTERRUPTED,
    described,
    is_refusal,
    print_json,
    say,
    say_wrapped,
    warn,
    wrapped,
)
from comparison.cli.progress import Reporter, progress

if TYPE_CHECKING:
    from comparison.scene import Scene
    from comparison.verdict.validate import Validation

Pair = tuple[str, str]


@dataclass(frozen=True)
class _Request:
    """What a user asks to be validated, and to be shown."""

    scenes: Sequence[str]
    changes: dict[str, object]
    accuracy: str | None
    tiers: Sequence[str]
    jobs: int
    allow_indeterminate: bool
    verbose: bool
    quiet: bool
    json: bool

    def options(self, models: Sequence[str]) -> list[str]:
        """Options of the command that does the same."""
        from comparison.verdict.validate import options as repeating

        return repeating(models, self.accuracy, self.tiers)

    def command(self, models: Sequence[str]) -> str:
        from comparison.scene import command_line

        return command_line("validate", self.scenes, self.changes, self.options(models))


def validate(
    scenes: options.SceneNames = None,
    out: options.OutFolder = None,
    jobs: options.Jobs = None,
    accuracy: options.Accuracy = None,
    models: options.Models = "reference,exudyn",
    overrides: options.Overrides = None,
    allow_indeterminate: options.AllowIndeterminate = False,
    quick: options.Quick = False,
    verbose: options.Verbose = False,
    quiet: options.Quiet = False,
    json: options.AsJson = False,
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
    request = _Request(
        scenes or [], changes, accuracy, tiers, jobs or cpus(), allow_indeterminate, verbose, quiet, json
    )
    with kept_workers():
        if models.count(",") > 1:
            folder = out or options.REPORTS / name_with("pairwise", changes)
            code, summary = _validate_pairs(request, several(models), folder)
        else:
            code, summary = _validate_pair(request, pair(models), out)
    if json and summary:
        print_json(summary)
    return code


def _validate_pair(request: _Request, models: Pair, out: Path | None) -> tuple[int, dict[str, Any]]:
    """Validate two models, print the verdicts, write the report; return the exit code and the summary.

    The summary is empty if Ctrl-C came before a scene was finished.
    """
    from comparison.cli.results import verdict_lines, write_validation
    from comparison.files import check_folder, plain
    from comparison.models import MODELS
    from comparison.scene import load_scene, name_with, shipped_scenes
    from comparison.verdict import shipped
    from comparison.verdict.results import EXIT_CODES, exit_code
    from comparison.words import verdicts as words
    from comparison.words.record import as_mapping

    names = request.scenes or ([options.MAIN] if "tight" not in request.tiers else shipped_scenes())
    scenes = [load_scene(name, request.changes) for name in dict.fromkeys(names)]
    _check(scenes, models, request.accuracy)
    usual = scenes[0].name if len(scenes) == 1 else name_with("validate", request.changes)
    folder, command = check_folder(out or options.REPORTS / usual), request.command(models)
    title = f"{len(scenes)} scenes" if len(scenes) > 1 else scenes[0].name
    with progress(title, quiet=request.quiet) as report:
        results = _validate_batches(scenes, models, request, report)
    if not results:
        return INTERRUPTED, {}
    missing = [scene.name for scene in scenes[len(results) :]]
    scenes, comparisons = scenes[: len(results)], [result.comparison for result in results]
    codes = [
        70 if result.crashed else EXIT_CODES[tier.verdict]
        for result in results
        for tier in result.comparison.tiers
    ]
    code = INTERRUPTED if missing else exit_code(codes, allow_indeterminate=request.allow_indeterminate)
    sentences = [words.headline(comparisons), words.incomplete(comparisons, missing)]
    if models == MODELS and request.accuracy is None:
        record = shipped.verdicts_record()
        sentences.append(words.departures(shipped.departures(scenes, comparisons, record), record["made"]))
    for line in () if request.quiet else verdict_lines(comparisons, verbose=request.verbose):
        typer.echo(line, err=request.json)  # with colours
    say_wrapped(*sentences, err=request.json)
    summary: dict[str, Any] = plain(
        {
            "command": command,
            "exit_code": code,
            "not_compared": missing,
            "scenes": [as_mapping(comparison) for comparison in comparisons],
        }
    )
    page, kept = write_validation(results, folder, summary)
    say_wrapped(*kept, err=request.json)
    say(str(page), err=request.json)
    warn([f"scene {scene.name!r}: {warning}" for scene in scenes for warning in scene.warnings])
    return code, summary


def _check(scenes: Sequence[Scene], models: Pair, accuracy: str | None) -> None:
    """Refuse what is known to be wrong before anything runs: names, gates, an accuracy out of reach."""
    from comparison.accuracy.levels import solver_values
    from comparison.scene import SceneError
    from comparison.tables.table import TableError
    from comparison.verdict.compare import check_gate

    options.check_unique([scene.name for scene in scenes], "report")
    for scene in scenes:
        try:
            check_gate(scene.gate)
        except TableError as error:
            raise SceneError(f"scene {scene.name!r}: compare.{error}") from None
        for model in models if accuracy is not None else ():
            solver_values(model, accuracy or "", scene)


def _validate_batches(
    scenes: Sequence[Scene], models: Pair, request: _Request, report: Reporter
) -> list[Validation]:
    """Validate scenes in their order, as many at a time as keep the workers busy.

    Ctrl-C leaves out the scenes that were not finished. An error while one is compared makes it "cannot
    compare", crashed unless it is a refusal of the input, which is raised before any scene is finished.
    """
    from comparison.accuracy.refine import family
    from comparison.verdict.results import no_comparison
    from comparison.verdict.validate import Validation
    from comparison.verdict.validate import validate as validate_scenes

    costs = [sum(job.cost for model in models for _, job in family(scene, model)) for scene in scenes]
    # One scene has some twenty runs, but two or three of them take most of its time.
    size = max(1, request.jobs // 2)
    waiting = [range(first, min(first + size, len(scenes))) for first in range(0, len(scenes), size)]
    results: list[Validation] = []
    most = 0.0

    def progress_of(done: float, cost: float, share: float) -> None:
        nonlocal most  # an ensemble that starts anew from 0 does not turn progress back
        most = max(most, (done + cost * share) / sum(costs))
        report(most)

    with suppress(KeyboardInterrupt):
        if len(scenes) > 1:
            # A first verdict before the tight tier and the other scenes compile code of their own.
            with suppress(Exception):  # raised again, and reported, by the scene's own batch
                (first,) = validate_scenes(
                    scenes[:1],
                    models=models,
                    n_jobs=request.jobs,
                    accuracy=request.accuracy,
                    tiers=request.tiers[:1],
                    on_progress=partial(progress_of, 0.0, costs[0] / len(request.tiers)),
                )
                report(most, f"{first.comparison.name}, standard tier: {first.comparison.verdict}")
        while waiting:
            batch = waiting.pop(0)
            done, cost = sum(costs[: batch.start]), sum(costs[batch.start : batch.stop])
            try:
                results += validate_scenes(
                    [scenes[number] for number in batch],
                    models=models,
                    n_jobs=request.jobs,
                    accuracy=request.accuracy,
                    tiers=request.tiers,
                    on_progress=partial(progress_of, done, cost),
                )
            except Exception as error:
                if len(batch) > 1:  # their runs are cached: it costs little to find out which one it is
                    waiting = [range(number, number + 1) for number in batch] + waiting
                    continue
                if is_refusal(error) and not results:
                    raise
                scene, (message, code) = scenes[batch.start], described(error)
                message = " ".join(message.split())
                command = scene.command("validate", *request.options(models))
                refusal = no_comparison(scene, message, labels=models, command=command, tier="standard")
                results.append(Validation(refusal, crashed=code == 70))
            last = results[-1].comparison
            verdicts = ", ".join(dict.fromkeys(tier.verdict for tier in last.tiers))
            text = f"{len(results)} of {len(scenes)} scenes; {last.name}: {verdicts}"
            report((done + cost) / sum(costs), text)
    return results


def _validate_pairs(request: _Request, models: Sequence[str], folder: Path) -> tuple[int, dict[str, Any]]:
    """Validate all pairs of models and write the page of all of them; return the worst exit code.

    The runs of a model are the same in each of its pairs: all but the first time they come from the cache.
    Ctrl-C ends with the report of the pair under way: no page of all models is written.
    """
    from comparison.files import check_folder, write_json
    from comparison.report.other_pages import Row, write_pairwise
    from comparison.verdict.results import exit_code
    from comparison.verdict.several import pairs, standing
    from comparison.words.verdicts import standing as sentence

    folder = check_folder(folder)
    codes, results = [], {}
    for pair in pairs(models):
        say(f"{pair[0]} and {pair[1]}:", err=request.json)
        code, summary = _validate_pair(request, pair, folder / "-".join(pair))
        if code == INTERRUPTED:
            return INTERRUPTED, {}
        codes.append(code)
        results[pair] = summary["scenes"]
    rows, records = [], []
    for scenes in zip(*results.values(), strict=True):
        of_pairs = dict(zip(results, scenes, strict=True))
        verdicts = {pair: scene["verdict"] for pair, scene in of_pairs.items()}
        row = Row(scenes[0]["name"], scenes[0]["title"], standing(models, verdicts), of_pairs)
        rows.append(row)
        records.append(
            {
                "name": row.name,
                "outcome": row.standing.outcome,
                "outlier": row.standing.outlier,
                "sentence": sentence(row.standing),
                "verdicts": {" and ".join(pair): verdict for pair, verdict in verdicts.items()},
            }
        )
    code, command = exit_code(codes), request.command(models)
    page = write_pairwise(rows, folder, models=models, command=command)
    summary = {"command": command, "exit_code": code, "models": models, "scenes": records}
    write_json(summary, folder / "summary.json")
    width = max(len(row.name) for row in rows)
    say("all together:", err=request.json)
    for row in rows:
        say(*wrapped(sentence(row.standing), first=f"{row.name:<{width}}  "), err=request.json)
    say(str(page), err=request.json)
    return code, summary
