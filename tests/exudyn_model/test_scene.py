"""What is taken from a scene: derived quantities, settings left open, one-line refusals."""

import pytest

from exudyn_model import simulate
from exudyn_model.parameters import read_scene


def test_contact_stiffness_and_damping_of_the_paper(make_scene):
    contact = read_scene(make_scene({})).guide
    # By hand: sigma = (1 - 0.28^2) / 210e9 = 4.388571e-12 for each body; sqrt(1e-3) = 0.03162278
    assert contact.stiffness == pytest.approx(4 * 0.0316227766 / (3 * 2 * 4.3885714286e-12), rel=1e-9)
    assert contact.damping == pytest.approx(0.1425, rel=1e-12)


def test_stiffnesses_of_the_side_and_of_the_pin(make_scene):
    parameters = read_scene(make_scene({"joints.crank_pin": "clearance"}))
    # By hand: Eq. 8 with a = 0.05 + 0.07 m; Eq. 10 with R = 0.01 * 0.0102 / 0.0002 = 0.51 m
    assert parameters.guide.side_stiffness == pytest.approx(0.12 / (0.475 * 2 * 4.3885714286e-12), rel=1e-9)
    journal = parameters.journal
    assert journal.stiffness == pytest.approx(4 * 0.7141428429 / (3 * 2 * 4.3885714286e-12), rel=1e-9)
    assert (journal.clearance, journal.journal_radius) == (2e-4, 0.01)
    assert read_scene(make_scene({})).journal is None


def test_materials_of_slider_and_guide_may_differ(make_scene):
    """Journal and bearing are both of the guide's."""
    changes = {"joints.crank_pin": "clearance", "contact.youngs_modulus": {"slider": 70e9, "guide": 210e9}}
    apart = read_scene(make_scene(changes | {"contact.poisson": {"slider": 0.33, "guide": 0.28}}))
    same = read_scene(make_scene({"joints.crank_pin": "clearance"}))
    # sigma = (1 - nu^2) / E: of the slider 1.273e-11 by hand, of the guide as above
    ratio = (1.2730e-11 + 4.3885714e-12) / (2 * 4.3885714e-12)
    assert same.guide.stiffness / apart.guide.stiffness == pytest.approx(ratio, rel=1e-5)
    assert same.guide.side_stiffness / apart.guide.side_stiffness == pytest.approx(ratio, rel=1e-5)
    assert apart.journal == same.journal


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"contact.law": "strip"},
            "contact.law = 'strip' is not simulated by the Exudyn model yet; "
            "use 'hertz-corners' or 'paper-switching' or 'foundation'",
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
            "solver.exudyn.formulation = 'minimal' must be one of 'auto', 'full' and 'tree'",
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
        ({"drive.speed_rpm": 0.0}, "drive.speed_rpm = 0.0 must not be zero"),
        ({"drive.cycles": 0.0}, "drive.cycles = 0.0 must be positive"),
        (
            {"drive.cycles": 4e-4},
            "drive.cycles = 0.0004 must last at least one sample: 1000 samples a cycle",
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
        assert read_scene(scene).integration.formulation == formulation
    scene["solver"]["exudyn"] = {"method": "trapezoidal-index2"}
    assert read_scene(scene).integration.formulation == "full"
