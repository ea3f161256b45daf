"""Peaks at the crank pin: from made-up runs, and within what the pin's shift allows in the model's."""

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import Outcome, run_one
from comparison.reliability.errors import QUANTITIES
from comparison.studies.paper import crank_pin as study


def peaks(sizes):
    """Runs of the reference whose peaks of every quantity have these sizes, by Young's modulus."""
    rows = [
        ("reference", name, modulus, size, 0.75, 2e-6)
        for modulus, several in sizes.items()
        for name in QUANTITIES
        for size in several
    ]
    return pd.DataFrame(rows, columns=[*study.CASE, "size", "time", "depth"])


def test_peaks_stand_beside_the_printed_ones_with_the_moduli_that_meet_them_and_failures_are_counted():
    (row,) = study.peak_rows(Outcome("bad input", "no pin"), None, 0.4)
    # In proportion to the modulus to the power 0.4: 494.9 m/s^2 is passed at 20 GPa.
    law = {E: (494.9 * (E / 20e9) ** 0.4,) for E in (7e9, 1e9, 90e9)}
    steel = {study.STEEL: (1000.0, 3000.0, 4000.0)}
    failed = pd.DataFrame([{"model": "exudyn", "modulus": study.STEEL} | row])
    told = study.page(pd.concat([peaks(steel), peaks(law), failed]))
    line = next(line for line in told["peaks"].splitlines() if line.startswith("| acceleration"))
    assert [cell.strip() for cell in line.replace("\u00a0", " ").split("|")[2:-1]] == [
        "494.9 m/s²", "3000 m/s² (1000 m/s² … 4000 m/s²)", "n/a", "20"
    ]  # fmt: skip
    assert told["failed"].to_dict() == {("exudyn", "not simulated: no pin"): 1}
    sizes = study.of_reference(study.cases(peaks(law)), "acceleration")["median"]
    assert study.met_at(sizes, 494.9) == pytest.approx([20.0], rel=1e-12)
    assert study.met_at(sizes, 1e6) == []


def test_the_largest_error_is_that_of_the_second_cycle(central_case, make_table):
    run, ideal, per_cycle = make_table(), make_table(), central_case.data["output"]["samples_per_cycle"]
    run.frame.loc[10, "slider_vy"] += 9.0
    run.frame.loc[per_cycle + 10, "slider_vy"] -= 2.0
    _, velocity, _ = study.peak_rows(Outcome("success", table=run), ideal, central_case.period)
    assert velocity["size"] == pytest.approx(2.0, rel=1e-9)


def test_the_slider_moves_no_further_than_the_pins_shift_and_penetration_allow():
    few = {"output.groups": [], "output.samples_per_cycle": 10_000}
    clearance = study.scene({}).data["clearance"]["crank_pin"]
    # The identified geometry's, with the digits that are known of it.
    assert study.reach(clearance) == pytest.approx(5.67e-4, abs=0.005e-4)
    actual, ideal = (
        run_one(study.scene(few | {"joints.crank_pin": joint}), "reference")
        for joint in ("clearance", "ideal")
    )
    size = np.abs(actual.values("slider_y") - ideal.values("slider_y")).max()
    depth = actual.events["largest_depth"].max()
    # Rigid bodies are met within 2 %, and the pin's depth adds no more than it can.
    assert 0.98 * study.reach(clearance) < size <= study.reach(clearance + depth)
    # The members of an ensemble differ by their start only.
    first, second = study.scene({}), study.scene({}, member=1)
    assert second.hash != first.hash
    angle = first.data["mechanism"]["crank_angle_deg"]
    assert second.with_values({"mechanism.crank_angle_deg": angle}).hash == first.hash
