"""Runs that fail for real: faults inside Exudyn, settings that nothing can meet (tests/cli has fake ones)."""

import numpy as np
import pytest

from comparison.execution.run import Job, run_all
from comparison.scene import load_scene

SHORT = {"drive.cycles": 0.1}
# Exudyn's reactions need constraints at velocity level, whose iteration has no relative tolerance: with a
# friction of 2 it fails in the first contact.
REACTIONS = SHORT | {"output.groups": ["joints"]}


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
