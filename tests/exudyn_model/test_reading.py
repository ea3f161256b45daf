"""Derived quantities, and one-line refusals of what the model does not simulate."""

import pytest

from exudyn_model import simulate
from exudyn_model.reading import read_scene


def test_contact_stiffness_and_damping_of_the_paper(make_scene):
    contact = read_scene(make_scene({})).contact
    # By hand: sigma = (1 - 0.28^2) / 210e9 = 4.388571e-12 for each body; sqrt(1e-3) = 0.03162278
    assert contact.stiffness == pytest.approx(4 * 0.0316227766 / (3 * 2 * 4.3885714286e-12), rel=1e-9)
    assert contact.damping == pytest.approx(0.1425, rel=1e-12)


def test_stiffnesses_of_the_side_and_of_the_pin(make_scene):
    parameters = read_scene(make_scene({"joints.crank_pin": "clearance"}))
    # By hand: Eq. 8 with a = 0.05 + 0.07 m; Eq. 10 with R = 0.01 * 0.0102 / 0.0002 = 0.51 m
    assert parameters.contact.side_stiffness == pytest.approx(0.12 / (0.475 * 2 * 4.3885714286e-12), rel=1e-9)
    journal = parameters.journal
    assert journal.stiffness == pytest.approx(4 * 0.7141428429 / (3 * 2 * 4.3885714286e-12), rel=1e-9)
    assert (journal.clearance, journal.radius) == (2e-4, 0.01)
    assert read_scene(make_scene({})).journal is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"contact.law": "winkler"},
            "contact.law = 'winkler' is not simulated by the Exudyn model yet; "
            "use 'hertz-corners' or 'paper-switching' or 'strip' or 'foundation'",
        ),
        (
            {"contact.impact_speed": "mean"},
            "contact.impact_speed = 'mean' is not simulated by the Exudyn model yet; "
            "use 'frozen' or 'current'",
        ),
        (
            {"output.groups": ["corners", "strain"]},
            "output.groups = 'strain' is not simulated by the Exudyn model yet; "
            "use 'accelerations' or 'corners' or 'joints' or 'energy'",
        ),
        (
            {"solver.exudyn.method": "dopri5"},
            "solver.exudyn.method = 'dopri5' does not integrate solver.exudyn.formulation = 'full'; "
            "use 'generalized-alpha'",
        ),
        (
            {"solver.exudyn.formulation": "tree"},
            "solver.exudyn.method = 'generalized-alpha' does not integrate solver.exudyn.formulation = "
            "'tree'; use 'dopri5'",
        ),
        (
            {"solver.exudyn.formulation": "minimal"},
            "solver.exudyn.formulation = 'minimal' must be one of 'auto', 'full', 'native' and 'tree'",
        ),
        (
            {
                "solver.exudyn.formulation": "tree",
                "solver.exudyn.method": "auto",
                "joints.slider": "ideal",
            },
            "joints.slider = 'ideal' leaves solver.exudyn.formulation = 'tree' nothing free; use 'full'",
        ),
        (
            {"output.groups": ["joints"]},
            "output.groups = 'joints' is not given by solver.exudyn.method = 'generalized-alpha'; "
            "use 'trapezoidal-index2' (formulation 'full')",
        ),
        (
            {
                "output.groups": ["joints"],
                "solver.exudyn.formulation": "tree",
                "solver.exudyn.method": "dopri5",
            },
            "output.groups = 'joints' is not given by solver.exudyn.method = 'dopri5'; "
            "use 'trapezoidal-index2' (formulation 'full')",
        ),
        (
            {"solver.exudyn.formulation": "native", "contact.law": "strip"},
            "contact.law = 'strip' has no contact object for solver.exudyn.formulation = 'native'; "
            "use 'full'",
        ),
        (
            {"solver.exudyn.formulation": "native", "contact.law": "foundation"},
            "contact.law = 'foundation' has no contact object for solver.exudyn.formulation = 'native'; "
            "use 'full'",
        ),
        (
            {"solver.exudyn.formulation": "native", "contact.impact_speed": "current"},
            "contact.impact_speed = 'current' has no contact object for solver.exudyn.formulation = "
            "'native'; use 'full'",
        ),
        (
            {"solver.exudyn.formulation": "native", "joints.crank_pin": "clearance"},
            "joints.crank_pin = 'clearance' has no contact object for solver.exudyn.formulation = 'native'; "
            "use 'full'",
        ),
        (
            {"solver.exudyn.formulation": "native", "joints.slider": "ideal"},
            "joints.slider = 'ideal' leaves solver.exudyn.formulation = 'native' nothing free; use 'full'",
        ),
        ({"drive.speed_rpm": 0.0}, "drive.speed_rpm = 0.0 must not be zero"),
        ({"drive.cycles": 0.0}, "drive.cycles = 0.0 must be positive"),
        (
            {"drive.cycles": 4e-4},
            "drive.cycles = 0.0004 must last for a sample at least: 1000 samples a cycle",
        ),
        ({"solver.exudyn.step": -1e-6}, "solver.exudyn.step = -1e-06 must be positive"),
        ({"contact.impact_speed_floor": 0.0}, "contact.impact_speed_floor = 0.0 must be positive"),
        (
            {"friction.transition_speed": 1e-4},
            "friction.transition_speed = 0.0001 must be greater than friction.static_speed = 0.0001",
        ),
    ],
)
def test_unsupported_scenes_are_refused_in_one_line(make_scene, changes, message):
    with pytest.raises(ValueError, match=r"must|not simulated|use '") as caught:
        simulate(make_scene(changes))
    assert str(caught.value) == message
