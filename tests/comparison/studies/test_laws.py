"""The part on contact laws from made-up runs: how a run ended stands in its line."""

import pandas as pd

from comparison.execution.run import Outcome
from comparison.studies.paper.laws import TOLERANCES, page, runs_frame
from comparison.tables.table import Table


def test_a_refusal_and_a_run_that_stopped_are_shown_with_their_reason():
    refused = Outcome("bad input", "contact.law = 'foundation' is not simulated")
    partial = Table(
        pd.DataFrame({"time": [0.0, 0.1], "energy_residual": [0.0, -5.0], "slider_x": [0.0, 1.0]}),
        pd.DataFrame(
            {"corner": ["ll"], "start": [0.0], "end": [0.1], "peak_force": [3.0], "largest_depth": [1e-6]}
        ),
        {"slider_vx": {"min": -2.0, "max": 1.0}},
    )
    stopped = Outcome("work-limit", "shorten drive.cycles", partial=partial)
    results = {
        (law, "reference", tolerance): refused if law == "foundation" else stopped
        for law, each in TOLERANCES.items()
        for tolerance in each
    }
    frame = runs_frame(results).drop_duplicates("law").set_index("law")
    assert (frame["spurious_energy_J"]["hertz-corners"], frame["speed_of_x_m/s"]["hertz-corners"]) == (5, 2)
    assert pd.isna(frame["force_N"]["foundation"])
    hertz, foundation, *literal = page(results)["runs"].splitlines()[2:]
    assert hertz.endswith("| work-limit at 0.1000 s |")
    assert foundation.endswith("| not simulated: contact.law = 'foundation' is not simulated |")
    assert len(literal) == 4
