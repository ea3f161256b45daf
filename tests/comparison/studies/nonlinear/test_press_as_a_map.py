"""The press in stages from flight to flight, and what it remembers while it rests."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.studies.nonlinear.press import (
    SHORTEST,
    STATE,
    Press,
    free,
    scale,
    states,
)
from comparison.tables.table import Table

PER_CYCLE = 200


@pytest.fixture(scope="module")
def scene():
    values = {"drive.cycles": 2.0, "output.groups": ["corners"], "output.samples_per_cycle": PER_CYCLE}
    return load_scene("150rpm-0.2mm", values | {"solver.reference.tolerance": 1e-12})


def test_stages_from_flight_to_flight_are_the_run(scene):
    run = run_one(scene, "reference")
    press = Press(scene, partial(run_one, model="reference"))
    whole, flying = states(run, scene), free(run, scene)
    when, stages = int(np.argmax(flying)), 0
    while when < PER_CYCLE:
        state, end = press.orbit(whole[when], when)
        assert end - when >= SHORTEST * PER_CYCLE
        assert flying[end]
        # A state in the table is rounded to 1e-16 m; an impact makes 1e-12 m of that (its force changes by
        # 1e7 N a metre), and a stage through the chatter multiplies it by up to 1e4.
        assert np.linalg.norm((state - whole[end]) * scale(scene)) < 1e-7
        assert press.perturbed(whole[when], when, end).tolist() == state.tolist()
        when, stages = end, stages + 1
    # The rest at the wall takes a quarter of the cycle in one stage.
    assert 5 <= stages <= 1 / SHORTEST
    # Just after the rest the slider crosses its clearance and meets nothing: rounding is left, and the local
    # errors of some steps at 1e-12 rad x 0.24 m.
    begin = next(k for k in range(round(0.82 * PER_CYCLE), PER_CYCLE) if flying[k : k + 5].all())
    apart = (press.perturbed(whole[begin], begin, begin + 4) - whole[begin + 4]) * scale(scene)
    assert np.linalg.norm(apart) < 1e-12


def test_backwards_the_crank_angle_goes_backwards(scene):
    asked = []

    def note(asked_scene):
        asked.append(asked_scene.data)
        return Table(pd.DataFrame({name: [1.0] for name in STATE}))

    Press(scene.with_values({"drive.speed_rpm": -150.0}), note).perturbed(
        np.zeros(4), 3 * PER_CYCLE + 50, 3 * PER_CYCLE + 90
    )
    assert asked[0]["mechanism"]["crank_angle_deg"] == pytest.approx(111.36 - 90.0)
    assert asked[0]["drive"]["cycles"] == pytest.approx(0.2)
