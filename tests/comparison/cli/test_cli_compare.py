"""`sixbar compare` of tables from elsewhere: exit codes, numbers, and tables that never pass."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from comparison.cli import main
from comparison.tables.table import Table, read, write


@pytest.fixture
def tables(make_table):
    """Two foreign tables that differ by a thousandth, and one that is the first."""
    write(make_table(), Path("a.csv"))
    write(make_table(stretch=1e-3), Path("b.csv"))
    write(make_table(), Path("same.csv"))


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["a.csv", "b.csv"], 3),
        (["a.csv", "b.csv", "--allow-indeterminate"], 0),
        (["a.csv", "b.csv", "--tolerance", "1e-2"], 0),
        (["a.csv", "b.csv", "--tolerance", "1e-5"], 1),
        (["a.csv", "b.csv", "--tolerance", "1e-5", "--allow-indeterminate"], 1),
        (["a.csv", "same.csv"], 3),
        (["a.csv", "same.csv", "--tolerance", "1e-9"], 0),
        (["a.csv", "b.csv", "--scene", "ideal"], 2),
    ],
)
def test_compare_exit_codes(arguments, code):
    assert main(["compare", *arguments]) == code


@pytest.mark.usefixtures("tables")
def test_compare_writes_numbers_and_ends_with_the_report(capsys):
    assert main(["compare", "a.csv", "b.csv", "--json", "deep/n.json", "--out", "c"]) == 3
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["channel", "verdict", "max"]
    assert Path(lines[-1]).parent == Path("c")
    numbers = json.loads(Path("deep/n.json").read_text())
    assert numbers["verdict"] == "indeterminate"
    assert numbers["labels"] == ["a", "b"]
    assert numbers["channels"]["slider_x"]["max_difference"] == pytest.approx(2e-7, rel=1e-6)
    assert numbers["channels"]["slider_x"]["explained"] is None  # there is nothing to explain it by


@pytest.mark.usefixtures("tables")
def test_the_tolerance_may_stand_in_the_scene(scene_file):
    coarse = scene_file("own", extra="[compare]\ntolerance = 1e-2\n").replace("100", "200")
    path = Path(coarse)
    path.write_text(path.read_text().replace("samples_per_cycle = 100", "samples_per_cycle = 200"))
    assert main(["compare", "a.csv", "b.csv", "--scene", coarse]) == 0
    assert main(["compare", "a.csv", "b.csv", "--scene", coarse, "--tolerance", "1e-5"]) == 1


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("fault", ["nan", "missing", "truncated", "zero force"])
def test_faulty_tables_never_pass(fault, capsys):
    frame = read("a.csv").frame
    if fault == "nan":
        frame.loc[3, "slider_ay"] = np.nan
    elif fault == "missing":
        frame = frame.drop(columns="slider_ay")
    elif fault == "truncated":
        frame = frame.iloc[:350]
    else:
        frame["corner_lr_normal"] = 0.0
    write(Table(frame), Path("bad.csv"))
    code = main(["compare", "a.csv", "bad.csv", "--tolerance", "0.01"])
    if fault == "zero force":
        assert code == 1
        assert "corner_lr_normal" in capsys.readouterr().out
    else:
        assert code == 2
        err = capsys.readouterr().err
        assert err.startswith("sixbar: bad: ") or "truncated" in err
        assert not Path("reports").exists()


def test_parquet_and_text_give_the_same_verdict(make_table):
    write(make_table(), Path("a.parquet"))
    write(make_table(), Path("b.csv"))
    assert main(["compare", "a.parquet", "b.csv", "--tolerance", "1e-12"]) == 0
