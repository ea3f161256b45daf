"""The work of ``sixbar validate``: two models on scenes, or more in pairs, what is printed, and the report.

Scenes are validated in batches: what is finished survives an interruption, or the fault of one scene. It
imports what the command needs, and is imported when that runs.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from comparison.accuracy.levels import solver_values
from comparison.accuracy.refine import family
from comparison.cli import options
from comparison.cli.console import INTERRUPTED, described, is_refusal, say, say_wrapped, warn, wrapped
from comparison.cli.progress import Reporter, progress
from comparison.cli.results import verdict_lines, write_validation
from comparison.files import check_folder, plain, write_json
from comparison.models import MODELS
from comparison.report.page import Row, write_pairwise
from comparison.scene import Scene, SceneError, command_line, load_scene, name_with, shipped_scenes
from comparison.tables.table import TableError
from comparison.verdict import validate as judge
from comparison.verdict.compare import check_gate
from comparison.verdict.results import EXIT_CODES, exit_code, no_comparison
from comparison.verdict.validate import Validation, pairs, standing
from comparison.words import verdicts as words
from comparison.words.record import as_mapping

Pair = tuple[str, str]


@dataclass(frozen=True)
class Request:
    """What a user asks to be validated, and to be shown."""

    names: Sequence[str]
    changes: dict[str, object]
    accuracy: str | None
    tiers: Sequence[str]
    jobs: int
    allow_indeterminate: bool
    verbose: bool
    quiet: bool
    json: bool

    def command(self, models: Sequence[str]) -> str:
        """Return the command that does the same."""
        return command_line(
            "validate", self.names, self.changes, judge.options(models, self.accuracy, self.tiers)
        )


def validate_pair(request: Request, models: Pair, out: Path | None) -> tuple[int, dict[str, Any]]:
    """Validate two models, write the report; return exit code and summary, {} if nothing was finished."""
    names = request.names or ([options.MAIN] if "tight" not in request.tiers else shipped_scenes())
    asked = [load_scene(name, request.changes) for name in dict.fromkeys(names)]
    _check(asked, models, request.accuracy)
    usual = asked[0].name if len(asked) == 1 else name_with("validate", request.changes)
    folder, command = check_folder(out or options.REPORTS / usual), request.command(models)
    title = asked[0].name if len(asked) == 1 else f"{len(asked)} scenes"
    with progress(title, quiet=request.quiet) as report:
        results = _validate_batches(asked, models, request, report)
    if not results:
        return INTERRUPTED, {}
    scenes, missing = asked[: len(results)], [scene.name for scene in asked[len(results) :]]
    comparisons = [result.comparison for result in results]
    codes = [
        70 if result.crashed else EXIT_CODES[tier.verdict]
        for result in results
        for tier in result.comparison.tiers
    ]
    code = INTERRUPTED if missing else exit_code(codes, allow_indeterminate=request.allow_indeterminate)
    sentences = [words.headline(comparisons), words.incomplete(comparisons, missing)]
    if models == MODELS and request.accuracy is None:
        record = judge.verdicts_record()
        sentences.append(words.departures(judge.departures(scenes, comparisons, record), record["made"]))
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
    options.check_unique([scene.name for scene in scenes], "report")
    for scene in scenes:
        try:
            check_gate(scene.compare.gate)
        except TableError as error:
            raise SceneError(f"scene {scene.name!r}: compare.{error}") from None
        for model in models if accuracy is not None else ():
            solver_values(model, accuracy or "", scene)


def _validate_batches(
    scenes: Sequence[Scene], models: Pair, request: Request, report: Reporter
) -> list[Validation]:
    """Validate scenes in their order, as many at a time as keep the workers busy.

    Ctrl-C leaves out the scenes that were not finished. An error while one is compared makes it "cannot
    compare", crashed unless it is a refusal of the input, which is raised before any scene is finished.
    """
    costs = [sum(job.cost for model in models for _, job in family(scene, model)) for scene in scenes]
    results: list[Validation] = []
    most = 0.0

    def judged(batch: range, tiers: Sequence[str]) -> list[Validation]:
        done, cost = sum(costs[: batch.start]), sum(costs[number] for number in batch)

        def progressed(share: float) -> None:
            nonlocal most  # an ensemble that starts anew from 0 does not turn progress back
            most = max(most, (done + cost * share * len(tiers) / len(request.tiers)) / sum(costs))
            report(most)

        return judge.validate(
            [scenes[number] for number in batch],
            models=models,
            n_jobs=request.jobs,
            accuracy=request.accuracy,
            tiers=tiers,
            on_progress=progressed,
        )

    # One scene has some twenty runs, but two or three of them take most of its time.
    size = max(1, request.jobs // 2)
    waiting = [range(first, min(first + size, len(scenes))) for first in range(0, len(scenes), size)]
    with suppress(KeyboardInterrupt):
        if len(scenes) > 1:
            # A first verdict before the tight tier and the other scenes compile code of their own.
            with suppress(Exception):  # raised again, and reported, by the scene's own batch
                (first,) = judged(range(1), request.tiers[:1])
                report(most, f"{first.comparison.name}, standard tier: {first.comparison.verdict}")
        while waiting:
            batch = waiting.pop(0)
            try:
                results += judged(batch, request.tiers)
            except Exception as error:
                if len(batch) > 1:  # their runs are cached: it costs little to find out which one it is
                    waiting = [range(number, number + 1) for number in batch] + waiting
                    continue
                if is_refusal(error) and not results:
                    raise
                scene, (message, code) = scenes[batch.start], described(error)
                command = scene.command("validate", *judge.options(models, request.accuracy, request.tiers))
                refusal = no_comparison(
                    scene, " ".join(message.split()), labels=models, command=command, tier="standard"
                )
                results.append(Validation(refusal, crashed=code == 70))
            last = results[-1].comparison
            verdicts = ", ".join(dict.fromkeys(tier.verdict for tier in last.tiers))
            text = f"{len(results)} of {len(scenes)} scenes; {last.name}: {verdicts}"
            report(sum(costs[: batch.stop]) / sum(costs), text)
    return results


def validate_pairs(request: Request, models: Sequence[str], folder: Path) -> tuple[int, dict[str, Any]]:
    """Validate all pairs of models and write the page of all; after Ctrl-C no such page is written."""
    folder = check_folder(folder)
    codes, results = [], {}
    for pair in pairs(models):
        say(f"{pair[0]} and {pair[1]}:", err=request.json)
        code, summary = validate_pair(request, pair, folder / "-".join(pair))
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
                "sentence": words.standing(row.standing),
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
        say(*wrapped(words.standing(row.standing), first=f"{row.name:<{width}}  "), err=request.json)
    say(str(page), err=request.json)
    return code, summary
