"""Scenes of a made-up press, their page, and tables of the press with what records their scene."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from bouncing_press import make_scene
from half_sines import half_sines

from comparison.report.pictures.notebook import RunTable
from comparison.tables.table_files import write


@pytest.fixture(scope="session")
def scene():
    """Two crank cycles on which both models agree."""
    return make_scene()


@pytest.fixture(scope="session")
def differing():
    """The same with the second model's normal forces 3 % too large."""
    return make_scene(
        "stiff", alter=lambda columns: {k: 1.03 * v if "normal" in k else v for k, v in columns.items()}
    )


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


@pytest.fixture(scope="session")
def struck(scene):
    """The runs of the press as tables with their contacts, and of these the forces in time."""
    tables, times = {}, {"time": scene.time}
    for side, (label, events) in enumerate(zip("ab", scene.events, strict=True)):
        pulses = half_sines(scene)[side]
        columns = {
            "row": np.repeat(np.arange(len(pulses)), [pulse.time.size for pulse in pulses]),
            "time": np.concatenate([events["start"][pulse.row] + pulse.time for pulse in pulses]),
            "force": np.concatenate([pulse.force for pulse in pulses]),
        }
        values = {name: (channel.a, channel.b)[side] for name, channel in scene.channels.items()}
        record = {"scene": scene.scene, "model": label}
        tables[label] = RunTable(
            pd.DataFrame(times | values), events, provenance=record, pulses=columns, extrema={}
        )
    return tables


@pytest.fixture
def files(tables, tmp_path, monkeypatch):
    """The same as files a.csv and b.csv here."""
    monkeypatch.chdir(tmp_path)
    for label, table in tables.items():
        write(table, f"{label}.csv")
    return tmp_path
