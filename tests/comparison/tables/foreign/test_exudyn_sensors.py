"""Sensor files that Exudyn itself writes, of a slider-crank against the closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from exudyn_slider_crank import ROD, closed_form, simulate
from foreign_tables import put

from comparison.cli import main
from comparison.tables.foreign import read_tables
from comparison.tables.mapping import load_mapping
from comparison.verdict.recorded import Recorded, compare_recorded

MAPPING = """
compare = ["slider"]
[channels.slider]
[a."#2"]
channel = "slider"
[b.{column}]
channel = "slider"
"""
STEP = 1e-3


def runs(*steps: float, rod: float = ROD) -> None:
    """Write the sensors of each run below its step, and the closed form at the same times."""
    for step in steps:
        Path(f"{step:g}").mkdir()
        simulate(step, Path(f"{step:g}"), rod)
    time = np.loadtxt(f"{steps[0]:g}/position.txt", delimiter=",")[:, 0]
    exact = np.column_stack([time, closed_form(time)])
    np.savetxt("exact.csv", exact, "%.17g", ",", header="time,position,velocity", comments="")
    for column in ("position", "velocity"):
        put(f"{column}.toml", MAPPING.format(column=column))


def compared(of: str, *options: str) -> tuple[int, dict]:
    command = ["compare", f"{STEP:g}/{of}.txt", "exact.csv", "--mapping", f"{of}.toml", "--json", "n.json"]
    code = main([*command, *options])
    return code, json.loads(Path("n.json").read_text())["channels"]["slider"]


# Every step fulfils the constraints of positions: 6e-15 m of 0.2 m measured, round-off.
# Velocities follow at second order: 2.8e-6 of 1.3 m/s measured.
@pytest.mark.parametrize(("of", "tolerance"), [("position", 1e-12), ("velocity", 1e-5)])
def test_sensors_agree_with_the_closed_form_and_a_longer_rod_differs(of, tolerance, capsys):
    runs(STEP)
    code, found = compared(of, "--tolerance", f"{tolerance:g}")
    assert (code, found["verdict"]) == (0, "agree")
    Path(f"{STEP:g}").rename("right")
    runs(STEP, rod=ROD + 1e-4)
    code, found = compared(of, "--tolerance", f"{tolerance:g}")
    assert (code, found["verdict"]) == (1, "differ")
    capsys.readouterr()


def test_the_uncertainty_from_sensor_files_covers_the_true_error_closely():
    runs(STEP / 2, STEP / 4, STEP)
    files = [Path(f"{step:g}/velocity.txt") for step in (STEP / 2, STEP / 4, STEP)]
    sides = ["a", "a", "a", "b"]
    (*ours, exact), _ = read_tables(
        [*files, Path("exact.csv")], sides, load_mapping(Path("velocity.toml")), None
    )
    result = compare_recorded(
        Recorded(*ours, refinement=(2.0, 2.0)), Recorded(exact, exact), scene=None, labels=("a", "b")
    )
    found = result.channels["slider"]
    assert (result.verdict, found.coverage) == ("agree", 1.0)
    error = np.abs(found.difference)
    assert (error <= found.u_a).all()
    # 1.25 times the error that three levels show; a tenth for what is not of second order.
    assert found.u_a.max() < 1.1 * 1.25 * error.max()
