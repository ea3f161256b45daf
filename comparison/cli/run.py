"""``sixbar run``: one scene by one model, with an estimate of its error where an accuracy is asked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli.console import saved, say, warn, warn_about_the_cache
from comparison.cli.layout import wrapped
from comparison.cli.options import Accuracy, Model, NoProgress, Overrides, SceneName
from comparison.cli.progress import progress

if TYPE_CHECKING:
    from comparison.execution.run import Job, Outcome, RunError
    from comparison.scene import Scene
    from comparison.tables.table import Table

NOT_REACHED = 3
"""Exit code where a wanted accuracy is not reachable, or an error could not be estimated: indeterminate."""


def run(
    scene: SceneName,
    model: Model,
    out: Annotated[Path, typer.Option(help="The table to write: .csv or .parquet.")],
    accuracy: Accuracy = None,
    check: Annotated[
        bool | None,
        typer.Option(
            "--check/--no-check",
            help="Estimate the error by further runs of this scene; default: for an accuracy in metres, "
            "where no measurement of this scene is at hand.",
        ),
    ] = None,
    uncertainty: Annotated[
        bool,
        typer.Option("--uncertainty", help="Add the estimated error as a column slider_x_u (--check)."),
    ] = False,
    formulation: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Formulation of the equations; default: the scene's."),
    ] = None,
    overrides: Overrides = None,
    quiet: NoProgress = False,
) -> int:
    """Run one scene by one model and write its table, with events and provenance beside it.

    An accuracy in metres is estimated from further runs of this very scene, and the setting refined until it
    holds on the predictable part of the run. If none does, the best table is written, and the exit code is 3.

    Prints the files that it wrote, the table last.

    The results of a run that stopped early or violates an invariant of its model are written to
    NAME.partial.csv.
    """
    from comparison.accuracy.levels import NAMES, is_measured, unmeasured, with_declared
    from comparison.execution.quality import quality_warnings
    from comparison.execution.run import RunError
    from comparison.files import check_file
    from comparison.models import find
    from comparison.scene import load_scene, parse_set
    from comparison.tables.table_files import check_format, companions, write

    if uncertainty and check is False:
        raise typer.BadParameter("--uncertainty needs the further runs that --no-check leaves out")
    find(model)
    check_format(out)
    out = check_file(out)
    named = {} if formulation is None else {f"solver.{model}.formulation": formulation}
    loaded = with_declared(load_scene(scene, parse_set(overrides or []) | named), [model])
    unasked = check is None
    if check is None:
        own = accuracy is not None and accuracy not in NAMES and not is_measured(loaded, model, accuracy)
        check = uncertainty or own
    code = 0
    try:
        if check:
            table, code = _checked(loaded, model, accuracy, uncertainty=uncertainty, quiet=quiet)
        else:
            table = _single(loaded, model, accuracy, quiet=quiet)
    except RunError as error:
        raise _kept(error, out) from None
    if unasked and accuracy is None and not check and (note := unmeasured(loaded, model)):
        say(f"sixbar: {note}", err=True)
    warn(quality_warnings(table))
    path = saved(lambda folder: write(table, folder / out.name), out.parent)
    for each in (*companions(table, path), path):
        say(str(each))
    return code


def _single(scene: Scene, model: str, accuracy: str | None, *, quiet: bool) -> Table:
    """Run once, at the setting whose measured error bound meets the accuracy."""
    from comparison.accuracy.levels import measured_record, solver_values
    from comparison.accuracy.plan import expectation
    from comparison.execution.run import Job, run_uncached, successful

    record = {}
    if accuracy is not None:
        values = solver_values(model, accuracy, scene)
        scene = scene.variant(values)
        for key, value in values.items():
            for line in wrapped(f"{key} = {value:g}: {expectation(scene, model)}", rest="  "):
                say(line)
        record = {"accuracy": measured_record(scene, model, accuracy)}
    warn(scene.warnings)
    warn_about_the_cache()
    job = Job(scene, model)
    with progress(f"{scene.name} by {model}", quiet=quiet) as report:
        table = successful(run_uncached(job, report), job)
    return replace(table, provenance=table.provenance | record)


def _checked(
    scene: Scene, model: str, accuracy: str | None, *, uncertainty: bool, quiet: bool
) -> tuple[Table, int]:
    """Run with an estimate of the error; the exit code tells whether it is as small as wanted."""
    from comparison.agreement.refinement.accurate_run import accurate_run
    from comparison.agreement.refinement.words import cost_before, result
    from comparison.execution.pool import cpus

    for line in wrapped(cost_before(scene, model, accuracy), rest="  "):
        say(line)
    warn(scene.warnings)
    warn_about_the_cache()
    with progress(f"{scene.name} by {model}", quiet=quiet) as report:
        found = accurate_run(scene, model, accuracy, n_jobs=cpus(), on_progress=report)
    for line in wrapped(result(found), rest="  "):
        say(line)
    return found.with_uncertainty() if uncertainty else found.table, 0 if found.kept else NOT_REACHED


def _kept(error: RunError, out: Path) -> RunError:
    """Write what there is of a run that did not succeed; return the error that says where."""
    from comparison.execution.run import VIOLATED
    from comparison.execution.run import RunError as Error
    from comparison.files import write_text
    from comparison.tables.table_files import write

    outcome: Outcome = error.outcome
    job: Job = error.job
    if outcome.partial is not None:
        partial, name = outcome.partial, f"{out.stem}.partial{out.suffix}"
        kept = saved(lambda folder: write(partial, folder / name), out.parent)
        count = len(outcome.partial.frame)
        samples = f"all {count} samples" if outcome.status == VIOLATED else f"{count} samples until then"
        return Error(replace(outcome, message=f"{outcome.message}; {samples} are in {kept}"), job)
    if outcome.traceback:
        kept = out.with_name(f"{out.stem}.traceback.txt")
        write_text(outcome.traceback, kept)
        return Error(replace(outcome, message=f"{outcome.message}; its traceback is in {kept}"), job)
    return error
