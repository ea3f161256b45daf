"""Crank angle and speed of our tables, which hold neither, beside a table that does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import read_pair

from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.mapping import Mapping
from comparison.tables.table import Table
from comparison.tables.table_files import write

# A multiple of the eighth of a revolution that the start is at has no rounding of its own.
CHANGES = {"drive.speed_rpm": -120.0, "mechanism.crank_angle_deg": 45.0}


@pytest.fixture
def tables(make_table) -> tuple[Table, Table]:
    """One of ours, and one of another program with the crank's motion: an eighth ahead, two a second back."""
    scene = load_scene("ideal", CHANGES)
    ours = make_table(of=scene)
    frame = ours.frame.assign(
        crank_angle=np.pi / 4 - 4 * np.pi * ours.time, crank_speed=np.full(ours.time.size, -4 * np.pi)
    )
    ours = replace(ours, provenance={"model": "reference", "scene": scene.data})
    write(ours, Path("ours.csv"))
    write(Table(frame), Path("other.csv"))
    return ours, Table(frame)


@pytest.mark.parametrize("order", [["ours.csv", "other.csv"], ["other.csv", "ours.csv"]])
def test_a_table_of_ours_has_the_motion_that_its_scene_prescribes(tables, order, capsys):
    ours, other = tables
    assert main(["compare", *order, "--tolerance", "1e-9"]) == 0
    assert "ours.csv: as its scene prescribes: crank_angle, crank_speed" in capsys.readouterr().err
    read, _, _ = read_pair(Path("ours.csv"), Path("other.csv"))
    # Round-off of an angle of some revolutions.
    np.testing.assert_allclose(read.values("crank_angle"), other.values("crank_angle"), rtol=0, atol=1e-13)
    for name in ours.channels:
        assert read.values(name).tobytes() == ours.values(name).tobytes()


@pytest.mark.parametrize(("channel", "error"), [("crank_angle", 0.1), ("crank_speed", 0.1)])
def test_a_crank_that_turns_otherwise_differs(tables, channel, error, capsys):
    frame = tables[1].frame
    write(Table(frame.assign(**{channel: frame[channel] * (1 + error)})), Path("other.csv"))
    assert main(["compare", "ours.csv", "other.csv", "--tolerance", "1e-3"]) == 1
    assert channel in capsys.readouterr().out


def test_nothing_is_added_where_none_asks_for_it(tables):
    ours, _ = tables
    again, _, warnings = read_pair(Path("ours.csv"), Path("ours.csv"))
    assert again.channels == ours.channels
    only = Mapping(compare=["slider_y"])
    assert read_pair(Path("ours.csv"), Path("other.csv"), only)[0].channels == ["slider_y"]
    assert not [line for line in warnings if "prescribes" in line]


@pytest.mark.parametrize("scene", [None, 3, {"drive": {"speed_rpm": "fast"}}])
def test_a_table_without_such_a_record_lacks_the_channel(tables, scene, capsys):
    ours, _ = tables
    write(replace(ours, provenance={"scene": scene}), Path("ours.csv"))
    assert main(["compare", "ours.csv", "other.csv", "--tolerance", "1"]) == 2
    assert "channel crank_angle is missing" in capsys.readouterr().err
