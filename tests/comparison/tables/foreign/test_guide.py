"""The guide to foreign tables, as a user follows it; their report."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import FRAME, put, text
from scipy.io import savemat

from comparison.cli import main
from comparison.tables.table import Table
from comparison.tables.table_files import write

GUIDE = (Path(__file__).parents[4] / "docs" / "foreign-tables.md").read_text("utf-8")


@pytest.fixture
def documented(make_table) -> str:
    """The files of the guide; its command."""
    put("adams.toml", re.search(r"```toml\n(.*?)```", GUIDE, re.DOTALL)[1])
    header = re.search(r"```text\n(.*?)\n```", GUIDE, re.DOTALL)[1]
    frame = make_table().frame
    write(Table(frame), Path("ours.csv"))
    t, x, y, angle, vx = (frame[n] for n in ("time", "slider_x", "slider_y", "slider_angle", "slider_vx"))
    rows = np.column_stack([t * 1e3, -(x + 0.55) * 1e3, y * 1e3, -np.degrees(angle), -vx * 1e3, 0 * t])
    lines = ("\t".join(f"{value:.10e}" for value in row) for row in rows)
    put("adams.tab", header + "\n" + "\n".join(lines) + "\n")
    return re.search(r"```sh\nsixbar (.*?)\n```", GUIDE, re.DOTALL)[1]


def test_the_guide_works(documented, capsys):
    assert main([*documented.split(), "--json"]) == 0
    out, err = capsys.readouterr()
    assert (
        "adams.tab: not compared, since the mapping leaves it out: .press.slider.VX, .press.crank.TQ" in err
    )
    assert "No significant time shift" in err
    html = Path("reports/out/compare/report.html").read_text("utf-8")
    assert "No significant time shift" in html
    assert "--mapping adams.toml" in html
    assert "-.press.slider.X in mm -550" in html.replace("−", "-")
    numbers = json.loads(out)
    assert list(numbers["channels"]) == ["slider_x", "slider_y", "slider_angle"]
    assert numbers["time_shift"]["reason"] == ""
    # Ten digits after the point of 0.2 mm and 100 mm.
    assert numbers["channels"]["slider_x"]["max_difference"] < 1e-13


@pytest.mark.parametrize(
    ("was", "becomes"),
    [("sign = -1        #", "sign = 1  #"), ("-550.0", "-550.01"), ('unit = "deg"', 'unit = "rad"')],
)
def test_a_wrong_mapping_differs(documented, was, becomes):
    path = Path("adams.toml")
    path.write_text(path.read_text().replace(was, becomes))
    assert main(documented.split()) == 1


def test_a_channel_that_one_side_lacks_is_refused_unless_the_mapping_chooses(documented, capsys):
    path = Path("adams.toml")
    path.write_text(re.sub("compare = .*", "", path.read_text()))
    assert main(documented.split()) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "adams: channel slider_vx is missing" in err


def test_two_foreign_tables_make_a_report(capsys):
    put("one.csv", text("time [ms];slider_y [mm];slider_angle [deg]", ";", ","))
    savemat("two.mat", {"run": {name: FRAME[name].to_numpy() for name in FRAME}})
    assert main(["compare", "one.csv", "two.mat", "--tolerance", "1e-12", "--out", "r"]) == 0
    assert "cannot be estimated: 11 common samples" in capsys.readouterr().out
    html = Path("r/report.html").read_text("utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert "taken from two.mat" in html


def test_names_of_another_program_are_escaped_in_the_report(capsys):
    put("a.csv", text("time,<b>y</b>,slider_angle\nms,mm,deg"))
    put("map.toml", '[columns."<b>y</b>"]\nchannel = "slider_y"\n')
    assert main(["compare", "a.csv", "a.csv", "--mapping", "map.toml", "--out", "r"]) == 3
    capsys.readouterr()
    html = Path("r/report.html").read_text("utf-8")
    assert "<b>y</b>" not in html
    assert "&lt;b&gt;y&lt;/b&gt;" in html


def test_the_channels_of_the_guide_compare(capsys):
    _, mapping, _ = re.findall(r"```toml\n(.*?)```", GUIDE, re.DOTALL)
    put("map.toml", mapping)
    time = np.linspace(0, 1, 101)
    knee, speed, moment = 30 * np.sin(6 * time), 180 * np.cos(6 * time), 0.1 * np.cos(time)
    names = "time,knee_angle_r,knee_speed,hip_moment"
    rows = np.column_stack([time, knee, speed, moment])
    np.savetxt("a.csv", rows, "%.15g", ",", header=f"{names}\ns,deg,deg/s,-", comments="")
    rows = np.column_stack([time, speed, moment, np.radians(knee)])
    np.savetxt("b.csv", rows, "%.15g", ",", header="time,knee_speed,hip_moment,q7", comments="")
    # One states the moment as a pure number, the other states nothing: the factor has the unit.
    command = [
        "compare",
        "a.csv",
        "b.csv",
        "--mapping",
        "map.toml",
        "--tolerance",
        "1e-9",
        "--json",
    ]
    assert main(command) == 0
    numbers = json.loads(capsys.readouterr().out)["channels"]
    assert numbers["knee"]["unit"] == "deg"
    assert numbers["knee"]["scale"] == 60.0
    assert numbers["hip_moment"]["scale"] == pytest.approx(736 * np.ptp(moment), rel=1e-12)
