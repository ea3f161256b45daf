"""Two models of a linkage are judged as any two solvers are."""

import math

import pytest

from comparison.accuracy.refine import levels
from comparison.execution.sides import Run
from comparison.report.page import render
from comparison.scene import load_scene
from comparison.verdict.linkage import linkage_pair, moved_states
from comparison.verdict.validate import validate

PENDULUM = """
[body.rod]
length = 1
centroid = 0.5
mass = 1
inertia = 0.1
[pin.O]
joins = ["frame", "rod.start"]
[drive]
free = true
[output]
duration = 2.0
samples = 400
[initial.rod]
angle_deg = 30
"""


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)
    return lambda **changes: load_scene(
        path, {key.replace("__", "."): value for key, value in changes.items()}
    )


@pytest.mark.parametrize("name", ["normal", "differ"])
def test_two_models_of_a_free_linkage_are_judged(name, pendulum, fake_models, gravity):
    expected = {"normal": "agree", "differ": "differ"}[name]
    (result,) = validate(pendulum(environment__gravity=getattr(gravity, name)), n_jobs=0)
    comparison = result.comparison
    assert comparison.verdict == expected
    assert comparison.tight is None
    assert comparison.channels["rod.x"].scale == 1.0
    assert comparison.channels["rod.angle"].scale == 1.0
    assert comparison.reliability is None  # without clearance
    # Both runs, three settings each, and two moved starts at the coarser one.
    text = fake_models.read_text()
    assert text.count("reference ") >= 5
    assert {*result.runs} == {"reference", "exudyn"}
    page = render([comparison], title="t", command="c")
    assert "rod x" in page


def test_two_models_with_clearances_are_judged_by_their_gaps_and_list_their_contacts(
    tmp_path, fake_models, gravity
):
    path = tmp_path / "loose.toml"
    path.write_text(
        f"{PENDULUM}[clearance.O]\nsize = 1e-4\n[guide.G]\nbody = 'rod'\n"
        "[clearance.G]\nsize = 2e-4\nlength = 0.1\nwidth = 0.05\n"
    )
    for name, expected in (("normal", "agree"), ("differ", "differ")):
        scene = load_scene(path, {"environment.gravity": getattr(gravity, name)})
        (result,) = validate(scene, n_jobs=0)
        comparison = result.comparison
        assert comparison.verdict == expected
        assert comparison.channels["O.x"].scale == 1e-4
        assert comparison.channels["G.ul_gap"].scale == 2e-4
        page = render([comparison], title="t", command="c")
        assert "O normal" in page
        assert "G.ul" in page
        assert "Not available: the drive has no period" in page
    assert [list(events["corner"]) for events in comparison.events] == [["O", "G.ul"]] * 2
    assert "reference 9.81" in fake_models.read_text()
    assert moved_states(scene)[2:] == ["O.x", "O.y", "G.offset", "G.tilt"]
    pair = linkage_pair(scene.with_values({"clearance.O.offset": [1e-4, 0]}), ("reference", "exudyn"), list)
    moved = pair.job(Run(pair.sides[0], -1, (0.0, 0.0, 1e-12, -1e-12, 1e-9, 1e-3))).scene.data
    assert moved["clearance"]["O"]["offset"] == pytest.approx([1e-4, -1e-12])
    assert math.hypot(*moved["clearance"]["O"]["offset"]) <= 1e-4
    assert moved["clearance"]["G"]["offset"] == 1e-9
    assert moved["clearance"]["G"]["tilt_deg"] == pytest.approx(math.degrees(1e-3))
    assert moved["solver"]["reference"]["tolerance"] == pytest.approx(1e-9)
    gated = levels(scene, "reference")  # what the gate runs
    for name, sign in (("perturbed", 1), ("other_perturbed", -1)):
        assert gated[name].data["clearance"]["O"]["offset"] == pytest.approx([1e-13, sign * 1e-13])
        assert gated[name].data["clearance"]["G"]["offset"] == pytest.approx(2e-13)


@pytest.mark.usefixtures("fake_models")
@pytest.mark.parametrize("status", ["singular", "violate", "crash"])
def test_a_run_that_does_not_succeed_is_reported(status, pendulum, gravity):
    n_jobs = int(status == "crash")
    (result,) = validate(pendulum(environment__gravity=getattr(gravity, status)), n_jobs=n_jobs)
    comparison = result.comparison
    assert (comparison.verdict, comparison.exit_code) == ("cannot compare", 2)
    if status == "singular":
        assert "singular position at t = 0.714 s" in comparison.error
        assert result.partial["standard exudyn base"].time[-1] == 2.0
    assert result.crashed == (status == "crash")
    assert comparison.error in render([comparison], title="t", command="c")


def test_what_the_start_gives_is_moved(pendulum):
    assert moved_states(pendulum()) == ["rod.angle", "rod.omega"]  # at rest
    assert moved_states(pendulum(initial__rod__vx=1.0)) == ["rod.angle", "rod.vx"]
    assert moved_states(load_scene("four-bar")) == []  # the drive leaves no freedom
