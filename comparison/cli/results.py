"""The work of `sixbar validate`, and the lines and files of this command and of `sixbar compare`.

Scenes are validated in batches: finished ones survive an interruption, or the fault of another. This module
is imported when one of the commands runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from glob import escape
from importlib import import_module
from math import isfinite
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

import typer

from comparison.accuracy.levels import check_accuracy
from comparison.accuracy.refine import family
from comparison.cli import console
from comparison.cli.console import (
    INTERRUPTED,
    Reporter,
    columns,
    describe_error,
    is_refusal,
    progress,
    say,
    say_wrapped,
    warn,
    wrapped,
)
from comparison.execution.pool import cpus
from comparison.files import check_folder, json_value, replacing_in, write_json, write_text
from comparison.formatting import MISSING, NO_BREAK, number, percent
from comparison.report.ci import write_job_summary, write_junit
from comparison.scene import Scene, SceneError, load_scene, name_with, shipped_scenes
from comparison.tables.table import TableError
from comparison.tables.table_files import write
from comparison.verdict import validate as judge
from comparison.verdict.channel import check_gate
from comparison.verdict.results import SceneComparison, exit_code, no_comparison
from comparison.verdict.validate import Pair, Validation, pairs, standing
from comparison.words import verdicts as words
from comparison.words.differences import lead
from comparison.words.record import Case, as_mapping, of_comparisons
from comparison.words.since import Since, compare_reports, earlier_report, rows, sentences
from comparison.words.verdicts import ratio_name

if TYPE_CHECKING:
    from comparison.cli.compare import Validation as Options


def validate_pair(options: Options, models: Pair, out: Path | None) -> tuple[int, dict[str, Any]]:
    """Validate two models, write the report; return exit code and summary, {} if nothing was finished."""
    names = options.scenes or ([console.MAIN] if "tight" not in options.tiers else shipped_scenes())
    scenes = [load_scene(name, options.changes) for name in dict.fromkeys(names)]
    _check(scenes, models, options.accuracy)
    default_name = scenes[0].name if len(scenes) == 1 else name_with("validate", options.changes)
    folder, command = check_folder(out or console.REPORTS / default_name), options.command(models)
    scene_names = [scene.name for scene in scenes]
    earlier = None if options.since is None else earlier_report(options.since, scene_names)
    title = scenes[0].name if len(scenes) == 1 else f"{len(scenes)} scenes"
    Thread(target=import_module, args=("comparison.report.page",), daemon=True).start()  # while they run
    with progress(title, quiet=options.quiet) as report:
        results = _validate_batches(scenes, models, options, report)
    if not results:
        return INTERRUPTED, {}
    finished_scenes, missing = scenes[: len(results)], [scene.name for scene in scenes[len(results) :]]
    comparisons = [result.comparison for result in results]
    codes = [
        70 if result.crashed else tier.exit_code for result in results for tier in result.comparison.tiers
    ]
    code = INTERRUPTED if missing else exit_code(codes, allow_indeterminate=options.allow_indeterminate)
    sentences = [words.incomplete(comparisons, missing), words.headline(comparisons)]
    say_wrapped(*([] if options.quiet else lead(comparisons)), err=options.json)
    for line in () if options.quiet else verdict_lines(comparisons, verbose=options.verbose):
        typer.echo(line, err=options.json)  # with colours
    failures = [tier for one in comparisons if options.quiet for tier in one.tiers if tier.error]
    say_wrapped(*(f"{tier.name}: {tier.error}" for tier in failures), err=options.json)
    say_wrapped(*sentences, err=options.json)
    with console.uninterrupted():
        summary = summary_of(comparisons, command, code, missing)
        moves = say_since(earlier, summary, err=options.json)
        page, notes = write_validation(results, folder, summary, since=moves)
        say_wrapped(*notes, err=options.json)
        say(str(page), err=options.json)
    warn([f"scene {scene.name!r}: {warning}" for scene in finished_scenes for warning in scene.warnings])
    return code, summary


def _check(scenes: Sequence[Scene], models: Pair, accuracy: str | None) -> None:
    """Refuse wrong names, gates and accuracies before anything runs."""
    console.check_unique([scene.name for scene in scenes], "report")
    for scene in scenes:
        try:
            check_gate(scene.compare.gate)
        except TableError as error:
            raise SceneError(f"scene {scene.name!r}: compare.{error}") from None
    for model in models if accuracy is not None else ():
        check_accuracy(model, accuracy or "")


def _validate_batches(
    scenes: Sequence[Scene], models: Pair, options: Options, report: Reporter
) -> list[Validation]:
    """Validate scenes in their order, as many at a time as keep the workers busy.

    Ctrl-C leaves out the scenes that were not finished. An error while one is compared makes it "cannot
    compare", crashed unless it is a refusal of the input, which is raised before any scene is finished.
    """
    costs = [sum(job.cost for model in models for _, job in family(scene, model)) for scene in scenes]
    results: list[Validation] = []
    highest = 0.0

    def judge_batch(batch: range) -> list[Validation]:
        finished_cost, cost = sum(costs[: batch.start]), sum(costs[number] for number in batch)

        def report_share(share: float) -> None:
            nonlocal highest  # an ensemble that starts anew from 0 does not turn progress back
            highest = max(highest, (finished_cost + cost * share) / sum(costs))
            report(highest)

        return judge.validate(
            [scenes[number] for number in batch],
            models=models,
            n_jobs=options.jobs or cpus(),
            accuracy=options.accuracy,
            tiers=options.tiers,
            on_progress=report_share,
        )

    # One scene has some twenty runs, but two or three of them take most of its time.
    size = max(1, (options.jobs or cpus()) // 2)
    waiting = [range(first, min(first + size, len(scenes))) for first in range(0, len(scenes), size)]
    with suppress(KeyboardInterrupt):
        while waiting:
            batch = waiting.pop(0)
            try:
                results += judge_batch(batch)
            except Exception as error:
                if len(batch) > 1:  # their runs are cached: it costs little to find out which one it is
                    waiting = [range(number, number + 1) for number in batch] + waiting
                    continue
                if is_refusal(error) and not results:
                    raise
                scene, (message, code) = scenes[batch.start], describe_error(error)
                command = scene.command("validate", *judge.options(models, options.accuracy, options.tiers))
                refusal = no_comparison(
                    scene, " ".join(message.split()), labels=models, command=command, tier="standard"
                )
                results.append(Validation(refusal, crashed=code == 70))
            last = results[-1].comparison
            verdicts = ", ".join(dict.fromkeys(tier.verdict for tier in last.tiers))
            text = f"{len(results)} of {len(scenes)} scenes; {last.name}: {verdicts}"
            report(sum(costs[: batch.stop]) / sum(costs), text)
    return results


def validate_pairs(options: Options, models: Sequence[str], folder: Path) -> tuple[int, dict[str, Any]]:
    """Validate all pairs of models and write the page of all; after Ctrl-C no such page is written."""
    from comparison.report.page import Row, write_pairwise

    folder = check_folder(folder)
    codes, results = [], {}
    for pair in pairs(models):
        say(f"{pair[0]} and {pair[1]}:", err=options.json)
        before = options.since and options.since / "-".join(pair)
        code, summary = validate_pair(replace(options, since=before), pair, folder / "-".join(pair))
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
    code, command = exit_code(codes), options.command(models)
    page = write_pairwise(rows, folder, models=models, command=command)
    summary = {"command": command, "exit_code": code, "models": models, "scenes": records}
    write_json(summary, folder / "summary.json")
    width = max(len(row.name) for row in rows)
    say("all together:", err=options.json)
    for row in rows:
        say(
            *wrapped(words.standing(row.standing), first=f"{row.name:<{width}}  ", rest="  "),
            err=options.json,
        )
    say(str(page), err=options.json)
    return code, summary


# ---- lines and files


_BESIDE = 40  # most letters of a name beside its verdict; a longer one has a line of its own


def summary_of(
    comparisons: Sequence[SceneComparison], command: str, code: int, missing: Sequence[str] = ()
) -> dict[str, Any]:
    """Return all results without curves, for ``summary.json``."""
    from comparison.report.page import origin

    scenes = [as_mapping(comparison) for comparison in comparisons]
    head = {"command": command, "made": origin(), "exit_code": code, "not_compared": missing}
    return dict(json_value(head | {"scenes": scenes}))


def say_since(earlier: Mapping[str, Any] | None, summary: Mapping[str, Any], *, err: bool) -> Since | None:
    """Print what has moved since an earlier report, if there is one, and return it."""
    if earlier is None:
        return None
    result = compare_reports(earlier, summary)
    lines = rows(result)
    say_wrapped(*sentences(result), err=err)
    say(*(columns(lines) if len(lines) > 1 else ()), err=err)
    return result


def verdict_lines(comparisons: Sequence[SceneComparison], *, verbose: bool = False) -> list[str]:
    """Return one line per scene and tier, below a heading; with their reasons below each if verbose."""
    tiers = [(scene.name, tier) for scene in comparisons for tier in scene.tiers]
    has_u = any(tier.has_u for _, tier in tiers)  # a tolerance judges all samples
    rows = [
        (
            name if len(name) <= _BESIDE else "",
            tier.tier,
            tier.verdict,
            *([percent(tier.coverage).replace(NO_BREAK, " "), words.round_down(tier.until)] if has_u else []),
            MISSING if tier.decisive is None else number(tier.decisive.ratio, 2),
            "" if verbose and not tier.error else _note(tier),
        )
        for name, tier in tiers
    ]
    numbers = (*["coverage", "until (s)"] * has_u, ratio_name(comparisons))
    headings = ("scene", "tier", "verdict", *numbers, "")
    heading, *lines = columns([headings, *rows], right=range(3, 3 + len(numbers)), verdict=2)
    output = [heading]
    for line, (name, tier) in zip(lines, tiers, strict=True):
        output += [line] if len(name) <= _BESIDE else [console.printable(name), line]
        for topic, text in words.reasons(tier) if verbose or tier.error else ():
            output += wrapped(text, first=f"    {topic:<12}  ")
    return output


def _note(tier: SceneComparison) -> str:
    """Return a short note: error, first difference, or reason of an indeterminate verdict."""
    notes, result, worst = [], tier.attribution, tier.worst_channel
    if tier.error:
        return tier.error
    if tier.verdict == "differ" and result.outside_in:
        notes.append(f"{result.outside_in} from {result.outside_from:.3f} s")
    notes.append(words.mark(tier))
    if tier.verdict == "indeterminate" and worst is not None:
        notes.append(f"{worst.channel}: {words.reason(worst)}")
    return "; ".join(filter(None, notes))


def channel_lines(comparison: SceneComparison) -> list[str]:
    """Return one line per channel: verdict, largest difference, predictable part, samples outside, RMS."""
    has_u = comparison.has_u  # a tolerance judges all samples
    coverage = ["coverage", "until (s)"] * has_u
    heading = ("channel", "verdict", "max", "unit", "max/scale", *coverage, "outside", "rms", "rms/scale")
    rows = [
        (
            channel.channel,
            channel.verdict,
            f"{channel.max_difference:.3g}",
            channel.unit,
            f"{channel.max_scaled:.3g}",
            *[f"{channel.coverage:.1%}", words.until(channel)] * has_u,
            str(channel.outside) if isfinite(channel.worst_threshold) else "",
            f"{channel.rms_difference:.3g}",
            f"{channel.rms_scaled:.3g}",
        )
        for channel in comparison.channels.values()
    ]
    return columns([heading, *rows], right=(2, *range(4, len(heading))), verdict=1)


def write_page(
    comparisons: Sequence[SceneComparison],
    folder: Path,
    command: str,
    missing: Sequence[str] = (),
    title: str = "",
    since: Since | None = None,
) -> Path:
    """Write the report of scenes into a folder and return its path; its title says how many are missing."""
    from comparison.report.page import write_report

    total = len(comparisons) + len(missing)
    title = title or (comparisons[0].title if total == 1 else "Cross-validation of the two models")
    if missing:
        title += f" (incomplete: {len(comparisons)} of {total} scenes)"
    context: dict[str, Any] = {"title": title, "command": command, "missing": missing, "since": since}
    return write_report(comparisons, folder / "report.html", **context)


def write_validation(
    results: Sequence[Validation],
    folder: Path,
    summary: Mapping[str, Any],
    verb: str = "validate",
    since: Since | None = None,
) -> tuple[Path, list[str]]:
    """Write the report with its tables and summaries; return its path, and lines on partial results.

    Tables of an earlier call are deleted where there is none now: they would appear to belong to this report.
    """
    comparisons = [result.comparison for result in results]
    missing, command, notes = summary["not_compared"], summary["command"], []
    with replacing_in(folder) as part:
        page = write_page(comparisons, part, command, missing, since=since)
        for result in results:
            name = result.comparison.name
            for model, run in result.runs.items():
                write(run.base, part / "tables" / f"{name}-{model}.csv")
            for which, table in result.partial.items():
                path = Path("tables", f"{name}.{which.replace(' ', '-')}.partial.csv")
                write(table, part / path)
                notes.append(f"{len(table.frame)} samples of the {which} run are in {folder / path}")
            for which, text in result.tracebacks.items():
                path = Path(f"{name}.{which.replace(' ', '-')}.traceback.txt")
                write_text(text, part / path)
                notes.append(f"the traceback of the {which} run is in {folder / path}")
        write_json(summary, part / "summary.json")
        cases = of_comparisons(comparisons)
        cases += [Case(name, "standard", "verdict", "error", "not compared: interrupted") for name in missing]
        write_junit(cases, part / "junit.xml", name=f"sixbar {verb}")
        lines = [
            words.incomplete(comparisons, missing),
            *lead(comparisons),
            words.headline(comparisons),
            f"Made by: {command}",
        ]
        write_job_summary(
            part / "summary.md",
            title="Cross-validation of the two models" if verb == "validate" else comparisons[0].title,
            sentences=[line for line in lines if line],
            headings=("scene", "tier", "verdict", "why"),
            rows=[
                (c.name, tier.tier, tier.verdict, words.why(tier)) for c in comparisons for tier in c.tiers
            ],
            cases=cases,
        )
        new_names = {path.name for path in part.rglob("*")}
    for name in (*missing, *(comparison.name for comparison in comparisons)):
        stale = [*(folder / "tables").glob(f"{escape(name)}.*.partial.*")]
        stale += folder.glob(f"{escape(name)}.*.traceback.txt")
        for end in (".csv", ".events.csv", ".pulses.csv", ".extrema.csv", ".json"):
            stale += [folder / "tables" / f"{name}-{model}{end}" for model in comparisons[0].labels]
        for path in stale:
            if path.name not in new_names:
                path.unlink(missing_ok=True)
    return folder / page.name, notes
