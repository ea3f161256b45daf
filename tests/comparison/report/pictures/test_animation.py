"""The press in motion: positions, the page that shows them, a film."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from comparison.cli import main
from comparison.report.pictures.drawing import GAP, SLIDER, corners
from comparison.report.pictures.film import PICTURES_A_SECOND, write_film
from comparison.report.pictures.motion import FRAMES, motion
from comparison.tables.table import TableError


def test_the_links_keep_their_lengths_and_the_slider_is_where_the_table_has_it(tables, central_case):
    found, mechanism = motion(tables, central_case.data), central_case.data["mechanism"]
    for ends, length in (("OA", "crank"), ("AB", "rod2"), ("HC", "rocker"), ("CF", "rod4")):
        apart = np.linalg.norm(found.links[ends[0]] - found.links[ends[1]], axis=1)
        # To round-off of coordinates below 1 m.
        np.testing.assert_allclose(apart, mechanism[length]["length"], rtol=1e-12)
    np.testing.assert_allclose(found.links["F"][:, 0], mechanism["guide_x"])
    x = tables["b"].values("slider_x") - mechanism["guide_x"]
    np.testing.assert_allclose(found.sliders["b"][:, 0], x, atol=1e-15)
    assert found.cycle[-1] == pytest.approx(2.0)


def test_a_corner_that_touches_the_wall_touches_it_in_the_drawing(tables, central_case):
    table = tables["a"]
    clearance = central_case.data["clearance"]["slider"]
    frame = table.frame.assign(
        slider_x=central_case.data["mechanism"]["guide_x"] - clearance, slider_angle=0.0
    )
    drawn = corners(motion({"a": replace(table, frame=frame)}, central_case.data), "a")
    np.testing.assert_allclose(drawn[:, 0, 0], -SLIDER[0] / 2 - GAP)  # ll
    np.testing.assert_allclose(drawn[:, 2, 0], SLIDER[0] / 2 - GAP)  # ur
    # Turned to the left: the upper corners go left, the lower ones right.
    frame = table.frame.assign(slider_x=central_case.data["mechanism"]["guide_x"], slider_angle=1e-3)
    ll, _, _, ul = corners(motion({"a": replace(table, frame=frame)}, central_case.data), "a")[0]
    assert ul[0] < -SLIDER[0] / 2 < ll[0]


def test_an_impact_between_two_frames_is_shown(tables, central_case):
    table = tables["a"]
    times = np.linspace(0.0, 0.8, 5 * FRAMES + 1)
    columns = {name: np.interp(times, table.time, table.values(name)) for name in table.channels}
    columns["corner_ul_normal"] = np.where(np.arange(times.size) == 503, 60.0, 0.0)
    found = motion(
        {
            "a": replace(
                table, frame=table.frame.iloc[:0].reindex(range(times.size)).assign(time=times, **columns)
            )
        },
        central_case.data,
    )
    assert len(found.time) <= FRAMES
    assert found.forces["a"]["ul"].max() == 60.0


@pytest.mark.usefixtures("files")
def test_the_page_needs_nothing_and_holds_every_frame(capsys):
    assert main(["animate", "a.csv", "b.csv"]) == 0
    assert capsys.readouterr().out == "a-b.html\n"
    page = Path("a-b.html").read_text("utf-8")
    assert not re.search(r"(?:src|href)=", page)
    script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page)[0])
    assert len(data["sliders"]) == 2
    assert {len(part) for part in (data["time"], data["links"]["A"], *data["sliders"])} == {401}
    assert len(page) < 1_000_000


@pytest.mark.usefixtures("files")
def test_a_label_cannot_break_the_page():
    name = "<b>&x"
    for ending in (".csv", ".json"):
        Path(f"a{ending}").rename(f"{name}{ending}")
    assert main(["animate", f"{name}.csv", "--out", "p.html"]) == 0
    page = Path("p.html").read_text("utf-8")
    assert name not in page
    assert "&lt;b&gt;&amp;x" in page


def test_a_film_has_its_pictures_and_leaves_no_part_behind(tables, central_case, tmp_path):
    short = {label: replace(table, frame=table.frame.iloc[:4]) for label, table in tables.items()}
    shares: list[float] = []
    path = write_film(motion(short, central_case.data), tmp_path / "f.gif", shares.append)
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert film.info["duration"] == 1000 / PICTURES_A_SECOND
    assert shares[-1] == 1.0
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        (["a.csv", "--out", "a.avi"], "a.avi: the name must end in .html, .gif or .mp4"),
        (["a.csv", "--out", "a.mp4"], "MP4 needs ffmpeg, which is not installed"),
        (["bare.csv"], "bare: no scene is recorded beside the table; name it by --scene"),
        (["bare.csv", "--scene", "idael"], "did you mean 'ideal'"),
    ],
)
def test_mistakes_are_one_line(arguments, rule, capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    Path("bare.csv").write_text(Path("a.csv").read_text())
    assert main(["animate", *arguments]) == 2
    err = capsys.readouterr().err
    assert rule in err
    assert err.count("\n") == 1
    assert not list(Path.cwd().glob("*.html"))


def test_a_table_without_the_slider_is_refused(tables, central_case):
    bare = replace(tables["a"], frame=tables["a"].frame.drop(columns="slider_angle"))
    with pytest.raises(TableError, match="a: channel 'slider_angle' is missing"):
        motion({"a": bare}, central_case.data)
