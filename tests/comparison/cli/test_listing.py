"""What there is: scenes and channels, for people and for programs."""

from __future__ import annotations

from comparison.cli import main
from comparison.scene import shipped_scenes


def test_scenes_lists_name_speed_and_clearance(capsys):
    assert main(["scenes"]) == 0
    heading, *lines = capsys.readouterr().out.splitlines()
    assert heading.split() == ["scene", "speed", "clearance", "title"]
    assert [line.split()[0] for line in lines] == shipped_scenes()
    assert any(line.split()[:5] == ["90rpm-0.1mm", "90", "rpm", "0.1", "mm"] for line in lines)
    assert any(line.startswith("ideal ") and line.split()[3] == "none" for line in lines)
    assert any(line.startswith("both-clearances") and "0.2 mm + 0.2 mm" in line for line in lines)
