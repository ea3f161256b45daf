"""Switches of the contact law and the energy they create: by hand, and in the paper's central case."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of

from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.studies.shared.switches import created, depths, surplus, switches
from comparison.tables.table import Table


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([], []),
        ([("ll", 1, 5), ("lr", 2, 3), ("ur", 4, 5)], []),  # of different sides, or one after the other
        # The later to start and the first to leave are not those whose depth counts.
        ([("ll", 1, 5), ("ul", 2, 4)], [(2.0, True, "ll"), (4.0, False, "ll")]),
        ([("ll", 1, 4), ("ul", 2, 5)], [(2.0, True, "ll"), (4.0, False, "ul")]),
        (
            [("lr", 1, 9), ("ur", 2, 3), ("ur", 5, 6)],
            [(2.0, True, "lr"), (3.0, False, "lr"), (5.0, True, "lr"), (6.0, False, "lr")],
        ),
        ([("ll", 1, 3), ("ul", 3, 4)], []),  # they only meet
    ],
)
def test_switches_are_where_two_corners_of_a_side_begin_and_cease_to_touch(events, expected):
    assert list(switches(contacts_of(*events)).itertuples(index=False, name=None)) == expected


def test_the_energy_of_a_switch_is_the_jump_of_the_residual_and_two_between_samples_are_refused():
    time = np.arange(11) / 10
    residual = np.where(time > 0.25, -3.0, 0.0) + np.where(time > 0.52, 1.0, 0.0)
    table = Table(pd.DataFrame({"time": time, "energy_residual": residual}))
    found = switches(contacts_of(("ll", 0.1, 0.9), ("ul", 0.25, 0.52)))
    assert created(found, table).tolist() == [3.0, -1.0]
    near = switches(contacts_of(("ll", 0.1, 0.9), ("ul", 0.25, 0.29)))
    with pytest.raises(ValueError, match=r"samples 0\.1 s apart do not separate switches 0\.04 s apart"):
        created(near, table)
    assert created(switches(contacts_of()), table).size == 0


@pytest.mark.parametrize("corner", ["ll", "lr", "ul", "ur"])
def test_the_depth_of_a_corner_at_a_switch_of_a_parabolic_motion_is_exact(corner):
    scene = load_scene("150rpm-0.2mm").data
    slider = scene["mechanism"]["slider"]
    right, up = (1 if corner[1] == "r" else -1), (1 if corner[0] == "u" else -1)
    t = np.arange(20) * 1e-6
    angle = 1e-5 + 3 * t
    # Distance from the guide's centre line of the corner beyond its wall by 1e-6 + 0.3 t + 4e3 t^2.
    wanted = 1e-6 + 0.3 * t + 4e3 * t**2
    arm = np.cos(angle) * right * slider["width"] / 2 - np.sin(angle) * up * slider["length"] / 2
    x = right * (wanted + slider["width"] / 2 + scene["clearance"]["slider"]) - arm
    table = Table(
        pd.DataFrame({"time": t, "slider_x": scene["mechanism"]["guide_x"] + x, "slider_angle": angle})
    )
    other = {"ll": "ul", "ul": "ll", "lr": "ur", "ur": "lr"}[corner]
    instants = np.array([4.3e-6, 11.7e-6])
    found = switches(contacts_of((corner, 0, 1), (other, *instants)))
    # Coordinates of half a metre round at 1e-16 m; the parabola amplifies that up to ten times.
    assert depths(found, table, scene) == pytest.approx(1e-6 + 0.3 * instants + 4e3 * instants**2, abs=1e-15)


def test_what_the_surface_law_stores_beyond_the_corner_law():
    # K = 4 / (3 * 2 sigma) sqrt(R), K_s = (T + L) / (0.475 * 2 sigma), sigma = (1 - 0.28^2) / 210 GPa:
    # 4.8038e9 N/m^1.5 and 2.8783e10 N/m (paper-model, Sec. 2), so at 1 um 4.7971e-3 - 1.9215e-6 J.
    scene = load_scene("150rpm-0.2mm").data
    assert surplus(np.array([1e-6, 0.0, -1e-9]), scene) == pytest.approx([4.795228e-3, 0, 0], rel=1e-4)


def test_every_switch_of_the_literal_law_creates_what_its_two_potentials_differ_by():
    values = {"contact.law": "paper-switching", "drive.cycles": 0.55, "output.groups": ["energy"]}
    # A sample every microsecond.
    literal = run_one(load_scene("150rpm-0.2mm", values | {"output.samples_per_cycle": 400_000}), "reference")
    assert literal.events is not None
    scene = load_scene("150rpm-0.2mm").data
    found = switches(literal.events)
    measured = created(found, literal)
    theory = np.where(found["to_surface"], 1, -1) * surplus(depths(found, literal, scene), scene)
    assert len(found) >= 4
    assert np.abs(measured).max() > 1e-4
    # Depths are read from samples 1 us beside the switch: 3e-4 of an energy; 1e-9 J is the integration's.
    assert measured == pytest.approx(theory, rel=1e-3, abs=1e-8)
    # Between switches nothing is created but the integration's error, 1e-9 J in a cycle.
    assert measured.sum() == pytest.approx(-literal.values("energy_residual")[-1], rel=1e-6, abs=1e-8)
