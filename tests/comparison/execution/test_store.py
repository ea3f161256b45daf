"""The store of runs and rows: what is damaged is not used, what cannot be written is not needed."""

import json
import logging
import multiprocessing
import os
import random
import stat
import tempfile

import numpy as np
import pandas as pd
import pytest

from comparison.execution.store import append_row, cache_folder, cache_warnings, fetch, keep, read_rows
from comparison.files import FolderError
from comparison.tables.table import Table

KEY = "0" * 64
ROWS = {f"{number:064x}": {"status": "success", "x": 0.1 * number, "n": number} for number in range(20)}
CONTACT = {"corner": "ll", "start": 0.1, "end": 0.2, "normal_speed": 0.1, "impulse": 0.02}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of its own, with a temporary folder of its own."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def fetched(make_table):
    table = make_table()
    return lambda: fetch(KEY, table.channels, (0.0, table.time[-1]))


@pytest.fixture
def files(cache, make_table):
    """The files of a stored run."""
    events = pd.DataFrame([CONTACT | {"peak_force": 40.0, "largest_depth": 1e-6}] * 2)
    pulses = {"row": np.array([0, 0]), "time": np.array([0.11, 0.19]), "force": np.array([40.0, 0.1])}
    keep(KEY, Table(make_table().frame, events, {}, {"model": "reference", "steps": 5}, pulses=pulses))
    return sorted((cache / "runs" / KEY).iterdir())


@pytest.fixture
def ledger(tmp_path):
    """A file of all `ROWS`."""
    path = tmp_path / "rows.jsonl"
    for key, row in ROWS.items():
        append_row(path, key, row)
    return path


def damaged(content, how):
    """Return a content with a digit or a bit changed, cut off, zeroed in part, without a line, or empty."""
    at = how.randrange(len(content))
    digit = how.choice([place for place, byte in enumerate(content) if chr(byte).isdigit()])
    length = how.randrange(1, 300)
    lines = content.splitlines(keepends=True)
    row = how.randrange(len(lines))
    return how.choice(
        [
            content[:digit] + bytes([48 + (content[digit] - 47) % 10]) + content[digit + 1 :],
            content[:at] + bytes([content[at] ^ (1 << how.randrange(8))]) + content[at + 1 :],
            content[:at],
            content[:at] + bytes(len(content[at : at + length])) + content[at + length :],
            b"".join(lines[:row] + lines[row + 1 :]),
            b"",
        ]
    )


def test_a_run_is_found_as_it_was_stored_and_is_this_users_alone(files, fetched, make_table, cache):
    names = ["run.events.csv", "run.json", "run.parquet", "run.pulses.csv", "sha256.json"]
    assert [path.name for path in files] == names
    before = [path.stat().st_mtime_ns for path in files]
    keep(KEY, make_table(error=1e-3))  # the second to store it finds it stored
    assert [path.stat().st_mtime_ns for path in files] == before
    assert [path.name for path in (cache / "runs").iterdir()] == [KEY]
    table = fetched()
    assert table.frame.equals(make_table().frame)
    assert (len(table.events), table.pulses["time"].tolist()) == (2, [0.11, 0.19])
    assert table.provenance == {"model": "reference", "steps": 5}
    for folder in (cache, cache / "runs", cache / "runs" / KEY):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_no_damaged_run_is_used_and_each_is_reported(files, fetched, caplog):
    """Of 240 damages 77 were used before runs had checksums."""
    sound = {path: path.read_bytes() for path in files}
    how, done = random.Random(22), 0
    for number in range(120):
        files[0].parent.mkdir(exist_ok=True)
        for path, content in sound.items():
            path.write_bytes(content)
        caplog.clear()
        path = how.choice(files)
        path.write_bytes(damaged(sound[path], how))
        if number % 10 == 0:
            path.unlink()
        elif path.read_bytes().rstrip() == sound[path].rstrip():
            continue  # the last line of the sums without its end
        done += 1
        assert (fetched(), fetched()) == (None, None), (number, path)
        assert "is damaged and is run again" in caplog.text
        assert [record.levelno for record in caplog.records] == [logging.WARNING]  # once: it is deleted
    assert done > 100


def test_a_cache_that_cannot_be_written_is_replaced_by_a_temporary_one(
    cache, make_table, fetched, monkeypatch
):
    assert cache_warnings() == []
    file = cache.parent / "file"
    file.touch()
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(file))
    keep(KEY, make_table())
    assert fetched().frame.equals(make_table().frame)
    (temporary,) = (cache.parent / "tmp").iterdir()
    assert stat.S_IMODE(temporary.stat().st_mode) == 0o700
    (warning,) = cache_warnings()
    assert warning.startswith(f"{file} cannot be written: the cache is in {temporary}; ")
    with monkeypatch.context() as usual:  # which is not searched where the usual one is written
        usual.setenv("SIXBAR_CACHE_DIR", str(cache))
        assert fetched() is None
        home = {"SIXBAR_CACHE_DIR": "", "XDG_CACHE_HOME": "", "HOME": str(cache.parent / "home")}
        for name, value in home.items():  # what is empty is not set
            usual.setenv(name, value)
        assert cache.parent / "home" in cache_folder().parents
    temporary.chmod(0o755)  # another user may have written to it before
    assert fetched() is None
    keep(KEY, make_table())
    with pytest.raises(FolderError, match="no cache folder can be written"):
        cache_folder()
    (warning,) = cache_warnings()
    assert warning.startswith("no cache folder can be written: nothing is cached")


def test_a_cache_that_can_only_be_read_is_used(files, fetched, make_table, monkeypatch):
    """Of which root takes no notice: so every change is refused here."""
    before = {path: path.stat().st_mtime_ns for path in files}

    def refuse(*_arguments, **_options):
        raise PermissionError(13, "read-only")

    for name in ("tempfile.TemporaryFile", "tempfile.mkdtemp", "os.utime", "pathlib.Path.mkdir"):
        monkeypatch.setattr(name, refuse)
    assert fetched().frame.equals(make_table().frame)
    keep("1" * 64, make_table())
    assert {path: path.stat().st_mtime_ns for path in files} == before


def test_what_nobody_used_in_a_month_is_dropped_and_nothing_else(cache, make_table):
    names = ("runs/old/run.csv", "runs/new/run.csv", "exudyn_model-0/x.nbi", "old.jsonl", "new.jsonl")
    files = [cache / name for name in names]
    for path in files:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    for path in (files[0].parent, files[2].parent, *files[3:]):
        os.utime(path, (0, 0))
    read_rows(files[4])  # is a use
    keep(KEY, make_table())
    assert [path.exists() for path in files] == [False, True, True, False, True]
    assert (cache / "runs" / KEY).is_dir()


def test_no_damaged_row_is_used_and_sound_ones_are(ledger):
    content = ledger.read_bytes()
    assert read_rows(ledger) == ROWS
    how = random.Random(22)
    for _ in range(300):
        ledger.write_bytes(damaged(content, how))
        rows = read_rows(ledger)
        assert rows.items() <= ROWS.items()
        if len(ledger.read_bytes()) == len(content):  # a digit, a bit, or zeros over at most three lines
            assert len(rows) >= len(ROWS) - 4
    # Nor is one without checksum or of another type.
    lines = [{"key": "a", "row": {"x": 1}}, {"key": "a", "row": [1]}, {"key": ["a"], "row": {}}, [1], 1, None]
    ledger.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert read_rows(ledger) == {}


def test_a_damaged_row_is_reported_once_and_one_cut_off_by_a_kill_is_not(ledger, caplog):
    content = ledger.read_bytes()
    ledger.write_bytes(content + b'{"key":"b","row":{"x"')
    assert read_rows(ledger) == ROWS
    assert append_row(ledger, "c", {"x": np.float64(0.1), "y": np.nan}) == {"x": 0.1, "y": None}
    assert read_rows(ledger) == ROWS | {"c": {"x": 0.1, "y": None}}  # on a line of its own
    assert caplog.records == []
    ledger.write_bytes(content.replace(b'"n":1}', b'"n":2}', 1).replace(b'"n":3}', b'"n":"a"}', 1))
    assert len(read_rows(ledger)) == len(ROWS) - 2
    (record,) = caplog.records
    assert (record.levelno, "2 lines are damaged" in record.getMessage()) == (logging.WARNING, True)


def append_many(path, writer, together):
    together.wait()
    for number in range(500):
        append_row(path, f"{writer} {number}", {"text": str(writer) * (1 + number)})


def test_two_processes_may_write_at_once(tmp_path):
    path = tmp_path / "rows.jsonl"
    context = multiprocessing.get_context("spawn")
    together = context.Barrier(2)
    writers = [context.Process(target=append_many, args=(path, number, together)) for number in (1, 2)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert {key: row["text"] for key, row in read_rows(path).items()} == {
        f"{writer} {number}": str(writer) * (1 + number) for writer in (1, 2) for number in range(500)
    }
