"""A load's table is interpolated between its rows, however steep, by both models: force, energy, motion."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene
from exudyn_model.parameters import read_scene
from exudyn_model.workpiece import workpiece_array, workpiece_forces
from reference_model.parameters import read_parameters
from reference_model.workpiece import load_energy, load_force

CASES = Path(__file__).parents[1] / "cases" / "physics"
SURFACE = -0.0318
TABLES = {
    "jump": [[0.0, 0.0], [1e-30, 100.0]],
    "steep": [[0.0, 0.0], [1e-12, 100.0]],
    "drop": [[0.0, 0.0], [1e-3, 100.0], [1e-3 + 1e-12, 0.0]],
    "there and back": [[0.0, 0.0], [1e-18, 300.0], [1e-3, 100.0], [1e-3 + 1e-15, 0.1], [2e-3, 0.3]],
    "spike": [[0.0, 0.0], [1e-3, 100.0], [1.000001e-3, 5000.0], [1.000002e-3, 100.0]],
    "gentle": [[0.0, 0.0], [1e-3, 300.0], [1.5e-3, 50.0], [4e-3, 500.0]],
}
SCENE = {"mechanism.crank_angle_deg": 285.0, "drive.cycles": 0.07, "load.surface": SURFACE}


def exact(rows, y):
    """Force and energy by the page, without rounding."""
    depth = max(Fraction(SURFACE) - Fraction(y), Fraction(0))
    energy, force = Fraction(0), Fraction(0)
    rows = [[Fraction(number) for number in row] for row in rows]
    for (d0, f0), (d1, f1) in zip(rows, [*rows[1:], [max(depth, rows[-1][0]) + 1, rows[-1][1]]], strict=True):
        inside = min(depth, d1) - d0
        if inside > 0:
            force = f0 + (f1 - f0) * inside / (d1 - d0)
            energy += (f0 + force) / 2 * inside
    return float(force), float(energy)


@pytest.mark.parametrize("rows", TABLES.values(), ids=TABLES)
def test_force_and_energy_are_exact_but_for_rounding(rows):
    scene = load_scene("150rpm-0.2mm", SCENE | {"load.table": rows}).data
    depths = [d + by for d, _ in rows for by in (-1e-4, -1e-13, -1e-17, 0.0, 1e-17, 5e-13, 1e-4, 1e-2)]
    heights = SURFACE - np.array(depths)
    wanted = np.array([exact(rows, float(y)) for y in heights]).T
    load = read_parameters(scene).load
    of_reference = load_force(load, heights), load_energy(load, heights)
    of_exudyn = workpiece_forces(heights, workpiece_array(read_scene(scene).load))
    largest = max(force for _, force in rows)
    # A few roundings of the largest force, and of this force times a depth.
    for computed in (of_reference, of_exudyn):
        np.testing.assert_allclose(computed[0], wanted[0], rtol=0, atol=1e-15 * largest)
        np.testing.assert_allclose(computed[1], wanted[1], rtol=4e-16, atol=1e-17 * largest * 1e-3)


@pytest.mark.parametrize("rows", TABLES.values(), ids=TABLES)
def test_both_models_move_alike(rows):
    """In free flight, which magnifies nothing, into the workpiece and out of it."""
    changes = {
        "clearance.slider": 2e-2, "initial.slider_offset": 0.0, "output.samples_per_cycle": 500,
        "load.table": rows, "output.groups": [], "solver.reference.tolerance": 1e-12,
        "solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-12,
    }  # fmt: skip
    scene = load_scene("150rpm-0.2mm", SCENE | changes).data
    one, other = (model.simulate(scene) for model in (reference_model, exudyn_model))
    assert one.status == other.status == "success"
    assert not len(one.events["corner"]) + len(other.events["corner"])
    for name in ("slider_x", "slider_y", "slider_angle"):
        assert np.abs(one.columns[name] - other.columns[name]).max() < 1e-9
    assert one.columns["slider_y"].min() < SURFACE - 1e-3


@pytest.mark.parametrize("name", ["jump", "there and back"])
def test_both_models_agree_through_the_contacts_that_follow(name):
    """Measured 6e-11 and 2e-11 m; some twenty contacts magnify the errors of both."""
    scene = load_scene(CASES / "load-step.toml", {"load.table": TABLES[name]})
    tight = {"solver.reference.tolerance": 1e-12, "solver.exudyn.formulation": "tree"}
    scene = scene.with_values(tight | {"solver.exudyn.tolerance": 1e-12})
    one, other = (model.simulate(scene.data) for model in (reference_model, exudyn_model))
    assert one.status == other.status == "success"
    # Two corners that touch at one instant may stand in either order
    assert sorted(one.events["corner"]) == sorted(other.events["corner"])
    for channel in ("slider_x", "slider_y"):
        assert np.abs(one.columns[channel] - other.columns[channel]).max() < 1e-9
