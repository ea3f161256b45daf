"""Command line ``sixbar``; each command imports what it needs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from comparison.cli.compare import compare
from comparison.cli.console import (
    complain,
    fail,
    progress,
    saved,
    say,
    session,
    warn,
    warn_about_the_cache,
)
from comparison.cli.gate import gate
from comparison.cli.options import Accuracy, Overrides
from comparison.cli.study import studies
from comparison.cli.validate import validate

# The class raised by this typer: some of its releases vendor click.
_UsageError: Any = typer.BadParameter.__base__

app = typer.Typer(
    name="sixbar",
    add_completion=False,
    rich_markup_mode=None,
    help="Cross-validation of two models of a press with clearance in its slider's guide.",
    epilog="Exit codes: 0 agree; 1 differ, or a regression; 2 cannot compare or bad input; 3 indeterminate; "
    "70 internal error; 130 interrupted. For several scenes the worst one.",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code."""
    try:
        with session(program=arguments is None):
            return _main(sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt:
        return complain("interrupted", 130)


def _main(arguments: Sequence[str]) -> int:
    if bad := [text for text in arguments if any("\ud800" <= character <= "\udfff" for character in text)]:
        return complain(f"{bad[0]}: is not UTF-8; files and folders must have names that are", 2)
    try:
        Path.cwd()
    except OSError:
        return complain("the working directory does not exist any more, or cannot be read", 2)
    try:
        code = int(typer.main.get_command(app)(arguments, prog_name="sixbar", standalone_mode=False) or 0)
    except _UsageError as error:
        asked = getattr(error.ctx, "command_path", "sixbar")
        return complain(f"{error.format_message()} (see {asked} --help)", 2)
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except SystemExit:
        # Typer signals a closed output pipe (head, less) by exit code 1, which here means "differ".
        return 141
    except Exception as error:
        return fail(error)
    # Some releases of typer convert Ctrl-C to this code themselves.
    return complain("interrupted; finished runs are cached", 130) if code == 130 else code


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        say(f"sixbar-crossval {version('sixbar-crossval')}")
        raise typer.Exit


@app.callback()
def _root(
    _version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit."),
    ] = False,
) -> None:
    pass


@app.command()
def scenes() -> int:
    """List the shipped scenes: name, speed, clearance, title."""
    from comparison.scene import load_scene, shipped_scenes

    for name in shipped_scenes():
        scene = load_scene(name)
        where = [joint for joint in ("slider", "crank_pin") if scene.data["joints"][joint] == "clearance"]
        size = " + ".join(f"{scene.data['clearance'][joint] * 1e3:g} mm" for joint in where) or "no clearance"
        say(f"{name:<16} {scene.data['drive']['speed_rpm']:>6g} rpm  {size:<15}  {scene.title}")
    return 0


@app.command()
def run(
    scene: Annotated[str, typer.Argument(help="A shipped scene or the path of a TOML file.")],
    model: Annotated[
        str, typer.Option(metavar="NAME", help="Model: reference, exudyn, or one of another package.")
    ],
    out: Annotated[Path, typer.Option(help="The table to write: .csv or .parquet.")],
    accuracy: Accuracy = None,
    formulation: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Formulation of the equations; default: the scene's."),
    ] = None,
    overrides: Overrides = None,
) -> int:
    """Run one scene by one model and write its table, with events and provenance beside it.

    The results of a run that stopped early or violates an invariant of its model are written to
    NAME.partial.csv.
    """
    from dataclasses import replace

    from comparison.accuracy.levels import solver_values, with_declared
    from comparison.accuracy.plan import expectation
    from comparison.engines.registry import find
    from comparison.execution.quality_checks import doubts
    from comparison.execution.run import VIOLATED, Job, RunError, run_uncached, successful
    from comparison.files import check_file, write_text
    from comparison.scene import load_scene, parse_set
    from comparison.tables.table import check_format, write

    find(model)
    check_format(out)
    out = check_file(out)
    named = {} if formulation is None else {f"solver.{model}.formulation": formulation}
    loaded = with_declared(load_scene(scene, parse_set(overrides or []) | named), [model])
    if accuracy is not None:
        values = solver_values(model, accuracy, loaded)
        loaded = loaded.with_values(values)
        for key, value in values.items():
            say(f"{key} = {value:g}: {expectation(loaded, model)}")
    warn(loaded.warnings)
    warn_about_the_cache()
    job = Job(loaded, model)
    with progress(f"{loaded.name} by {model}") as report:
        outcome = run_uncached(job, report)
    if outcome.partial is not None:
        partial, name = outcome.partial, f"{out.stem}.partial{out.suffix}"
        kept = saved(lambda folder: write(partial, folder / name), out.parent)
        count = len(outcome.partial.frame)
        samples = f"all {count} samples" if outcome.status == VIOLATED else f"{count} samples until then"
        reported = f"{outcome.message}; {samples} are in {kept}"
        raise RunError(replace(outcome, message=reported), job)
    if outcome.traceback:
        kept = out.with_name(f"{out.stem}.traceback.txt")
        write_text(outcome.traceback, kept)
        reported = f"{outcome.message}; its traceback is in {kept}"
        raise RunError(replace(outcome, message=reported), job)
    table = successful(outcome, job)
    warn(doubts(table))
    path = saved(lambda folder: write(table, folder / out.name), out.parent)
    say(str(path))
    return 0


@app.command()
def plan(
    scene: Annotated[str, typer.Argument(help="A shipped scene or the path of a TOML file.")],
    overrides: Overrides = None,
) -> int:
    """Show what each model integrates for a scene, what it leaves out and why, and the cost of a run."""
    from comparison.accuracy.plan import channels_line, lines
    from comparison.accuracy.plan import plan as plan_run
    from comparison.execution.run import MODELS
    from comparison.scene import load_scene, parse_set

    loaded = load_scene(scene, parse_set(overrides or []))
    warn(loaded.warnings)
    say(channels_line(loaded))
    for model in MODELS:
        for line in lines(plan_run(loaded, model)):
            say(line)
    return 0


app.command()(compare)
app.command()(validate)
app.command()(gate)
app.add_typer(studies, name="study")
