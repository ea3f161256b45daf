"""Run a scene: the function that the entry point names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

import numpy as np

from pinocchio_press.integration import StepError, integrate
from pinocchio_press.motion import FREE, INTEGRALS, Motion
from pinocchio_press.press import Vector
from pinocchio_press.recording import Recording

TOLERANCE = 1e-10
"""Absolute local error of the angles, rad, where the scene gives none."""
LIMIT = 100_000
"""Steps and parts of steps in a cycle after which a run is stopped: over twenty times those of the shipped
scenes at 1e-12. The law "paper-switching" adds energy without bound where a slider is wedged.
"""


def simulate(scene: Mapping[str, Any], *, progress: Callable[[float], None] | None = None) -> SimpleNamespace:
    """Simulate the press.

    Parameters
    ----------
    scene
        Complete scene; of ``[solver.pinocchio]`` the ``tolerance``, absolute local error of the angles of
        rod 4 and slider (rad).
    progress
        Called with the finished share, 0 to 1.

    Returns
    -------
    SimpleNamespace
        As ``docs/engine.md`` requires. Status "step-too-small": the tolerance is below the rounding of the
        contact forces; "work-limit": more steps than `LIMIT` a cycle.

    Raises
    ------
    ValueError
        If the scene is outside the model, or the mechanism cannot be assembled.
    """
    if scene["joints"]["crank_pin"] == "clearance":
        raise ValueError("joints.crank_pin = 'clearance' must be 'ideal': only the slider has clearance here")
    tolerance = scene["solver"].get("pinocchio", {}).get("tolerance", TOLERANCE)
    if not (isinstance(tolerance, float) and 1e-14 <= tolerance < 1e-3):
        raise ValueError(f"solver.pinocchio.tolerance = {tolerance!r} must be real, 1e-14 to 1e-3 rad")
    drive, per_cycle = scene["drive"], scene["output"]["samples_per_cycle"]
    cycle = 60.0 / abs(drive["speed_rpm"])
    times = np.arange(round(drive["cycles"] * per_cycle) + 1) / per_cycle * cycle
    motion = Motion(scene)
    for t in times:  # what cannot be assembled is refused before it is run
        motion.linkage.at(t)
    y = motion.start(scene["initial"])
    record = Recording(motion, y, times, scene["output"]["groups"])
    status, remedy, pieces, switches = "success", "", 0, 0
    try:
        for piece in integrate(motion, y, times[-1], _tolerances(tolerance), cycle / 200.0):
            if pieces == LIMIT * max(1.0, drive["cycles"]):
                status, remedy = "work-limit", f"{pieces} steps up to {piece.start:g} s; run fewer cycles"
                break
            record.add(piece)
            pieces, switches = pieces + 1, switches + (piece.switched is not None)
            if progress:
                progress(piece.end / times[-1])
        else:
            record.finish()
    except StepError as error:
        status, remedy = "step-too-small", f"{error}; set a larger solver.pinocchio.tolerance"
    record.close()
    return SimpleNamespace(
        columns={name: np.array(values) for name, values in record.columns.items()},
        events=record.events(),
        extrema={},
        provenance={
            "integrator": "DOP853 between switching instants",
            "settings": {"tolerance": tolerance},
            "counters": {"pieces": pieces, "switches": switches},
            "versions": {name: version(name) for name in ("pin", "numpy", "scipy")},
        },
        status=status,
        remedy=remedy,
    )


def _tolerances(angle: float) -> Vector:
    """Return the absolute tolerance of each component: angles, their rates, integrals (J and N s).

    An error of a rate acts over a flight of some 10 ms.
    """
    tolerance = np.full(FREE + INTEGRALS, angle)
    tolerance[2:4] = angle / 0.01
    return tolerance
