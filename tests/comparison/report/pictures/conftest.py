"""Tables of the press with what records their scene."""

from dataclasses import replace

import pandas as pd
import pytest

from comparison.scene import Scene, load_scene
from comparison.tables.table import write


@pytest.fixture
def scene() -> Scene:
    """The paper's central case with fewer samples; the report's own tests have another `scene`."""
    return load_scene("150rpm-0.2mm", {"output.samples_per_cycle": 200})


@pytest.fixture
def tables(make_table, scene):
    """Two tables of the scene, the second a thousandth larger, with events."""
    record = {"scene": scene.data, "model": "reference"}
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
