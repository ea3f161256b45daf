"""``sixbar gate``: check whether a model has changed since its baseline was recorded."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from comparison.cli import console
from comparison.cli.console import print_json, progress, say, warn, wrapped

if TYPE_CHECKING:
    from comparison.scene import Scene

BASELINE = Path("sixbar-baseline.toml")
MOST_LINES = 15  # most lines on a terminal; the files hold all


def gate(
    scenes: Annotated[list[str] | None, typer.Argument(metavar="SCENE", hidden=True)] = None,
    baseline: Annotated[Path, console.option("FILE", "The baseline.")] = BASELINE,
    update: Annotated[
        bool,
        console.option(
            None,
            "Recreate the baseline for the scenes named, or for all of its scenes; "
            "a new baseline without names: the shipped scenes.",
            "--update",
        ),
    ] = False,
    out: console.OutFolder = None,
    jobs: console.Jobs = None,
    quiet: console.Quiet = False,
    json: console.AsJson = False,
) -> int:
    """Compare each model with its baseline: a regression gate for CI.

    SCENE: shipped names or TOML files; by default those of the baseline.
    """
    from comparison.execution.pool import cpus
    from comparison.files import check_folder, expand_home, replacing_in, write_json
    from comparison.regression.check import gate as check_against
    from comparison.regression.record import read, scenes_of
    from comparison.report.ci import write_job_summary, write_junit
    from comparison.report.page import write_gate
    from comparison.scene import load_scene
    from comparison.words.record import gate_counts, gate_lines, gate_notes, gate_summary, of_gate

    baseline = expand_home(baseline)
    selection = [load_scene(name) for name in dict.fromkeys(scenes or [])]
    console.check_unique([scene.name for scene in selection], "baseline")
    if update and json:
        raise typer.BadParameter("--json prints a check: with --update nothing is checked")
    if update:
        return _update(selection, baseline, jobs or cpus(), quiet=quiet)
    folder = check_folder(out or console.REPORTS / "gate")
    record = read(baseline)
    checked_scenes, missing = (selection, []) if scenes else scenes_of(record, baseline.parent)
    with progress("gate", quiet=quiet) as report:
        result = check_against(record, checked_scenes, missing, n_jobs=jobs or cpus(), on_progress=report)
    cases, remarks, deviations = of_gate(result), gate_notes(result), gate_lines(result)
    texts = [f"REGRESSION {line}" for line in deviations]
    texts[1:1] = [f"note: {note}" for note in remarks]  # such as that a scene has changed: a cause
    summary = wrapped(gate_summary(result), rest="    ")
    lines = [] if quiet else [line for text in texts for line in wrapped(text, rest="    ")]
    room = MOST_LINES - 1 - len(summary)  # the path of the page is the last line
    if len(lines) > room:
        lines = [*lines[: room - 1], f"... {len(lines) - room + 1} more lines are on the page"]
    say(*lines, *summary, err=json)
    numbers: dict[str, Any] = {
        "command": shlex.join(["sixbar", "gate", *(scenes or []), "--baseline", str(baseline)]),
        "exit_code": result.exit_code,
        "notes": remarks,
        "checks": [case._asdict() for case in cases],
    }
    if json:
        print_json(numbers)
    sentences = [f"{line}." for line in (*deviations[:1], gate_summary(result))]
    sentences += [f"Note: {note}." for note in remarks]
    with replacing_in(folder) as part:
        write_junit(cases, part / "junit.xml", name="sixbar gate")
        write_json(numbers, part / "gate.json")
        write_job_summary(
            part / "summary.md",
            title="Has a model changed since its baseline?",
            sentences=[*sentences, f"Made by: {numbers['command']}"],
            headings=("scene", "run", "passed", "failed", "skipped"),
            rows=gate_counts(result),
            cases=cases,
        )
        write_gate(result, part / "report.html", command=numbers["command"], lead=deviations)
    say(str(folder / "report.html"), err=json)
    return result.exit_code


def _update(selection: Sequence[Scene], path: Path, jobs: int, *, quiet: bool) -> int:
    from comparison.files import check_file
    from comparison.regression.record import new_baseline, read, same_origin, scenes_of, write
    from comparison.scene import load_scene, shipped_scenes

    check_file(path)
    old = read(path) if path.exists() else None
    if old is not None and not (selection and same_origin(old)):
        recorded, missing = scenes_of(old, path.parent)
        warn([f"scene {name!r} of the old baseline no longer exists and is left out" for name in missing])
        if selection:
            warn(["platform, versions or thresholds changed: all scenes of the baseline are made anew"])
        selection = [*recorded, *selection]
        old = old.model_copy(update={"scenes": {}})
    scenes = {scene.name: scene for scene in selection or map(load_scene, shipped_scenes())}
    with progress("baseline", quiet=quiet) as report:
        scene_list = [scenes[name] for name in sorted(scenes)]
        new = new_baseline(scene_list, path.parent, old, n_jobs=jobs, on_progress=report)
    for name in sorted(scenes):
        scene = new.scenes[name]
        points = sum(len(points) for run in scene.runs.values() for points in run.channels.values())
        say(f"{name}: {len(scene.runs)} runs, {points} checkpoints")
    if others := len(new.scenes) - len(scenes):
        say(f"{others} other scene{'s are' if others > 1 else ' is'} kept")
    say(str(write(new, path)))
    return 0
