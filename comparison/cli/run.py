"""``sixbar run`` and ``settings``: runs of a scene; ``plot`` and ``animate``: pictures of tables."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli import console
from comparison.cli.console import (
    INTERRUPTED,
    columns,
    complain,
    print_json,
    progress,
    say,
    say_wrapped,
    warn,
)

if TYPE_CHECKING:
    from comparison.execution.run import RunError
    from comparison.tables.table import Table

NOT_REACHED = 3
"""Exit code where a wanted accuracy is not reachable, or an error could not be estimated: indeterminate."""


def run(
    scene: console.SceneName,
    model: console.Model,
    out: Annotated[Path, console.option("FILE", "The table to write: .csv or .parquet.")],
    accuracy: console.Accuracy = None,
    check: Annotated[
        bool,
        console.option(
            None,
            "Estimate the error by further runs of this scene, as for an accuracy in metres, and add it as a "
            "column slider_x_u.",
            "--check",
            "--uncertainty",
        ),
    ] = False,
    formulation: Annotated[
        str | None, console.option("NAME", "Formulation of the equations; by default the scene's.")
    ] = None,
    overrides: console.Overrides = None,
    quiet: console.NoProgress = False,
) -> int:
    """Run one scene by one model and write its table.

    SCENE: a shipped scene or the path of a TOML file. Events and provenance are written beside the table.

    An accuracy in metres is estimated from further runs of this very scene, and the setting refined until it
    holds on the predictable part of the run. If none does, the best table is written, and the exit code is 3.

    The command prints the paths of its files, the table last.

    The results of a run that stopped early or violates an invariant of its model are written to
    NAME.partial.csv.
    """
    from comparison.execution.pool import cpus, kept_workers
    from comparison.models import find

    find(model)
    with kept_workers(ahead=int(model != "reference")):
        from comparison.accuracy.levels import NAMES, forecast, measured_record, solver_values, with_declared
        from comparison.execution.run import Job, RunError, quality_warnings, run_uncached, table_of
        from comparison.files import check_file
        from comparison.scene import load_scene, parse_set
        from comparison.tables.table_files import check_format, companions, write
        from comparison.words.accuracy import accuracy_line, cost_before, expectation, unmeasured_note

        check_format(out)
        out = check_file(out)
        changes = {} if formulation is None else {f"solver.{model}.formulation": formulation}
        setup = with_declared(load_scene(scene, parse_set(overrides or []) | changes), [model])
        if check or accuracy is not None:
            setup.require_press("an accuracy")
        estimated, variant, record = check or accuracy not in (None, *NAMES), setup, {}
        if estimated:
            from comparison.accuracy.refine import accurate_run, expected_cost  # they load scipy

            say_wrapped(cost_before(expected_cost(setup, model, accuracy)), rest="  ")
        elif accuracy is not None:
            values = solver_values(model, accuracy, setup)
            variant = setup.variant(values)
            for key, value in values.items():
                say_wrapped(f"{key} = {value:g}: {expectation(forecast(variant, model))}", rest="  ")
            record = {"accuracy": measured_record(variant, model, accuracy)}
        warn(variant.warnings)
        code, job = 0, Job(variant, model)
        try:
            with progress(f"{variant.name} by {model}", quiet=quiet) as report:
                if estimated:
                    result = accurate_run(setup, model, accuracy, n_jobs=cpus(), on_progress=report)
                else:
                    table = table_of(run_uncached(job, report), job)
        except RunError as error:
            raise _with_partial(error, out) from None
        if estimated:
            say_wrapped(accuracy_line(result), rest="  ")
            table = result.with_uncertainty() if check else result.table
            code = 0 if result.kept else NOT_REACHED
        elif accuracy is None and (note := unmeasured_note(forecast(setup, model))):
            say(f"sixbar: {note}", err=True)
        warn(quality_warnings(table))
        record |= {"reliability": setup.reliability.model_dump()}
        path = write(table.with_record(record), out)
        say(*map(str, (*companions(table, path), path)))
        return code


def _with_partial(error: RunError, out: Path) -> RunError:
    """Write the partial results of a run that did not succeed; return its error with their path."""
    from comparison.execution.run import VIOLATED
    from comparison.files import write_text
    from comparison.tables.table_files import write

    outcome, where = error.outcome, ""
    if (partial := outcome.partial) is not None:
        name = f"{out.stem}.partial{out.suffix}"
        path = write(partial, out.with_name(name))
        count = len(partial.frame)
        samples = f"all {count} samples" if outcome.status == VIOLATED else f"{count} samples until then"
        where = f"; {samples} are in {path}"
    elif outcome.traceback:
        path = out.with_name(f"{out.stem}.traceback.txt")
        write_text(outcome.traceback, path)
        where = f"; its traceback is in {path}"
    return type(error)(replace(outcome, message=f"{outcome.message}{where}"), error.job)


def settings(
    scene: console.SceneName,
    seconds: Annotated[float, console.option("SECONDS", "Wall time for all runs.")] = 60.0,
    out: Annotated[Path | None, console.option("FILE", "The work-precision plot to write: .svg.")] = None,
    overrides: console.Overrides = None,
    quiet: console.NoProgress = False,
    json: console.AsJson = False,
) -> int:
    """Find the cheapest settings of both models on a scene.

    SCENE: a shipped scene or the path of a TOML file. Errors are those of slider_x against the most accurate
    run that both models confirm. "front" marks settings whose error is certainly smaller than that of each
    cheaper one marked. Ctrl-C ends the runs: the settings measured by then are printed.
    """
    from comparison.accuracy.work_precision import work_precision
    from comparison.execution.pool import cpus
    from comparison.report.figures import draw_work_precision
    from comparison.scene import load_scene, parse_set
    from comparison.words.accuracy import settings_basis, settings_commands, settings_table

    console.check_positive("--seconds", seconds)
    if out is not None:
        out = console.check_output(out, ".svg")
    setup = load_scene(scene, parse_set(overrides or []))
    setup.require_press("the search for settings")
    warn(setup.warnings)
    with progress(f"settings of {setup.name}", quiet=quiet) as report:
        result = work_precision(
            setup,
            seconds,
            n_jobs=cpus(),
            on_finished=lambda share, row: report(share, row.candidate.formulation),
        )
    say_wrapped(settings_basis(result), err=json)
    say(*columns(settings_table(result), right=(1, 2)), err=json)
    for part, command in settings_commands(result):
        say(f"{part}:", f"  {command}", err=json)
    if json:
        print_json(
            [
                {
                    "formulation": row.candidate.formulation,
                    "setting": row.candidate.setting,
                    "status": row.status,
                    "error_m": result.error(row),
                    "seconds": row.seconds,
                    "front": row in result.front,
                }
                for row in result.rows
            ]
        )
    if out is not None:
        say(str(draw_work_precision(result, out)), err=json)
    if result.interrupted:
        # Not the usual line of an interrupted command: timed runs are not cached.
        raise SystemExit(complain("interrupted; the other settings were not measured", INTERRUPTED))
    return 0


# ---- pictures of tables


MOST_CHANNELS = 30
_Tables = Annotated[list[Path], typer.Argument(metavar="TABLE", hidden=True)]


def plot(
    tables: _Tables,
    channels: Annotated[
        str, console.option("NAME,NAME", "Channels, a panel each; see `sixbar channels`.")
    ] = "slider_x",
    out: Annotated[Path | None, console.option("FILE", "The picture: .svg (default), .png or .pdf.")] = None,
    start: Annotated[float | None, console.option("SECONDS", "Start of the time shown.", "--from")] = None,
    end: Annotated[float | None, console.option("SECONDS", "End of the time shown.", "--to")] = None,
) -> int:
    """Draw channels of one table, or of two over each other."""
    from comparison.report.figures import picture, write_picture

    path = console.check_output(out or _default_path(tables, ".svg"), ".svg, .png or .pdf")
    names = [name.strip() for name in channels.split(",") if name.strip()]
    if not names:
        raise typer.BadParameter("--channels needs at least one name, see `sixbar channels`")
    if len(names) > MOST_CHANNELS:
        raise typer.BadParameter(f"--channels names {len(names)}; at most {MOST_CHANNELS} fit in a picture")
    if start is not None and end is not None and start >= end:
        raise typer.BadParameter(f"--from {start:g} must be before --to {end:g}")
    write_picture(picture(_read(tables, names), names, start=start, end=end), path)
    say(str(path))
    return 0


def animate(
    tables: _Tables,
    out: Annotated[Path | None, console.option("FILE", "The animation: .html.")] = None,
    scene: console.OfScene = None,
) -> int:
    """Animate the press, and the slider in its guide magnified.

    The HTML file shows the forces at the slider's corners and needs nothing else. Two tables are shown over
    each other.
    """
    from comparison.report.page import write_animation
    from comparison.report.plots import FORCES, MOTION
    from comparison.scene import load_scene
    from comparison.tables.align import cut
    from comparison.tables.table import TableError, slacks

    path = console.check_output(out or _default_path(tables, ".html"), ".html")
    tables_by_label = _read(tables, (*MOTION, *FORCES))
    command = shlex.join(["sixbar", "animate", *map(str, tables), *(["--scene", scene] if scene else [])])
    label, first = next(iter(tables_by_label.items()))
    press = first.scene if scene is None else load_scene(scene)
    if press is None:
        raise TableError(f"{label}: no valid scene is recorded beside the table; name it by --scene")
    press.require_press("the animation")
    for name, table in tables_by_label.items():
        recorded = press.data if table.scene is None else table.scene.data
        differences = [part for part in ("mechanism", "clearance") if recorded.get(part) != press.data[part]]
        differences += ["speed"] * (recorded["drive"].get("speed_rpm") != press.data["drive"]["speed_rpm"])
        warn([f"{name}: recorded of a scene with another {part}" for part in differences])
    times = [table.time for table in tables_by_label.values()]
    (before, after), start, end = slacks(*times), max(t[0] for t in times), min(t[-1] for t in times)
    if start >= end:
        raise TableError(f"{' and '.join(tables_by_label)}: have no common time")
    if any(t[0] < start - before or t[-1] > end + after for t in times):
        warn([f"drawn from {start:g} to {end:g} s: only there both tables have rows"])
    if first.time[0] < start - before or first.time[-1] > end + after:
        tables_by_label[label] = cut(first, start, end)
    title = f"Animation of {' and '.join(tables_by_label)}"
    say(str(write_animation(tables_by_label, press.data, path, title=title, command=command)))
    return 0


def _default_path(tables: list[Path], end: str) -> Path:
    return Path("-".join(table.stem for table in tables[:2]) + end)


def _read(paths: list[Path], channels: Sequence[str]) -> dict[str, Table]:
    """Read one table or two, by name; check these channels, and the contacts that are drawn."""
    from comparison.report.plots import contact_of
    from comparison.tables.table import check
    from comparison.tables.table_files import read

    if len(paths) > 2:
        raise typer.BadParameter(f"{len(paths)} tables: give one or two")
    paths_by_label = {path.stem: path for path in paths}
    if len(paths_by_label) < len(paths):
        paths_by_label = {str(path): path for path in paths}
    if len(paths_by_label) < len(paths):
        raise typer.BadParameter(f"{paths[0]} is given twice")
    tables = {label: read(path) for label, path in paths_by_label.items()}
    for label, table in tables.items():
        subset = table.only([name for name in channels if name != "time"])  # time is no channel
        if any(contact_of(name, None) for name in subset.channels):
            subset = replace(subset, events=table.events, pulses=table.pulses)
        check(subset, subset.channels, name=label)
    return tables
