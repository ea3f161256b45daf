"""The audit of the energy closes: the motor's work comes from Exudyn's multiplier, the rest from states."""

import numpy as np
import pytest

from exudyn_model import simulate

ENERGY = {"output.groups": ["corners", "energy"], "solver.exudyn.method": "trapezoidal-index2"}
NAMES = [
    f"energy_{name}" for name in ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
]


def largest_residual(scene):
    return np.max(np.abs(simulate(scene).columns["energy_residual"]))


def test_channels_of_the_group(make_scene):
    columns = simulate(make_scene(ENERGY | {"drive.cycles": 0.005, "output.groups": ["energy"]})).columns
    assert list(columns)[7:] == NAMES
    first = {name: values[0] for name, values in columns.items() if name in NAMES}
    assert first.pop("energy_kinetic") > 0
    assert set(first.values()) == {0.0}


def test_a_cycle_of_the_ideal_mechanism_returns_all_work(make_scene):
    scene = make_scene(ENERGY | {"joints.slider": "ideal", "drive.cycles": 1.0, "solver.exudyn.step": 2e-5})
    columns = simulate(scene).columns
    for name in ("drive", "gravity"):
        work = columns[f"energy_{name}"]
        assert np.ptp(work) > 0.5
        # The trapezoidal rule over a period is exact to round-off; the Newton iteration leaves 1e-12
        assert abs(work[-1]) < 1e-10
    kinetic = columns["energy_kinetic"]
    assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-9)
    # Within the cycle second order in the step: 2e-8 J of 1 J measured
    assert np.max(np.abs(columns["energy_residual"])) < 4e-8
    for name in ("contact", "damping", "friction"):
        assert not columns[f"energy_{name}"].any()


def test_residual_is_of_second_order(make_scene):
    """The first 0.04 s with seven contacts; friction takes 3e-3 J, damping 8e-5 J, the walls store 1e-4 J."""
    coarse, fine = (
        largest_residual(make_scene(ENERGY | {"drive.cycles": 0.1, "solver.exudyn.step": step}))
        for step in (8e-6, 4e-6)
    )
    # Where touches fall in their steps scatters it; 4.1 measured
    assert coarse / fine == pytest.approx(4.0, abs=1.0)
    # A thousandth of the smallest part; 7e-8 J measured
    assert fine < 1e-7


def test_contacts_only_dissipate(make_scene):
    columns = simulate(make_scene(ENERGY | {"drive.cycles": 0.1, "solver.exudyn.step": 4e-6})).columns
    for name in ("damping", "friction"):
        lost = columns[f"energy_{name}"]
        assert np.all(np.diff(lost) >= 0)
        assert lost[-1] > 5e-5
    assert np.all(columns["energy_contact"] >= 0)


def test_nothing_is_lost_without_damping_and_friction(make_scene):
    elastic = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
    scene = make_scene(ENERGY | elastic | {"drive.cycles": 0.1, "solver.exudyn.step": 4e-6})
    columns = simulate(scene).columns
    assert not columns["energy_friction"].any()
    # Forces K depth^n less the same: round-off
    assert np.max(np.abs(columns["energy_damping"])) < 1e-15
    assert np.max(columns["energy_contact"]) > 1e-5
    assert np.max(np.abs(columns["energy_residual"])) < 1e-7


def test_samples_of_the_works_do_not_depend_on_how_many_are_taken(make_scene):
    changes = ENERGY | {"drive.cycles": 0.05, "solver.exudyn.step": 4e-6}
    seldom = simulate(make_scene(changes)).columns
    often = simulate(make_scene(changes | {"output.samples_per_cycle": 10_000})).columns
    scale = np.max(seldom["energy_kinetic"])
    for name in NAMES:
        # Steps in flight end at samples: the order's error of the longest, 3e-5 s
        np.testing.assert_allclose(often[name][::10], seldom[name], atol=1e-6 * scale, err_msg=name)
