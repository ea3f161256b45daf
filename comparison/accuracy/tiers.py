"""The two settings at which a scene is compared: what a user would run, and the closest look.

At the standard tier the models run as the scene says. At the tight tier the reference runs at ``strict`` and
Exudyn integrates what the drive leaves free with its explicit solver (what both promise on which scene stands
in ``measured.toml``); where a scene needs all five bodies (no clearance, reactions), these run as the scene
says. The numbers by which a tier judges stand in ``thresholds.toml``.
"""

from __future__ import annotations

from comparison.accuracy.levels import solver_values
from comparison.engines.registry import OWN
from comparison.scene import Scene
from comparison.scene.formulation import smallest_in_exudyn

TIERS = ("standard", "tight")


def tight(scene: Scene, models: tuple[str, str]) -> Scene | None:
    """Return the scene with the models' settings of the tight tier; None where one of them is not ours.

    Nobody has measured what another package's model is capable of.
    """
    if not set(models) <= set(OWN):
        return None
    values: dict[str, object] = {}
    if "reference" in models:
        values |= solver_values("reference", "strict", scene)
    if "exudyn" in models and smallest_in_exudyn(scene.data) == "tree":
        tree: dict[str, object] = {"solver.exudyn.formulation": "tree"}
        values |= tree | solver_values("exudyn", "strict", scene.with_values(tree))
    return scene.with_values(values)
