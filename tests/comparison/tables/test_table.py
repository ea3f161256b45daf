"""Tables come back bit for bit, and a bad one is refused by channel and row."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.files import FolderError, check_folder
from comparison.tables.channels import expected
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import companions, read, write

EVENTS = pd.DataFrame({"corner": ["ll", "ur"], "start": [0.0, 0.1], "end": [0.01, 0.2]})


@pytest.mark.parametrize("ending", ["csv", "parquet", "CSV"])
def test_what_is_written_is_read_bit_for_bit(tmp_path, make_table, ending):
    extrema = {"slider_x": {"min": -1.0, "time_of_min": 0.1, "max": 1.0, "time_of_max": 0.2}}
    table = Table(make_table().frame, EVENTS, extrema, {"model": "reference", "status": "success"})
    again = read(write(table, tmp_path / "deep" / f"run.{ending}"))
    assert again.frame.columns.tolist() == table.frame.columns.tolist()
    assert again.frame.to_numpy().tobytes() == table.frame.to_numpy().tobytes()
    pd.testing.assert_frame_equal(again.events, EVENTS, check_exact=True)
    assert (again.extrema, again.provenance) == (extrema, table.provenance)
    names = {path.name for path in (tmp_path / "deep").iterdir()}
    assert names == {f"run.{ending}", "run.events.csv", "run.json"}


def test_extrema_by_cycle_are_kept_in_a_file_of_their_own(tmp_path, make_table):
    by_cycle = {"slider_x_min": np.array([-1.0, -0.1 - 2e-17]), "slider_x_time_of_min": np.array([0.0, 0.4])}
    table = replace(make_table(), cycle_extrema=by_cycle)
    path = write(table, tmp_path / "run.csv")
    assert companions(table, path) == [tmp_path / "run.extrema.csv", tmp_path / "run.json"]
    for name, values in read(path).cycle_extrema.items():
        assert values.tobytes() == by_cycle[name].tobytes()
    write(make_table(), path)
    assert not (tmp_path / "run.extrema.csv").exists()
    assert read(path).cycle_extrema is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("slider_x_min\nlow\n", "its cycle_extrema: slider_x_min must be an array of real numbers"),
        ("slider_x_min\n1,2\n", "cannot be read"),
    ],
)
def test_extrema_by_cycle_that_are_none_are_refused_in_one_line(tmp_path, make_table, text, reason):
    path = write(make_table(), tmp_path / "run.csv")
    (tmp_path / "run.extrema.csv").write_text(text)
    with pytest.raises(TableError, match=reason):
        check(read(path), make_table().channels, None, name="run.csv")


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ([1.0], "cycle_extrema must be a dict or None, not list"),
        ({"slider_x_min": [1.0]}, "slider_x_min must be an array of real numbers"),
        ({"a": np.zeros(2), "b": np.zeros(3)}, "columns differ in length"),
    ],
)
def test_extrema_by_cycle_of_a_model_are_columns(columns, reason):
    result = SimpleNamespace(
        columns={"time": np.zeros(2)}, events={}, extrema={}, status="success", remedy="", provenance={}
    )
    Table.from_result(result)
    result.cycle_extrema = columns
    with pytest.raises(TableError, match=reason):
        Table.from_result(result)


@given(arrays(np.float64, 20, elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_any_double_survives_the_text_file(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("t") / "a.csv"
    write(Table(pd.DataFrame({"time": np.arange(20.0), "slider_x": values})), path)
    # -0.0 and 0.0 are one value.
    assert np.array_equal(read(path).values("slider_x"), values)


def test_the_table_itself_is_written_last_and_nothing_is_left_of_a_failed_attempt(
    tmp_path, make_table, monkeypatch
):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    path = write(make_table(), tmp_path / "run.csv")
    before = path.read_bytes()
    monkeypatch.setattr("comparison.tables.table_files.csv.write_csv", full)
    with pytest.raises(TableError, match=r"run\.csv: cannot be written: No space left on device"):
        write(make_table(stretch=1.0), path)
    assert path.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {"run.csv", "run.json"}


def test_json_beside_the_table_is_strict(tmp_path, make_table):
    write(
        Table(make_table().frame, None, {}, {"error": np.float64("nan"), "n": np.int64(3)}),
        tmp_path / "a.csv",
    )
    text = (tmp_path / "a.json").read_text()
    assert json.loads(text, parse_constant=lambda word: pytest.fail(word)) == {
        "error": None,
        "n": 3,
        "extrema": {},
    }


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_refused_with_channel_and_row(scene, make_table, value):
    table = make_table()
    table.frame.loc[16, "slider_vy"] = value
    with pytest.raises(TableError, match=r"run: slider_vy is -?(nan|inf) in data row 17 \(1 such rows\)"):
        check(table, expected(scene.data), name="run")


def test_missing_and_unexpected_channels_are_refused(scene, make_table):
    wanted = expected(scene.data)
    lacking = Table(make_table().frame.drop(columns=["slider_ax", "corner_ul_gap"]))
    with pytest.raises(TableError, match=r"run: channel slider_ax is missing \(and 1 more\)"):
        check(lacking, wanted, name="run")
    with pytest.raises(TableError, match="channel crank_torque is unexpected"):
        check(make_table(crank_torque=0.0), wanted)


@pytest.mark.parametrize("step", [0.0, -1e-9])
def test_time_must_increase(scene, make_table, step):
    table = make_table()
    table.frame.loc[5, "time"] = table.frame.loc[4, "time"] + step
    with pytest.raises(TableError, match="time does not increase in data row 6"):
        check(table, expected(scene.data))


def test_a_run_that_lacks_a_single_sample_at_either_end_is_truncated(scene, make_table):
    wanted, span = expected(scene.data), (0.0, scene.duration)
    check(make_table(), wanted, span)
    for part in (slice(None, -1), slice(1, None)):
        with pytest.raises(TableError, match=r"truncated: it spans .* and must span 0 to 0\.8 s"):
            check(Table(make_table().frame.iloc[part]), wanted, span)


def test_a_single_row_is_no_table(scene, make_table):
    with pytest.raises(TableError, match="1 data rows"):
        check(Table(make_table().frame.iloc[:1]), expected(scene.data))


def test_text_in_a_column_is_named(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,slider_x\n0,1\n1,oops\n2,3\n")
    with pytest.raises(TableError, match="slider_x is not a number in data row 2: 'oops'"):
        check(read(path), ["slider_x"])


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("", "cannot be read"),
        ("a,b\n1,2\n", "channel time is missing"),
        ("time,slider_x\n0,1,2\n1,2,3\n", "more values than its header"),
        ("time,slider_x\n0,1\n1,2,3\n", "cannot be read"),
    ],
)
def test_files_that_are_no_tables(tmp_path, content, rule):
    path = tmp_path / "a.csv"
    path.write_text(content)
    with pytest.raises(TableError, match=rule) as refused:
        read(path)
    assert "\n" not in str(refused.value)


def test_a_foreign_file_with_spaces_a_byte_order_mark_and_integers_is_read(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("slider_x, time\r\n1, 0\r\n2, 1\r\n", encoding="utf-8-sig")
    table = read(path)
    check(table, ["slider_x"])
    assert table.frame.columns.tolist() == ["time", "slider_x"]
    assert table.values("slider_x").dtype == np.float64


def test_unknown_endings_missing_files_and_files_for_folders_are_refused(tmp_path, make_table):
    with pytest.raises(TableError, match=r"must end in \.csv or \.parquet"):
        write(make_table(), tmp_path / "a.txt")
    with pytest.raises(TableError, match="No such file"):
        read(tmp_path / "none.csv")
    (tmp_path / "file").touch()
    with pytest.raises(FolderError, match="is not a folder"):
        check_folder(tmp_path / "file" / "deeper")
