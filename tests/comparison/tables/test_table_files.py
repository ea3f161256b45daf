"""Tables come back bit for bit; what is no table, or no companion of one, is one line."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import companions, read, write

PARTS = {
    "events": pd.DataFrame({"corner": ["ll", "ur"], "start": [0.0, 0.1], "end": [0.01, 0.2]}),
    "extrema": {"slider_x": {"min": -1.0, "time_of_min": 0.1, "max": 1.0, "time_of_max": 0.2}},
    "provenance": {"model": "reference", "status": "success"},
    "pulses": {"row": np.array([0, 1]), "time": np.array([0.005, 0.1]), "force": np.array([1.0, 2.0])},
    "cycle_extrema": {"slider_x_min": np.array([-1.0, -0.1 - 2e-17])},
}


@pytest.mark.parametrize("ending", ["csv", "parquet", "CSV"])
def test_what_is_written_is_read_bit_for_bit(tmp_path, make_table, ending):
    table = replace(make_table(), **PARTS)
    path = write(table, tmp_path / "deep" / f"run.{ending}")
    beside = {f"run.{end}" for end in ("events.csv", "pulses.csv", "extrema.csv", "json")}
    assert {file.name for file in companions(table, path)} == beside
    assert {file.name for file in path.parent.iterdir()} == beside | {path.name}
    again = read(path)
    assert list(again.frame) == list(table.frame)
    assert again.frame.to_numpy().tobytes() == table.frame.to_numpy().tobytes()
    pd.testing.assert_frame_equal(again.events, table.events, check_exact=True)
    assert (again.extrema, again.provenance) == (table.extrema, table.provenance)
    for one, other in ((again.pulses, table.pulses), (again.cycle_extrema, table.cycle_extrema)):
        assert list(one) == list(other)
        for name in other:
            assert (one[name].dtype, one[name].tobytes()) == (other[name].dtype, other[name].tobytes())
    bare = read(write(make_table(), path))  # what an earlier table has beside it goes
    assert {file.name for file in path.parent.iterdir()} == {path.name, "run.json"}
    assert (bare.events, bare.pulses, bare.cycle_extrema) == (None, None, None)


@settings(max_examples=30)
@given(arrays(np.float64, 20, elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_any_double_survives_the_text_file(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("t") / "a.csv"
    write(Table(pd.DataFrame({"time": np.arange(20.0), 'a "quoted", name': values})), path)
    assert np.array_equal(read(path).values('a "quoted", name'), values)  # -0.0 and 0.0 are one value


@pytest.mark.parametrize(
    ("name", "text", "rule"),
    [
        ("csv", "time,slider_x\n0,1,2\n1,2,3\n", "more values than its header"),
        ("csv", "time,slider_x\n0,1\n1,2,3\n", "cannot be read"),
        ("csv", "time,slider_x,slider_x\n0,1,2\n1,2,3\n", "channel slider_x.1 is unexpected"),
        ("extrema.csv", "slider_x_min\nlow\n", "its cycle_extrema: slider_x_min must be an array of real"),
        ("pulses.csv", "row,time\n0,1.0\n", "its pulses: force must be an array of real numbers"),
        ("json", '{"extrema": {"slider_x": 1}}', "extrema of slider_x must be an object of numbers"),
        ("json", '{"wall_time_s": "long"}', "wall_time_s must be a number"),
        ("json", '{"scene": {"solver": 5}}', r"scene\.solver must be an object"),
    ],
)
def test_files_that_are_no_tables_and_companions_that_are_none_are_one_line(
    tmp_path, make_table, name, text, rule
):
    path = write(make_table().only(["slider_x"]), tmp_path / "run.csv")
    (tmp_path / "run.events.csv").write_text("corner,start,end\n")  # without it no pulses are read
    (tmp_path / f"run.{name}").write_text(text)
    with pytest.raises(TableError, match=rule) as refused:
        check(read(path), ["slider_x"], name="run")
    assert "\n" not in str(refused.value)
