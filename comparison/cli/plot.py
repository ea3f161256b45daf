"""``sixbar plot`` and ``sixbar animate``: result tables as one picture, or in motion."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from comparison.cli.console import say
from comparison.cli.options import OfScene

if TYPE_CHECKING:
    from comparison.tables.table import Table

MOST_CHANNELS = 30
_Start = Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Start of the time shown.")]
_End = Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="End of the time shown.")]
_Tables = Annotated[list[Path], typer.Argument(metavar="TABLE", hidden=True)]


def plot(
    tables: _Tables,
    channels: Annotated[
        str, typer.Option(metavar="NAME,NAME", help="Channels, a panel each; see `sixbar channels`.")
    ] = "slider_x",
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The picture: .svg (default), .png or .pdf.", show_default=False),
    ] = None,
    start: _Start = None,
    end: _End = None,
) -> int:
    """Draw channels of one table, or of two over each other."""
    from comparison.files import check_file
    from comparison.report.pictures.plot import check_format, write_picture

    path = out or _beside(tables, ".svg")
    check_format(path)
    path = check_file(path)
    names = [name.strip() for name in channels.split(",") if name.strip()]
    if not names:
        raise typer.BadParameter("--channels needs at least one name, see `sixbar channels`")
    if len(names) > MOST_CHANNELS:
        raise typer.BadParameter(f"--channels names {len(names)}; at most {MOST_CHANNELS} fit in a picture")
    read = _read(tables)
    _check(read, names)
    say(str(write_picture(read, names, path, start=start, end=end)))
    return 0


def animate(
    tables: _Tables,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The animation: .html.", show_default=False),
    ] = None,
    scene: OfScene = None,
) -> int:
    """Animate the press, and the slider in its guide magnified.

    The HTML file shows the forces at the slider's corners and needs nothing else. Two tables are shown over
    each other.
    """
    from comparison.files import check_file
    from comparison.report.animation import recorded_scene, write_animation
    from comparison.report.plots import FORCES, MOTION
    from comparison.scene import load_scene

    path = out or _beside(tables, ".html")
    if path.suffix.lower() != ".html":
        raise typer.BadParameter(f"{path}: the name must end in .html")
    path = check_file(path)
    read = _read(tables)
    _check(read, (*MOTION, *FORCES))
    options = ["--scene", scene] if scene is not None else []
    command = shlex.join(["sixbar", "animate", *map(str, tables), *options])
    data = load_scene(scene).data if scene is not None else recorded_scene(read)
    title = f"Animation of {' and '.join(read)}"
    say(str(write_animation(read, data, path, title=title, command=command)))
    return 0


def _read(paths: list[Path]) -> dict[str, Table]:
    """Read one table or two, by their names.

    Raises
    ------
    typer.BadParameter
        If they are more.
    """
    from comparison.tables.table_files import read

    if len(paths) > 2:
        raise typer.BadParameter(f"{len(paths)} tables: give one or two")
    labels = [path.stem for path in paths]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in paths]
    if len(set(labels)) < len(labels):
        raise typer.BadParameter(f"{labels[0]} is given twice")
    return {label: read(path) for label, path in zip(labels, paths, strict=True)}


def _check(tables: Mapping[str, Table], names: Sequence[str]) -> None:
    """Reject numbers that cannot be drawn; whether channels are missing is said by what draws them."""
    from comparison.tables.table import check

    for label, table in tables.items():
        used = table.only([name for name in names if name != "time"])  # which is no channel
        check(used, used.channels, name=label)


def _beside(paths: list[Path], ending: str) -> Path:
    return Path("-".join(path.stem for path in paths[:2]) + ending)
