"""Contacts resolved in time: enough points, the event table's peak, and no word in any verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.agreement.cross_check import validate
from comparison.agreement.dense_run import DenseRun, dense, measure, thinned
from comparison.agreement.pulses import PEAK, POINTS, drawable, resolved
from comparison.execution.job import MODELS
from comparison.execution.run import run_one
from comparison.metrics.impacts import WINDOW
from comparison.scene import load_scene


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
@pytest.mark.parametrize("tier", ["standard", "tight"])
def test_every_drawn_pulse_has_twenty_points_and_the_peak_of_the_event_table(model, tier):
    # The first impacts, some of them chatter; five bodies, whose steps end at samples, and the tree.
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1})
    if tier == "tight" and model == "exudyn":
        scene = scene.with_values({"solver.exudyn.formulation": "tree"})
    base = run_one(scene, model)
    assert base.events is not None
    closer = dense(scene.data, base.events, model)
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
    closer = dense(scene.data, events, "reference")
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


def test_five_bodies_take_the_steps_of_the_base_run(events):
    """With two of them or more between samples, and a sample at each of the base run."""
    scene = load_scene("300rpm-0.2mm", {"solver.exudyn.formulation": "full", "solver.exudyn.step": 4e-6})
    closer = dense(scene.data, events.assign(end=events["start"] + 1e-5), "exudyn")
    assert closer is not None
    assert closer.data["solver"] == scene.data["solver"]
    # 50 steps of 4e-6 s in an interval of 2e-4 s
    assert closer.data["output"]["samples_per_cycle"] == 25 * 1000


def test_a_long_run_is_cut_and_without_contacts_at_corners_there_is_none(events):
    long = load_scene("150rpm-0.2mm", {"drive.cycles": 100.0})
    closer = dense(long.data, events, "reference")
    assert closer is not None
    assert closer.data["drive"]["cycles"] * closer.data["output"]["samples_per_cycle"] <= 400_000
    assert dense(long.data, events.iloc[:0], "exudyn") is None
    assert dense(long.data, events.assign(corner="pin"), "exudyn") is None
    assert dense(None, events, "exudyn") is None
    assert dense(long.data, None, "exudyn") is None


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


def test_thinning_keeps_the_ends_and_the_envelope_and_of_a_long_contact_the_impact():
    for count in (2, 20, 32):
        assert thinned(np.ones(count)).tolist() == list(range(count))
    force = np.sin(np.linspace(0.0, np.pi, 301))
    kept = thinned(force)
    assert POINTS <= kept.size <= 34
    assert {0, 150, 300} <= set(kept.tolist())
    long = np.exp(-np.arange(50_000) / 200.0) * (1.0 + np.cos(np.arange(50_000) / 10.0)) + 1.0
    long[30_000] = 9.0
    kept = thinned(long)
    assert kept.size <= 2 + 32 + 2 * 96
    assert {*range(32), 30_000, 49_999} <= set(kept.tolist())


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
