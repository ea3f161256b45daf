"""A run that ended and means little says so."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from comparison.execution.quality import energy_share, quality_warnings, steps_per_contact
from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.tables.table import Table


def made(durations=(), depth=1e-6, step=None, forces=1.0, residual=None, lost=1.0, kinetic=2.0) -> Table:
    time = np.linspace(0.0, 1.0, 5)
    frame = pd.DataFrame({"time": time})
    if residual is not None:
        frame["energy_residual"] = residual * np.array([0.0, 0.5, -1.0, 0.2, 0.1])
        frame["energy_damping"], frame["energy_friction"] = 0.25 * lost * time, 0.75 * lost * time
        frame["energy_kinetic"] = kinetic * np.array([0.1, 1.0, 0.3, 0.2, 0.1])
    events = pd.DataFrame({"corner": ["ll"] * len(durations), "start": 0.0, "end": list(durations)})
    events["largest_depth"], events["peak_force"] = depth, forces
    settings = {} if step is None else {"step_used": step}
    scene = {"contact": {"corner_radius": 1e-3}}
    return Table(frame, events=events, extrema={}, provenance={"settings": settings, "scene": scene})


def test_steps_of_a_contact_are_those_of_the_median_one_and_only_where_steps_are_fixed():
    assert steps_per_contact(made([3e-4, 1e-4, 9e-4], step=1e-5)) == pytest.approx(30.0)
    # One long touch that bears little does not make up for two short hits.
    uneven = made([1e-1, 2e-1, 3e-1, 2e-5, 5e-5], step=1e-5, forces=[0.1, 0.1, 0.1, 2.0, 1.0])
    assert steps_per_contact(uneven) == pytest.approx(2.0)
    assert math.isnan(steps_per_contact(made([3e-4])))
    assert math.isnan(steps_per_contact(made([], step=1e-5)))


def test_energy_from_nowhere_counts_by_the_dissipated_or_else_the_kinetic():
    assert energy_share(made(residual=0.03, lost=1.5)) == pytest.approx(0.02)
    assert energy_share(made(residual=0.03, lost=0.0)) == pytest.approx(0.015)
    assert math.isnan(energy_share(made()))


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (made([1e-4] * 3, step=1.1e-5), "last less than 9.1 steps"),
        (made(residual=0.011), "spurious energy is 1.10"),
        (made([1e-4], depth=1.01e-3), "deeper than its radius"),
    ],
)
def test_each_doubt_is_reported_alone(run, words):
    (warning,) = quality_warnings(run)
    assert words in warning


@pytest.mark.parametrize("drift", [{"position": 1.1e-6}, {"position": 0.0, "velocity": 1.1e-3}])
def test_violated_constraints_are_a_doubt(drift):
    run = made()
    run.provenance["constraints"] = drift
    (warning,) = quality_warnings(run)
    assert "constraints are violated" in warning
    run.provenance["constraints"] = {"position": 0.9e-6, "velocity": 0.9e-3}
    assert quality_warnings(run) == []


def test_at_the_limits_nothing_is_doubted():
    assert quality_warnings(made([1e-4], depth=1e-3, step=1e-5, residual=0.01)) == []
    assert quality_warnings(made()) == []


def test_the_paper_s_case_is_not_doubted_and_one_in_coarse_steps_is():
    values = {"drive.cycles": 0.2, "solver.exudyn.formulation": "full"}
    scene = load_scene("150rpm-0.2mm", values)
    assert quality_warnings(run_one(scene, "exudyn")) == []
    # 2e-4 s, an ordinary contact of this scene, are four such steps.
    (warning,) = quality_warnings(run_one(scene.with_values({"solver.exudyn.step": 5e-5}), "exudyn"))
    assert "steps" in warning


def test_gains_that_a_loose_tolerance_cannot_bear_are_reported():
    """Alpha 1000/s with steps of up to 8 ms: the feedback multiplies what the stages of a step miss."""
    values = {
        "joints.slider": "ideal",
        "solver.reference.formulation": "multiplier",
        "solver.reference.tolerance": 5e-6,
        "solver.reference.baumgarte_alpha": 1e3,
        "solver.reference.baumgarte_beta": 0.0,
    }
    (warning,) = quality_warnings(run_one(load_scene("150rpm-0.2mm", values), "reference"))
    assert "Baumgarte" in warning
