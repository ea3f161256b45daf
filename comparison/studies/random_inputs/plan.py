"""What the study random-inputs runs."""

from __future__ import annotations

from comparison.scene import Scene, load_scene
from comparison.studies.random_inputs.draws import Draws
from comparison.studies.random_inputs.inputs import inputs_of

SCENE = "150rpm-0.2mm"
SAMPLES = 500
"""A turn. Peaks of the acceleration last less: what is between samples is seen by none of these runs."""
TOLERANCE = 1e-10
RUNS = 10_000
PLANE = 400
"""Runs that a plane is fitted to."""
FACTORS = (0.003, 0.03, 0.3, 1.0)
"""Scales of the scatter over which a gradient is measured."""
TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
COMMON = 2000
"""Runs with the same inputs at every tolerance."""
MONTE_CARLO, GRADIENT = 1, 2
"""Seeds."""


def scene(tolerance: float = TOLERANCE) -> Scene:
    """Return two turns of the scene."""
    values: dict[str, object] = {
        "drive.cycles": 2.0,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": SAMPLES,
        "solver.reference.tolerance": tolerance,
    }
    return load_scene(SCENE, values)


def monte_carlo() -> Draws:
    """Return the many runs."""
    return Draws(scene(), inputs_of(scene()), RUNS, MONTE_CARLO)


def planes() -> dict[float, Draws]:
    """Return the runs of each scale's plane."""
    return {factor: Draws(scene(), inputs_of(scene()), PLANE, GRADIENT, factor) for factor in FACTORS}


def coarser() -> dict[float, Draws]:
    """Return the runs of each tolerance; at the usual one they are the first of the many."""
    inputs = inputs_of(scene())
    return {tolerance: Draws(scene(tolerance), inputs, COMMON, MONTE_CARLO) for tolerance in TOLERANCES}
