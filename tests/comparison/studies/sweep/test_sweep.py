"""Sweeps: which points, what is measured, resumed after a kill, on processes and on a cluster."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.studies.sweep.outputs import USUAL, measure, names
from comparison.studies.sweep.points import SweepError, check_keys, grid, latin_hypercube, listed
from comparison.tables.table import Table


def test_a_grid_is_every_combination_with_the_last_key_changing_first():
    points = grid(["drive.speed_rpm=100, 150", "joints.slider=ideal,clearance"])
    assert points == [
        {"drive.speed_rpm": speed, "joints.slider": joint}
        for speed in (100, 150)
        for joint in ("ideal", "clearance")
    ]


def test_a_latin_hypercube_has_one_point_in_each_part_of_each_range():
    points = latin_hypercube(["drive.speed_rpm=100:200", "clearance.slider=1e-4:2e-4"], 20, seed=3)
    for key, low, high in (("drive.speed_rpm", 100.0, 200.0), ("clearance.slider", 1e-4, 2e-4)):
        parts = sorted(int(20 * (point[key] - low) / (high - low)) for point in points)
        assert parts == list(range(20))
    assert points == latin_hypercube(["drive.speed_rpm=100:200", "clearance.slider=1e-4:2e-4"], 20, seed=3)
    assert points != latin_hypercube(["drive.speed_rpm=100:200", "clearance.slider=1e-4:2e-4"], 20, seed=4)


def test_a_list_is_read_with_its_types(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("drive.speed_rpm,contact.law\n100,foundation\n1.5e2,hertz-corners\n")
    assert listed(path) == [
        {"drive.speed_rpm": 100, "contact.law": "foundation"},
        {"drive.speed_rpm": 150.0, "contact.law": "hertz-corners"},
    ]
    path.write_text("drive.speed_rpm,contact.law\n100\n")
    with pytest.raises(SweepError, match="line 2 has 1 values for 2 keys"):
        listed(path)


def test_materials_are_swept_of_both_partners_or_of_one():
    number = load_scene("150rpm-0.2mm")
    for scene in (number, number.with_values({"contact.youngs_modulus.guide": 69e9})):
        check_keys(
            scene, ["contact.youngs_modulus", "contact.youngs_modulus.slider", "contact.poisson.guide"]
        )
        with pytest.raises(SweepError, match=r"did you mean 'contact\.poisson\.guide'"):
            check_keys(scene, ["contact.poisson.guid"])


def test_what_is_measured_of_a_run_whose_numbers_are_known():
    time_ = np.linspace(0.0, 2.0, 5)
    y = np.array([0.0, 9.0, 1.0, -3.0, 2.0])
    frame = pd.DataFrame({"time": time_, "slider_y": y})
    events = pd.DataFrame({"impulse": [0.25, 0.5], "peak_force": [3.0, 7.0]})
    run = Table(frame, events, {"slider_y": {"min": -3.5, "max": 9.5}}, {"counters": {"steps": 12}})
    ideal = Table(pd.DataFrame({"time": time_, "slider_y": [0.0, 0.0, 0.5, 0.0, 0.5]}))
    asked = (
        "min:slider_y",
        "max:slider_y",
        "end:slider_y",
        "rms:slider_y",
        "peak_error:slider_y",
        "contacts",
    )
    found = measure(run, ideal, 1.0, (*asked, "impulse", "largest:peak_force", "steps", "max:slider_vx"))
    # The largest error, 9, is in the first cycle; in the second it is -3.
    assert list(found.values()) == [-3.5, 9.5, 2.0, np.sqrt(95 / 5), 3.0, 2.0, 0.75, 7.0, 12.0, None]
    assert measure(Table(frame), None, 1.0, ("contacts", "impulse")) == {"contacts": None, "impulse": None}
    assert set(USUAL) <= set(names())
