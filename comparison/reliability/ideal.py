"""The ideal mechanism that a scene's errors are measured against."""

from __future__ import annotations

from comparison.accuracy.levels import coarser
from comparison.scene import Scene, load_scene
from comparison.scene.loading import BASE
from comparison.scene.schema import ExudynSolver, ReferenceSolver

STEPS = 10_000
"""Exudyn's steps per crank cycle, fixed. Constraints alone move an ideal mechanism: positions are right to
1e-12 m whatever the step, velocities to 1e-7 m/s and accelerations to 5e-7 m/s^2 at 150 rpm (of order
step^2), measured against the closed form. The step of 2e-6 s for a clearance would cost twenty times as much.
"""
_WITHOUT_MEANING = ("clearance", "contact", "friction", "initial", "environment")


def ideal_scenes(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the same scene with ideal joints, by its name in `comparison.accuracy.uncertainty.Runs`.

    Samples, speed and bodies are the scene's. What does not affect a motion that the drive alone prescribes
    is set to one value, also gravity and the settings of our two models: scenes that differ in nothing else
    share the run. The reference model has a closed form of the ideal mechanism; Exudyn moves its five
    bodies, in `STEPS` steps per cycle. An installed model keeps its settings.

    Parameters
    ----------
    scene
        Any.
    model
        Whose coarser run gives the uncertainty; one that cannot be refined has none.

    Returns
    -------
    dict of Scene
        ``"base"`` and, where there is one, ``"coarser"``.
    """
    base = load_scene(BASE).data
    values: dict[str, object] = {
        f"{section}.{key}": value for section in _WITHOUT_MEANING for key, value in base[section].items()
    }
    for name, solver in (
        ("reference", ReferenceSolver()),
        ("exudyn", ExudynSolver(step=scene.period / STEPS)),
    ):
        values |= {f"solver.{name}.{key}": value for key, value in solver.model_dump().items()}
    values |= {"joints.slider": "ideal", "joints.crank_pin": "ideal", "output.groups": ["accelerations"]}
    ideal = scene.variant(values)
    coarse = coarser(model, ideal)
    return {"base": ideal} | ({} if coarse is None else {"coarser": coarse})
