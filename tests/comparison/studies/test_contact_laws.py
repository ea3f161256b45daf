"""The page of the study contact-laws from made-up runs."""

import pandas as pd

from comparison.execution.run import Outcome
from comparison.studies.contact_laws.study import run_row, shown_run, shown_switches
from comparison.tables.table import Table


def shown(outcome, law):
    return shown_run({"law": law, "model": "reference"} | run_row(outcome, law, None))


def test_a_refusal_and_a_run_that_stopped_are_shown_with_their_reason():
    refused = shown(Outcome("bad input", "contact.law = 'foundation' is not simulated"), "foundation")
    assert refused["end"] == "not simulated: contact.law = 'foundation' is not simulated"
    assert list(refused.values())[2:-1] == ["n/a"] * 4
    partial = Table(
        pd.DataFrame({"time": [0.0, 0.1], "energy_residual": [0.0, -5.0]}),
        pd.DataFrame(
            {"corner": ["ll"], "start": [0.0], "end": [0.1], "peak_force": [3.0], "largest_depth": [1e-6]}
        ),
        {name: {"min": -2.0, "max": 1.0} for name in ("slider_vx", "slider_omega")},
        {"counters": {"steps": 7}},
    )
    stopped = Outcome("work-limit", "shorten drive.cycles", partial=partial)
    line = shown(stopped, "hertz-corners")
    assert line["end"] == "work-limit at 0.1000 s"
    assert (line["spurious energy"], line["largest speed of x"]) == ("5.00\u00a0J", "2.00\u00a0m/s")
    assert shown_switches(1e-9, stopped)["switches"] == "not measured: work-limit"
