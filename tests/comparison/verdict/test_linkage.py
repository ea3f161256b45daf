"""Two models of a linkage are judged as any two solvers are."""

import pytest

from comparison.report.page import render
from comparison.scene import load_scene
from comparison.verdict.linkage import moved_states
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
    # Both runs, three settings each, and two moved starts at the coarser one.
    text = fake_models.read_text()
    assert text.count("reference ") >= 5
    assert {*result.runs} == {"reference", "exudyn"}
    page = render([comparison], title="t", command="c")
    assert "rod x" in page


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
