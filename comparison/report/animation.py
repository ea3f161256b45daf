"""Animation of the press and of the magnified slider as one offline HTML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from comparison.metrics.contacts import noted
from comparison.report.plots import FORCES, MOTION, table_plots
from comparison.report.schematic import joints, schematic
from comparison.report.templates import interactive_page, write_page
from comparison.scene import SceneError, scene_from_mapping
from comparison.tables.table import Table, TableError

_ANGLES = 360
"""Of a turn, at which the mechanism must be assembled."""


def write_animation(
    tables: Mapping[str, Table], scene: Mapping[str, Any], path: Path, *, title: str, command: str
) -> Path:
    """Write the animation of one table, or two over each other, into an HTML file that needs nothing else.

    Parameters
    ----------
    tables
        Label -> table, at most two; shown at the times of the first.
    scene
        The scene mapping.
    path
        The file; its folder is made.
    title, command
        Heading, and what reproduces the page.

    Raises
    ------
    TableError
        If a table lacks the slider's position or has no two samples, or the mechanism cannot be assembled.
    """
    for label, table in tables.items():
        if missing := [name for name in MOTION if name not in table.channels]:
            raise TableError(
                f"{label}: channel {missing[0]!r} is missing; an animation needs {', '.join(MOTION)}"
            )
        if table.time.size < 2:
            raise TableError(f"{label}: an animation needs two samples at least")
    mechanism, speed = scene["mechanism"], float(scene["drive"]["speed_rpm"])
    start, time = float(mechanism["crank_angle_deg"]), next(iter(tables.values())).time
    turn = min(360.0, 6.0 * abs(speed) * float(time[-1] - time[0]))
    if any(
        joints(mechanism, start + angle) is None for angle in np.sign(speed) * np.linspace(0, turn, _ANGLES)
    ):
        raise TableError("the mechanism of this scene cannot be assembled at every crank angle")
    html = interactive_page(
        "animation.html.j2",
        title=title,
        labels=list(tables),
        seconds=float(time[-1] - time[0]),
        cycles=float(time[-1] - time[0]) * abs(speed) / 60.0,
        schematic=schematic(scene),
        plots=table_plots(
            tables,
            (*MOTION, *FORCES),
            period=60.0 / abs(speed),
            guide=float(mechanism["guide_x"]),
            pulses=[noted(table) for table in tables.values()],
        ),
        command=command,
    )
    return write_page(html, path)


def recorded_scene(tables: Mapping[str, Table]) -> Mapping[str, Any]:
    """Return the scene recorded beside the first table.

    Raises
    ------
    TableError
        If there is none, or it is not valid.
    """
    label, table = next(iter(tables.items()))
    scene = table.provenance.get("scene")
    if not isinstance(scene, dict):
        raise TableError(f"{label}: no scene is recorded beside the table; name it by --scene")
    try:
        # The model of a table need not be installed here.
        return scene_from_mapping({key: part for key, part in scene.items() if key != "solver"}).data
    except SceneError as error:
        raise TableError(f"{label}: the recorded scene is not valid: {error}; name one by --scene") from error
