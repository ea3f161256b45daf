"""Motion of the press from a table, as the positions that an animation shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from comparison.report.mechanism import joints
from comparison.scene import SceneError, scene_from_mapping
from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS
from comparison.tables.table import Table, TableError

NEEDED = ("slider_x", "slider_y", "slider_angle")
FORCES = tuple(f"corner_{corner}_normal" for corner in CORNERS)
FRAMES = 2000
"""Frames at most; also of a long run two hundred or more per cycle remain for ten cycles."""


@dataclass(frozen=True)
class Motion:
    """Positions at the frames, n of them.

    Attributes
    ----------
    time
        s, shape (n,).
    cycle
        Crank cycles since the start, shape (n,).
    links
        Joint -> positions, m, shape (n, 2): "O", "A", "B", "H", "C", "F" with clearances neglected.
    sliders
        Label -> offset from the guide's centre line (m), y (m), angle (rad), shape (n, 3).
    forces
        Label -> corner -> normal force, N, shape (n,); 0 where the table holds none.
    clearance
        Of the slider, m; 0 where it is ideal.
    size
        Width and length of the slider, m.
    """

    time: Array
    cycle: Array
    links: dict[str, Array]
    sliders: dict[str, Array]
    forces: dict[str, dict[str, Array]]
    clearance: float
    size: tuple[float, float]


def motion(tables: Mapping[str, Table], scene: Mapping[str, Any]) -> Motion:
    """Return the motion of the press and of the slider in one table, or in two at the frames of the first.

    Parameters
    ----------
    tables
        Label -> table, at most two.
    scene
        The scene mapping.

    Raises
    ------
    TableError
        If a table lacks the slider's position, or the mechanism cannot be assembled.
    """
    for label, table in tables.items():
        if missing := [name for name in NEEDED if name not in table.channels]:
            raise TableError(
                f"{label}: channel {missing[0]!r} is missing; an animation needs {', '.join(NEEDED)}"
            )
    whole = next(iter(tables.values())).time
    time = whole[:: max(1, -(-len(whole) // FRAMES))]
    mechanism, speed = scene["mechanism"], float(scene["drive"]["speed_rpm"])
    angles = float(mechanism["crank_angle_deg"]) + 6.0 * speed * time
    found = [joints(mechanism, angle) for angle in angles]
    positions = [each for each in found if each is not None]
    if len(positions) < len(found):
        raise TableError("the mechanism of this scene cannot be assembled at every crank angle")
    guide = float(mechanism["guide_x"])
    return Motion(
        time=time,
        cycle=time * abs(speed) / 60.0,
        links={name: np.array([getattr(each, name) for each in positions]) for name in "OABHCF"},
        sliders={
            label: np.column_stack(
                [_at(time, table, name) - (guide if name == "slider_x" else 0.0) for name in NEEDED]
            )
            for label, table in tables.items()
        },
        forces={
            label: {corner: _force(time, table, corner) for corner in CORNERS}
            for label, table in tables.items()
        },
        clearance=float(scene["clearance"]["slider"]) if scene["joints"]["slider"] == "clearance" else 0.0,
        size=(float(mechanism["slider"]["width"]), float(mechanism["slider"]["length"])),
    )


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


def _at(time: Array, table: Table, name: str) -> Array:
    return np.interp(time, table.time, table.values(name))


def _force(time: Array, table: Table, corner: str) -> Array:
    """Return the largest force since the frame before: a contact may be shorter than a frame."""
    name = f"corner_{corner}_normal"
    if name not in table.channels:
        return np.zeros_like(time)
    values = np.abs(table.values(name))
    frame = np.searchsorted(time, table.time)  # the first frame that is not before the sample
    largest = np.zeros_like(time)
    inside = frame < len(time)
    np.maximum.at(largest, frame[inside], values[inside])
    return largest
