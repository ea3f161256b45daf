"""What the accuracy table says of the settings that cost little is measured again."""

import tomllib
from pathlib import Path

import numpy as np

import exudyn_model
import reference_model

TABLE = tomllib.loads((Path(__file__).parents[2] / "comparison" / "accuracy.toml").read_text())


def exact(scene) -> np.ndarray:
    """slider_x of the first cycle at 150 rpm, 0.2 mm: within 6e-12 m of the run at 1e-12."""
    changes = {"drive.cycles": 1.0, "solver.reference.tolerance": 1e-13}
    return reference_model.simulate(scene(changes)).columns["slider_x"]


def test_reference_settings_keep_what_the_table_promises(scene) -> None:
    best = exact(scene)
    for row in TABLE["reference"]["table"]:
        changes = {"drive.cycles": 1.0, "solver.reference.tolerance": row["setting"]}
        found = reference_model.simulate(scene(changes)).columns["slider_x"]
        assert np.abs(found - best).max() <= row["error"], row


def test_settings_of_exudyns_tree_keep_what_the_table_promises(scene) -> None:
    """Against the other model: an error that the tree's own finest run shared would be seen."""
    best = exact(scene)
    for row in TABLE["exudyn"]["formulation"]["tree"]["table"]:
        changes = {"drive.cycles": 1.0, "solver.exudyn.formulation": "tree", "solver.exudyn.step": 1e-4}
        changes |= {"solver.exudyn.tolerance": row["setting"], "solver.exudyn.method": "auto"}
        found = exudyn_model.simulate(scene(changes)).columns["slider_x"]
        assert np.abs(found - best).max() <= row["error"], row
