"""The guide to foreign tables, as a user follows it; their report."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from foreign_tables import FRAME, put, text
from scipy.io import savemat

from comparison.cli import main
from comparison.tables.mapping import load_mapping
from comparison.tables.table_files import write

GUIDE = (Path(__file__).parents[4] / "docs" / "foreign-tables.md").read_text("utf-8")
ADAMS, OWN, _ = re.findall(r"```toml\n(.*?)```", GUIDE, re.DOTALL)


def test_the_guide_works(make_table, capsys):
    load_mapping(put("own.toml", OWN))
    put("adams.toml", ADAMS)
    write(make_table(), Path("ours.csv"))
    frame = make_table().frame
    t, x, y, angle, vx = (frame[n] for n in ("time", "slider_x", "slider_y", "slider_angle", "slider_vx"))
    rows = np.column_stack([t * 1e3, -(x + 0.55) * 1e3, y * 1e3, -np.degrees(angle), -vx * 1e3, 0 * t])
    header = re.search(r"```text\n(.*?)\n```", GUIDE, re.DOTALL)[1]
    np.savetxt("adams.tab", rows, "%.10e", "\t", header=header, comments="")
    command = re.search(r"```sh\nsixbar (.*?)\n```", GUIDE, re.DOTALL)[1].split()
    assert main([*command, "--json"]) == 0
    out, err = capsys.readouterr()
    left = "adams.tab: not compared, since the mapping leaves it out: .press.slider.VX, .press.crank.TQ"
    assert left in err
    html = Path("reports/out/compare/report.html").read_text("utf-8")
    for words in ("No significant time shift", "--mapping adams.toml", "-.press.slider.X in mm -550"):
        assert words in html.replace("−", "-")
    numbers = json.loads(out)
    assert list(numbers["channels"]) == ["slider_x", "slider_y", "slider_angle"]
    assert numbers["time_shift"]["reason"] == ""
    # Ten digits after the point of 0.2 mm and 100 mm.
    assert numbers["channels"]["slider_x"]["max_difference"] < 1e-13
    put("adams.toml", re.sub("compare = .*", "", ADAMS))
    assert main(command) == 2
    assert re.fullmatch(".*adams: channel slider_vx is missing.*\n", capsys.readouterr().err)


def test_two_foreign_tables_make_a_report_and_names_of_another_program_are_escaped(capsys):
    put("one.csv", text("time [ms];<b>y</b> [mm];slider_angle [deg]", ";", ","))
    put("map.toml", '[a."<b>y</b>"]\nchannel = "slider_y"\n')
    savemat("two.mat", {"run": {name: FRAME[name].to_numpy() for name in FRAME}})
    command = ["compare", "one.csv", "two.mat", "--tolerance", "1e-12", "--mapping", "map.toml", "--out", "r"]
    assert main(command) == 0
    assert "cannot be estimated: 11 common samples" in capsys.readouterr().out
    html = Path("r/report.html").read_text("utf-8")
    assert "taken from two.mat" in html
    assert "&lt;b&gt;y&lt;/b&gt;" in html
    assert "<b>y</b>" not in html
