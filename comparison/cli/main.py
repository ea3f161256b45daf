"""Command line ``sixbar``; each command imports what it needs."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from comparison.cli.console import complain, fail, progress, warn
from comparison.cli.gate import gate
from comparison.cli.layout import wrapped
from comparison.cli.listing import channels, scenes
from comparison.cli.options import (
    REPORTS,
    Accuracy,
    AllowIndeterminate,
    Model,
    NoProgress,
    OutFolder,
    Overrides,
    SceneName,
)
from comparison.cli.plot import animate, plot
from comparison.cli.study import studies
from comparison.cli.validate import validate, write_page

_PLAN_INDENT = 14  # of what follows the names in a plan
# The class raised by this typer: some of its releases vendor click.
_UsageError: Any = typer.BadParameter.__base__

app = typer.Typer(
    name="sixbar",
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Cross-validation of two models of a press with clearance in its slider's guide.",
    epilog="Exit codes: 0 agree; 1 differ, or a regression; 2 cannot compare or bad input; 3 indeterminate; "
    "70 internal error; 130 interrupted. For several scenes the worst one.",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code."""
    try:
        code = int(typer.main.get_command(app)(arguments, prog_name="sixbar", standalone_mode=False) or 0)
    except _UsageError as error:
        asked = getattr(error.ctx, "command_path", "sixbar")
        return complain(f"{error.format_message()} (see {asked} --help)", 2)
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except SystemExit as end:
        # Typer signals a closed output pipe (head, less) by exit code 1, which here means "differ"; the
        # shell's completion ends so too.
        return 141 if end.code == 1 else int(end.code or 0)
    except Exception as error:
        return fail(error)
    # Some releases of typer convert Ctrl-C to this code themselves.
    return complain("interrupted; finished runs are cached", 130) if code == 130 else code


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"sixbar-crossval {version('sixbar-crossval')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    _version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit."),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def run(
    scene: SceneName,
    model: Model,
    out: Annotated[Path, typer.Option(help="The table to write: .csv or .parquet.")],
    accuracy: Accuracy = None,
    formulation: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Formulation of the equations; default: the scene's."),
    ] = None,
    overrides: Overrides = None,
    quiet: NoProgress = False,
) -> int:
    """Run one scene by one model and write its table, with events and provenance beside it.

    Prints the files that it wrote, the table last.

    The results of a run that stopped early or violates an invariant of its model are written to
    NAME.partial.csv.
    """
    from dataclasses import replace

    from comparison.accuracy.levels import solver_values
    from comparison.accuracy.plan import expectation
    from comparison.engines.registry import find
    from comparison.execution.quality_checks import doubts
    from comparison.execution.run import VIOLATED, Job, RunError, run_uncached, successful
    from comparison.files import check_folder
    from comparison.scene import load_scene, parse_set
    from comparison.tables.table import check_format, write

    find(model)
    check_format(out)
    check_folder(out.parent)
    named = {} if formulation is None else {f"solver.{model}.formulation": formulation}
    loaded = load_scene(scene, parse_set(overrides or []) | named)
    if accuracy is not None:
        values = solver_values(model, accuracy, loaded)
        loaded = loaded.with_values(values)
        for key, value in values.items():
            for line in wrapped(f"{key} = {value:g}: {expectation(loaded, model)}", rest="  "):
                typer.echo(line)
    warn(loaded.warnings)
    job = Job(loaded, model)
    with progress(f"{loaded.name} by {model}", quiet=quiet) as report:
        outcome = run_uncached(job, report)
    if outcome.partial is not None:
        kept = write(outcome.partial, out.with_name(f"{out.stem}.partial{out.suffix}"))
        count = len(outcome.partial.frame)
        samples = f"all {count} samples" if outcome.status == VIOLATED else f"{count} samples until then"
        reported = f"{outcome.message}; {samples} are in {kept}"
        raise RunError(replace(outcome, message=reported), job)
    table = successful(outcome, job)
    path = write(table, out)
    warn(doubts(table))
    events = [] if table.events is None else [path.with_name(f"{path.stem}.events.csv")]
    for each in (*events, path.with_name(f"{path.stem}.json"), path):
        typer.echo(str(each))
    return 0


def plan(
    scene: SceneName,
    overrides: Overrides = None,
) -> int:
    """Show what each model integrates for a scene, what it leaves out and why, and the cost of a run."""
    from comparison.accuracy.plan import channels_line, lines
    from comparison.accuracy.plan import plan as plan_run
    from comparison.execution.run import MODELS
    from comparison.scene import load_scene, parse_set

    loaded = load_scene(scene, parse_set(overrides or []))
    warn(loaded.warnings)
    said = [channels_line(loaded), *(line for model in MODELS for line in lines(plan_run(loaded, model)))]
    for each in said:
        for line in wrapped(each, rest=" " * _PLAN_INDENT):
            typer.echo(line)
    return 0


def compare(
    a: Annotated[Path, typer.Argument(help="A table: .csv, .parquet, .mat, or text of another program.")],
    b: Annotated[Path, typer.Argument(help="The other table.")],
    scene: Annotated[
        str | None, typer.Option(help="Scene of the tables; default: the one recorded beside both.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Allowed difference, as a share of each channel's scale.")
    ] = None,
    mapping: Annotated[
        Path | None, typer.Option(help="TOML file that assigns another program's columns to channels.")
    ] = None,
    out: OutFolder = None,
    json: Annotated[Path | None, typer.Option(help="Also write the numbers to this file.")] = None,
    allow_indeterminate: AllowIndeterminate = False,
) -> int:
    """Compare any two tables, also of other programs. Without a tolerance: metrics and "indeterminate"."""
    from comparison.agreement.compare import Runs, recorded_scene
    from comparison.agreement.compare import compare as compare_runs
    from comparison.cli.verdicts import channel_lines, verdict_lines
    from comparison.files import check_folder, write_json
    from comparison.report.text import EXIT_CODES, as_mapping, exit_code, shift_line
    from comparison.scene import load_scene
    from comparison.tables.imports.mapping import load_mapping
    from comparison.tables.imports.text import read_pair

    if tolerance is not None and not 0 < tolerance < float("inf"):
        raise typer.BadParameter(f"--tolerance {tolerance:g} must be a positive number")
    folder = out or REPORTS / "compare"
    check_folder(folder)
    rules = None if mapping is None else load_mapping(mapping)
    *tables, left_out = read_pair(a, b, rules)
    loaded, warnings = (load_scene(scene), ()) if scene is not None else recorded_scene(*tables)
    if tolerance is None and loaded is not None:
        tolerance = loaded.tolerance
    command = shlex.join(
        ["sixbar", "compare", str(a), str(b)]
        + (["--scene", scene] if scene is not None else [])
        + (["--mapping", str(mapping)] if mapping is not None else [])
        + (["--tolerance", f"{tolerance:g}"] if tolerance is not None else [])
    )
    labels = (a.stem, b.stem) if a.stem != b.stem else (str(a), str(b))
    comparison = compare_runs(
        Runs(tables[0]),
        Runs(tables[1]),
        scene=loaded,
        tolerance=tolerance,
        labels=labels if labels[0] != labels[1] else (f"{a} (a)", f"{b} (b)"),
        command=command,
        warnings=(*left_out, *warnings),
        only=None if rules is None else rules.compare,
    )
    report = write_page([comparison], folder, command)
    if json is not None:
        json.parent.mkdir(parents=True, exist_ok=True)
        write_json(as_mapping(comparison), json)
    for line in (*channel_lines(comparison), *wrapped(shift_line(comparison))):
        typer.echo(line)
    for line in (*verdict_lines([comparison], verbose=True), str(report)):
        typer.echo(line)
    warn(comparison.warnings)
    return exit_code([EXIT_CODES[comparison.verdict]], allow_indeterminate=allow_indeterminate)


for _command in (scenes, channels, plan, run, validate, compare, plot, animate, gate):
    app.command()(_command)
app.add_typer(studies, name="study")
