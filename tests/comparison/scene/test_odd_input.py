"""Scenes that no one means: extreme numbers, depth, length, files. Each is one line, before anything runs."""

from __future__ import annotations

import pytest

from comparison.scene import SceneError, load_scene, parse_set
from comparison.scene.loading import LARGEST_FILE

BASE = '[scene]\nextends = "paper"\n'
INPUT = '[[random]]\nkey = "drive.speed_rpm"\ndistribution = "normal"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BASE + INPUT + "deviation = 1.0\ncolour = 3\n", "random.0.colour is not a known key"),
        (BASE + INPUT + "deviatoin = 1.0\n", "random.0.deviation is missing"),
        (BASE + INPUT + "deviation = 1.0\nelment = 1\n", "did you mean random.0.element?"),
        (BASE + INPUT + "deviation = -1.0\n", "random.0.deviation = -1.0 must be > 0"),
        (f"{BASE}[drive]\ncycles = {'9' * 400}\n", "drive.cycles = 999"),
        (f"{BASE}[drive]\ncycles = {'9' * 5000}\n", "has an integer of too many digits"),
        (f"{BASE}[output]\nsamples_per_cycle = {'9' * 400}\n", "must be <= 1e+15"),
        (f"{BASE}[drive]\ncycles = 1e308\n", "must give 1 to 100000000 samples, not inf"),
        (f"{BASE}[drive]\nspeed_rpm = 1e-310\n", "last for ever"),
        (f"{BASE}x = {'[' * 500}{']' * 500}\n", "is nested too deeply"),
        (f"{BASE}[reliability]\nbins = 1_000_000_000\n", "reliability.bins = 1000000000 must be <= 10000"),
        (f'[scene]\nextends = "paper"\nname = "{"a" * 240}"\n', "must have at most 100 characters"),
        (f"{BASE}# {'a' * LARGEST_FILE}\n", "is larger than 1000000 bytes"),
        (BASE.replace("paper", "~nosuchuser/x"), "there is no such home folder"),
        (BASE.replace("paper", "a" * 5000), "File name too long"),
        ("scene = 4\n", "scene = 4 must be a section"),
    ],
)
def test_a_scene_file_is_refused_in_one_line(text, message, tmp_path):
    path = tmp_path / "odd.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as refused:
        load_scene(path)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 600 or "File name" in message


def test_three_thousand_files_that_extend_one_another(tmp_path):
    for number in range(3000):
        (tmp_path / f"{number}.toml").write_text(f'[scene]\nextends = "{number + 1}.toml"\n')
    with pytest.raises(SceneError, match="leads over more than 20 files"):
        load_scene(tmp_path / "0.toml")


@pytest.mark.parametrize("text", ["9" * 5000, "[" * 3000, "{a=" * 3000])
def test_a_value_that_toml_cannot_read_is_a_string(text):
    assert parse_set([f"drive.cycles={text}"]) == {"drive.cycles": text}


@pytest.mark.parametrize("value", [True, 1.0, "1", 2])
@pytest.mark.parametrize("key", ["rocker_branch", "slider_branch"])
def test_a_branch_is_the_integer_one_with_a_sign(key, value):
    """What is true is equal to 1, but not meant as such."""
    with pytest.raises(SceneError, match=rf"mechanism\.{key} = {value!r} must be -1 or 1"):
        load_scene("ideal", {f"mechanism.{key}": value})
