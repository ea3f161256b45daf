"""A load's table is interpolated between its rows, however steep; its forces: test_states.py."""

from pathlib import Path

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

CASES = Path(__file__).parents[1] / "cases" / "physics"
SURFACE = -0.0318
TABLES = {
    "jump": [[0.0, 0.0], [1e-30, 100.0]],
    "there and back": [[0.0, 0.0], [1e-18, 300.0], [1e-3, 100.0], [1e-3 + 1e-15, 0.1], [2e-3, 0.3]],
    "spike": [[0.0, 0.0], [1e-3, 100.0], [1.000001e-3, 5000.0], [1.000002e-3, 100.0]],
    "gentle": [[0.0, 0.0], [1e-3, 300.0], [1.5e-3, 50.0], [4e-3, 500.0]],
}
TIGHT = {
    "solver.reference.tolerance": 1e-12,
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.tolerance": 1e-12,
}
FREE = {
    "mechanism.crank_angle_deg": 285.0, "drive.cycles": 0.07, "load.surface": SURFACE,
    "clearance.slider": 2e-2, "initial.slider_offset": 0.0, "output.samples_per_cycle": 500,
}  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "contacts"), [*((rows, False) for rows in TABLES), ("jump", True), ("there and back", True)]
)
def test_both_models_move_alike_into_the_workpiece_and_out_of_it(rows, contacts):
    """In free flight, which magnifies nothing; or with twenty contacts after it: measured 6e-11 m."""
    scene = CASES / "load-step.toml" if contacts else "150rpm-0.2mm"
    data = load_scene(scene, TIGHT | ({} if contacts else FREE) | {"load.table": TABLES[rows]}).data
    one, other = (model.simulate(data) for model in (reference_model, exudyn_model))
    assert one.status == other.status == "success"
    # Two corners that touch at one instant may stand in either order
    assert sorted(one.events["corner"]) == sorted(other.events["corner"])
    assert (len(one.events["corner"]) > 0) == contacts
    for name in ("slider_x", "slider_y"):
        assert np.abs(one.columns[name] - other.columns[name]).max() < 1e-9
    assert contacts or one.columns["slider_y"].min() < SURFACE - 1e-3
