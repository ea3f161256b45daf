"""The schematic: the press as it is assembled, with the scene's dimensions."""

from math import hypot

import pytest

from comparison.report.schematic import joints, schematic
from comparison.scene import load_scene


@pytest.mark.parametrize("angle", [0.0, 111.36, 200.0, 290.0])
def test_the_joints_keep_the_lengths_and_the_branches(angle: float) -> None:
    mechanism = load_scene("150rpm-0.2mm").data["mechanism"]
    at = joints(mechanism, angle)
    assert at is not None

    def length(a: str, b: str) -> float:
        p, q = getattr(at, a), getattr(at, b)
        return hypot(p[0] - q[0], p[1] - q[1])

    # Round-off of coordinates of half a metre.
    assert length("O", "A") == pytest.approx(mechanism["crank"]["length"], abs=1e-14)
    assert length("A", "B") == pytest.approx(mechanism["rod2"]["length"], abs=1e-14)
    assert length("B", "H") == pytest.approx(mechanism["rocker"]["centroid"], abs=1e-14)
    assert length("C", "H") == pytest.approx(mechanism["rocker"]["length"], abs=1e-14)
    assert length("C", "F") == pytest.approx(mechanism["rod4"]["length"], abs=1e-14)
    assert at.F[0] == mechanism["guide_x"]
    assert at.F[1] < at.C[1]  # rod 4 hangs down
    (ax, ay), (bx, by), (hx, hy) = at.A, at.B, at.H
    assert (hx - ax) * (by - ay) - (hy - ay) * (bx - ax) > 0  # B lies to the left of the line from A to H


def test_at_the_start_the_slider_is_where_both_models_put_it() -> None:
    """At the start both models give slider_y = 0.189090 m, at 0.05 mm from the guide's centre line."""
    scene = load_scene("150rpm-0.2mm").data
    at = joints(scene["mechanism"], scene["mechanism"]["crank_angle_deg"])
    assert at is not None
    # Rod 4 leans by 0.2: 0.05 mm across move the slider by 0.01 mm.
    assert at.F[1] == pytest.approx(0.189090, abs=2e-5)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("150rpm-0.2mm", ["clearance 0.2\u00a0mm on each side", "50\u00a0mm wide", "150 rpm"]),
        ("90rpm-0.5mm", ["clearance 0.5\u00a0mm on each side", "90 rpm"]),
        ("ideal", ["held by its guide"]),
        ("crank-pin", ["held by its guide", "clearance at the crank pin A 0.2\u00a0mm"]),
    ],
)
def test_the_dimensions_are_the_scenes(name: str, said: list[str]) -> None:
    found = schematic(load_scene(name).data)
    assert found is not None
    for words in said:
        assert words in found.caption
        assert words in found.alt
    assert ("no clearance" in found.svg) == ("held by" in found.caption)


def test_without_a_scene_or_an_assembly_nothing_is_drawn() -> None:
    assert schematic(None) is None
    scene = load_scene("150rpm-0.2mm", {"mechanism.rod2.length": 0.01}).data
    assert schematic(scene) is None
