"""``sixbar plot`` and ``sixbar animate``: result tables as one picture, or in motion."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli import console
from comparison.cli.console import say

if TYPE_CHECKING:
    from comparison.tables.table import Table

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

    path = console.check_output(out or _usual(tables, ".svg"), ".svg, .png or .pdf")
    names = [name.strip() for name in channels.split(",") if name.strip()]
    if not names:
        raise typer.BadParameter("--channels needs at least one name, see `sixbar channels`")
    if len(names) > MOST_CHANNELS:
        raise typer.BadParameter(f"--channels names {len(names)}; at most {MOST_CHANNELS} fit in a picture")
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
    from comparison.tables.table import TableError

    path = console.check_output(out or _usual(tables, ".html"), ".html")
    read = _read(tables, (*MOTION, *FORCES))
    command = shlex.join(["sixbar", "animate", *map(str, tables), *(["--scene", scene] if scene else [])])
    label, first = next(iter(read.items()))
    known = first.scene if scene is None else load_scene(scene)
    if known is None:
        raise TableError(f"{label}: no valid scene is recorded beside the table; name it by --scene")
    title = f"Animation of {' and '.join(read)}"
    say(str(write_animation(read, known.data, path, title=title, command=command)))
    return 0


def _usual(tables: list[Path], end: str) -> Path:
    return Path("-".join(table.stem for table in tables[:2]) + end)


def _read(paths: list[Path], channels: Sequence[str]) -> dict[str, Table]:
    """Read one table or two, by name; check these channels, and the contacts that are drawn."""
    from comparison.report.curves import contact_of
    from comparison.tables.table import check
    from comparison.tables.table_files import read

    if len(paths) > 2:
        raise typer.BadParameter(f"{len(paths)} tables: give one or two")
    named = {path.stem: path for path in paths}
    if len(named) < len(paths):
        named = {str(path): path for path in paths}
    if len(named) < len(paths):
        raise typer.BadParameter(f"{paths[0]} is given twice")
    tables = {label: read(path) for label, path in named.items()}
    for label, table in tables.items():
        used = table.only([name for name in channels if name != "time"])  # time is no channel
        if any(contact_of(name, None) for name in used.channels):
            used = replace(used, events=table.events, pulses=table.pulses)
        check(used, used.channels, name=label)
    return tables
