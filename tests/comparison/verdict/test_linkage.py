"""Two models of a linkage are judged as any two solvers are; its starts are moved in what it gives."""

import math

import pytest

from comparison.accuracy.refine import levels
from comparison.execution.sides import Run
from comparison.scene import load_scene
from comparison.verdict.linkage import linkage_pair, moved_states
from comparison.verdict.validate import validate

LINKAGE = """
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
[clearance.O]
size = 1e-4
[guide.G]
body = 'rod'
[clearance.G]
size = 2e-4
length = 0.1
width = 0.05
"""


@pytest.fixture
def loose(tmp_path):
    path = tmp_path / "loose.toml"
    path.write_text(LINKAGE)
    return path


@pytest.mark.usefixtures("fake_models")
def test_two_models_with_clearances_are_judged_by_their_gaps(loose, gravity):
    (result,) = validate(load_scene(loose, {"environment.gravity": gravity.differ}), n_jobs=0)
    comparison = result.comparison
    assert (comparison.verdict, comparison.confirmation.outcome) == ("differ", "confirmed")
    assert [comparison.channels[name].scale for name in ("O.x", "G.ul_gap", "rod.x")] == [1e-4, 2e-4, 1.0]
    assert [list(events["corner"]) for events in comparison.events] == [["O", "G.ul"]] * 2


def test_starts_are_moved_within_the_clearances(loose):
    scene = load_scene(loose)
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


def test_what_the_start_gives_is_moved(loose):
    for changes, states in (
        ({}, ["rod.angle", "rod.omega"]),  # at rest
        ({"initial.rod.vx": 1.0}, ["rod.angle", "rod.vx"]),
    ):
        assert moved_states(load_scene(loose, changes))[:2] == states
    assert moved_states(load_scene("four-bar")) == []  # the drive leaves no freedom
