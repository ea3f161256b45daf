"""Which column is which channel, in every layout and unit: the same numbers, and nothing is lost silently."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import put, read_pair, refused, text
from hypothesis import given
from hypothesis import strategies as st

from comparison.tables.channels import channels
from comparison.tables.mapping import Dialect, load_mapping
from comparison.tables.units import parse_unit

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
    guide = (Path(__file__).parents[4] / "docs" / "foreign-tables.md").read_text("utf-8")
    dialect, _, own, _ = re.findall(r"```toml\n(.*?)```", guide, re.DOTALL)
    stated = load_mapping(put("map.toml", dialect)).dialect
    assert stated.model_fields_set == Dialect.model_fields.keys()
    assert load_mapping(put("map.toml", own)).channels.keys() == {"knee", "knee_speed", "hip_moment"}


QW = "time,q,w\n0,1,0\n1,2,0\n"
UNIT = '[channels.q]\nunit = "m"\n'
X = '[columns.x]\nchannel = "slider_x"\n'
ANGLES = "time,slider_y,slider_angle\n"


@pytest.mark.parametrize(
    ("a", "b", "mapping", "rule"),
    [
        (text(ANGLES + "ms,deg,deg"), "", None, "'slider_y': unit 'deg' does not fit the channel slider_y"),
        (text("TIME,slider_y,time\nms,mm,s"), "", None, "'TIME' and 'time' are both the channel time"),
        (MM, "time,reach\n0,1\n1,2\n", None, "column 'reach' is in mm in a.csv and without a unit in b.csv"),
        (MM, "time,reach\ns,deg\n0,1\n1,2\n", None, "is in mm in a.csv and in deg in b.csv"),
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
        ('[columns.x]\nchannel = "slider_z"', "map.toml|'slider_z'"),
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
        ("in", "m", 0.0254), ("µm", "m", 1e-6), ("rpm", "rad/s", math.pi / 30), ("mm/sec**2", "m/s^2", 1e-3),
        ("mm/s²", "m/s^2", 1e-3), ("m·s⁻²", "m/s^2", 1.0), ("mm/(ms^2)", "m/s^2", 1e3), ("mJ", "J", 1e-3),
        ("deg/sec", "rad/s", math.pi / 180), ("N*m", "N m", 1.0), ("newton-mm", "N m", 1e-3),
        ("kg mm^2/s^2", "J", 1e-6), ("DEG", "rad", math.pi / 180), ("turn", "deg", 360.0),
        ("lbm", "kg", 0.45359237), ("N", "kg m/s^2", 1.0), ("lbf", "N", 4.4482216152605), ("W", "J/s", 1.0),
        ("Pa", "N/m^2", 1.0), ("Hz", "1/s", 1.0), ("ns", "us", 1e-3), ("h", "min", 60.0), ("kN", "mN", 1e6),
        ("GPa", "kPa", 1e6), ("kJ", "Nmm", 1e6), ("g", "kg", 1e-3), ("ft", "in", 12.0), ("cm", "mm", 10.0),
    ],
)  # fmt: skip
def test_spellings_and_factors(text, si, factor):
    unit, wanted = parse_unit(text), parse_unit(si)
    assert unit.powers == wanted.powers
    # The factor is one rounding from the written one, as is the test's own.
    assert float(unit.factor / wanted.factor) == pytest.approx(factor, rel=3e-16)


def test_what_is_no_unit_is_none_and_those_of_the_channels_are_si():
    for none in ("", " ", "furlong", "N/", "/s", "mm^", "mm//s", "x", "12", "MM", "m s oops"):
        assert parse_unit(none) is None, none
    for channel in channels().values():
        assert parse_unit(channel.unit).factor == 1, channel.name


@given(st.integers(-(10**15), 10**15), st.sampled_from([("mm", 3), ("um", 6), ("ms", 3), ("cm", 2)]))
def test_a_decimal_unit_gives_the_double_next_to_the_exact_value(n, unit):
    text, digits = unit
    assert parse_unit(text).convert(np.array([float(n)]), parse_unit(text[-1]))[0] == float(f"{n}e-{digits}")
