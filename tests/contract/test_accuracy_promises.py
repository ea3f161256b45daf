"""What the accuracy table says of the reference's settings is measured again."""

import tomllib
from pathlib import Path

import numpy as np

import reference_model

TABLE = tomllib.loads((Path(__file__).parents[2] / "comparison" / "accuracy.toml").read_text())


def test_reference_settings_keep_what_the_table_promises(scene) -> None:
    """First-cycle error of slider_x at 150 rpm, 0.2 mm against a run at 1e-13."""

    def run(tolerance: float) -> np.ndarray:
        changes = {"drive.cycles": 1.0, "solver.reference.tolerance": tolerance}
        return reference_model.simulate(scene(changes)).columns["slider_x"]

    exact = run(1e-13)
    for row in TABLE["reference"]["table"]:
        assert np.abs(run(row["setting"]) - exact).max() <= row["error"], row
