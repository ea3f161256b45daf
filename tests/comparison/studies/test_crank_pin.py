"""Peaks at the crank pin from made-up runs."""

import pandas as pd
import pytest

from comparison.execution.run import Outcome
from comparison.studies.crank_pin.study import (
    CASE,
    CYCLE,
    MODULUS,
    PASSAGE,
    QUANTITIES,
    RADIUS,
    SHOWN,
    cases,
    failures,
    modulus,
    peak_rows,
    powers,
    shown_peak,
    shown_ratios,
)


def peaks(key, sizes):
    """Runs of the reference whose peaks of every quantity have these sizes, by the value of a key."""
    rows = [
        (key, value, "reference", name, PASSAGE, size, 0.75)
        for value, several in sizes.items()
        for name in QUANTITIES
        for size in several
    ]
    return pd.DataFrame(rows, columns=[*CASE, "size", "time"])


def test_peaks_of_an_ensemble_stand_beside_the_published_ones():
    frame = cases(peaks(RADIUS, {SHOWN: (100.0, 494.9, 600.0)}))
    line = {
        name: cell.replace("\u00a0", " ") for name, cell in shown_peak(frame, "acceleration", PASSAGE).items()
    }
    assert line["published"] == "494.9 m/s²"
    assert line["reference"] == "494.9 m/s² (100.0 m/s² … 600.0 m/s²)"
    assert line["reference / published"] == "1.00"
    assert line["exudyn"] == "n/a"
    ratios = shown_ratios(frame, RADIUS, SHOWN, "reference", "a")
    assert ratios["acceleration, passage"] == "1.00"
    assert ratios["acceleration, second cycle"] == "n/a"


def test_runs_that_failed_are_counted_with_their_reason():
    (row,) = peak_rows(Outcome("bad input", "no pin"), None, 0.4)
    frame = pd.concat(
        [peaks(RADIUS, {SHOWN: (1.0,)}), pd.DataFrame([{"key": RADIUS, "model": "exudyn"} | row])]
    )
    assert failures(frame) == "1 exudyn runs: not simulated: no pin."
    assert len(cases(frame)) == 3


def test_exponents_and_where_the_published_peak_is_met():
    frame = cases(peaks(MODULUS, {E: (494.9 * (E / 20e9) ** 0.4,) for E in (1e9, 7e9, 90e9)}))
    assert powers(frame, MODULUS, 0.0, 1e12) == "displacement 0.40, velocity 0.40, acceleration 0.40"
    assert modulus(frame, "acceleration") == "20 GPa"
    assert modulus(cases(peaks(MODULUS, {1e9: (1.0,), 2e9: (2.0,)})), "acceleration") == "no modulus"


def test_the_largest_error_is_taken_in_the_second_cycle_and_near_the_published_instant(scene, make_table):
    run, ideal, per_cycle = make_table(), make_table(), scene.data["output"]["samples_per_cycle"]
    run.frame.loc[10, "slider_vy"] += 9.0
    run.frame.loc[per_cycle + 10, "slider_vy"] -= 2.0
    rows = peak_rows(Outcome("success", table=run), ideal, scene.period)
    sizes = {row["where"]: row["size"] for row in rows if row["quantity"] == "velocity"}
    assert sizes == {PASSAGE: 0.0, CYCLE: pytest.approx(2.0, rel=1e-9)}
