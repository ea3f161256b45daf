"""The two models at tight tolerances, under each law that is predictable: the same motion and contacts."""

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene


@pytest.mark.parametrize(
    ("name", "cycles", "law"),
    [
        ("150rpm-0.2mm", 1.0, "hertz-corners"),
        ("adams-impact", 1.0, "adams-impact"),
        ("69GPa-slider", 1.0, "hertz-corners"),
        ("workpiece", 0.25, "hertz-corners"),
        # Of a whole side; later neither model knows the motion.
        ("150rpm-0.2mm", 0.4, "foundation"),
        ("surface", 0.3, "foundation"),
    ],
)
def test_tree_and_strict_reference_agree_to_a_nanometre(name, cycles, law):
    """Both adaptive, with located contacts, at tight tolerances: 1e-9 m, 1e-7 rad over the first cycle."""
    strict = {"solver.reference.tolerance": 1e-13, "drive.cycles": cycles, "output.groups": []}
    strict["contact.law"] = law
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
