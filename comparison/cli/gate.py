"""``sixbar gate``: check whether a model has changed since its baseline was recorded."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from comparison.cli.console import print_json, saved, say, warn, warn_about_the_cache, wrapped
from comparison.cli.options import REPORTS, AsJson, Jobs, OutFolder, Quiet
from comparison.cli.progress import progress

if TYPE_CHECKING:
    from comparison.regression.check import Gate
    from comparison.scene import Scene
    from comparison.words.cases import Case

BASELINE = Path("sixbar-baseline.toml")
SHOWN = 20  # lines of regressions on a terminal; the files hold all


def gate(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE", hidden=True),
    ] = None,
    baseline: Annotated[Path, typer.Option(metavar="FILE", help="The baseline.")] = BASELINE,
    update: Annotated[
        bool,
        typer.Option(
            "--update",
            help="Recreate the baseline for its scenes and those named; "
            "a new baseline without names: the shipped scenes.",
        ),
    ] = False,
    out: OutFolder = None,
    jobs: Jobs = None,
    quiet: Quiet = False,
    json: AsJson = False,
) -> int:
    """Compare each model with its baseline: a regression gate for CI.

    SCENE: shipped names or TOML files; by default those of the baseline.
    """
    from comparison.execution.pool import cpus
    from comparison.files import check_folder, expanded
    from comparison.regression.baseline import read, scenes_of
    from comparison.regression.check import gate as hold_against
    from comparison.scene import load_scene
    from comparison.words.regression import summary

    folder, baseline = out or REPORTS / "gate", expanded(baseline)
    asked = [load_scene(name) for name in dict.fromkeys(scenes or [])]
    _check_names([scene.name for scene in asked])
    if update and json:
        raise typer.BadParameter("--json prints a check: with --update nothing is checked")
    if update:
        return _update(asked, baseline, jobs or cpus(), quiet=quiet)
    folder = check_folder(folder)
    record = read(baseline)
    chosen, gone = (asked, []) if scenes else scenes_of(record, baseline.parent)
    warn_about_the_cache()
    with progress("gate", quiet=quiet) as report:
        result = hold_against(record, chosen, gone, n_jobs=jobs or cpus(), on_progress=report)
    command = shlex.join(["sixbar", "gate", *(scenes or []), "--baseline", str(baseline)])
    lines = [summary(result)] if quiet else _lines(result)
    say(*(part for line in lines for part in wrapped(line, rest="    ")), err=json)
    if json:
        print_json(_numbers(result, command))
    page = saved(lambda folder: _write(result, folder, command), folder)
    say(str(page), err=json)
    return result.exit_code


def _update(asked: Sequence[Scene], path: Path, jobs: int, *, quiet: bool) -> int:
    from comparison.files import check_file
    from comparison.regression.baseline import read, scenes_of, write
    from comparison.regression.record import renewed
    from comparison.scene import load_scene, shipped_scenes

    check_file(path)
    old = read(path) if path.exists() else None
    held, gone = ([], []) if old is None else scenes_of(old, path.parent)
    warn([f"scene {name!r} of the old baseline no longer exists and is left out" for name in gone])
    if not asked and not held:
        asked = [load_scene(name) for name in shipped_scenes()]
    scenes = {scene.name: scene for scene in (*held, *asked)}
    warn_about_the_cache()
    with progress("baseline", quiet=quiet) as report:
        made = renewed(
            [scenes[name] for name in sorted(scenes)], path.parent, old, n_jobs=jobs, on_progress=report
        )
    for name, scene in made.scenes.items():
        points = sum(len(points) for run in scene.runs.values() for points in run.channels.values())
        say(f"{name}: {len(scene.runs)} runs, {points} checkpoints")
    say(str(saved(lambda folder: write(made, folder / path.name), path.parent)))
    return 0


def _check_names(names: Sequence[str]) -> None:
    from comparison.scene import SceneError

    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a baseline must be unique")


def _lines(result: Gate) -> list[str]:
    """Return the lines for the terminal: notes, regressions, and a summary sentence."""
    from comparison.words.regression import message, notes, summary

    regressions = result.regressions
    lines = [f"note: {note}" for note in notes(result)]
    lines += [f"REGRESSION {message(check)}" for check in regressions[:SHOWN]]
    if len(regressions) > SHOWN:
        lines.append(f"... and {len(regressions) - SHOWN} more")
    return [*lines, summary(result)]


def _write(result: Gate, folder: Path, command: str) -> Path:
    """Write JSON, JUnit XML and the Markdown summary, and return the path of the latter."""
    from comparison.files import replacing_in

    with replacing_in(folder) as part:
        page = _write_files(result, part, command)
    return folder / page.name


def _write_files(result: Gate, folder: Path, command: str) -> Path:
    from comparison.files import write_json
    from comparison.report.ci import write_job_summary, write_junit
    from comparison.words.regression import cases, notes, summary

    checks, remarks = cases(result), notes(result)
    write_junit(checks, folder / "junit.xml", name="sixbar gate")
    write_json(_numbers(result, command), folder / "gate.json")
    groups = dict.fromkeys((case.suite, case.group) for case in checks)
    return write_job_summary(
        folder / "summary.md",
        title="Has a model changed since its baseline?",
        sentences=[
            f"{summary(result)}.",
            *(f"Note: {note}." for note in remarks),
            f"Made by: {command}",
        ],
        headings=("scene", "run", "passed", "failed", "skipped"),
        rows=[(*group, *_counted(checks, group)) for group in groups],
        cases=checks,
    )


def _numbers(result: Gate, command: str) -> dict[str, Any]:
    from comparison.words.regression import cases, notes

    return {
        "command": command,
        "exit_code": result.exit_code,
        "notes": notes(result),
        "checks": [asdict(case) for case in cases(result)],
    }


def _counted(cases: Sequence[Case], group: tuple[str, str]) -> list[str]:
    statuses = [case.status for case in cases if (case.suite, case.group) == group]
    failed = statuses.count("failed") + statuses.count("error")
    return [str(number) for number in (statuses.count("passed"), failed, statuses.count("skipped"))]
