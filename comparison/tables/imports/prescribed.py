"""Crank angle and speed of a table of this project: no model writes them, since the scene prescribes both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from comparison.tables.imports.exports import Column

ANGLE, SPEED = "crank_angle", "crank_speed"


def prescribed(record: Mapping[str, Any] | None, time: ArrayLike) -> list[Column]:
    """Return the columns of both channels, in rad and rad/s, by the scene recorded beside a table.

    Parameters
    ----------
    record
        Provenance of the table.
    time
        s, shape (n,).

    Returns
    -------
    list of Column
        Empty if there is no such scene.
    """
    scene: Any = (record or {}).get("scene")
    try:
        start, speed = scene["mechanism"]["crank_angle_deg"], scene["drive"]["speed_rpm"]
        start, omega = np.radians(float(start)), float(speed) * np.pi / 30.0
        time = np.asarray(time, dtype=np.float64)
    except (KeyError, TypeError, ValueError):  # of another program's record, or texts among the times
        return []
    return [
        Column(ANGLE, "rad", start + omega * time),
        Column(SPEED, "rad/s", np.full(time.shape, omega)),
    ]
