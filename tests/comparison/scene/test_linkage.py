"""Linkages: scenes with tables ``body``, their complete mapping and the messages about them."""

import pytest

from comparison.scene import SceneError, load_scene, scene_from_mapping
from comparison.scene.loading import new_scene, shipped_linkages
from comparison.tables.channels import expected, known_channels

BLOCK = {"size": 1e-4, "length": 0.06, "width": 0.02}


def test_the_complete_mapping_has_points_and_defaults() -> None:
    scene = load_scene("four-bar", {"body.coupler.length": 0.4})
    assert scene.data["body"]["coupler"]["points"]["end"] == [0.4, 0.0]
    assert scene.data["solver"]["reference"]["formulation"] == "multiplier"
    assert scene.name == "four-bar+body.coupler.length=0.4"
    assert scene.reliability.channels["velocity"] == "rocker.omega"
    assert scene.duration == 1.0
    assert load_scene("slider-crank", {"output.duration": 3e-3}).duration == 3e-3


@pytest.mark.parametrize("name", shipped_linkages())
def test_a_new_file_is_its_linkage(name, tmp_path) -> None:
    path = tmp_path / "new.toml"
    (tmp_path / "base.toml").write_text(f"[scene]\nextends = '{name}'\n[compare]\nuntil = 0.5")
    path.write_text(new_scene(path, str(tmp_path / "base.toml")))
    copy, base = load_scene(path), load_scene(name)
    assert copy.hash == base.hash == scene_from_mapping(base.data).hash
    assert (copy.compare.until, [*copy.data["body"]]) == (0.5, [*base.data["body"]])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("body.coupler.lenght", 1.0, "is not a known key; did you mean body.coupler.length?"),
        ("body.rod", {"mass": 1, "inertai": 1}, "inertai is not a known key; did you mean body.rod.inertia"),
        ("body.r.od", {"mass": 1.0, "inertia": 1.0}, "body.r.od is not a known key; sixbar keys --linkage"),
        ("drive.two", {"body": "rocker", "speed_rpm": 9.0}, "two is not a known key; sixbar keys --linkage"),
        ("body.coupler.mass", -1, "= -1 kg must be > 0"),
        ("body.coupler.points.centroid", [0.0, 0.0], "is body.centroid already"),
        ("body.coupler.points.end", [9.0, 0.0], "by body.coupler.length"),
        ("pin.A.joins", ["crank.ende", "coupler.start"], "'crank.ende'; did you mean crank.end?"),
        ("pin.A.joins", ["crank.end", "crank.start"], "joins a body to itself"),
        ("pin.A.point", [1.0, 0.0], "is for a joint with the frame alone"),
        ("guide.G", {"body": "coupler", "on": "coupler"}, "must be another body"),
        ("spring.A", {"joins": ["frame", "coupler.end"], "stiffness": 1.0, "length": 0.0}, "is taken"),
        ("drive.torque", 1.0, "must have one of speed_rpm, torque, torque_table, free"),
        ("drive", {"body": "crank", "torque_table": [[0.0, 1.0], [360.0, 2.0]]}, "with equal torques there"),
        ("drive.torque_table", [[0.0, 1.0], [9.0, 2.0], [8.0, 2.0], [360.0, 1.0]], "must have rising angles"),
        ("output.duration", 1.0, "is for a linkage without drive.speed_rpm"),
        ("initial.crnk.omega", 1.0, "is no body; did you mean crank?"),
        ("reliability.of", "coupler.z", "'coupler.z' must be BODY.x, BODY.y or BODY.angle"),
        ("joints.slider", "ideal", "joints is for the press: a scene with [body] has none"),
        ("crank.length", 1.0, "crank is for the press: a scene with [body] has none"),
        ("contact.exponent", 2.0, "contact = {'exponent': 2.0} is for a linkage with a table clearance"),
        ("clearance.D.size", 1e-4, "clearance.D = 'D' is no pin or guide; there are O, A, B, C"),
        ("clearance.A", {"size": 1e-4, "width": 0.1}, "clearance.A.width = 0.1 m is for a guide"),
        ("clearance.A", {"size": 1e-4, "offset": [1e-4, 1e-4]}, "starts 4.14e-05 m beyond the gap"),
        ("clearance.A", {"size": 1e-4, "contact": {"law": "foundation"}}, "'hertz-corners' or 'adams-imp"),
        ("clearance.A", {"size": 1e-4, "friction": {"static_speed": 1.0}}, "must be > clearance.A.friction"),
        ("clearance.bed", {"size": 1e-4}, "clearance.bed.length is missing: a guide needs it"),
        ("clearance.bed", BLOCK | {"journal_radius": 0.01}, "journal_radius = 0.01 m is for a pin"),
        ("clearance.bed", BLOCK | {"tilt_deg": 1.0}, "tilt_deg = 1.0 deg starts 0.000422 m beyond"),
        ("clearance.bed", BLOCK | {"tilt_deg": 1.0, "offset": 1e-5}, "= 1e-05 m with tilt_deg = 1 deg"),
    ],
)
def test_a_mistake_is_one_line(key, value, message) -> None:
    with pytest.raises(SceneError) as refusal:
        load_scene("quick-return" if "bed" in key else "four-bar", {key: value})
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_clearances_have_complete_laws_and_channels_of_their_kind() -> None:
    groups = ["accelerations", "contacts", "energy"]
    values = {"clearance.bed": BLOCK, "clearance.A.size": 2e-4, "clearance.A.contact.exponent": 2.0}
    scene = load_scene("quick-return", values | {"contact.restitution": 0.5, "output.groups": groups})
    pin, guide = scene.data["clearance"]["A"], scene.data["clearance"]["bed"]
    assert guide["contact"] == scene.data["contact"]
    assert pin["contact"] == scene.data["contact"] | {"exponent": 2.0}
    assert scene.data["contact"]["restitution"] == 0.5
    assert scene.data["solver"]["exudyn"]["step"] == 2e-6
    assert scene_from_mapping(scene.data).hash == scene.hash
    names = ["bed.ur_gap", "bed.ur_normal", "bed.ur_friction", "A.x", "A.y", "A.normal", "A.friction"]
    assert expected(scene.data)[-15:-8] == names
    assert known_channels(scene.data)["bed.ll_gap"].given == 1e-4
    assert scene.loose == ("bed", "A")
