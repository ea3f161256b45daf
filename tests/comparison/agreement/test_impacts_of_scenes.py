"""Impacts of two results of a scene: contacts matched, and where they are predictable."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.metrics.contacts import WINDOW
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, compare
from comparison.words.record import as_mapping

CORNERS = ("ll", "lr", "ul", "ur")
MOTION = ("time", "slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")


def contacts(count: int = 5) -> pd.DataFrame:
    """Contacts at every corner, 0.1 s apart."""
    starts = np.concatenate([np.arange(count) * 0.1 + k * 0.01 for k in range(4)])
    quantities = dict.fromkeys(("normal_speed", "impulse", "peak_force", "largest_depth"), 1.0)
    return pd.DataFrame(
        {"corner": np.repeat(CORNERS, count), "start": starts, "end": starts + 1e-3, **quantities}
    )


def with_events(table: Table, events: pd.DataFrame | None) -> Runs:
    return Runs(Table(table.frame, events))


def moved(events: pd.DataFrame, by: float) -> pd.DataFrame:
    return events.assign(start=events["start"] + by, end=events["end"] + by)


def test_a_comparison_of_scenes_tells_the_impacts(scene, make_table):
    a = moved(contacts(), 0.1)
    window = WINDOW * scene.period
    b = moved(a, 0.9 * window)
    result = compare(with_events(make_table(), a), with_events(make_table(), b), scene=scene, tolerance=1e-3)
    # Without uncertainties nothing tells which part is predictable.
    assert list(result.impacts) == ["all"]
    assert result.impacts["all"].recall == 1.0
    impacts = as_mapping(result)["impacts"]["all"]
    assert (impacts["matched"], impacts["count_a"], impacts["precision"]) == (20, 20, 1.0)
    assert "pairs" not in impacts
    late = moved(a, 1.1 * window)
    result = compare(with_events(make_table(), a), with_events(make_table(), late), scene=scene)
    assert result.impacts["all"].recall == 0.0


@pytest.mark.parametrize("lacking", [0, 1])
def test_a_table_without_events_has_no_impacts(scene, make_table, lacking):
    both = [contacts(), contacts()]
    both[lacking] = None
    result = compare(*(with_events(make_table(), events) for events in both), scene=scene)
    assert result.impacts is None
    assert as_mapping(result)["impacts"] is None


def test_nor_have_tables_of_no_known_speed(make_table):
    run = with_events(make_table(), contacts())
    assert compare(run, run).impacts is None


def test_a_contact_is_predictable_where_the_gap_of_its_corner_is(scene, make_table):
    """Gaps decide for their corners; where there are none, and for the crank pin, x does."""
    names = ["slider_x", *(f"corner_{corner}_gap" for corner in CORNERS)]
    runs = [Table(make_table(part).frame) for part in (1e-6, 2.5e-7, 4e-6, 4e-6)]
    # One finer run is far off in the gap at lower right, in the second half.
    later = runs[1].time > 0.4
    runs[1].frame.loc[later, "corner_lr_gap"] += 1e-3
    start = [0.6, 0.1, 0.6, 0.6]
    events = contacts().iloc[:4].assign(corner=["ll", "lr", "lr", "pin"], start=start, end=0.7)
    run = Runs(Table(runs[0].frame, events), *runs[1:])
    result = compare(run, run, scene=scene)
    assert result.channels["corner_lr_gap"].coverage == pytest.approx(0.5, abs=0.02)
    assert all(result.channels[name].coverage == 1 for name in names if name != "corner_lr_gap")
    part = result.impacts["predictable"]
    assert sorted(part.pairs[:, 0]) == [0, 1, 3]
    without = scene.with_values({"output.groups": []})
    motion = [Table(table.frame[list(MOTION)].copy()) for table in runs]
    motion[1].frame["slider_x"] += 1e-3
    run = Runs(Table(motion[0].frame, events), *motion[1:])
    assert compare(run, run, scene=without).impacts["predictable"].count_a == 0
