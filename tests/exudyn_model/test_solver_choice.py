"""Formulation and settings where the scene leaves them open."""

import pytest

from exudyn_model import simulate
from exudyn_model.solver_choice import choose_solver


def test_usual_settings_of_the_formulation(make_scene):
    scene = make_scene({"drive.cycles": 0.01})
    scene["solver"]["exudyn"] = {"formulation": "tree"}
    provenance = simulate(scene).provenance
    assert provenance["formulation"] == "rod 4 and slider tree"
    assert provenance["integrator"] == "dopri5"
    assert provenance["settings"]["tolerance"] == 1e-10


@pytest.mark.parametrize(
    ("changes", "formulation"),
    [
        ({}, "tree"),
        ({"joints.crank_pin": "clearance"}, "tree"),
        ({"joints.slider": "ideal"}, "full"),
        ({"output.groups": ["joints"]}, "full"),
        ({"output.groups": ["energy"]}, "full"),
    ],
)
def test_left_open_it_is_the_smallest_that_gives_what_is_asked_for(make_scene, changes, formulation):
    scene = make_scene(changes)
    for settings in ({}, {"formulation": "auto", "method": "auto"}):
        scene["solver"]["exudyn"] = settings
        assert choose_solver(scene)["formulation"] == formulation
    scene["solver"]["exudyn"] = {"method": "trapezoidal-index2"}
    assert choose_solver(scene)["formulation"] == "full"
