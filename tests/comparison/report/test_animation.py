"""The press in motion: one page that needs nothing, and what it cannot show."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.report.animation import write_animation
from comparison.tables.table import TableError


@pytest.mark.usefixtures("files")
def test_the_page_needs_nothing_and_holds_motion_and_mechanism(capsys, central_case):
    assert main(["animate", "a.csv", "b.csv"]) == 0
    assert capsys.readouterr().out == "a-b.html\n"
    page = Path("a-b.html").read_text("utf-8")
    assert not re.search(r"\s(?:src|href)=", page.partition("<script")[0])
    script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)[-1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page
    geometry = json.loads(unescape(re.findall(r'data-geometry="([^"]*)"', page)[0]))
    mechanism = central_case.data["mechanism"]
    assert geometry["mechanism"]["crank"] == mechanism["crank"]["length"]
    # Pixels per metre: a corner that touches its wall touches it in the drawing, 18 pixels away.
    assert geometry["magnified"] * central_case.data["clearance"]["slider"] == pytest.approx(18.0)
    assert "a and b, 0.8 s, 2 crank cycles" in page
    assert len(page) < 300_000


@pytest.mark.usefixtures("files")
def test_a_label_cannot_break_the_page():
    name = "<b>&x"
    for ending in (".csv", ".json"):
        Path(f"a{ending}").rename(f"{name}{ending}")
    assert main(["animate", f"{name}.csv", "--out", "p.html"]) == 0
    page = Path("p.html").read_text("utf-8")
    assert name not in page
    assert "&lt;b&gt;&amp;x" in page


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        (["a.csv", "--out", "a.gif"], "a.gif: the name must end in .html"),
        (["a.csv", "--out", "a.mp4"], "a.mp4: the name must end in .html"),
        (["bare.csv"], "bare: no scene is recorded beside the table; name it by --scene"),
        (["bare.csv", "--scene", "idael"], "did you mean 'ideal'"),
    ],
)
def test_mistakes_are_one_line(arguments, rule, capsys):
    Path("bare.csv").write_text(Path("a.csv").read_text())
    assert main(["animate", *arguments]) == 2
    err = capsys.readouterr().err
    assert rule in err
    assert err.count("\n") == 1
    assert not list(Path.cwd().glob("*.html"))


def test_what_cannot_be_shown_is_refused(tables, central_case, tmp_path):
    def write(table, scene):
        write_animation({"a": table}, scene, tmp_path / "a.html", title="a", command="sixbar")

    table, scene = tables["a"], central_case.data
    with pytest.raises(TableError, match="a: channel 'slider_angle' is missing"):
        write(replace(table, frame=table.frame.drop(columns="slider_angle")), scene)
    with pytest.raises(TableError, match="a: an animation needs two samples at least"):
        write(replace(table, frame=table.frame.iloc[:1]), scene)
    rod = scene["mechanism"]["rod4"] | {"length": 1e-3}
    with pytest.raises(TableError, match="cannot be assembled at every crank angle"):
        write(table, scene | {"mechanism": scene["mechanism"] | {"rod4": rod}})
    assert not list(tmp_path.iterdir())
