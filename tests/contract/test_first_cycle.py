"""The two models on the paper's central case: they converge to each other at the method's order."""

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene


def test_both_models_start_in_the_same_state(scene):
    """Loop closure, initial velocities and the first accelerations, written twice, agree to round-off."""
    short = {"drive.cycles": 0.01}
    a, b = reference_model.simulate(scene(short)).columns, exudyn_model.simulate(scene(short)).columns
    assert list(a) == list(b)
    for name in a:
        # Coordinates of 0.5 m round at 1e-16; an acceleration of some 50 m/s^2 at 1e-13 by two formulations.
        assert a[name][0] == pytest.approx(b[name][0], abs=1e-12), name


@pytest.mark.parametrize(
    ("name", "cycles"),
    [("150rpm-0.2mm", 1.0), ("adams-impact", 1.0), ("69GPa-slider", 1.0), ("workpiece", 0.25)],
)
def test_tree_and_strict_reference_agree_to_a_nanometre(name, cycles):
    """Both adaptive, with located contacts, at tight tolerances: 1e-9 m, 1e-7 rad over the first cycle."""
    strict = {"solver.reference.tolerance": 1e-13, "drive.cycles": cycles, "output.groups": []}
    settings = {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-10}
    exact = reference_model.simulate(load_scene(name, strict).data)
    tree = exudyn_model.simulate(load_scene(name, strict | settings).data)
    assert tree.status == exact.status == "success"
    for name, bound in {"slider_x": 1e-9, "slider_y": 1e-9, "slider_angle": 1e-7}.items():
        assert np.abs(tree.columns[name] - exact.columns[name]).max() <= bound, name
    # The same contacts, corner by corner; starts to what 1e-9 m mean at the slowest touches, 1e-3 m/s.
    for corner in ("ll", "lr", "ul", "ur"):
        a, b = (run.events["start"][run.events["corner"] == corner] for run in (exact, tree))
        assert a.size == b.size
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-6)
