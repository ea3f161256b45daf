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

STEP = 1e-3


def runs(*steps: float, rod: float = ROD) -> None:
    """Write the sensors of each run below its step, and the closed form at the same times."""
    for step in steps:
        Path(f"{step:g}").mkdir(exist_ok=True)
        simulate(step, Path(f"{step:g}"), rod)
    time = np.loadtxt(f"{steps[0]:g}/position.txt", delimiter=",")[:, 0]
    exact = np.column_stack([time, closed_form(time)])
    np.savetxt("exact.csv", exact, "%.17g", ",", header="time,position,velocity", comments="")
    for column in ("position", "velocity"):
        rules = (f'[{side}]\nchannel = "slider"\n' for side in ('a."#2"', f"b.{column}"))
        put(f"{column}.toml", 'compare = ["slider"]\n[channels.slider]\n' + "".join(rules))


# Every step fulfils the constraints of positions: 6e-15 m of 0.2 m measured, round-off.
# Velocities follow at second order: 2.8e-6 of 1.3 m/s measured.
@pytest.mark.parametrize(("of", "tolerance"), [("position", "1e-12"), ("velocity", "1e-5")])
@pytest.mark.parametrize(("longer", "verdict"), [(0.0, "agree"), (1e-4, "differ")])
def test_sensors_agree_with_the_closed_form_and_a_longer_rod_differs(of, tolerance, longer, verdict, capsys):
    runs(STEP, rod=ROD + longer)
    command = ["compare", f"{STEP:g}/{of}.txt", "exact.csv", "--mapping", f"{of}.toml", "--json"]
    assert main([*command, "--tolerance", tolerance]) == (verdict == "differ")
    assert json.loads(capsys.readouterr().out)["channels"]["slider"]["verdict"] == verdict


def test_the_uncertainty_from_sensor_files_covers_the_true_error_closely():
    steps = STEP / 2, STEP / 4, STEP
    runs(*steps)
    files = [*(Path(f"{step:g}/velocity.txt") for step in steps), Path("exact.csv")]
    (*ours, exact), _ = read_tables(files, ["a", "a", "a", "b"], load_mapping(Path("velocity.toml")))
    one, other = Recorded(*ours, refinement=(2.0, 2.0)), Recorded(exact, exact)
    result = compare_recorded(one, other, scene=None, labels=("a", "b"))
    found = result.channels["slider"]
    assert (result.verdict, found.coverage) == ("agree", 1.0)
    error = np.abs(found.difference)
    assert (error <= found.u_a).all()
    # 1.25 times the error that three levels show; a tenth for what is not of second order.
    assert found.u_a.max() < 1.1 * 1.25 * error.max()
