"""Linkages: scenes with tables ``body``, their complete mapping and the messages about them."""

import pytest

from comparison.scene import SceneError, load_scene, scene_from_mapping
from comparison.scene.loading import new_scene, shipped_linkages


def test_the_complete_mapping_has_points_and_defaults() -> None:
    scene = load_scene("four-bar", {"body.coupler.length": 0.4})
    assert scene.data["body"]["coupler"]["points"]["end"] == [0.4, 0.0]
    assert scene.data["solver"]["reference"]["formulation"] == "multiplier"
    assert scene.name == "four-bar+body.coupler.length=0.4"
    assert scene.duration == 1.0


def test_the_duration_of_a_free_linkage_is_stated(tmp_path) -> None:
    path = tmp_path / "free.toml"
    path.write_text(
        "[scene]\nextends = 'pendulum.toml'\n[output]\nduration = 3.0\nsamples = 300\n"
        "[body.rod.points]\nP = [0, 1]"
    )
    (tmp_path / "pendulum.toml").write_text(
        "[body.rod]\nlength = 1\ncentroid = 0.5\nmass = 1\ninertia = 0.1\n"
        "[pin.O]\njoins = ['frame', 'rod.start']\n[drive]\nfree = true\n[initial.rod]\nangle_deg = 0"
    )
    with pytest.raises(SceneError, match=r"output.duration = None must be given \(s\)"):
        load_scene(tmp_path / "pendulum.toml")
    scene = load_scene(path)
    assert scene.duration == 3.0
    assert scene.data["body"]["rod"]["points"] == {"start": [0, 0], "end": [1, 0], "P": [0, 1]}
    assert scene.data["drive"] == {"free": True}
    assert scene.data["initial"] == {"rod": {"angle_deg": 0.0}}
    interval = 3.0 / 300
    assert interval / scene.data["solver"]["exudyn"]["step"] == pytest.approx(334)  # not below 100,000 steps


@pytest.mark.parametrize("name", shipped_linkages())
def test_a_new_file_is_its_linkage(name, tmp_path) -> None:
    path = tmp_path / "new.toml"
    (tmp_path / "base.toml").write_text(f"[scene]\nextends = '{name}'\n[compare]\nuntil = 0.5")
    path.write_text(new_scene(path, str(tmp_path / "base.toml")))
    known = load_scene(name)
    assert load_scene(path).hash == known.hash == scene_from_mapping(known.data).hash
    assert load_scene(path).compare.until == 0.5
    assert [*load_scene(path).data["body"]] == [*known.data["body"]]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("body.coupler.lenght", 1.0, "is not a known key; did you mean body.coupler.length?"),
        ("body.coupler.mass", -1, "= -1 kg must be > 0"),
        ("body.coupler.centroid", "x", "must be a number or [x, y]"),
        ("body.a b.mass", 1.0, "must be letters, digits, _ and - only"),
        ("body.coupler.points.centroid", [0.0, 0.0], "is body.centroid already"),
        ("body.coupler.points.end", [9.0, 0.0], "by body.coupler.length"),
        (
            "pin.A.joins",
            ["crank.ende", "coupler.start"],
            "names no point 'crank.ende'; did you mean crank.end?",
        ),
        ("pin.A.joins", ["crank.end", "crank.start"], "joins a body to itself"),
        ("pin.A.point", [1.0, 0.0], "is for a joint with the frame alone"),
        ("guide.G", {"body": "coupler", "on": "coupler"}, "must be another body"),
        ("guide.G", {"body": "couplr"}, "is no body; did you mean coupler?"),
        (
            "spring.A",
            {"joins": ["frame", "coupler.end"], "stiffness": 1.0, "length": 0.0},
            "is taken: bodies",
        ),
        ("pim.A.joins", [], "did you mean pin?"),
        ("drive.torque", 1.0, "must have one of speed_rpm, torque, torque_table, free"),
        ("drive.speed_rpm", 0.0, "must not be zero"),
        ("drive", {"body": "crank", "torque_table": [[0.0, 1.0], [360.0, 2.0]]}, "with equal torques there"),
        ("drive.torque_table", [[0.0, 1.0], [9.0, 2.0], [8.0, 2.0], [360.0, 1.0]], "must have rising angles"),
        ("drive.cycles", 1e9, "must give 1 to 100000000 samples, not 1e+12"),
        ("output.duration", 1.0, "is for a linkage without drive.speed_rpm"),
        ("output.groups", ["corners"], "must be 'accelerations', 'joints' or 'energy'"),
        ("initial.crnk.omega", 1.0, "is no body; did you mean crank?"),
        ("load", {"body": "coupler", "table": [[0.0, 1.0]]}, "must begin with [0, 0]"),
        ("contact.law", "x", "contact is for the press: a scene with [body] has none"),
    ],
)
def test_a_mistake_is_one_line(key, value, message) -> None:
    with pytest.raises(SceneError) as refused:
        load_scene("four-bar", {key: value})
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_body_does_not_make_a_linkage_of_the_press() -> None:
    with pytest.raises(SceneError, match="body is not a known key"):
        load_scene("ideal", {"body.coupler.mass": 1.0})
