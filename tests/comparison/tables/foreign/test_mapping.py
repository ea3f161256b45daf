"""Which column is which channel, in every layout and unit: the same numbers, and nothing is lost silently."""

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
OURS = NAMES + "\nms,mm,deg"
MM = "time,reach\ns,mm\n0,1\n1,2\n"


def one(path: Path, mapping: str | None = None) -> Table:
    """Read a table beside itself."""
    rules = None if mapping is None else load_mapping(put("map.toml", mapping))
    return read_pair(path, path, rules)[0]


def same(table: Table) -> None:
    """Assert the frame in SI. A value in other units and back is off by two roundings, of pi by one more."""
    assert list(table.frame) == list(FRAME)
    np.testing.assert_allclose(table.frame.to_numpy(), FRAME.to_numpy(), rtol=1e-15, atol=0)


def refused(rule: str, a: Path, b: Path | None = None, mapping: str | None = None) -> None:
    def read() -> None:
        read_pair(a, b or a, None if mapping is None else load_mapping(put("map.toml", mapping)))

    with pytest.raises(TableError, match=re.escape(rule)) as error:
        read()
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "encoding"),
    [
        (text(OURS), "utf-8"),
        (text(NAMES + "\n[ms],[mm],[deg]"), "utf-8"),
        (text("time [ms],slider_y [mm],slider_angle [deg]", end="\r\n"), "utf-8-sig"),
        (text('"time (ms)", "slider_y (mm)", "slider_angle (deg)"', ", "), "utf-8"),
        (text("time [ms];slider_y [mm];slider_angle [°]", ";", ","), "cp1252"),
        (text("TIME;slider_y;slider_angle\nms;mm;deg", ";"), "utf-8"),
        (text("time\tslider_y\tslider_angle\nms\tmm\tdeg", "\t", ","), "utf-8"),
        (text("time,slider_y,slider_angle,\nms,mm,deg,", end=",\n"), "utf-8"),
        (text("# press\n# time (ms)  slider_y (mm)  slider_angle (deg)", "   "), "utf-8"),
        (text("# time slider_y slider_angle\n# ms mm deg", " "), "utf-8"),
        (text("Press, last run\n\nmade, on a day, in May\n" + OURS), "utf-8"),
    ],
)
def test_every_layout_gives_the_same_numbers(content, encoding):
    same(one(put("a.csv", content, encoding)))


@pytest.mark.parametrize("separator", ["\t", " ", "   "])
def test_adams_with_a_title_and_quoted_names(separator):
    header = "Adams table: press\n\n" + separator.join(['"TIME"', '".press.Y"', '".press.ROT"'])
    same(one(put("adams.tab", text(header, separator)), ADAMS))
    pd.DataFrame(ROWS, columns=["TIME", ".press.Y", ".press.ROT"]).to_parquet("a.parquet", index=False)
    same(one(Path("a.parquet"), ADAMS))


def test_our_own_tables_are_read_bit_for_bit(make_table):
    table = make_table()
    events = pd.DataFrame({"corner": ["ll"], "start": [0.1], "end": [0.2]})
    path = write(Table(table.frame, events, {}, {"model": "mine"}), Path("own.csv"))
    again = one(path)
    assert again.frame.to_numpy().tobytes() == table.frame.to_numpy().tobytes()
    assert again.provenance == {"model": "mine"}
    assert again.events.equals(events)


def test_sign_and_offset_are_in_the_columns_unit_and_a_rule_for_one_table_goes_first():
    mapping = ADAMS.replace('unit = "mm"', 'unit = "mm"\nsign = -1\noffset = -550.0')
    path = put("adams.tab", text("TIME\t.press.Y\t.press.ROT", "\t"))
    # 0.55 m less 0.1 m round at 1e-16.
    moved = -FRAME["slider_y"] - 0.55
    np.testing.assert_allclose(one(path, mapping).values("slider_y"), moved, rtol=0, atol=3e-16)
    rule = '[b.".press.Y"]\nchannel = "slider_y"\nunit = "mm"\nsign = -1\n'
    a, b, _ = read_pair(path, path, load_mapping(put("map.toml", ADAMS + rule)))
    same(a)
    np.testing.assert_array_equal(a.values("slider_y"), -b.values("slider_y"))


def test_what_the_mapping_leaves_out_is_listed():
    path = put("adams.tab", text("TIME\t.press.Y\t.press.ROT", "\t"))
    mapping = load_mapping(put("map.toml", ADAMS.partition('[columns.".press.ROT"]')[0]))
    a, _, warnings = read_pair(path, path, mapping)
    assert a.channels == ["slider_y"]
    assert warnings == ("adams.tab: not compared, since the mapping leaves it out: .press.ROT",) * 2
    path = put("a.csv", text(OURS))
    a, b, warnings = read_pair(path, path, load_mapping(put("map.toml", 'compare = ["slider_y"]')))
    assert a.channels == b.channels == ["slider_y"]
    assert "slider_angle" in warnings[0]


def test_a_mapping_of_one_table_leaves_out_what_it_does_not_name_in_both():
    put("a.csv", "time,q,hip\n0,1,3\n1,2,4\n")
    put("b.csv", "time,knee,hip\n0,1,3\n1,2,4\n")
    definition = '[channels.knee]\nunit = "deg"\n[a.q]\nchannel = "knee"\n'
    a, b, warnings = read_pair(Path("a.csv"), Path("b.csv"), load_mapping(put("map.toml", definition)))
    assert a.channels == b.channels == ["knee"]
    assert [line for line in warnings if line.endswith("leaves it out: hip")] == [
        f"{name}: not compared, since the mapping leaves it out: hip" for name in ("a.csv", "b.csv")
    ]
    rules = load_mapping(put("map.toml", 'compare = ["knee", "hip"]\n' + definition))
    assert read_pair(Path("a.csv"), Path("b.csv"), rules)[0].channels == ["knee", "hip"]


def test_a_unit_that_differs_is_converted_to_the_first_tables():
    a, b, _ = read_pair(put("a.csv", MM), put("b.csv", "time,reach\ns,m\n0,0.001\n1,0.002\n"))
    assert a.own["reach"].unit == "mm"
    np.testing.assert_array_equal(a.values("reach"), b.values("reach"))


def test_numbers_that_are_not_finite_come_through_to_the_check():
    for bad in ("nan", "", "inf"):
        table = one(put("a.csv", text(OURS) + f"20,{bad},3\n"))
        with pytest.raises(TableError, match=r"slider_y is (nan|inf) in data row 12"):
            check(table, ["slider_y", "slider_angle"])


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
        (text(OURS) + text(OURS), "text after data row 11: save one block"),
        (text(OURS) + "20,oops,3\n", "'slider_y' is not a number in data row 12: 'oops'"),
        (text(OURS) + "20,1,3,4\n", "line 14 holds 4 fields, but line 3 holds 3"),
        (text("x;y;z\nms;mm;deg", ";", ",") + "20,5;1.2345,5;3\n", "columns: x, y, z; a mapping"),
    ],
)
def test_a_table_that_is_not_clear_is_refused_in_one_line(content, rule):
    refused(rule, put("a.csv", content))


@pytest.mark.parametrize(
    ("a", "b", "rule"),
    [
        (MM, "time,reach\n0,1\n1,2\n", "column 'reach' is in mm, b.csv states no unit"),
        (MM, "time,reach\ns,deg\n0,1\n1,2\n", "is in mm in a.csv and in deg in b.csv"),
        (MM, "time,size\n0,1\n1,2\n", "'reach' is not a channel, nor a column of both"),
        ("inDegrees=yes\ntime q\n0 1\n1 2\n", "inDegrees=no\ntime q\n0 1\n1 2\n", "a.csv is inDegrees=yes"),
        ("0 1 3\n1 2 3\n", "speed of\n0 1 3\n1 2 3\n", "line 2 holds 3 numbers, but line 1 names 2"),
    ],
)  # fmt: skip
def test_two_tables_that_do_not_fit_are_refused_in_one_line(a, b, rule):
    refused(rule, put("a.csv", a), put("b.csv", b))


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
        (ADAMS, "map.toml: column 'TIME' is not in either table; columns:"),
        ('[columns.slider_Y]\nchannel = "slider_y"', "is not in either table; did you mean 'slider_y'"),
        ('[b.slider_Y]\nchannel = "slider_y"', "'slider_Y' is not in a.csv; did you mean 'slider_y'"),
        (
            '[columns.slider_y]\nchannel = "slider_y"\nunit = "cm"',
            "the unit is 'mm' in the table and 'cm' in the mapping",
        ),
        ('[columns.slider_y]\nchannel = "slider_angle"\nunit = "deg"', "both the channel slider_angle"),
        ("[channels.slider_x]\nangle = true", "'slider_x': angle is fixed for a channel of the press"),
        ('[channels.q]\nunit = "furlong"', "channels.'q': unit = 'furlong' is not known"),
        ("[channels.q]\nscale = 0", "channels.q.scale = 0 must be above 0"),
        ("[channels.q]\nfactor = 0", "channels.'q': factor = 0 leaves nothing"),
        ('[channels.q]\nrate = "v"', "rate = 'v' is not another channel"),
        ("[channels.time]\nscale = 1.0", "channels.'time': time is no channel"),
    ],
)
def test_a_mapping_that_is_not_clear_is_refused_in_one_line(mapping, rule):
    refused(rule, put("a.csv", text(OURS)), mapping=mapping)


@pytest.mark.parametrize(
    ("mapping", "rule"),
    [
        ('[channels.q]\nunit = "m"\nangle = true', "angle = true, but its unit 'm' is no angle"),
        ('[channels.q]\nunit = "m"\nrate = "w"\n[channels.w]\nunit = "mm/s"', "which is not m per second"),
        ('[columns.q]\nchannel = "slider_y"', "column 'q' has no unit"),
    ],
)
def test_a_definition_that_does_not_fit_the_table_is_refused_in_one_line(mapping, rule):
    refused(rule, put("a.csv", "time,q,w\n0,1,0\n1,2,0\n"), mapping=mapping)


def test_a_mapping_gives_the_scale_of_a_channel_of_the_press():
    table = one(put("a.csv", text(OURS)), "[channels.slider_y]\nscale = 0.5\n")
    assert table.own["slider_y"].given == 0.5


def test_a_key_that_holds_dots_is_quoted_in_a_message():
    mapping = "[columns.'.press.X']\nchannel = \"slider_x\"\nsigns = 1\n"
    refused("columns.'.press.X'.signs is not a known key", put("a.csv", text(OURS)), mapping=mapping)


def test_a_number_too_long_to_print_is_one_line():
    mapping = f"[columns.x]\nchannel = 'slider_x'\nsign = 0x{'f' * 6000}\n"
    refused("sign = an integer of thousands of digits must be", put("a.csv", text(OURS)), mapping=mapping)
