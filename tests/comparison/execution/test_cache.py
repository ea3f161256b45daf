"""The cache of runs: what is damaged is not used, what cannot be written is not needed."""

from __future__ import annotations

import logging
import os
import random
import stat
import tempfile
from pathlib import Path

import numpy as np
import pytest

from comparison.execution.cache import cache_folder, cache_warnings, fetch, keep
from comparison.execution.job import Job
from comparison.execution.run import run_all
from comparison.files import FolderError

KEY = "0" * 64


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of its own, with a temporary folder of its own."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def stored(cache, make_table, scene):
    """A run in the cache: its files, and what fetches it."""
    table = make_table()
    events = (
        make_table()
        .frame.head(2)[["time"]]
        .assign(
            corner="ll",
            start=0.1,
            end=0.2,
            normal_speed=0.1,
            impulse=0.02,
            peak_force=40.0,
            largest_depth=1e-6,
        )
    )
    pulses = {"row": np.array([0, 0]), "time": np.array([0.11, 0.19]), "force": np.array([40.0, 0.1])}
    record = {"model": "reference", "steps": 5}
    keep(KEY, type(table)(table.frame, events.drop(columns="time"), {}, record, pulses=pulses))
    files = sorted((cache / "runs" / KEY).iterdir())
    return files, lambda: fetch(KEY, table.channels, (0.0, scene.duration))


def test_a_run_is_found_as_it_was_stored(stored, make_table):
    files, found = stored
    names = ["run.csv", "run.events.csv", "run.json", "run.pulses.csv", "sha256.json"]
    assert [path.name for path in files] == names
    assert found().frame.equals(make_table().frame)
    assert len(found().events) == 2
    assert found().pulses["time"].tolist() == [0.11, 0.19]
    assert found().provenance == {"model": "reference", "steps": 5}


def damage(files: list[Path], how: random.Random) -> str:
    """Damage one of the files in one way; return which and how."""
    path = how.choice(files)
    content = path.read_bytes()
    at = how.randrange(len(content))
    kind = how.choice(["digit", "bit", "cut", "removed", "zeroed", "emptied", "line"])
    if kind == "removed":
        path.unlink()
        return f"{path.name} {kind}"
    lines = content.splitlines(keepends=True)
    digits = [place for place, byte in enumerate(content) if chr(byte).isdigit()]
    if kind == "digit":
        at = how.choice(digits)
    damaged = {
        "digit": content[:at] + bytes([48 + (content[at] - 47) % 10]) + content[at + 1 :],
        "bit": content[:at] + bytes([content[at] ^ (1 << how.randrange(8))]) + content[at + 1 :],
        "cut": content[:at],
        "zeroed": bytes(len(content)),
        "emptied": b"",
        "line": b"".join(lines[: (row := how.randrange(len(lines)))] + lines[row + 1 :]),
    }[kind]
    path.write_bytes(damaged)
    return f"{path.name} {kind} at {at}"


def test_no_damaged_run_is_used_and_each_is_reported(stored, caplog):
    """Of 240 damages 77 were used before runs had checksums."""
    files, found = stored
    sound = {path: path.read_bytes() for path in files}
    how, done = random.Random(22), 0
    for _ in range(240):
        files[0].parent.mkdir(exist_ok=True)
        for path, content in sound.items():
            path.write_bytes(content)
        caplog.clear()
        what = damage(files, how)
        if all(path.exists() and path.read_bytes().rstrip() == old.rstrip() for path, old in sound.items()):
            continue  # the last line of the sums without its end
        done += 1
        assert found() is None, what
        assert [record.levelno for record in caplog.records] == [logging.WARNING], what
        assert "is damaged and is run again" in caplog.text
        assert found() is None
        assert len(caplog.records) == 1  # deleted
    assert done > 230


@pytest.mark.usefixtures("fake_models")
def test_a_damaged_run_is_made_again(scene):
    (first,) = run_all([Job(scene, "reference")], 1)
    (path,) = cache_folder().glob("runs/*/run.csv")
    path.write_text(path.read_text().replace("1", "2", 1))
    (second,) = run_all([Job(scene, "reference")], 1)
    assert second.table.frame.equals(first.table.frame)
    (third,) = run_all([Job(scene, "reference")], 1)
    assert third.table.provenance == second.table.provenance


def test_folders_are_this_users_alone(stored, cache):
    assert stored
    for folder in (cache, cache / "runs", cache / "runs" / KEY):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_a_cache_that_cannot_be_written_is_replaced_by_a_temporary_one(cache, make_table, monkeypatch):
    assert cache_warnings() == []
    (cache.parent / "file").touch()
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(cache.parent / "file"))
    table = make_table()
    keep(KEY, table)
    assert fetch(KEY, table.channels, (0.0, table.time[-1])).frame.equals(table.frame)
    (temporary,) = (cache.parent / "tmp").iterdir()
    assert stat.S_IMODE(temporary.stat().st_mode) == 0o700
    (warning,) = cache_warnings()
    assert warning.startswith(f"{cache.parent / 'file'} cannot be written: the cache is in {temporary}; ")
    temporary.chmod(0o755)  # another user may have written to it before
    assert fetch(KEY, table.channels, (0.0, table.time[-1])) is None
    keep(KEY, table)
    with pytest.raises(FolderError, match="no cache folder can be written"):
        cache_folder()
    (warning,) = cache_warnings()
    assert warning.startswith("no cache folder can be written: nothing is cached")


def test_a_temporary_cache_is_not_searched_where_the_usual_one_is_written(cache, make_table, monkeypatch):
    (cache.parent / "file").touch()
    table = make_table()
    with monkeypatch.context() as elsewhere:
        elsewhere.setenv("SIXBAR_CACHE_DIR", str(cache.parent / "file"))
        keep(KEY, table)
    assert fetch(KEY, table.channels, (0.0, table.time[-1])) is None


def test_an_empty_variable_is_not_set(cache, monkeypatch):
    home = cache.parent / "home"
    home.mkdir()
    for name in ("SIXBAR_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, "")
    monkeypatch.setenv("HOME", str(home))
    assert home in cache_folder().parents


def test_what_nobody_asked_for_in_a_month_is_dropped(cache, make_table):
    old, rows = cache / "runs" / "old", cache / "old.jsonl"
    old.mkdir(parents=True)
    for path in (old / "run.csv", rows):
        path.touch()
    for path in (old, rows):
        os.utime(path, (0, 0))
    keep(KEY, make_table())
    assert not old.exists()
    assert not rows.exists()
    assert (cache / "runs" / KEY).is_dir()
