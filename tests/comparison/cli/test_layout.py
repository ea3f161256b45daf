"""What is printed fits the terminal: every command at several widths, and in a pipe."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from comparison.cli import console, main
from comparison.tables.table_files import write

WIDTHS = (60, 80, 120, None)
"""Columns; None: a pipe."""


@pytest.fixture(params=WIDTHS)
def columns(request, monkeypatch) -> int:
    if request.param is None:
        monkeypatch.delenv("COLUMNS", raising=False)
        return 80
    monkeypatch.setenv("COLUMNS", str(request.param))
    return request.param


def too_long(text: str, columns: int) -> list[str]:
    """Lines that do not fit, but for those that are a path, which must not be broken."""
    return [line for line in text.splitlines() if len(line) > columns and not Path(line).exists()]


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["-h"],
        ["scenes"],
        ["channels"],
        ["plan", "both-clearances"],
        ["study"],
        *([command, "-h"] for command in ("run", "validate", "compare", "gate", "plot", "animate")),
        ["study", "sweep", "-h"],
    ],
    ids=" ".join,
)
def test_commands_that_run_nothing(arguments, columns, capsys):
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert too_long(out, columns) == []
    assert "\x1b" not in out
    assert len(out.splitlines()) > 8
    assert err == ""


@pytest.fixture(scope="module")
def shared(tmp_path_factory) -> Path:
    """A folder for what runs once for all widths."""
    return tmp_path_factory.mktemp("shared")


@pytest.fixture
def runs_of_all_widths(shared, fakes, monkeypatch):
    """Fake models whose runs are kept from one width to the next."""
    with fakes(shared, monkeypatch):
        yield


@pytest.mark.usefixtures("runs_of_all_widths")
def test_validate_and_the_sweep(columns, scene_file, gravity, capsys):
    good, bad = scene_file("a-scene"), scene_file("bad", gravity.fail)
    assert main(["validate", good, bad, "--out", "v", "--set", "drive.cycles=1", "-v"]) == 2
    out, err = capsys.readouterr()
    # The table of verdicts leaves out no column, sentences are wrapped.
    assert all(line.startswith(("scene", "a-scene", "bad")) for line in too_long(out, columns))
    assert all(line.startswith("sixbar: 2 scenes: ") for line in err.splitlines())  # progress
    # Every column is shown at any width; the note is cut.
    assert re.search(r"\nbad\+drive\.cycles=1 +standard  cannot compare", out)
    assert (
        main(["study", "sweep", good, "--grid", "drive.speed_rpm=" + ",".join(map(str, range(90, 97)))]) == 0
    )
    out = capsys.readouterr().out
    # No column is left out, however many a sweep has.
    assert out.startswith("point  drive.speed_rpm  model")
    assert "  impulse  largest:p" in out.splitlines()[0]
    assert out.splitlines()[-2] == "... and 2 more rows"


@pytest.mark.usefixtures("columns")
def test_compare(make_table, capsys):
    write(make_table(), Path("a.csv"))
    write(make_table(stretch=1e-3), Path("b.csv"))
    assert main(["compare", "a.csv", "b.csv", "--tolerance", "1e-5"]) == 1
    out = capsys.readouterr().out
    heading, *_ = out.splitlines()
    assert heading.split() == [
        *("channel", "verdict", "max", "unit", "max/scale", "coverage", "outside", "rms", "rms/scale"),
    ]


def test_no_column_is_left_out_and_only_the_last_text_is_cut(monkeypatch):
    rows = [("name", "value", "note"), ("first", "12345678", "a long explanation"), ("b", "1", "")]
    monkeypatch.setenv("COLUMNS", "40")
    assert console.columns(rows, right=(1,)) == [
        "name      value  note",
        "first  12345678  a long explanation",
        "b             1",
    ]
    monkeypatch.setenv("COLUMNS", "30")
    assert console.columns(rows, right=(1,))[1] == "first  12345678  a long exp..."
    monkeypatch.setenv("COLUMNS", "12")
    assert console.columns(rows, right=(1,))[1] == "first  12345678  a long ex..."


def test_verdicts_have_colours_unless_they_are_not_wanted(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert console.coloured("differ  ", "differ  ") == "\x1b[31mdiffer  \x1b[0m"
    assert console.coloured("unknown", "unknown") == "unknown"
    monkeypatch.setenv("NO_COLOR", "1")
    assert console.coloured("differ", "differ") == "differ"


def test_paths_are_not_broken(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    path = "a-folder/of-a/long-name/with-hyphens-and/more-of-it.csv"
    assert console.wrapped(f"the table is in {path}") == ["the table is in", path]
