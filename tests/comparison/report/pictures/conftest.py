"""Tables of the press with what records their scene."""

from dataclasses import replace

import pandas as pd
import pytest

from comparison.tables.table_files import write


@pytest.fixture
def tables(make_table, central_case):
    """Two tables of the scene, the second a thousandth larger, with events."""
    record = {"scene": central_case.data, "model": "reference"}
    events = pd.DataFrame({"corner": ["ll"], "start": [0.01], "end": [0.02]})
    first, second = make_table(), make_table(stretch=1e-3)
    return {
        "a": replace(first, provenance=record, events=events),
        "b": replace(second, provenance=record | {"model": "exudyn"}),
    }


@pytest.fixture
def files(tables, tmp_path, monkeypatch):
    """The same as files a.csv and b.csv here."""
    monkeypatch.chdir(tmp_path)
    for label, table in tables.items():
        write(table, f"{label}.csv")
    return tmp_path
