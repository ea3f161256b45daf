"""Contacts resolved in time: enough points, the event table's peak, and no word in any verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.agreement.pulses import PEAK, POINTS, noted
from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.tables.channels import touching
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.validate import validate


def contact(
    start: float = 0.01, count: int = 30, peak: float = 40.0, corner: str = "ll"
) -> dict[str, object]:
    phase = np.linspace(0.0, 1.0, count)
    force = peak * np.sin(np.pi * phase)
    force[count // 2] = peak
    return {"corner": corner, "start": start, "time": list(2e-4 * phase), "force": list(force)}


@pytest.fixture
def events() -> pd.DataFrame:
    start = np.array([0.01, 0.02])
    return pd.DataFrame(
        {"corner": ["ll", "ur"], "start": start, "end": start + 2e-4, "peak_force": [40.0, 40.0]}
    )


def pulse_columns(of: dict[str, object], row: int) -> dict[str, np.ndarray]:
    """The columns of one contact in a table."""
    time, force = (np.array(of[name]) for name in ("time", "force"))
    return {"row": np.full(time.size, row), "time": of["start"] + time, "force": force}


@pytest.mark.parametrize(
    ("count", "peak", "drawn"),
    [(30, 40.0, 1), (20, 40.3, 1), (5, 40.0, 1), (4, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)],
)
def test_what_a_table_has_of_a_contact_is_drawn_with_enough_points_and_the_same_peak(
    events, count, peak, drawn
):
    found = contact(start=0.02, count=count, peak=peak)
    found["time"] = 1e-6 + np.array(found["time"])  # the touch is inside a step
    frame = pd.DataFrame({"time": [0.0, 1.0]})
    pulses = noted(Table(frame, events, pulses=pulse_columns(found, row=1)))
    assert [pulse.row for pulse in pulses] == [1] * drawn
    for pulse in pulses:
        # Differences of times of 0.02 s, rounded at 3.5e-18 s each
        np.testing.assert_allclose(
            pulse.time[:: (pulse.time.size - 1) // (count - 1)], found["time"], rtol=0, atol=1e-17
        )
        # A spline's nodes round at 1e-16 of the largest
        noted_force = pulse.force[:: (pulse.time.size - 1) // (count - 1)]
        np.testing.assert_allclose(noted_force, found["force"], rtol=0, atol=1e-15 * peak)
        assert pulse.time.size >= POINTS
        assert pulse.force.max() == max(found["force"])  # the spline is monotone between points


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        ("reference", {}),
        ("reference", {"solver.reference.formulation": "multiplier"}),
        ("reference", {"contact.law": "foundation"}),
        ("exudyn", {"solver.exudyn.formulation": "full"}),
        ("exudyn", {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-9}),
        # A side is one contact
        ("exudyn", {"solver.exudyn.formulation": "tree", "contact.law": "foundation"}),
    ],
)
def test_what_a_model_notes_is_what_samples_inside_contacts_show(model, changes):
    # The first impacts, some of them chatter; later ones of another sampling are other ones
    values = {"drive.cycles": 0.1, "output.groups": ["corners"], **changes}
    base = run_one(load_scene("150rpm-0.2mm", values), model)
    dense = run_one(load_scene("150rpm-0.2mm", {**values, "output.samples_per_cycle": 50_000}), model)
    assert base.events is not None
    pulses = noted(base)
    # All but the last, which may last at the end
    assert {pulse.row for pulse in pulses} >= set(range(len(base.events) - 1))
    assert len(pulses) >= 5
    for pulse in pulses:
        event = base.events.iloc[pulse.row]
        time = dense.time - event["start"]
        inside = (time >= pulse.time[0]) & (time <= pulse.time[-1])
        sharing = touching(event["corner"], base.provenance["scene"])
        force = np.sum([dense.values(f"corner_{name}_normal")[inside] for name in sharing], axis=0)
        # Points of an envelope are up to two of 16 parts apart, over which a line misses a half sine by
        # (pi / 8)^2 / 8 of its peak, 0.019
        line = np.interp(time[inside], pulse.time, pulse.force)
        np.testing.assert_allclose(line, force, rtol=0, atol=0.04 * pulse.force.max())
        assert pulse.time.size >= POINTS == 20
        assert pulse.force.max() == pytest.approx(event["peak_force"], rel=PEAK)
        assert PEAK == 0.01
        assert np.all(np.diff(pulse.time) > 0.0)
        # The pulse's zero of time is the touch
        assert 0.0 <= pulse.time[0] < pulse.time[-1] <= 1.0001 * (event["end"] - event["start"])


@pytest.mark.usefixtures("fake_models")
def test_without_forces_in_a_table_nothing_is_drawn(scene):
    (good,) = validate([scene], n_jobs=2, tiers=("standard",))
    assert good.comparison.pulses == ([], [])
    run = good.runs["exudyn"]
    assert run.base.events is not None
    columns = pulse_columns(contact(start=float(run.base.events["start"][0])), row=0)
    own = replace(run, base=replace(run.base, pulses=columns))
    reference, exudyn = compare(good.runs["reference"], own, scene=scene).pulses
    assert (list(reference), [pulse.row for pulse in exudyn]) == ([], [0])
