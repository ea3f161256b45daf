"""What is run for a scene's reliability: its base run with more samples, and the ideal mechanism."""

from __future__ import annotations

from math import ceil

from comparison.accuracy.levels import coarser
from comparison.scene import Scene, load_scene
from comparison.scene.loading import BASE
from comparison.scene.schema import ExudynSolver, ReferenceSolver

STEPS = 10_000
"""Exudyn's steps per crank cycle, fixed. Constraints alone move an ideal mechanism: positions are right to
1e-12 m whatever the step, velocities to 1e-7 m/s and accelerations to 5e-7 m/s^2 at 150 rpm (of order
step^2), measured against the closed form. The step of 2e-6 s for a clearance would cost twenty times as much.
"""
DENSE = 10_000
"""Samples per crank cycle at least, of which the reliability is computed: contacts last some 5 intervals. On
1,000 R of the central case's acceleration is wrong by 4e-4, on these by 6e-7."""
MOST = 400_000
"""Samples of a run at most, some 80 MB: of a run of more than 40 cycles fewer are taken a cycle."""
_WITHOUT_MEANING = ("clearance", "contact", "friction", "initial", "environment")


def dense_scene(scene: Scene) -> Scene:
    """Return a scene with at least `DENSE` samples a cycle, a whole multiple of its own.

    Without forces at corners, which nobody reads there. The steps of a run do not depend on its samples, but
    for those of five bodies, which are whole parts of a sample interval.
    """
    output, cycles = scene.data["output"], scene.data["drive"]["cycles"]
    own = int(output["samples_per_cycle"])
    times = max(1, min(ceil(DENSE / own), int(MOST / (own * cycles))))
    groups = dict.fromkeys(["accelerations", *(name for name in output["groups"] if name != "corners")])
    return scene.variant({"output.samples_per_cycle": own * times, "output.groups": list(groups)})


def ideal_scenes(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the same scene with ideal joints, by its name in `comparison.accuracy.uncertainty.Runs`.

    Speed and bodies are the scene's, samples those of `dense_scene`, but a coarser run's the scene's. What
    does not affect a motion that the drive alone prescribes is set to one value, also gravity and the
    settings of our two models: scenes that differ in nothing else share the run. The reference model has a
    closed form of the ideal mechanism; Exudyn moves its five bodies, in `STEPS` steps per cycle. An installed
    model keeps its settings.

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
    # Its step, twice that of the other, would not fit between dense samples
    return {"base": dense_scene(ideal)} | ({} if coarse is None else {"coarser": coarse})
