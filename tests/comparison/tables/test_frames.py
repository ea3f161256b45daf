"""Frames as files hold them: spaces around names, a separator at the end of a line, sizes once decoded."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from foreign_tables import read_pair
from pyarrow import parquet

from comparison.tables.table import TableError
from comparison.tables.table_files import read, read_frame


def lines(table) -> list[str]:
    return table.frame.to_csv(index=False).splitlines()


@pytest.mark.parametrize("ending", [".csv", ".txt"])
@pytest.mark.parametrize(
    "changed",
    [
        pytest.param(lambda rows: rows, id="commas"),
        pytest.param(lambda rows: [rows[0].replace(",", " , ") + " ", *rows[1:]], id="spaces around names"),
        pytest.param(lambda rows: [f"{row}," for row in rows], id="a comma at the end"),
        pytest.param(lambda rows: [f"{row} , " for row in rows], id="a comma and a space at the end"),
    ],
)
def test_layouts_of_a_table_that_are_meant_the_same(ending, changed, make_table, tmp_path):
    path = tmp_path / f"own{ending}"
    path.write_text("\n".join(changed(lines(make_table()))) + "\n")
    one, other, _ = read_pair(path, path)
    for table in (one, other):
        pd.testing.assert_frame_equal(table.frame, make_table().frame, check_exact=True, check_dtype=False)


def test_names_that_are_one_without_their_spaces_are_refused(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("time,slider_x,slider_x \n0,1,2\n1,2,3\n")
    with pytest.raises(TableError, match="column 'slider_x' occurs twice"):
        read(path)


def test_a_column_without_a_name_that_holds_numbers_is_kept(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("time,slider_x,\n0,1,2\n1,2,3\n")
    assert read(path).channels == ["slider_x", "Unnamed: 2"]


def test_a_small_parquet_file_of_too_many_numbers_is_refused_before_they_are_decoded(tmp_path, monkeypatch):
    """The file is a hundredth of what it holds: its numbers are all the same."""
    path = tmp_path / "own.parquet"
    pd.DataFrame({"time": np.zeros(100_000)}).to_parquet(path)
    assert path.stat().st_size < 8000
    monkeypatch.setattr("comparison.tables.table_files.LARGEST", 800_000)
    assert len(read(path).frame) == 100_000
    monkeypatch.setattr("comparison.tables.table_files.LARGEST", 799_999)
    monkeypatch.setattr("pandas.read_parquet", lambda *_, **__: pytest.fail("decoded"))
    with pytest.raises(TableError, match="holds more than 799999 bytes of numbers"):
        read(path)


def test_a_text_that_is_repeated_takes_no_memory_but_once(tmp_path):
    path = tmp_path / "own.parquet"
    note = pa.DictionaryArray.from_arrays(np.zeros(100_000, np.int32), ["a" * 100_000])  # 10 GB, repeated
    parquet.write_table(pa.table({"time": np.arange(1e5), "note": note}), path, store_schema=False)
    frame = read_frame(path, parquet=True)
    assert len(frame) == 100_000
    assert frame.memory_usage(deep=True).sum() < 10_000_000


def test_damaged_metadata_of_parquet_is_one_line(tmp_path):
    """What pandas notes about its index, and trusts."""
    path = tmp_path / "own.parquet"
    for note in ("{}", '{"index_columns": 5, "columns": 3, "column_indexes": []}', "[", '{"columns": [{}]}'):
        table = pa.table({"time": [0.0, 1.0]}).replace_schema_metadata({"pandas": note})
        parquet.write_table(table, path)
        with pytest.raises(TableError, match="cannot be read: is no readable Parquet file") as refused:
            read(path)
        assert "\n" not in str(refused.value)


def test_two_columns_of_one_name_are_refused_in_parquet_too(tmp_path):
    path = tmp_path / "own.parquet"
    column = pa.array([0.0, 1.0])
    parquet.write_table(pa.Table.from_arrays([column, column], names=["time", "time"]), path)
    with pytest.raises(TableError, match="cannot be read"):
        read(path)
