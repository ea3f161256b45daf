"""``sixbar settings``: what the settings of both models cost and how much they err on one scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from comparison.cli.console import complain, say, warn, warn_about_the_cache
from comparison.cli.layout import columns, wrapped
from comparison.cli.options import NoProgress, Overrides, SceneName
from comparison.cli.progress import progress

INTERRUPTED = 130


def settings(
    scene: SceneName,
    seconds: Annotated[float, typer.Option(help="Wall time for all runs, s.")] = 60.0,
    out: Annotated[Path | None, typer.Option(help="The work-precision plot to write: .svg.")] = None,
    overrides: Overrides = None,
    quiet: NoProgress = False,
) -> int:
    """Run the settings of both models on a scene, and say which is the cheapest for an error.

    Errors are those of slider_x against the most accurate run that both models confirm. "front" marks what no
    other setting beats in error and processor time. Ctrl-C ends the runs: what was measured is printed.
    """
    from comparison.agreement.refinement.settings_words import basis, commands, table
    from comparison.agreement.refinement.work_precision import work_precision
    from comparison.execution.workers import cpus
    from comparison.files import check_file
    from comparison.report.figures import draw_work_precision
    from comparison.scene import load_scene, parse_set

    if not 0 < seconds < float("inf"):
        raise typer.BadParameter(f"--seconds {seconds:g} must be a positive number")
    if out is not None:
        if out.suffix.lower() != ".svg":
            raise typer.BadParameter(f"{out}: the name must end in .svg")
        out = check_file(out)
    loaded = load_scene(scene, parse_set(overrides or []))
    warn(loaded.warnings)
    warn_about_the_cache()
    with progress(f"settings of {loaded.name}", quiet=quiet) as report:
        found = work_precision(
            loaded,
            seconds,
            n_jobs=cpus(),
            on_finished=lambda share, row: report.finished(share, row.candidate.formulation),
        )
    for line in (*wrapped(basis(found)), *columns(table(found), right=(1, 2))):
        say(line)
    for part, command in commands(found):
        say(f"{part}:")
        say(f"  {command}")
    if out is not None:
        say(str(draw_work_precision(found, out)))
    if found.interrupted:
        # Not the usual line of an interrupted command: timed runs are not cached.
        raise SystemExit(complain("interrupted; the other settings were not measured", INTERRUPTED))
    return 0
