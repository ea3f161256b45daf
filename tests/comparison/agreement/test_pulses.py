"""Contacts resolved in time: enough points, the event table's peak, and no word in any verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.agreement.cross_check import validate
from comparison.agreement.dense_run import DenseRun, dense, measure
from comparison.agreement.pulses import PEAK, POINTS, drawable, noted, resolved
from comparison.execution.job import MODELS
from comparison.execution.run import run_one
from comparison.metrics.impacts import WINDOW
from comparison.scene import load_scene
from comparison.tables.table import Table


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


@pytest.mark.parametrize("model", MODELS)
def test_every_pulse_of_a_dense_run_has_twenty_points_and_the_peak_of_the_event_table(model):
    # The first impacts, some of them chatter; of exudyn five bodies, whose steps end at samples.
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1})
    base = run_one(scene, model)
    assert base.events is not None
    closer = dense(scene.data, base.events)
    assert closer is not None
    row = measure(DenseRun(closer, model), lambda _: None)
    pulses = drawable(row["contacts"], base.events, WINDOW * scene.period)
    # All of them: before the motion becomes unpredictable both runs have the same contacts. Of the last one,
    # which may last at the end, the runs need not see the same part.
    assert {pulse.row for pulse in pulses} >= set(range(len(base.events) - 1))
    assert len(pulses) >= 5
    for pulse in pulses:
        event = base.events.iloc[pulse.row]
        assert pulse.time.size >= POINTS == 20
        assert pulse.force.max() == pytest.approx(event["peak_force"], rel=PEAK)
        assert PEAK == 0.01
        assert np.all(np.diff(pulse.time) > 0.0)
        # The touch of either run is the pulse's own zero of time; the force vanishes at both ends.
        assert 0.0 <= pulse.time[0] < pulse.time[-1] <= 1.01 * (event["end"] - event["start"])


def test_a_dense_run_differs_from_the_base_in_its_output_alone(events):
    scene = load_scene("300rpm-0.2mm")
    closer = dense(scene.data, events)
    assert closer is not None
    changed = {"scene", "output", "drive"}
    assert {k: v for k, v in closer.data.items() if k not in changed} == {
        k: v for k, v in scene.data.items() if k not in changed
    }
    assert closer.data["drive"] == scene.data["drive"]
    interval = closer.period / closer.data["output"]["samples_per_cycle"]
    assert 2e-4 / interval >= POINTS + 2  # a sample at either end may be lost
    # The steps between samples, 400 of them, remain as they are.
    assert 1000 % (closer.data["output"]["samples_per_cycle"] // 1000) == 0


def test_a_long_run_is_cut_and_without_contacts_at_corners_there_is_none(events):
    long = load_scene("150rpm-0.2mm", {"drive.cycles": 100.0})
    closer = dense(long.data, events)
    assert closer is not None
    assert closer.data["drive"]["cycles"] * closer.data["output"]["samples_per_cycle"] <= 400_000
    assert dense(long.data, events.iloc[:0]) is None
    assert dense(long.data, events.assign(corner="pin")) is None
    assert dense(None, events) is None
    assert dense(long.data, None) is None


@pytest.mark.parametrize(
    ("found", "rows"),
    [
        ([contact()], [0]),
        ([contact(start=0.01 + 1e-5)], [0]),
        ([contact(count=POINTS)], [0]),
        ([contact(count=POINTS - 1)], []),
        ([contact(peak=40.3)], [0]),
        ([contact(peak=40.5)], []),
        ([contact(peak=0.0)], []),
        ([contact(corner="ur")], []),
        ([contact(start=0.011)], []),
        ([contact(), contact(start=0.02, corner="ur")], [0, 1]),
        ([], []),
    ],
)
def test_a_contact_is_drawn_where_both_runs_have_it_with_the_same_peak(events, found, rows):
    assert [pulse.row for pulse in drawable(found, events, window=8e-5)] == rows


def pulse_columns(of: dict[str, object], row: int) -> dict[str, np.ndarray]:
    """The columns of one contact in a table."""
    time, force = (np.array(of[name]) for name in ("time", "force"))
    return {"row": np.full(time.size, row), "time": of["start"] + time, "force": force}


@pytest.mark.parametrize(
    ("count", "peak", "drawn"), [(30, 40.0, 1), (20, 40.3, 1), (19, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)]
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
        np.testing.assert_allclose(pulse.time, found["time"], rtol=0, atol=1e-17)
        np.testing.assert_array_equal(pulse.force, found["force"])


@pytest.mark.parametrize(
    "changes",
    [
        {"solver.exudyn.formulation": "full"},
        {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-9},
        # A side is one contact
        {"solver.exudyn.formulation": "tree", "contact.law": "foundation"},
    ],
)
def test_what_a_model_notes_is_what_dense_output_shows(changes):
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1, **changes})
    base = run_one(scene, "exudyn")
    closer = dense(scene.data, base.events)
    assert closer is not None
    row = measure(DenseRun(closer, "exudyn"), lambda _: None)
    shown = {p.row: p for p in drawable(row["contacts"], base.events, WINDOW * scene.period)}
    own = {pulse.row: pulse for pulse in noted(base)}
    assert own.keys() == shown.keys()
    assert len(own) >= 5
    for number, pulse in own.items():
        force = np.interp(shown[number].time, pulse.time, pulse.force)
        # Samples of either envelope are up to two of 16 parts apart, over which a line misses a half sine by
        # (pi / 8)^2 / 8 of its peak, 0.019
        np.testing.assert_allclose(force, shown[number].force, rtol=0, atol=0.04 * pulse.force.max())


@pytest.mark.usefixtures("fake_models")
def test_without_a_matching_or_a_successful_dense_run_nothing_is_drawn(scene, gravity):
    (good,) = validate([scene], n_jobs=2, tiers=("standard",))
    found = resolved([good], 2)
    # The fakes' samples reach 20 N of the 40 N in their event table: nothing may be drawn from these.
    assert found == {(scene.name, "standard"): ([], [])}
    base = good.runs["exudyn"].base
    failing = scene.with_values({"environment.gravity": gravity.fail})
    broken = replace(base, provenance=base.provenance | {"scene": failing.data})
    spoilt = replace(good, runs=good.runs | {"exudyn": replace(good.runs["exudyn"], base=broken)})
    assert resolved([spoilt], 2) == found
    # With pulses in its table no run is needed.
    assert base.events is not None
    columns = pulse_columns(contact(start=float(base.events["start"][0])), row=0)
    own = replace(
        good, runs=good.runs | {"exudyn": replace(good.runs["exudyn"], base=replace(broken, pulses=columns))}
    )
    reference, exudyn = resolved([own], 2)[scene.name, "standard"]
    assert (list(reference), [pulse.row for pulse in exudyn]) == ([], [0])
