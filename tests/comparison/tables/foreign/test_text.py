"""Tables that once were misread or refused (others: test_dialects), and the channels of columns."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from doc_pages import block
from foreign_tables import put, read_pair, refused, text
from hypothesis import given
from hypothesis import strategies as st

from comparison.tables.channels import channels
from comparison.tables.mapping import Dialect, load_mapping
from comparison.tables.units import parse_unit


@pytest.mark.parametrize(
    ("content", "names", "warning"),
    [
        ("# time, x\n0 1\n1 2\n", "x", ""),  # numpy's savetxt with a header of one's own
        ("TIME(Sec),x\n0,1\n1,2\n", "x", ""),
        ("time,0,1\n0.0,1,2\n1.0,2,3\n", "0 1", ""),
        ("2 3\n0 1 2\n1 2 3\n", "#2 #3", ""),  # the number of rows and columns
        ("time,ratio\ns,1\n0,5\n1,6\n", "ratio", ""),
        ("inDegrees=yes\nendheader\ntime knee\n0 1\n1 2\n", "knee", "title: 'inDegrees"),
        ('"Press\nrun 7"\ntime,x\n0,1\n1,2\n', "x", ""),
        ("Press\f run 7\ntime x\n0 1\n1 2\n", "x", ""),
        ("Date,2024-11-28\nTime,13:05:00\nSamples,3\ntime,x\n0,1\n1,2\n", "x", "line 2 is taken for a title"),
        ("time,thrust [8 real output]\n0,1\n1,2\n", "thrust", "'8 real output' beside thrust is not a unit"),
    ],
)
def test_a_table_as_programs_write_it_is_read(content, names, warning):
    table, _, warnings = read_pair(put("a.csv", content))
    assert (" ".join(table.channels), len(table.frame)) == (names, 2)
    assert warning in "".join(warnings)


pytestmark = pytest.mark.usefixtures("empty_folder")
FIELDS = "must hold {} fields, as the first row"
TITLE = "may be a row, name the columns or be a title: state decimal, thousands, names or skip"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("3 2\n4 5\n5 6\n6 7\n", "line 1 holds 3, 2, which may be names or numbers, or a size: state skip"),
        ("time   slider pos\n0      1\n1      2\n", TITLE),
        ('time,"x\n[mm]"\n0,1\n1,2\n', "line 2, below"),
        (",b1,b1\n,x,y\ntime,,\n0,1,5\n1,2,6\n", "line 1, above the names, may be names or units"),
        ("time,x [mm]\ns,m\n0,1\n1,2\n", "'x' states 'mm' beside its name and 'm' below"),
        ("time x\n0 1\n1\n", f"line 3 {FIELDS.format(2)}, and close quotation marks: state separator"),
        ('time,x\n0,1\n1,"2\n3"\n2,3\n', f"line 3 {FIELDS.format(2)}"),
        ("time,x\n" + "".join(f"{n},1\n" for n in range(999)) + "\x00\n", "has a zero byte"),
    ],
)
def test_what_is_not_clear_is_one_line(content, words):
    refused(words, put("a.csv", content))


def test_a_column_of_text_in_parquet():
    columns = {"x": ["a", "b", "c"], "y": [True, False, True], "z": [1, 2, None]}
    pd.DataFrame({"time": [0.0, 1.0, 2.0], **columns}).to_parquet("a.parquet")
    for name, words in (("x", "'x' is not a number|row 1: 'a'"), ("y", "'y' is not a number|row 1: 'True'")):
        refused(words, Path("a.parquet"), mapping=f"compare = ['{name}']\n")
    assert np.isnan(read_pair(Path("a.parquet"), mapping="compare = ['z']\n")[0].values("z")[2])


ROWS = "0,1,5\n1,2,6\n"
NAMES = 'names = ["time", "p", "q"]'
CLOCK = 'skip = 1\nnames = ["time", "x", "flag"]\n[columns.x]\nchannel = "x"\n[channels.x]'
ZEIT = '[columns.Zeit]\nchannel = "time"\nunit = "s"\n[columns.x]\nchannel = "x"\n[channels.x]'


@pytest.mark.parametrize(
    ("content", "words", "keys", "names", "values"),
    [
        ("time,load (left),load (right)\n" + ROWS, "column 'load' occurs twice", NAMES, "p q", [1, 2]),
        ("Zeit;x;F\n0;1;5\n1;2;6\n", "channel time is missing; columns: F, Zeit, x", ZEIT, "x", [1, 2]),
        ("time|x|F\n0|1|5\n1|2|6\n", "contains no row of two or more", 'separator = "|"', "x F", [1, 2]),
        ("2024 11 28\n12 30 45\ntime x F\n0 1 5\n1 2 6\n", "line 3 is text", "skip = 2", "x F", [1, 2]),
        ("clock;x;flag\n0;1;no\n1;2;yes\n", "contains no row", CLOCK, "x", [1, 2]),
        ("# Slider,press\n0,5.5\n1,6.5\n", "a comment, a row or", 'comment = "#"', "#2", [5.5, 6.5]),
    ],
)
def test_what_has_two_readings_is_read_once_a_mapping_states_the_key(content, words, keys, names, values):
    path = put("a.csv", content)
    refused(words, path)
    table, _, _ = read_pair(path, mapping=f"[dialect]\n{keys}")
    assert (" ".join(table.channels), table.values(table.channels[0]).tolist()) == (names, values)


def test_a_dialect_may_be_that_of_one_table():
    a, b = put("a.csv", "time;x\n0;1.500\n1;2.500\n"), put("b.csv", "time|x\n0|1,5\n1|2,5\n")
    mapping = '[dialect]\ndecimal = "."\n[dialect.b]\nseparator = "|"\ndecimal = ","'
    first, second, _ = read_pair(a, b, mapping)
    assert first.frame.equals(second.frame)


OURS = "time,slider_y,slider_angle\nms,mm,deg"
MM = "time,reach\ns,mm\n0,1\n1,2\n"


def test_what_a_mapping_does_not_name_is_left_out_of_both_tables_and_listed():
    files = put("a.csv", "time,q,hip\n0,1,3\n1,2,4\n"), put("b.csv", "time,knee,hip\n0,1,3\n1,2,4\n")
    definition = '[channels.knee]\nunit = "deg"\n[a.q]\nchannel = "knee"\n'
    a, b, warnings = read_pair(*files, definition)
    assert a.channels == b.channels == ["knee"]
    assert [line for line in warnings if line.endswith("leaves it out: hip")] == [
        f"{name}: not compared, since the mapping leaves it out: hip" for name in ("a.csv", "b.csv")
    ]
    assert read_pair(*files, 'compare = ["knee", "hip"]\n' + definition)[0].channels == ["knee", "hip"]


def test_the_mapping_of_the_guide_with_channels_of_its_own_is_one():
    dialect, definitions = (block("docs/foreign-tables.md", "toml", number) for number in (0, 2))
    section = load_mapping(put("map.toml", dialect)).dialect
    assert section.model_fields_set == Dialect.model_fields.keys()
    assert load_mapping(put("map.toml", definitions)).channels.keys() == {"knee", "knee_speed", "hip_moment"}


QW = "time,q,w\n0,1,0\n1,2,0\n"
UNIT = '[channels.q]\nunit = "m"\n'
X = '[columns.x]\nchannel = "slider_x"\n'
ANGLES = "time,slider_y,slider_angle\n"


@pytest.mark.parametrize(
    ("a", "b", "mapping", "rule"),
    [
        (text(ANGLES + "ms,deg,deg"), "", None, "'slider_y': unit 'deg' does not fit the channel slider_y"),
        (MM, "time,reach\n0,1\n1,2\n", None, "column 'reach' is in mm in a.csv and without a unit in b.csv"),
        (MM, "time,size\n0,1\n1,2\n", None, "'reach' is not a channel, nor a column of both"),
        (QW, "", '[columns.w]\nchannel = "slider_x"', "a.csv: |'w'|unit"),
        (QW, "", UNIT + "angle = true", "angle = true, but its unit 'm' is no angle"),
        (QW, "", UNIT + 'rate = "w"\n[channels.w]\nunit = "mm/s"', "which is not m per second"),
    ],
)
def test_tables_that_do_not_fit_are_refused_in_one_line(a, b, mapping, rule):
    refused(rule, put("a.csv", a), put("b.csv", b) if b else None, mapping)


@pytest.mark.parametrize(
    ("mapping", "rule"),
    [
        ("[colums.x]", "colums is not a known key; did you mean columns"),
        (X + "factor = 0.0", "columns.'x': factor = 0 leaves nothing"),
        (X + "sign = true", "columns.x.sign = True must be -1 or 1"),
        (X + X, "map.toml|line 3"),
        (X + 'unit = "furlong"', "map.toml|'x'|unit|furlong"),
        (X, "map.toml: column 'x' is not in either table; columns: slider_angle, slider_y, time"),
        ('compare = ["slider_z"]', "compare: 'slider_z' is not a channel"),
        ('[b.slider_Y]\nchannel = "slider_y"', "'slider_Y' is not in a.csv; columns: slider_angle, slider_y"),
        ('[columns.slider_y]\nchannel = "slider_y"\nunit = "cm"', "in the table and 'cm' in the mapping"),
        ("[channels.slider_x]\nangle = true", "'slider_x': angle is fixed for a channel of the press"),
        ('[channels.q]\nrate = "v"', "rate = 'v' is not another channel"),
        ("[channels.time]\nscale = 1.0", "channels.'time': time is no channel"),
    ],
)
def test_a_mapping_that_is_not_clear_is_refused_in_one_line(mapping, rule):
    refused(rule, put("a.csv", text(OURS)), mapping=mapping)


@pytest.mark.parametrize(
    ("text", "si", "factor"),
    [
        ("µm", "m", 1e-6), ("rpm", "rad/s", math.pi / 30), ("mm/sec**2", "m/s^2", 1e-3), ("W", "J/s", 1.0),
        ("m·s⁻²", "m/s^2", 1.0), ("mm/(ms^2)", "m/s^2", 1e3), ("N*m", "N m", 1.0), ("newton-mm", "N m", 1e-3),
        ("kg mm^2/s^2", "J", 1e-6), ("DEG", "rad", math.pi / 180), ("turn", "deg", 360.0), ("g", "kg", 1e-3),
        ("lbm", "kg", 0.45359237), ("lbf", "N", 4.4482216152605), ("Hz", "1/s", 1.0), ("ns", "us", 1e-3),
        ("h", "min", 60.0), ("GPa", "kPa", 1e6), ("kJ", "Nmm", 1e6), ("ft", "in", 12.0), ("cm", "mm", 10.0),
    ],
)  # fmt: skip
def test_spellings_and_factors(text, si, factor):
    unit, si_unit = parse_unit(text), parse_unit(si)
    assert unit.powers == si_unit.powers
    # The factor is one rounding from the written one, as is the test's own.
    assert float(unit.factor / si_unit.factor) == pytest.approx(factor, rel=3e-16)


def test_what_is_no_unit_is_none_and_those_of_the_channels_are_si():
    for word in ("", " ", "furlong", "N/", "/s", "mm^", "mm//s", "x", "12", "MM", "m s oops"):
        assert parse_unit(word) is None, word
    for channel in channels().values():
        assert parse_unit(channel.unit).factor == 1, channel.name


@given(st.integers(-(10**15), 10**15), st.sampled_from([("mm", 3), ("um", 6), ("ms", 3), ("cm", 2)]))
def test_a_decimal_unit_gives_the_double_next_to_the_exact_value(n, unit):
    text, digits = unit
    assert parse_unit(text).convert(np.array([float(n)]), parse_unit(text[-1]))[0] == float(f"{n}e-{digits}")
