"""Tables of other programs: in every layout and unit the same numbers arrive; nothing is lost silently."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from comparison.cli import main
from comparison.tables.check import check
from comparison.tables.imports.mapping import load_mapping
from comparison.tables.imports.text import read_pair
from comparison.tables.table import Table, TableError, write

GUIDE = (Path(__file__).parents[4] / "docs" / "foreign-tables.md").read_text("utf-8")
TIME = np.arange(0, 11) / 1000
FRAME = pd.DataFrame(
    {"time": TIME, "slider_y": 0.1 * np.cos(400 * TIME), "slider_angle": 1e-3 * np.sin(400 * TIME)}
)
ROWS = [(t * 1e3, y * 1e3, np.degrees(angle)) for t, y, angle in FRAME.to_numpy()]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def text(header: str, separator: str = ",", decimal: str = ".", end: str = "\n") -> str:
    """The frame in ms, mm and deg."""
    lines = [separator.join(repr(float(v)).replace(".", decimal) for v in row) for row in ROWS]
    return header + "\n" + end.join(lines) + end


def put(name: str, content: str | bytes, encoding: str = "utf-8") -> Path:
    path = Path(name)
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return path


def one(path: Path, mapping: str | None = None) -> Table:
    """Read a table beside itself."""
    rules = None if mapping is None else load_mapping(put("map.toml", mapping))
    return read_pair(path, path, rules)[0]


def same(table: Table) -> None:
    """Assert the frame in SI. A value in other units and back is off by two roundings, of pi by one more."""
    assert list(table.frame) == list(FRAME)
    np.testing.assert_allclose(table.frame.to_numpy(), FRAME.to_numpy(), rtol=1e-15, atol=0)


ADAMS = """
[columns.TIME]
channel = "time"
unit = "ms"
[columns.".press.Y"]
channel = "slider_y"
unit = "mm"
[columns.".press.ROT"]
channel = "slider_angle"
unit = "deg"
"""
NAMES = "time,slider_y,slider_angle"


@pytest.mark.parametrize(
    ("name", "content", "encoding"),
    [
        ("units.csv", text(NAMES + "\nms,mm,deg"), "utf-8"),
        ("brackets.csv", text(NAMES + "\n[ms],[mm],[deg]"), "utf-8"),
        ("bom.csv", text("time [ms],slider_y [mm],slider_angle [deg]", end="\r\n"), "utf-8-sig"),
        ("round.csv", text('"time (ms)", "slider_y (mm)", "slider_angle (deg)"', ", "), "utf-8"),
        ("windows.csv", text("time [ms];slider_y [mm];slider_angle [°]", ";", ","), "cp1252"),
        ("points.csv", text("TIME;slider_y;slider_angle\nms;mm;deg", ";"), "utf-8"),
        ("comma.tsv", text("time\tslider_y\tslider_angle\nms\tmm\tdeg", "\t", ","), "utf-8"),
        ("ends.csv", text("time,slider_y,slider_angle,\nms,mm,deg,", end=",\n"), "utf-8"),
        ("spaces.txt", text("# press\n# time (ms)  slider_y (mm)  slider_angle (deg)", "   "), "utf-8"),
        ("savetxt.dat", text("# time slider_y slider_angle\n# ms mm deg", " "), "utf-8"),
        ("title.csv", text("Press, last run\n\nmade, on a day, in May\n" + NAMES + "\nms,mm,deg"), "utf-8"),
    ],
)  # fmt: skip
def test_every_layout_gives_the_same_numbers(name, content, encoding):
    same(one(put(name, content, encoding)))


@pytest.mark.parametrize("separator", ["\t", "  ", " \t "])
def test_an_adams_table_with_a_title_and_quoted_names(separator):
    header = "Adams table: press\n\n" + separator.join(['"TIME"', '".press.Y"', '".press.ROT"'])
    same(one(put("adams.tab", text(header, separator)), ADAMS))


def test_our_own_tables_arrive_bit_for_bit(make_table):
    table = make_table()
    events = pd.DataFrame({"corner": ["ll"], "start": [0.1], "end": [0.2]})
    path = write(Table(table.frame, events, {}, {"model": "mine"}), Path("own.csv"))
    again = one(path)
    assert again.frame.to_numpy().tobytes() == table.frame.to_numpy().tobytes()
    assert again.provenance == {"model": "mine"}
    assert again.events.equals(events)


def test_parquet_with_other_names():
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame(ROWS, columns=["TIME", ".press.Y", ".press.ROT"])
    frame.to_parquet("a.parquet", index=False)
    same(one(Path("a.parquet"), ADAMS))


def test_sign_and_offset_are_in_the_columns_unit():
    mapping = ADAMS.replace('unit = "mm"', 'unit = "mm"\nsign = -1\noffset = -550.0')
    table = one(put("adams.tab", text("TIME\t.press.Y\t.press.ROT", "\t")), mapping)
    # 0.55 m less 0.1 m round at 1e-16.
    np.testing.assert_allclose(table.values("slider_y"), -FRAME["slider_y"] - 0.55, rtol=0, atol=3e-16)


def test_what_the_mapping_does_not_name_is_listed():
    path = put("adams.tab", text("TIME\t.press.Y\t.press.ROT", "\t"))
    mapping = load_mapping(put("map.toml", ADAMS.partition('[columns.".press.ROT"]')[0]))
    a, _, warnings = read_pair(path, path, mapping)
    assert a.channels == ["slider_y"]
    assert warnings == ("adams.tab: not compared, since the mapping leaves it out: .press.ROT",) * 2


def test_channels_to_compare_are_chosen_and_the_others_listed():
    path = put("a.csv", text(NAMES + "\nms,mm,deg"))
    a, b, warnings = read_pair(path, path, load_mapping(put("map.toml", 'compare = ["slider_y"]')))
    assert a.channels == b.channels == ["slider_y"]
    assert "slider_angle" in warnings[0]


def test_a_rule_for_one_of_the_tables_goes_before_one_for_both():
    put("a.csv", text("time,x,slider_angle\nms,mm,deg"))
    put("b.csv", text("time,x,slider_angle\nms,mm,deg"))
    rule = '."x"]\nchannel = "slider_y"\n'
    mapping = load_mapping(put("map.toml", f"[columns{rule}[b{rule}sign = -1\n"))
    a, b, _ = read_pair(Path("a.csv"), Path("b.csv"), mapping)
    same(a)
    np.testing.assert_array_equal(a.values("slider_y"), -b.values("slider_y"))


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (text(NAMES + "\nms,furlong,deg"), "'slider_y': unit 'furlong' is not known"),
        (
            text(NAMES + "\nms,deg,deg"),
            "'slider_y': unit 'deg' does not fit the channel slider_y, which is in m",
        ),
        (text(NAMES + "\nms,mm,mm"), "unit 'mm' does not fit the channel slider_angle"),
        (text(NAMES + "\nmm,mm,deg"), "unit 'mm' does not fit the channel time, which is in s"),
        (text("time,slider_y,slider_y\nms,mm,mm"), "column 'slider_y' occurs twice"),
        (text("time,slider_y,slider_Y\nms,mm,mm"), "'slider_Y' is not a channel; a mapping"),
        (text("t,slider_y,slider_angle\nms,mm,deg"), "'t' is not a channel"),
        (text("TIME,slider_y,time\nms,mm,s"), "columns 'TIME' and 'time' are both the channel time"),
        (text("time,slider_y"), "line 2 holds 3 numbers, but line 1 names 2"),
        (text("").lstrip(), "line 1 holds 3 numbers, but no line above names any"),
        (text(NAMES + "\nms,mm,deg") + text(NAMES + "\nms,mm,deg"), "text after data row 11: save one block"),
        (text(NAMES + "\nms,mm,deg") + "20,oops,3\n", "'slider_y' is not a number in data row 12: 'oops'"),
        (text(NAMES + "\nms,mm,deg") + "20,1,3,4\n", "cannot be read"),
        (text("x;y;z\nms;mm;deg", ";", ",") + "20,5;1.234,5;3\n", "is not a number in data row 12"),
    ],
)
def test_what_is_not_clear_is_refused_in_one_line(content, rule):
    with pytest.raises(TableError, match=re.escape(rule)) as refused:
        one(put("a.csv", content))
    assert "\n" not in str(refused.value)
    assert "a.csv" in str(refused.value)


@pytest.mark.parametrize(
    ("mapping", "rule"),
    [
        ("", "names no column"),
        ("columns = 3", "columns = 3 must be a section"),
        ("[columns", "cannot be read"),
        ("[colums.x]", "colums is not a known key"),
        ('[columns.x]\nunit = "mm"', "columns.x.channel is missing"),
        ('[columns.x]\nchannel = "slider_z"', "columns.'x': channel = 'slider_z' is not a channel"),
        ('[columns.x]\nchannel = "slider_x"\nunit = "furlong"', "unit = 'furlong' is not known"),
        ('[columns.x]\nchannel = "slider_x"\nsign = 2', "columns.x.sign = 2 must be 1 or -1"),
        ('[columns.x]\nchannel = "slider_x"\noffset = inf', "columns.x.offset = inf must be finite"),
        ('[columns.x]\nchannel = "slider_x"\noffset = "a"', "columns.x.offset = 'a' must be a number"),
        ('[columns.x]\nchannel = "slider_x"\nfactor = 2', "columns.x.factor is not a known key"),
        ("compare = []", "must name at least one channel"),
        ('compare = ["slider_z"]', "compare: 'slider_z' is not a channel"),
        (ADAMS, "mapping: column 'TIME' is not in either table; columns:"),
        ('[columns.slider_Y]\nchannel = "slider_y"', "is not in either table; did you mean 'slider_y'"),
        ('[b.slider_Y]\nchannel = "slider_y"', "'slider_Y' is not in a.csv; did you mean 'slider_y'"),
        (
            '[columns.slider_y]\nchannel = "slider_y"\nunit = "cm"',
            "the unit is 'mm' in the table and 'cm' in the mapping",
        ),
        ('[columns.slider_y]\nchannel = "slider_angle"\nunit = "deg"', "both the channel slider_angle"),
    ],
)  # fmt: skip
def test_a_mapping_that_is_not_clear_is_refused_in_one_line(mapping, rule):
    with pytest.raises(TableError, match=re.escape(rule)) as refused:
        one(put("a.csv", text(NAMES + "\nms,mm,deg")), mapping)
    assert "\n" not in str(refused.value)


def test_a_mapped_column_needs_a_unit():
    with pytest.raises(TableError, match="column 'y' has no unit"):
        one(put("a.csv", "time,y\n0,1\n1,2\n"), '[columns.y]\nchannel = "slider_y"')


def test_numbers_that_are_not_finite_come_through_to_the_check():
    for bad in ("nan", "", "inf"):
        table = one(put("a.csv", text(NAMES + "\nms,mm,deg") + f"20,{bad},3\n"))
        with pytest.raises(TableError, match=r"slider_y is (nan|inf) in data row 12"):
            check(table, ["slider_y", "slider_angle"])


@pytest.mark.parametrize("name", ["a.xls", "a"])
def test_other_endings_are_refused(name):
    with pytest.raises(TableError, match=r"must end in \.csv, .* or \.mat"):
        one(put(name, ""))


def test_a_text_without_numbers_is_refused():
    with pytest.raises(TableError, match="contains no row of two or more numbers"):
        one(put("a.tab", "nothing\nhere\n"))
    with pytest.raises(TableError, match="No such file"):
        one(Path("none.tab"))


# The command line


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
    assert main([*documented.split(), "--json", "numbers.json"]) == 0
    out = capsys.readouterr().out
    assert (
        "adams.tab: not compared, since the mapping leaves it out: .press.slider.VX, .press.crank.TQ" in out
    )
    assert "No significant time shift" in out
    html = Path(out.splitlines()[-1]).read_text("utf-8")
    assert "No significant time shift" in html
    assert "crank cycles" in html
    assert "--mapping adams.toml" in html
    assert "-.press.slider.X in mm -550" in html.replace("−", "-")
    numbers = json.loads(Path("numbers.json").read_text())
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
