"""Samples in the layouts of other programs: the motion x = 0.1 m cos(2 pi t), read by content."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from foreign_tables import put, read_pair

from comparison.tables.mapping import load_mapping
from comparison.tables.table import Table, TableError

SAMPLES = Path(__file__).with_name("samples")
TIME = np.arange(21) * 0.05
X, V = 0.1 * np.cos(2 * np.pi * TIME), -0.2 * np.pi * np.sin(2 * np.pi * TIME)


def sample(
    name: str, at_events: str | None = None, mapping: str | None = None
) -> tuple[Table, tuple[str, ...]]:
    """Read a sample beside itself."""
    rules = None if mapping is None else load_mapping(put("map.toml", mapping))
    table, _, warnings = read_pair(SAMPLES / name, SAMPLES / name, rules, at_events)
    return table, warnings


@pytest.mark.parametrize(
    ("name", "x", "v", "units", "digits"),
    [
        ("adams.xlsx", ".press.slider.X", ".press.slider.VX", ("meter", "meter/sec"), 15),
        ("chrono_adams.txt", "X_Pos", "X_Vel", ("", ""), 6),
        ("openfast.out", "PtfmSurge", "PtfmSurgeV", ("m", "m/s"), 5),
        ("hydrodyn.out", "PtfmSurge", "PtfmSurgeV", ("m", "m/s"), 5),
        ("opensim.sto", "pelvis_tx", "pelvis_tx_u", ("", ""), 7),
        ("opensim.mot", "pelvis_tx", "pelvis_tx_u", ("", ""), 7),
        ("fmi.csv", "x", "der(x)", ("", ""), 8),
        ("modelica.csv", "body.r_0[1]", "body.v_0[1]", ("", ""), 8),
        ("exudyn_sensor.txt", "#2", "#3", ("", ""), 8),
        ("exudyn_solution.txt", "#2", "#3", ("", ""), 8),
        ("siconos.ref", "#2", "#3", ("", ""), 15),
        ("siconos_nodim.ref", "#2", "#3", ("", ""), 15),
    ],
)
def test_every_sample_gives_its_columns_and_units(name, x, v, units, digits):
    table, warnings = sample(name)
    assert list(table.frame) == ["time", x, v]
    assert (table.own[x].unit, table.own[v].unit) == units
    np.testing.assert_allclose(table.time, TIME, rtol=0, atol=1e-15)
    # The digits that the sample is written with.
    np.testing.assert_allclose(table.values(x), X, rtol=0, atol=10.0**-digits)
    np.testing.assert_allclose(table.values(v), V, rtol=0, atol=10.0**-digits)
    assert ("no unit is stated" in "".join(warnings)) == (units == ("", ""))
    assert ("columns without names" in "".join(warnings)) == (x == "#2")


@pytest.mark.parametrize("name", sorted(path.name for path in SAMPLES.iterdir()))
def test_the_ending_says_nothing(name, tmp_path):
    shutil.copy(SAMPLES / name, tmp_path / "run.37")
    again, _, _ = read_pair(Path("run.37"), Path("run.37"), None, "left")
    assert again.frame.equals(sample(name, "left")[0].frame)


def test_tables_of_two_programs_compare_by_position_and_by_name():
    mapping = """
[channels.surge]
unit = "m"
rate = "speed"
[channels.speed]
unit = "m/s"
[a."#2"]
channel = "surge"
[a."#3"]
channel = "speed"
[b.PtfmSurge]
channel = "surge"
[b.PtfmSurgeV]
channel = "speed"
"""
    rules = load_mapping(put("map.toml", mapping))
    a, b, warnings = read_pair(SAMPLES / "exudyn_sensor.txt", SAMPLES / "openfast.out", rules)
    assert a.channels == b.channels == ["surge", "speed"]
    # 8 and 5 digits after the point of 0.1 m.
    np.testing.assert_allclose(a.values("surge"), b.values("surge"), rtol=0, atol=1e-6)
    assert a.own == b.own
    assert not [line for line in warnings if "left out" in line or "leaves" in line]


@pytest.mark.parametrize(
    ("at_events", "rows", "speeds"), [("left", 21, [0.0]), ("right", 21, [0.5]), ("both", 22, [0.0, 0.5])]
)
def test_the_rows_at_an_event(at_events, rows, speeds):
    table, _ = sample("modelica_event.csv", at_events)
    assert (np.diff(table.time) > 0).all()
    assert table.time.size == rows
    here = np.abs(table.time - 0.5) < 1e-9
    np.testing.assert_allclose(table.values("body.v_0[1]")[here], speeds, rtol=0, atol=1e-9)
    with pytest.raises(TableError, match=r"time 0\.5 s is repeated in data row 12 \(1 such row\).*--at-ev"):
        sample("modelica_event.csv")


def test_units_of_other_fields():
    kinds = {"mass": "kg", "pressure": "Pa", "frequency": "1/s"}
    mapping = "".join(f'[channels.{name}]\nunit = "{unit}"\n' for name, unit in kinds.items())
    table, _ = sample("units.csv", mapping=mapping)
    first = table.frame.iloc[0]
    assert (first["mass"], first["pressure"], first["frequency"]) == (2 * 0.45359237, 5000.0, 7.0)
    assert (table.own["torque"].unit, first["torque"]) == ("Nm", 3.0)  # as both tables have it


@pytest.mark.parametrize(
    ("head", "rule"),
    [
        (b"\x89HDF\r\n\x1a\n", "is an HDF5 file: export its columns as CSV"),
        (
            b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
            "Excel before 2007, or one with a password: save its sheet as .csv",
        ),
        (b"\x01\x00\x02\x00fast", "is a binary file: let the program write text or CSV"),
        (b"PK\x03\x04 no workbook", "is not a readable .xlsx workbook: save its sheet as CSV"),
        (b"", "contains no row of two or more numbers"),
        (b"nothing\nhere\n", "contains no row of two or more numbers"),
        (b"time\n1\n2\n", "contains no row of two or more numbers"),
        (None, "No such file"),
    ],
)
def test_what_cannot_be_read_says_how_to_export_it(head, rule):
    with pytest.raises(TableError, match=re.escape(rule)) as refused:
        read_pair(Path("run.out") if head is None else put("run.out", head), Path("run.out"))
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("run.out: ")
