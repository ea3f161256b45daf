"""Tables of the study contact-laws from made-up runs."""

import pandas as pd
import pytest

from comparison.execution.run import Outcome
from comparison.studies.contact_laws.study import run_row, shown_runs
from comparison.tables.table import Table


def test_a_refusal_and_a_run_that_stopped_are_shown_with_their_reason():
    refused = Outcome("bad input", "contact.law = 'foundation' is not simulated")
    partial = Table(
        pd.DataFrame({"time": [0.0, 0.1], "energy_residual": [0.0, -5.0]}),
        pd.DataFrame(
            {"corner": ["ll"], "start": [0.0], "end": [0.1], "peak_force": [3.0], "largest_depth": [1e-6]}
        ),
        {name: {"min": -2.0, "max": 1.0} for name in ("slider_vx", "slider_omega")},
        {"counters": {"steps": 7}},
    )
    stopped = Outcome("work-limit", "shorten drive.cycles", partial=partial)
    rows = [{"law": law} | run_row(outcome, law, None) for law, outcome in
            (("foundation", refused), ("hertz-corners", stopped))]  # fmt: skip
    first, second = shown_runs(pd.DataFrame(rows)).to_dict("records")
    assert first["end"] == "work-limit at 0.1000 s"
    assert (first["spurious_energy_J"], first["speed_of_x_m/s"]) == (5.0, 2.0)
    assert second["end"] == "not simulated: contact.law = 'foundation' is not simulated"
    assert second["force_N"] != pytest.approx(second["force_N"])  # not a number
