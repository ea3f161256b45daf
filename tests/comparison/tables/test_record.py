"""The record beside a table: that of a run, or of another program that happens to have its name."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from comparison.cli import main
from comparison.tables.result import check_record
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import read, write


@pytest.mark.parametrize(
    "record",
    [
        {},
        {"name": "package", "version": "1.0.0", "scene": "a picture", "model": {"a": [1]}},
        {"extrema": {"slider_x": {"min": 0, "max": None}}, "wall_time_s": None, "settings": {"a": [1]}},
        {"settings": None, "extrema": None},
    ],
)
def test_what_is_not_read_may_be_anything(record, make_table, tmp_path, capsys):
    path = write(make_table(), tmp_path / "own.csv")
    path.with_suffix(".json").write_text(json.dumps(record))
    assert read(path).frame.equals(make_table().frame)
    assert main(["compare", str(path), str(path), "--out", str(tmp_path / "out")]) == 3
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("[1]", "must contain one JSON object"),
        ('{"settings": 5}', "settings must be an object"),
        ('{"counters": "many"}', "counters must be an object"),
        ('{"versions": ["a"]}', "versions must be an object"),
        ('{"constraints": 1}', "constraints must be an object"),
        ('{"extrema": [1]}', "extrema must be an object"),
        ('{"extrema": {"slider_x": 1}}', "extrema of slider_x must be an object of numbers"),
        ('{"extrema": {"slider_x": {"min": true}}}', "extrema of slider_x must be an object of numbers"),
        ('{"wall_time_s": "long"}', "wall_time_s must be a number"),
        ('{"scene": {"solver": 5}}', "scene.solver must be an object"),
        ('{"a": ' + "[" * 60 + "]" * 60 + "}", "is nested too deeply"),
        ("[" * 100_000, "is nested too deeply"),
        (f'{{"a": {"9" * 5000}}}', "cannot be read"),
    ],
)
def test_entries_that_are_read_must_have_their_type(text, reported, make_table, tmp_path, capsys):
    path = write(make_table(), tmp_path / "own.csv")
    path.with_suffix(".json").write_text(text)
    assert main(["compare", str(path), str(path), "--out", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert str(path.with_suffix(".json")) in err
    assert reported in err
    assert err.count("\n") == 1


def test_so_must_those_of_an_engine():
    """Else its runs would be fine, and their report end in an error."""
    result = SimpleNamespace(
        columns={"time": np.zeros(2)}, events={}, extrema={}, status="success", remedy="", provenance={}
    )
    Table.from_result(result)
    result.provenance = {"counters": 5}
    with pytest.raises(TableError, match="provenance: counters must be an object"):
        Table.from_result(result)


def test_a_mapping_of_the_model_is_one_as_well():
    check_record({"extrema": {"slider_x": {"min": np.float64(1.0)}}})
