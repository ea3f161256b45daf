"""The store of runs and rows: what is damaged is not used, what nobody uses is dropped."""

import json
import logging
import os
import random
import stat

import numpy as np
import pandas as pd
import pytest

from comparison.execution.store import drop_unused, fetch, fetch_row, keep, keep_file, keep_row
from comparison.tables.table import Table

KEY = "0" * 64
ROW = {"status": "success", "x": 0.1, "n": 3}

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.fixture
def cache(tmp_path):
    return tmp_path / "cache"


@pytest.fixture
def stored(cache, make_table):
    events = pd.DataFrame({"corner": ["ll", "ur"], "start": [0.1, 0.2]})
    pulses = {"row": np.array([0, 0]), "time": np.array([0.11, 0.19]), "force": np.array([40.0, 0.1])}
    frame, cycles = make_table().frame, {"slider_x_min": np.array([-0.55, -0.5501])}
    keep(KEY, Table(frame, events, {}, {"steps": 5}, {}, pulses, cycles, frame[["time", "slider_y"]]))
    return cache / "runs" / KEY


def test_a_run_is_found_as_it_was_stored_and_is_this_users_alone(stored, make_table, cache):
    assert list((cache / "runs").iterdir()) == [stored]
    table = fetch(KEY)
    assert table.frame.equals(make_table().frame)
    assert table.dense.equals(table.frame[["time", "slider_y"]])
    assert (len(table.events), table.pulses["time"].tolist()) == (2, [0.11, 0.19])
    assert table.cycle_extrema["slider_x_min"].tolist() == [-0.55, -0.5501]
    assert table.provenance == {"steps": 5}
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    row = {"x": 0.1, "y": None}  # as it will be read
    assert keep_row(cache, "c", {"x": np.float64(0.1), "y": np.nan}) == row == fetch_row(cache, "c")


def damaged(content, how):
    """Return a content with a bit changed, or cut off."""
    at = how.randrange(len(content))
    changed = bytes([content[at] ^ (1 << how.randrange(8))])
    return content[:at] + how.choice([changed + content[at + 1 :], b""])


def test_no_damaged_result_is_used_and_each_is_reported(stored, cache, caplog):
    keep_row(cache, "row", ROW)
    how = random.Random(22)
    for path, get in ((stored, lambda: fetch(KEY)), (cache / "row", lambda: fetch_row(cache, "row"))):
        sound = path.read_bytes()
        assert get() is not None
        for _ in range(20):
            path.write_bytes(damaged(sound, how))
            caplog.clear()
            assert (get(), get()) == (None, None)
            assert [record.levelno for record in caplog.records] == [logging.WARNING]  # once: it is deleted


@pytest.mark.parametrize("name", ["os:system", "comparison.files:os", "comparison.execution.pool:_Worker"])
def test_a_stored_result_calls_nothing_but_records_of_this_package(name):
    head = json.dumps({name: {"dict": [["command", "touch called"]]}}).encode()
    keep_file(KEY, len(head).to_bytes(8) + head)
    with pytest.raises(TypeError, match="cannot be stored"):
        fetch(KEY)


def test_what_nobody_used_in_a_month_is_dropped_and_nothing_else(cache, make_table):
    names = ("rows-study/old", "rows-study/new", "exudyn_model-0/x.nbi", "old.jsonl", "runs/folder/run.csv")
    files = [cache / name for name in names]
    for path in files:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    keep(KEY, make_table())
    keep_row(files[1].parent, "new", ROW)
    for path in (*files, files[4].parent, cache / "runs" / KEY):
        os.utime(path, (0, 0))
    assert fetch(KEY) is not None  # is a use
    assert fetch_row(files[1].parent, "new") == ROW
    drop_unused()
    assert [path.exists() for path in files] == [False, True, True, False, False]
    assert fetch(KEY) is not None
