"""What is too large, too long or no file is refused by every reader, in one line, before it is read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.execution.store import LARGEST_LEDGER as LARGEST_STORE
from comparison.execution.store import LedgerError, read_rows
from comparison.files import LARGEST_TEXT
from comparison.scene.loading import LARGEST_FILE
from comparison.studies.sweep.points import LARGEST_LIST
from comparison.tables.table_files import LARGEST

SWEEP = ["study", "sweep", "ideal", "--list", "{path}"]
COMPARE = ["compare", "{path}", "sound.csv"]


def large(path: Path, size: int) -> None:
    """A file of zeros that takes no space on the disk."""
    path.touch()
    os.truncate(path, size)


def refused(command: list[str], path: str, capsys) -> str:
    assert main([word.format(path=path) for word in command]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize(
    ("command", "name", "most"),
    [
        (["plan", "{path}"], "own.toml", LARGEST_FILE),
        (["compare", "sound.csv", "sound.csv", "--mapping", "{path}"], "map.toml", LARGEST_TEXT),
        (["gate", "--baseline", "{path}"], "baseline.toml", LARGEST_TEXT),
        (["compare", "sound.csv", "sound.csv"], "sound.json", LARGEST_TEXT),
        (["compare", "sound.csv", "sound.csv"], "sound.events.csv", LARGEST),
        *((COMPARE, name, LARGEST) for name in ("own.csv", "own.txt", "own.parquet", "own.mat")),
        *((["plot", "{path}"], name, LARGEST) for name in ("own.csv", "own.parquet")),
        (["animate", "{path}", "--scene", "ideal"], "own.csv", LARGEST),
        (SWEEP, "list.csv", LARGEST_LIST),
    ],
)  # fmt: skip
def test_a_file_that_is_too_large(command, name, most, capsys):
    large(Path(name), most + 1)
    err = refused(command, name, capsys)
    assert name in err
    assert f"is larger than {most} bytes" in err


def test_a_store_of_rows_that_is_too_large():
    large(Path("rows.jsonl"), LARGEST_STORE + 1)
    with pytest.raises(LedgerError, match=f"is larger than {LARGEST_STORE} bytes"):
        read_rows(Path("rows.jsonl"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are POSIX")
@pytest.mark.parametrize("command", [COMPARE, ["plot", "{path}"], ["plan", "{path}"], SWEEP])
@pytest.mark.parametrize("name", ["pipe.csv", "pipe.mat", "pipe.parquet"])
def test_a_pipe_that_nobody_writes_to_is_not_waited_for(command, name, capsys):
    os.mkfifo(name)
    assert name.partition(".")[0] in refused(command, name, capsys)
