"""A load's table is interpolated between its rows, however steep, by both models: force, energy, motion."""

from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from page_engine import Engine
from scipy.integrate import solve_ivp

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


class Flight(Engine):
    """The page's press in free flight, segment by segment: in each the force is that of its own line."""

    def __init__(self, scene, rows):
        super().__init__(scene | {"load": scene["load"] | {"table": [], "force": 0.0}})
        wide = [pair for pair in pairwise(rows) if pair[1][0] - pair[0][0] > 1e-11]  # others are jumps
        edges = [(d0, d1, f0, (f1 - f0) / (d1 - d0)) for (d0, f0), (d1, f1) in wide]
        self.segments = [(-np.inf, 0.0, 0.0, 0.0), *edges, (rows[-1][0], np.inf, rows[-1][1], 0.0)]
        self.at = 0

    def forces(self, q, v):
        Q, states, motions = super().forces(q, v)
        low, _, force, slope = self.segments[self.at]
        Q[13] += force + slope * (SURFACE - q[13] - low) if self.at else 0.0
        return Q, states, motions

    def left(self, edge, direction):
        def event(_, y):
            return np.clip(SURFACE - y[13] - self.segments[self.at][edge], -1.0, 1.0)

        event.terminal, event.direction = True, direction
        return event

    def fly(self, times):
        """Return x, y and angle of the slider at these times, shape (3, n)."""
        t, y, samples = 0.0, self.start(), []
        events = [self.left(0, -1.0), self.left(1, 1.0)]
        while t < times[-1]:
            piece = solve_ivp(
                self.rates, (t, times[-1]), y, "DOP853", rtol=1e-12, atol=1e-14, events=events,
                dense_output=True, max_step=5e-4,
            )  # fmt: skip
            here = times[(times >= t) & ((times < piece.t[-1]) | (piece.t[-1] == times[-1]))]
            samples += [piece.sol(at)[12:15] for at in here]
            t, y = piece.t[-1], piece.y[:, -1]
            self.at += len(piece.t_events[1]) - len(piece.t_events[0])
        return np.transpose(samples)


@pytest.mark.parametrize("rows", TABLES.values(), ids=TABLES)
def test_both_models_move_as_the_page_says(rows):
    """In free flight, which magnifies nothing, into the workpiece and out of it."""
    changes = {
        "clearance.slider": 2e-2, "initial.slider_offset": 0.0, "output.samples_per_cycle": 500,
        "load.table": rows, "output.groups": [], "solver.reference.tolerance": 1e-12,
        "solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-12,
    }  # fmt: skip
    scene = load_scene("150rpm-0.2mm", SCENE | changes).data
    results = [model.simulate(scene) for model in (reference_model, exudyn_model)]
    wanted = Flight(scene, rows).fly(results[0].columns["time"])
    for result in results:
        assert result.status == "success"
        assert not len(result.events["corner"])
        for name, exact_values in zip(("slider_x", "slider_y", "slider_angle"), wanted, strict=True):
            assert np.abs(result.columns[name] - exact_values).max() < 1e-9
    assert wanted[1].min() < SURFACE - 1e-3


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
