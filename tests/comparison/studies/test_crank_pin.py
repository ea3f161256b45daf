"""Peaks at the crank pin: from made-up runs, and within what the pin's shift allows in the model's."""

from math import degrees

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import Outcome, run_one
from comparison.reliability.errors import QUANTITIES
from comparison.studies.crank_pin import study


def peaks(key, sizes):
    """Runs of the reference whose peaks of every quantity have these sizes, by the value of a key."""
    rows = [
        (key, value, "reference", name, study.PASSAGE, size, 0.75)
        for value, several in sizes.items()
        for name in QUANTITIES
        for size in several
    ]
    return pd.DataFrame(rows, columns=[*study.CASE, "size", "time"])


def test_peaks_of_an_ensemble_stand_beside_the_published_ones_and_failures_are_counted():
    (row,) = study.peak_rows(Outcome("bad input", "no pin"), None, 0.4)
    ensemble = peaks(study.RADIUS, {study.SHOWN: (100.0, 494.9, 600.0)})
    failed = pd.DataFrame([{"key": study.RADIUS, "model": "exudyn"} | row])
    told = study.page(pd.concat([ensemble, peaks(study.MODULUS, {2e11: (1.0,)}), failed]))
    line = next(line for line in told["peaks"].splitlines() if line.startswith("| acceleration, passage"))
    assert [cell.strip() for cell in line.replace("\u00a0", " ").split("|")[2:-1]] == [
        "494.9 m/s²", "494.9 m/s² (100.0 m/s² … 600.0 m/s²)", "1.00", "n/a", "n/a"
    ]  # fmt: skip
    assert told["failed"].to_dict() == {("exudyn", "not simulated: no pin"): 1}


def test_the_published_peak_is_met_where_a_power_law_passes_it():
    frame = study.cases(peaks(study.MODULUS, {E: (494.9 * (E / 20e9) ** 0.4,) for E in (7e9, 1e9, 90e9)}))
    sizes = study.over_modulus(frame, "acceleration", study.PASSAGE)["median"]
    assert study.met_at(sizes, 494.9) == pytest.approx([20.0], rel=1e-12)
    assert study.met_at(sizes, 1e6) == []


def test_the_largest_error_is_taken_in_the_second_cycle_and_near_the_published_instant(
    central_case, make_table
):
    run, ideal, per_cycle = make_table(), make_table(), central_case.data["output"]["samples_per_cycle"]
    run.frame.loc[10, "slider_vy"] += 9.0
    run.frame.loc[per_cycle + 10, "slider_vy"] -= 2.0
    rows = study.peak_rows(Outcome("success", table=run), ideal, central_case.period)
    sizes = {row["where"]: row["size"] for row in rows if row["quantity"] == "velocity"}
    assert sizes == {study.PASSAGE: 0.0, study.CYCLE: pytest.approx(2.0, rel=1e-9)}


def test_the_slider_moves_no_further_than_the_pins_shift_and_penetration_allow():
    few = {"output.groups": [], study.SAMPLES: 10_000}
    data = study.scene({}).data
    crank, angle = data["mechanism"]["crank"]["length"], data["mechanism"]["crank_angle_deg"]
    clearance = data["clearance"]["crank_pin"]

    def ideal(**values):
        keys = few | {f"mechanism.{key}": value for key, value in values.items()}
        return run_one(study.scene(keys | {"joints.crank_pin": "ideal"}), "reference").values("slider_y")

    step = clearance / 10
    along = [ideal(**{"crank.length": crank + sign * step}) for sign in (1, -1)]
    across = [ideal(crank_angle_deg=angle + sign * degrees(step / crank)) for sign in (1, -1)]
    # A rigid link in place of the clearance: the gradient of y in the pin's place times its reach.
    bound = clearance * np.hypot(along[0] - along[1], across[0] - across[1]) / (2 * step)
    # The identified geometry's, with the digits that are known of it (paper-model, Sec. 3).
    assert bound[10_000:].max() == pytest.approx(5.67e-4, abs=0.005e-4)
    assert bound[round(0.7523 / 0.4 * 10_000)] == pytest.approx(5.56e-4, abs=0.005e-4)
    actual = run_one(study.scene(few), "reference")
    depth = actual.events["largest_depth"].max()
    size = np.abs(actual.values("slider_y") - ideal())
    # Second order in the shift: (c + d)^2 over the crank's length is 1e-6 m. It is met within 2 %, too.
    assert np.all(size <= bound * (1 + depth / clearance) + 1e-6)
    assert (size / bound).max() > 0.98
    # The members of an ensemble differ by their start only.
    first, second = study.scene({}), study.scene({}, member=1)
    assert second.hash != first.hash == second.with_values({"mechanism.crank_angle_deg": angle}).hash
