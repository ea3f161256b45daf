"""The two tiers at which a scene is compared: standard (as a user runs it) and tight.

At the standard tier the models run with the scene's settings. At the tight tier the reference runs at
``strict`` and Exudyn integrates its tree of free bodies with its explicit solver (error bounds by scene:
``measured.toml``); where a scene requires five bodies (no clearance, reactions), it runs with the
scene's settings. The thresholds of a tier are in ``thresholds.toml``.
"""

from __future__ import annotations

from comparison.accuracy.levels import solver_values
from comparison.models import OWN, smallest_in_exudyn
from comparison.scene import Scene

TIERS = ("standard", "tight")


def tight(scene: Scene, models: tuple[str, str]) -> Scene | None:
    """Return the scene with the models' settings of the tight tier; None if one of them is not built in.

    The accuracy of another package's model is unmeasured.
    """
    if not set(models) <= set(OWN):
        return None
    values: dict[str, object] = {}
    if "reference" in models:
        values |= solver_values("reference", "strict", scene)
    if "exudyn" in models and smallest_in_exudyn(scene.data) == "tree":
        tree: dict[str, object] = {"solver.exudyn.formulation": "tree"}
        values |= tree | solver_values("exudyn", "strict", scene.variant(tree))
    return scene.variant(values)
