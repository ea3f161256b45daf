"""Columns of a model's result: pandas' frames only where asked for, and the same files without."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import write

ROOT = Path(__file__).parents[3]
EVENTS = ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


def result(n=50, **changed):
    rng = np.random.default_rng(1)
    size = 10.0 ** rng.uniform(-300, 25, n)
    events = {"corner": np.array(["ll", "pin"])} | {name: 10.0 ** rng.uniform(-12, -1, 2) for name in EVENTS}
    parts = {
        "columns": {"time": np.linspace(0.0, 1.0, n), "slider_x": size * rng.choice([-1.0, 1.0], n)},
        "events": events | {"start": np.array([1e-05, 0.5]), "end": np.array([0.25, 1.0])},
        "extrema": {},
        "provenance": {},
        "status": "success",
        "remedy": "",
    }
    return SimpleNamespace(**(parts | changed))


def framed(made):
    """Return the table of the same frames."""
    return Table(
        pd.DataFrame(made.columns), pd.DataFrame(made.events), {}, {"status": "success", "remedy": ""}
    )


@pytest.mark.parametrize("value", [0.5, -0.0, np.nan, np.inf])
def test_the_files_are_those_of_frames_byte_by_byte(tmp_path, value):
    made = result()
    made.columns["slider_x"][3] = made.events["impulse"][0] = value
    made.columns['a "quoted", name'] = made.columns["slider_x"]
    write(Table.from_result(made), tmp_path / "columns" / "a.csv")
    write(framed(made), tmp_path / "frames" / "a.csv")
    for name in ("a.csv", "a.events.csv", "a.json"):
        assert (tmp_path / "columns" / name).read_bytes() == (tmp_path / "frames" / name).read_bytes()


@pytest.mark.parametrize("name", ["columns", "events"])
def test_columns_of_different_lengths_are_refused(name):
    made = result()
    getattr(made, name)[next(reversed(getattr(made, name)))] = np.zeros(3)
    with pytest.raises(TableError, match="the model's columns are inconsistent: "):
        Table.from_result(made)


def test_what_is_no_array_of_doubles_is_a_frame_as_before(tmp_path):
    made = result()
    made.columns["slider_x"] = [1] * 50
    table = Table.from_result(made)
    assert table.frame["slider_x"].dtype == np.int64
    check(table, ["slider_x"])
    write(table, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[1] == "0,1"
    made.columns["slider_x"] = ["x"] * 50
    with pytest.raises(TableError, match="slider_x is not a number in data row 1: 'x'"):
        check(Table.from_result(made), ["slider_x"])


@pytest.mark.parametrize(
    ("scene", "unused"),
    [("ideal", {"numba", "scipy"}), ("150rpm-0.2mm", {"scipy.linalg"})],
)
def test_a_run_imports_nothing_heavy_that_it_does_not_need(tmp_path, scene, unused):
    """Each takes longer than such a run."""
    arguments = ["run", scene, "--model", "reference", "--out", str(tmp_path / "a.csv")]
    arguments += ["--set", "drive.cycles=0.1"]
    code = f"import sys; from comparison.cli import main; main({arguments}); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert not unused & set(done.stdout.splitlines()[-1].split())
    assert (tmp_path / "a.csv").is_file()
