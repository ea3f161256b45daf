"""What there is: scenes and channels, for people and for programs."""

from __future__ import annotations

import json

import pytest

from comparison.cli import main
from comparison.scene import load_scene, shipped_scenes
from comparison.tables.channels import channels, expected


def test_scenes_lists_name_speed_and_clearance(capsys):
    assert main(["scenes"]) == 0
    heading, *lines = capsys.readouterr().out.splitlines()
    assert heading.split() == ["scene", "speed", "clearance", "title"]
    assert [line.split()[0] for line in lines] == shipped_scenes()
    assert any(line.split()[:5] == ["90rpm-0.1mm", "90", "rpm", "0.1", "mm"] for line in lines)
    assert any(line.startswith("ideal ") and "no clearance" in line for line in lines)
    assert any(line.startswith("both-clearances") and "0.2 mm + 0.2 mm" in line for line in lines)


def test_scenes_for_programs(capsys):
    assert main(["scenes", "--json"]) == 0
    listed = {scene["name"]: scene for scene in json.loads(capsys.readouterr().out)}
    assert list(listed) == shipped_scenes()
    assert listed["90rpm-0.5mm"]["clearance"] == {"slider": 5e-4}
    assert listed["crank-pin"]["clearance"] == {"crank_pin": 2e-4}
    assert listed["ideal"]["hash"] == load_scene("ideal").hash


@pytest.mark.parametrize(("arguments", "names"), [([], list(channels())), (["ideal"], None)])
def test_channels_lists_all_or_those_of_a_scene(arguments, names, capsys):
    names = names or expected(load_scene("ideal").data)
    assert main(["channels", *arguments]) == 0
    _, *lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == names
    assert main(["channels", *arguments, "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [channel["name"] for channel in listed] == names
    assert listed[0]["unit"] == "m"
