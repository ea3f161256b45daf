"""``sixbar judge``: whether two solvers agree, by runs of their own."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from comparison.cli import console
from comparison.cli.console import print_json, progress, say, say_wrapped, warn


@dataclass(frozen=True)
class Judgement:
    """Options of ``sixbar judge``."""

    pair: Annotated[Path, typer.Argument(metavar="PAIR", hidden=True)]
    out: console.OutFolder = None
    jobs: console.Jobs = None
    until: console.Until = None
    since: console.Since = None
    allow_indeterminate: console.AllowIndeterminate = False
    quiet: console.NoProgress = False
    json: console.AsJson = False


@console.take_options(Judgement)
def judge(options: Judgement) -> int:
    """Judge whether two solvers agree, by runs of their own.

    PAIR: a TOML file with a command or an FMU on either side, see docs/judge.md. Each side runs with refined
    and perturbed runs, which give its uncertainty; a difference is confirmed by further ones.
    """
    from comparison.cli.results import channel_lines, say_since, summary_of, verdict_lines, write_validation
    from comparison.execution.pool import cpus
    from comparison.files import check_folder
    from comparison.scene import command_line, parse_set
    from comparison.verdict.pair import load_pair
    from comparison.verdict.results import exit_code
    from comparison.verdict.validate import Validation
    from comparison.words.differences import lead
    from comparison.words.since import earlier_report
    from comparison.words.verdicts import headline

    words = [] if options.until is None else ["--until", options.until]
    command = command_line("judge", [str(options.pair)], {}, words)
    pair = load_pair(options.pair, parse_set([f"until={options.until}"] if options.until else []))
    folder = check_folder(options.out or console.REPORTS / pair.name)
    earlier = None if options.since is None else earlier_report(options.since, [pair.name])
    with progress(pair.name, quiet=options.quiet) as report:
        comparison, programs = replace(pair, n_jobs=options.jobs or cpus(), on_progress=report).judge()
    comparison = replace(comparison, command=command)
    code = exit_code([comparison.exit_code], allow_indeterminate=options.allow_indeterminate)
    say_wrapped(*lead([comparison]), err=options.json)
    for line in (*channel_lines(comparison), *verdict_lines([comparison], verbose=True)):
        typer.echo(line, err=options.json)  # with colours
    say_wrapped(headline([comparison]), err=options.json)
    runs = {label: program.runs for label, program in zip(comparison.labels, programs, strict=True)}
    with console.uninterrupted():
        summary = summary_of([comparison], command, code)
        moves = say_since(earlier, summary, err=options.json)
        page, _ = write_validation([Validation(comparison, runs)], folder, summary, "judge", moves)
    if options.json:
        print_json(summary)
    say(str(page), err=options.json)
    warn(comparison.warnings)
    return code
