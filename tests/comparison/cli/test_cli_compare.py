"""`sixbar compare` of tables from elsewhere: exit codes, numbers, and tables that never pass."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from comparison.cli import main
from comparison.tables.table import Table
from comparison.tables.table_files import read, write


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
    assert main(["compare", "a.csv", "b.csv", "--out", "c"]) == 3
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["channel", "verdict", "max"]
    assert Path(lines[-1]).parent == Path("c")
    assert main(["compare", "a.csv", "b.csv", "--json", "--out", "c"]) == 3
    out, err = capsys.readouterr()
    assert err.splitlines() == lines
    numbers = json.loads(out)
    assert numbers["verdict"] == "indeterminate"
    assert numbers["labels"] == ["a", "b"]
    assert numbers["channels"]["slider_x"]["max_difference"] == pytest.approx(2e-7, rel=1e-6)
    assert numbers["channels"]["slider_x"]["explained"] is None  # there is nothing to explain it by


@pytest.mark.usefixtures("tables")
def test_the_tolerance_may_stand_in_the_scene(scene_file):
    coarse = scene_file("own", extra="[compare]\ntolerance = 1e-2\n")
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


def opensim(name: str, degrees: np.ndarray) -> None:
    """Ten joint angles at 100 Hz, as OpenSim stores the results of inverse kinematics."""
    names = [f"joint_{n}" for n in range(10)]
    head = f"Coordinates\nversion=1\nnRows={len(degrees)}\nnColumns=11\ninDegrees=yes\n\nendheader\n"
    rows = "\n".join(
        "\t".join(f"{value:16.8f}" for value in (n * 0.01, *row)) for n, row in enumerate(degrees)
    )
    Path(name).write_text(head + "\t".join(["time", *names]) + "\n" + rows + "\n")


@pytest.mark.parametrize(("wrong", "code"), [(0.0, 0), (0.5, 1)])
def test_ten_joint_angles_of_two_opensim_files_compare_without_a_mapping(wrong, code, capsys):
    time = np.arange(101) * 0.01
    degrees = 30 * np.sin(np.outer(time, np.arange(1, 11))) - 5.0
    opensim("left.sto", degrees)
    degrees[40, 6] += wrong
    opensim("right.mot", degrees)
    command = ["compare", "left.sto", "right.mot", "--tolerance", "1e-3"]
    assert main(command) == code
    out, err = capsys.readouterr()
    assert out.count(" agree ") >= 10 - code
    assert "no unit is stated for joint_0, joint_1" in err
    out = " ".join(out.split())  # reasons are wrapped
    if code:
        assert (
            "most of all joint_6, |E|/tolerance = 8.3: 1 of 101 samples are outside the tolerance, at worst "
            "at t = 0.4 s: " in out
        )
        assert "the difference is -0.5, the threshold 0.0" in out  # without a unit, none is stated
        assert main([*command, "--share", "0.99"]) == 0
        assert "1 of 101 samples are outside" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--share", "0"], "--share 0 must be above 0 and at most 1"),
        (["--share", "1.5"], "--share 1.5 must be above 0"),
        (["--period", "-1"], "--period -1 must be a positive number"),
        (["--at-events", "before"], "--at-events 'before' must be one of left, right, both"),
    ],
)
def test_options_that_mean_nothing_are_bad_input(options, rule, capsys):
    assert main(["compare", "a.csv", "b.csv", *options]) == 2
    assert rule in capsys.readouterr().err


def test_crank_angle_and_speed_are_channels():
    time = np.linspace(0.0, 0.8, 401)
    for name, angle in (("a", 15 * time + 2.0), ("b", np.mod(15 * time + 2.0, 2 * np.pi) - np.pi)):
        shift = np.pi if name == "b" else 0.0
        rows = "\n".join(f"{t:.12g},{q + shift:.12g},15" for t, q in zip(time, angle, strict=True))
        Path(f"{name}.csv").write_text(f"time,crank_angle,crank_speed\n{rows}\n")
    # One runs on, the other starts anew with each revolution.
    assert main(["compare", "a.csv", "b.csv", "--tolerance", "1e-9"]) == 0


def test_a_second_heading_among_the_rows_is_one_line(make_table, capsys):
    write(make_table(), Path("a.csv"))
    head, *rows = Path("a.csv").read_text().splitlines()
    Path("b.csv").write_text("\n".join([head, *rows[:3], head, *rows[3:]]) + "\n")
    assert main(["compare", "a.csv", "b.csv"]) == 2
    err = capsys.readouterr().err
    assert "text after data row 3" in err
    assert err.count("\n") == 1
