"""Warnings of runs that succeed and mean little."""

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import quality_warnings
from comparison.tables.table import Table


def table(durations=(), depth=1e-6, step=None, forces=1.0, residual=None, loss=1.0, drift=()):
    time = np.linspace(0.0, 1.0, 5)
    frame = pd.DataFrame({"time": time})
    if residual is not None:
        frame["energy_residual"] = residual * np.array([0.0, 0.5, -1.0, 0.2, 0.1])
        frame["energy_damping"], frame["energy_friction"] = 0.25 * loss * time, 0.75 * loss * time
        frame["energy_kinetic"] = 2.0 * np.array([0.1, 1.0, 0.3, 0.2, 0.1])
    events = pd.DataFrame({"corner": ["ll"] * len(durations), "start": 0.0, "end": list(durations)})
    events["largest_depth"], events["peak_force"] = depth, forces
    record = {"settings": {} if step is None else {"step_used": step}}
    record |= {"scene": {"contact": {"corner_radius": 1e-3}}, "constraints": dict(drift)}
    return Table(frame, events=events, extrema={}, provenance=record)


def test_of_a_linkage_each_clearance_has_its_own_radius():
    run = table([1e-4, 1e-4], depth=[1.5e-3, 4e-3])
    run.events["corner"] = ["G.ul", "B"]
    clearance = {"G": {"corner_radius": 2e-3}, "B": {"journal_radius": 5e-3}}
    run.provenance["scene"] = {"body": {}, "contact": {}, "clearance": clearance}
    assert quality_warnings(run) == []
    clearance["B"]["journal_radius"] = 3e-3
    (line,) = quality_warnings(run)
    assert "deeper than its radius clearance.B.journal_radius = 0.003 m" in line


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (table([1e-4] * 3, step=1.1e-5), "last less than 9.1 steps"),
        # One long touch that bears little does not make up for two short hits.
        (table([0.1, 0.2, 0.3, 2e-5, 5e-5], step=1e-5, forces=[0.1, 0.1, 0.1, 2.0, 1.0]), "less than 2"),
        # A share of the dissipated energy, or else of the kinetic one
        (table(residual=0.011), "spurious energy is 1.10"),
        (table(residual=0.03, loss=0.0), "spurious energy is 1.50"),
        (table([1e-4], depth=1.01e-3), "deeper than its radius"),
        (table(drift={"position": 1.1e-6}), "constraints are violated"),
        (table(drift={"position": 0.0, "velocity": 1.1e-3}), "constraints are violated"),
        (table([1e-4], depth=0.0), "largest_depth of all its 1 contacts are zero"),
        # At the limits nothing is doubted, nor are contacts without a fixed step.
        (table([1e-4], 1e-3, 1e-5, residual=0.01, drift={"position": 0.9e-6, "velocity": 0.9e-3}), None),
        (table([3e-6]), None),
    ],
)
def test_each_doubt_is_reported_alone(run, words):
    warnings = quality_warnings(run)
    assert len(warnings) == (words is not None)
    assert all(words in warning for warning in warnings)
