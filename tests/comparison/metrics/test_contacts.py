"""Contacts matched one by one, their situations and their forces, on tables of which these are known.

Random tables are compared a second way in tests/judge/test_second_opinion.py.
"""

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of

from comparison.execution.run import run_one
from comparison.metrics import (
    PULSE_POINTS,
    pulses_of,
    time_shares,
)
from comparison.scene import load_scene
from comparison.tables.channels import touching
from comparison.tables.table import Table

CORNERS = ("ll", "lr", "ul", "ur")
END = 8.0


def shares(events):
    return list(time_shares(events, (0.0, END)).values())


@pytest.mark.parametrize(
    ("rows", "eighths"),
    [
        ([("ll", 1, 5), ("ul", 3, 6)], [3, 3, 2, 0]),
        ([("lr", 1, 5), ("ur", 5, 6)], [3, 5, 0, 0]),  # touching ends: never both
        ([("ur", 0, 2), ("ur", 2, 3)], [5, 3, 0, 0]),  # one corner's contacts that touch
        ([("ul", 1, 4), ("ul", 3, 5)], [4, 4, 0, 0]),  # or overlap
        ([("ll", 1, 5), ("ur", 3, 6)], [3, 3, 0, 2]),  # a diagonal
        ([("ul", 0, 8), ("lr", 0, 8)], [0, 0, 0, 8]),
        ([("ll", 1, 6), ("ul", 2, 5), ("ur", 4, 7)], [2, 2, 2, 2]),  # three corners touch both walls
        ([("ll", -1, 1), ("ur", 7, 9)], [6, 2, 0, 0]),  # what is outside the run does not count
        # The journal at A is no corner.
        ([("pin", -1, 1), ("pin", 1, 4), ("pin", 3, 5)], [8, 0, 0, 0]),
    ],
)
def test_hand_made_tables(rows, eighths):
    # Sums of at most some ten quotients of binary fractions: a few units of the last place.
    assert shares(contacts_of(*rows)) == pytest.approx([n / 8 for n in eighths], rel=0, abs=1e-15)


def test_a_count_over_fine_samples_comes_to_the_same():
    rng, count = np.random.default_rng(3), 200_000
    edges = {corner: np.sort(rng.uniform(0, END, 2 * rng.integers(0, 40))) for corner in CORNERS}
    at = (np.arange(count) + 0.5) * END / count
    ll, lr, ul, ur = (np.searchsorted(own, at, side="right") % 2 == 1 for own in edges.values())
    both, free = (ll | ul) & (lr | ur), ~(ll | lr | ul | ur)
    one_side = ((ll & ul) | (lr & ur)) & ~both
    sampled = [free.mean(), 1 - free.mean() - one_side.mean() - both.mean(), one_side.mean(), both.mean()]
    events = contacts_of(*[(corner, *pair) for corner, own in edges.items() for pair in own.reshape(-1, 2)])
    # Every one of at most 320 edges may be off by half a sample.
    assert shares(events)[:4] == pytest.approx(sampled, abs=160 / count)


def test_the_wedge_scene_visits_all_situations_and_the_papers_case_never_two_opposite_corners():
    result = {}
    for name in ("wedge", "150rpm-0.2mm"):
        scene = load_scene(name)
        result[name] = time_shares(run_one(scene, "reference").events, (0.0, scene.duration))
    assert min(result["wedge"].values()) > 0.02
    assert result["150rpm-0.2mm"].pop("opposite") == 0.0
    assert min(result["150rpm-0.2mm"].values()) > 0.0


@pytest.mark.parametrize(
    ("count", "peak", "drawn"),
    [(30, 40.0, 1), (20, 40.3, 1), (5, 40.0, 1), (4, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)],
)
def test_what_a_table_has_of_a_contact_is_drawn_with_enough_points_and_the_same_peak(count, peak, drawn):
    start = np.array([0.01, 0.02])
    events = pd.DataFrame({"corner": ["ll", "ur"], "start": start, "end": start + 2e-4, "peak_force": 40.0})
    phase = np.linspace(0.0, 1.0, count)
    time, force = 1e-6 + 2e-4 * phase, peak * np.sin(np.pi * phase)  # the touch is inside a step
    force[count // 2] = peak
    columns = {"row": np.full(count, 1), "time": 0.02 + time, "force": force}
    pulses = pulses_of(Table(pd.DataFrame({"time": [0.0, 1.0]}), events, pulses=columns))
    assert [pulse.row for pulse in pulses] == [1] * drawn
    for pulse in pulses:
        every = (pulse.time.size - 1) // (count - 1)
        # Differences of times of 0.02 s, rounded at 3.5e-18 s each
        np.testing.assert_allclose(pulse.time[::every], time, rtol=0, atol=1e-17)
        # A spline's nodes round at 1e-16 of the largest
        np.testing.assert_allclose(pulse.force[::every], force, rtol=0, atol=1e-15 * peak)
        assert pulse.time.size >= PULSE_POINTS
        assert pulse.force.max() == force.max()  # the spline is monotone between points


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        ("reference", {}),
        ("exudyn", {"solver.exudyn.formulation": "full"}),
        # A side is one contact
        ("exudyn", {"solver.exudyn.formulation": "tree", "contact.law": "foundation"}),
    ],
)
def test_what_a_model_notes_is_what_samples_inside_contacts_show(model, changes):
    # The first impacts, some of them chatter; later ones of another sampling are other ones
    values = {"drive.cycles": 0.1, "output.groups": ["corners"], **changes}
    base = run_one(load_scene("150rpm-0.2mm", values), model)
    dense = run_one(load_scene("150rpm-0.2mm", {**values, "output.samples_per_cycle": 50_000}), model)
    pulses = pulses_of(base)
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
        assert pulse.force.max() == pytest.approx(event["peak_force"], rel=0.01)
        assert np.all(np.diff(pulse.time) > 0.0)
        # The pulse's zero of time is the touch
        assert 0.0 <= pulse.time[0] < pulse.time[-1] <= 1.0001 * (event["end"] - event["start"])
