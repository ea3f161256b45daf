"""The press in stages from flight to flight, and what it remembers while it rests."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.studies.nonlinear.press import (
    CLEAR_OF_WALLS,
    LATER,
    RESTING,
    SHORTEST,
    STATE,
    Press,
    by_cycle,
    gaps,
    remembered,
    scale,
    states,
)
from comparison.tables.table import Table

PER_CYCLE = 200


@pytest.fixture(scope="module")
def scene():
    values = {"drive.cycles": 2.0, "output.groups": ["corners"], "output.samples_per_cycle": PER_CYCLE}
    return load_scene("150rpm-0.2mm", values | {"solver.reference.tolerance": 1e-12})


@pytest.fixture(scope="module")
def run(scene):
    return run_one(scene, "reference")


def test_stages_from_flight_to_flight_are_the_run(scene, run):
    press = Press(scene, partial(run_one, model="reference"))
    whole, gap = states(run, scene), gaps(run)
    when, stages = int(np.argmax(gap > CLEAR_OF_WALLS * 2e-4)), 0
    while when < PER_CYCLE:
        state, end = press.orbit(whole[when], when)
        assert end - when >= SHORTEST * PER_CYCLE
        assert gap[end] > CLEAR_OF_WALLS * 2e-4 - 1e-7
        # A state in the table is rounded to 1e-16 m; an impact makes 1e-12 m of that (its force changes by
        # 1e7 N a metre), and a stage through the chatter multiplies it by up to 1e4.
        assert np.linalg.norm((state - whole[end]) * scale(scene)) < 1e-7
        assert press.perturbed(whole[when], when, end).tolist() == state.tolist()
        when, stages = end, stages + 1
    # The rest at the wall takes a quarter of the cycle in one stage.
    assert 5 <= stages <= 1 / SHORTEST


def test_a_stage_in_free_flight_is_the_run_to_rounding(scene, run):
    whole, gap = states(run, scene), gaps(run)
    free = np.flatnonzero(
        (gap[:-4] > 0) & (gap[1:-3] > 0) & (gap[2:-2] > 0) & (gap[3:-1] > 0) & (gap[4:] > 0)
    )
    press = Press(scene, partial(run_one, model="reference"))
    # Just after the rest: the slider crosses its clearance and meets nothing.
    begin = int(free[np.argmax(free > 0.82 * PER_CYCLE)])
    apart = (press.perturbed(whole[begin], begin, begin + 4) - whole[begin + 4]) * scale(scene)
    # Rounding of the states, and the local errors of some steps at 1e-12 rad x 0.24 m.
    assert np.linalg.norm(apart) < 1e-12


def test_backwards_the_crank_angle_goes_backwards(scene):
    asked = []

    def note(asked_scene):
        asked.append(asked_scene.data)
        names = (*(f"corner_{corner}_gap" for corner in ("ll", "lr", "ul", "ur")), *STATE)
        return Table(pd.DataFrame({name: [1.0] for name in names}))

    Press(scene.with_values({"drive.speed_rpm": -150.0}), note).perturbed(
        np.zeros(4), 3 * PER_CYCLE + 50, 3 * PER_CYCLE + 90
    )
    assert asked[0]["mechanism"]["crank_angle_deg"] == pytest.approx(111.36 - 90.0)
    assert asked[0]["drive"]["cycles"] == pytest.approx(0.2)


def resting(scene, cycles, known):
    """A table whose states after a rest follow from the impact speeds, or not."""
    rng = np.random.default_rng(2)
    speeds = rng.uniform(1e-4, 2e-3, size=(cycles, 2))
    count = cycles * PER_CYCLE + 1
    columns = {"time": np.arange(count) * scene.period / PER_CYCLE}
    made = 1e-14 / speeds @ rng.normal(size=(2, 4)) if known else 1e-11 * rng.normal(size=(cycles, 4))
    for k, name in enumerate(("slider_x", "slider_angle", "slider_vx", "slider_omega")):
        values = np.zeros(count)
        for angle in LATER:
            ahead = 1 if angle < RESTING else 0
            at = (np.arange(cycles - ahead) + ahead) * PER_CYCLE + round(angle * PER_CYCLE)
            values[at] = made[: cycles - ahead, k]
        columns[name] = values + (scene.data["mechanism"]["guide_x"] if k == 0 else 0.0)
    begin = (np.arange(cycles) + 0.6) * scene.period
    events = pd.concat(
        [
            pd.DataFrame(
                {"corner": corner, "start": begin, "end": begin + 0.21 * scene.period, "normal_speed": v}
            )
            for corner, v in zip(("lr", "ur"), speeds.T, strict=True)
        ]
    )
    return Table(pd.DataFrame(columns), events)


@pytest.mark.parametrize("known", [True, False])
def test_what_follows_from_the_impact_speeds_is_distinguished_from_what_does_not(scene, known):
    found = remembered(resting(scene, 60, known), scene, 2)
    assert len(found) == 4 * len(LATER)
    for of in found:
        # Of chance two regressors explain 2 of 57 degrees of freedom: 4 %, 20 % with a probability below
        # 1e-2. x is a difference from 0.55 m, rounded at 1e-16 of 1e-11.
        assert of.explained > 0.9999 if known else of.explained < 0.25


def test_without_a_rest_there_is_nothing_to_remember(scene):
    table = resting(scene, 20, True)
    assert table.events is not None
    late = Table(table.frame, table.events[table.events["corner"] == "lr"])
    assert remembered(late, scene, 2) == []
    assert by_cycle(states(late, scene), scene).shape == (20, PER_CYCLE, 4)
