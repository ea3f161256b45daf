"""The store of runs: damaged results are not used, unused ones go; files are whole or as before."""

import errno
import json
import logging
import os
import random
import stat
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from comparison.execution.store import drop_unused, fetch, fetch_row, keep, keep_file, keep_row
from comparison.files import replacing, replacing_in
from comparison.tables.table import Table

KEY = "0" * 64
ROW = {"status": "success", "x": 0.1, "n": 3}

pytestmark = pytest.mark.usefixtures("empty_cache")


@pytest.fixture
def cache(tmp_path):
    return tmp_path / "cache"


@pytest.fixture
def run_path(cache, make_table):
    events = pd.DataFrame({"corner": ["ll", "ur"], "start": [0.1, 0.2]})
    pulses = {"row": np.array([0, 0]), "time": np.array([0.11, 0.19]), "force": np.array([40.0, 0.1])}
    frame, cycles = make_table().frame, {"slider_x_min": np.array([-0.55, -0.5501])}
    keep(KEY, Table(frame, events, {}, {"steps": 5}, {}, pulses, cycles, frame[["time", "slider_y"]]))
    return cache / "runs" / KEY


def test_a_run_is_found_as_it_was_stored_and_is_this_users_alone(run_path, make_table, cache):
    assert list((cache / "runs").iterdir()) == [run_path]
    table = fetch(KEY)
    assert table.frame.equals(make_table().frame)
    assert table.dense.equals(table.frame[["time", "slider_y"]])
    assert (len(table.events), table.pulses["time"].tolist()) == (2, [0.11, 0.19])
    assert table.cycle_extrema["slider_x_min"].tolist() == [-0.55, -0.5501]
    assert table.provenance == {"steps": 5}
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700
    row = {"x": 0.1, "y": None}  # as it will be read
    assert keep_row(cache, "c", {"x": np.float64(0.1), "y": np.nan}) == row == fetch_row(cache, "c")


def damage(content, rng):
    at = rng.randrange(len(content))
    byte = bytes([content[at] ^ (1 << rng.randrange(8))])
    return content[:at] + rng.choice([byte + content[at + 1 :], b""])


def test_no_damaged_result_is_used_and_each_is_reported(run_path, cache, caplog):
    keep_row(cache, "row", ROW)
    rng = random.Random(22)
    for path, get in ((run_path, lambda: fetch(KEY)), (cache / "row", lambda: fetch_row(cache, "row"))):
        content = path.read_bytes()
        assert get() is not None
        for _ in range(20):
            path.write_bytes(damage(content, rng))
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


def test_an_error_of_writing_names_the_file(tmp_path):
    """The system's own error on a full disk names none."""
    with pytest.raises(OSError, match="No space") as error, replacing(tmp_path / "a.csv"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert error.value.filename == str(tmp_path / "a.csv")


@pytest.mark.usefixtures("empty_folder")
@pytest.mark.parametrize("obstacle", ["b", "sub/c"])
def test_files_of_one_folder_are_replaced_together_or_not_at_all(obstacle):
    """The last file cannot move, over a folder with content or below a file; the others have moved."""
    folder = Path("folder")
    folder.mkdir()
    (folder / "a").write_text("old")
    (folder / "b" / "c").mkdir(parents=True)
    (folder / "sub").write_text("old")
    before = {path: path.read_text() for path in folder.rglob("*") if path.is_file()}

    def write(*names):
        with replacing_in(folder) as part:
            for name in names:
                (part / name).parent.mkdir(exist_ok=True)
                (part / name).write_text("new")

    with pytest.raises(OSError, match="folder") as refusal:
        write("0", "a", obstacle)
    assert str(refusal.value.filename).startswith("folder/")
    assert {path: path.read_text() for path in folder.rglob("*") if path.is_file()} == before
    write("a", "other/c")
    assert (folder / "a").read_text() == (folder / "other" / "c").read_text() == "new"
    assert not list(folder.glob(".*"))
