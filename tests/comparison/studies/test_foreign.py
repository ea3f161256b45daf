"""The study `foreign`: its solvers and its truth against closed forms, its counts, its page."""

import numpy as np
import pandas as pd
import pytest

from comparison.studies.foreign.study import STUDY, Extent, lead, measure, until_is_late
from comparison.studies.foreign.systems import SYSTEMS
from comparison.studies.foreign.truth import Truth

BY_NAME = {system.name: system for system in SYSTEMS}


def exact_ball(times, height, g, restitution):
    """Return height and velocity of a ball that falls from rest and bounces, in closed form."""
    start, speed = -np.sqrt(2 * height / g), np.sqrt(2 * g * height)  # of a flight that would begin at 0
    states = []
    for t in times:
        while t > start + 2 * speed / g:
            start, speed = start + 2 * speed / g, restitution * speed
        flight = t - start
        states.append((speed * flight - g * flight**2 / 2, speed - g * flight))
    return np.array(states)


def test_the_solvers_and_the_truth_follow_a_closed_form():
    system = BY_NAME["Bouncing ball"]
    reference = exact_ball(system.times, 1.0, **system.parameters)
    run = system.side("DOP853", system.start, system.parameters)(1e-11, np.zeros(len(system.start)))
    # Tolerances of 1e-11 on values of about 1, over some hundred steps.
    assert np.abs(run.drop(columns="time").to_numpy() - reference).max() < 1e-8
    pytest.importorskip("heyoka", reason="the truth is computed by heyoka")
    # The closed form itself is rounded to some 1e-15 a bounce.
    assert np.abs(Truth(system).states(system.start) - reference).max() < 1e-12


@pytest.mark.parametrize(
    ("until", "is_late", "factor"), [(4.0, False, np.e), (5.05, False, 1.0), (5.2, True, 1.0)]
)
def test_until_is_late_only_behind_a_window_after_a_run_parts(until, is_late, factor):
    rows = pd.DataFrame([{"until": until, "parted": 5.0, "window": 0.1, "exponent": 1.0}])
    assert until_is_late(rows).tolist() == [is_late]
    assert np.exp(np.maximum(lead(rows), 0.0)).tolist() == pytest.approx([factor])


def test_a_page_of_one_system_is_whole(tmp_path):
    pytest.importorskip("heyoka", reason="the truth is computed by heyoka")
    results = measure(Extent([BY_NAME["Relaxation to a sine"]], 1), 1, None)
    assert results.failures == []
    clean, faults = (results.rows[results.rows["fault"].eq(0.0) == same] for same in (True, False))
    assert set(clean["verdict"]) == {"agree"}
    assert set(faults["verdict"]) == {"differ"}
    assert (clean["until"] == 50.0).all()
    page = STUDY.report(results, tmp_path)
    assert "| Relaxation to a sine | 3 |" in page.read_text("utf-8")
