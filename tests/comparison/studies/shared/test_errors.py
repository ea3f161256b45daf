"""Errors against the ideal mechanism, their peaks, and how far the crank pin's shift can move the slider."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.studies.crank_pin.study import scene, shifts
from comparison.studies.shared.errors import error, second_cycle, shift_bound
from comparison.studies.shared.published import published
from comparison.tables.table import Table

SAMPLES = 10_000


def test_the_second_cycle_holds_both_of_its_ends_whatever_the_rounding():
    time = np.arange(2001) * (0.4 / 1000)
    within = second_cycle(time, 0.4)
    assert within.sum() == 1001
    assert not within[999]


def test_runs_of_other_times_have_no_error():
    table = Table(pd.DataFrame({"time": [0.0, 1.0], "slider_y": [1.0, 2.0]}))
    assert error(table, table, "slider_y").tolist() == [0.0, 0.0]
    with pytest.raises(ValueError, match="other times"):
        error(table, Table(table.frame.assign(time=[0.0, 1.1])), "slider_y")


def test_the_bound_of_a_shift_against_a_slider_crank_in_closed_form():
    # A rod of length b from the pin (p, q) to a slider on y = 0: s = p + sqrt(b^2 - q^2).
    r, b, h, c = 0.05, 0.2, 1e-5, 2e-4
    phi = np.linspace(0, 2 * np.pi, 50)

    def slider(length, angle):
        return length * np.cos(angle) + np.sqrt(b**2 - (length * np.sin(angle)) ** 2)

    q = r * np.sin(phi)
    exact = c * np.hypot(1.0, q / np.sqrt(b**2 - q**2))
    found = shift_bound(
        (slider(r + h, phi), slider(r - h, phi)), (slider(r, phi + h / r), slider(r, phi - h / r)), h, c
    )
    # Central differences: (h / r)^2 / 6 of the slider's own size relative to the pin's.
    assert found == pytest.approx(exact, rel=1e-7)


def test_figures_come_from_the_published_table():
    found = published("F7-R-a")
    assert (found.value, found.unit, found.time) == (-494.9, "m/s^2", 0.7522)
    with pytest.raises(KeyError):
        published("F99")


def test_the_slider_moves_no_further_than_the_pins_shift_and_penetration_allow():
    still = {"joints.crank_pin": "ideal", "output.groups": []}
    ideal, *shifted = (
        run_one(scene(still | values, SAMPLES), "reference").values("slider_y") for values in ({}, *shifts())
    )
    clearance = scene({}).data["clearance"]["crank_pin"]
    bound = shift_bound((shifted[0], shifted[1]), (shifted[2], shifted[3]), clearance / 10, clearance)
    # The identified geometry's, with the digits that are known of it (paper-model, Sec. 3).
    assert bound[SAMPLES:].max() == pytest.approx(5.67e-4, abs=0.005e-4)
    assert bound[round(0.7523 / 0.4 * SAMPLES)] == pytest.approx(5.56e-4, abs=0.005e-4)
    actual = run_one(scene({"output.groups": []}, SAMPLES), "reference")
    assert actual.events is not None
    depth = actual.events["largest_depth"].max()
    size = np.abs(actual.values("slider_y") - ideal)
    # Second order in the shift: (c + d)^2 over the crank's length is 1e-6 m. It is met within 2 %, too.
    assert np.all(size <= bound * (1 + depth / clearance) + 1e-6)
    assert (size / bound).max() > 0.98


def test_the_members_of_an_ensemble_differ_by_their_start_only():
    first, second = scene({}, member=0), scene({}, member=1)
    changed = second.with_values(
        {"mechanism.crank_angle_deg": load_scene("150rpm-0.2mm").data["mechanism"]["crank_angle_deg"]}
    )
    assert first.hash != second.hash
    assert first.hash == changed.hash
