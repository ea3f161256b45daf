"""Sensor files that Exudyn itself writes, of a slider-crank against the closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from exudyn_slider_crank import ROD, closed_form, simulate
from foreign_tables import put

from comparison.cli import main


@pytest.mark.parametrize(("longer", "verdict"), [(0.0, "agree"), (1e-4, "differ")])
def test_sensors_agree_with_the_closed_form_and_a_longer_rod_differs(longer, verdict, capsys):
    simulate(1e-3, Path(), ROD + longer)
    time = np.loadtxt("position.txt", delimiter=",")[:, 0]
    exact = np.column_stack([time, closed_form(time)])
    np.savetxt("exact.csv", exact, "%.17g", ",", header="time,position,velocity", comments="")
    # Every step fulfils the constraints of positions: 6e-15 m of 0.2 m measured, round-off.
    # Velocities follow at second order: 2.8e-6 of 1.3 m/s measured.
    for quantity, tolerance in (("position", "1e-12"), ("velocity", "1e-5")):
        rules = (f'[{side}]\nchannel = "slider"\n' for side in ('a."#2"', f"b.{quantity}"))
        put("map.toml", 'compare = ["slider"]\n[channels.slider]\n' + "".join(rules))
        command = ["compare", f"{quantity}.txt", "exact.csv", "--mapping", "map.toml", "--json"]
        assert main([*command, "--tolerance", tolerance]) == (verdict == "differ")
        assert json.loads(capsys.readouterr().out)["channels"]["slider"]["verdict"] == verdict
