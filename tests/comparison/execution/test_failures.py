"""Runs that fail for real: faults inside Exudyn, settings that nothing can meet (tests/cli has fake ones)."""

import numpy as np
import pytest

from comparison.execution.run import Job, run_all, run_uncached
from comparison.scene import load_scene

SHORT = {"drive.cycles": 0.1}
# Exudyn's reactions need constraints at velocity level, whose iteration has no relative tolerance: with a
# friction of 2 it fails in the first contact.
REACTIONS = SHORT | {"output.groups": ["joints"]}
FAULTY = """
from exudyn_model import simulate as whole
from exudyn_model.five_bodies.slider_contact import SliderPart

made = SliderPart._user_function

def faulty(*arguments):
    force = made(*arguments)
    def later(mbs, t, *rest):
        if t > 0.005:
            raise ArithmeticError("the wall is\\ngone")
        return force(mbs, t, *rest)
    return later

def simulate(scene, *, progress=None):
    SliderPart._user_function = faulty
    try:
        return whole(scene, progress=progress)
    finally:
        SliderPart._user_function = made
"""


@pytest.mark.usefixtures("own_cache")
def test_an_exception_inside_exudyns_user_function_is_one_line_and_spoils_no_later_run(install):
    install("faulty_press", FAULTY, {"faulty": "faulty_press:simulate"})
    # The second is expected to take less time, and so comes after the fault in the same process.
    jobs = [
        Job(load_scene("150rpm-0.2mm", {"drive.cycles": cycles}), model)
        for model, cycles in (("faulty", 0.1), ("exudyn", 0.04))
    ]
    result, sound = run_all(jobs, 1)
    assert (result.status, result.message) == ("crashed", "ArithmeticError: the wall is gone")
    assert result.traceback.startswith("Traceback")
    assert sound.table.frame.equals(run_uncached(jobs[1]).table.frame)


@pytest.mark.usefixtures("own_cache")
def test_an_iteration_that_does_not_converge_is_a_status_and_keeps_what_was_computed():
    values = REACTIONS | {"friction.coefficient": 2.0}
    scenes = load_scene("150rpm-0.2mm", values), load_scene("150rpm-0.2mm", REACTIONS)  # at 0.15: it helps
    outcome, sound = run_all([Job(scene, "exudyn") for scene in scenes], 1)
    assert (outcome.status, outcome.table) == ("newton-failed", None)
    assert outcome.message.startswith("raise solver.exudyn.tolerance if below 1e-8, ")
    assert outcome.message.endswith("where friction.coefficient is above 1, lower it")
    until = len(outcome.partial.frame)
    assert 1 < until < len(sound.table.frame)
    # It stops in the first contact, before which there is no friction.
    assert np.array_equal(outcome.partial.values("slider_x"), sound.table.values("slider_x")[:until])
    assert outcome.partial.provenance["scene"]["drive"]["cycles"] == 0.1
