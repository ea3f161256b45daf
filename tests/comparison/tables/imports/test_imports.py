"""Tables of other programs: in every layout and unit the same numbers arrive; nothing is lost silently."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from foreign_tables import FRAME, ROWS, put, read_pair, text

from comparison.tables.mapping import load_mapping
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import write


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
        (text("T,slider_y,slider_angle\nms,mm,deg"), "channel time is missing; columns: T, slider_angle,"),
        (text("TIME,slider_y,time\nms,mm,s"), "columns 'TIME' and 'time' are both the channel time"),
        (text("time,slider_y"), "line 2 holds 3 numbers, but line 1 names 2"),
        (text(NAMES + "\nms,mm,deg") + text(NAMES + "\nms,mm,deg"), "text after data row 11: save one block"),
        (text(NAMES + "\nms,mm,deg") + "20,oops,3\n", "'slider_y' is not a number in data row 12: 'oops'"),
        (text(NAMES + "\nms,mm,deg") + "20,1,3,4\n", "line 14 holds 4 fields, but line 3 3"),
        (text("x;y;z\nms;mm;deg", ";", ",") + "20,5;1.2345,5;3\n", "columns: x, y, z; a mapping"),
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
        ('[columns.x]\nchannel = "slider_x"\nfactor = 0.0', "columns.'x': factor = 0 leaves nothing"),
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


def test_a_text_without_numbers_is_refused():
    with pytest.raises(TableError, match="contains no row of two or more numbers"):
        one(put("a.tab", "nothing\nhere\n"))
    with pytest.raises(TableError, match="No such file"):
        one(Path("none.tab"))
