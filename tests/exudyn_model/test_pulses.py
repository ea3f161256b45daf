"""Forces of the contacts in time: of every contact, from touch to separation, and those of its row."""

import numpy as np
import pytest

from exudyn_model import simulate, tables

CORNERS = ("ll", "lr", "ul", "ur")


def by_contact(result):
    """Times and forces of each contact at a corner, by row; all of them have some."""
    rows = np.flatnonzero(np.isin(result.events["corner"], CORNERS))
    assert np.unique(result.pulses["row"]).tolist() == rows.tolist()
    assert result.pulses["row"].dtype == np.int64
    edges = np.searchsorted(result.pulses["row"], [rows, rows + 1]).T
    return {
        row: tuple(result.pulses[name][slice(*edge)] for name in ("time", "force"))
        for row, edge in zip(rows.tolist(), edges.tolist(), strict=True)
    }


# Each formulation, each law; the impact of a whole side is twenty times as short
RUNS = {
    "full": ({}, None),
    "tree": ({}, 1e-10),
    "loose": ({}, 1e-6),
    "foundation": ({"contact.law": "foundation", "solver.exudyn.step": 1e-7}, None),
    "foundation-tree": ({"contact.law": "foundation"}, 1e-10),
    "pin": ({"joints.crank_pin": "clearance", "clearance.crank_pin": 1e-4}, 1e-8),
}


@pytest.mark.parametrize("name", RUNS)
def test_every_contact_has_a_pulse_whose_peak_and_impulse_are_those_of_its_row(run, name):
    changes, tree = RUNS[name]
    result = run(changes, {"drive.cycles": 0.15}, tree=tree)
    assert result.status == "success"
    computed = by_contact(result)
    assert len(computed) >= 5
    for row, (time, force) in computed.items():
        event = {name: column[row] for name, column in result.events.items()}
        start, end = event["start"], event["end"]
        assert np.all(np.diff(time) > 0.0)
        assert np.all(force >= 0.0)
        # The longest step in a contact, of the loose tree
        reach = 0.15 * (end - start)
        assert start <= time[0] < start + reach
        assert end - reach < time[-1] <= end
        assert time.size >= 10
        assert force.max() <= event["peak_force"]
        # Of a tree the row has it at quarters of steps, the pulse after 20 steps at their ends: it lies
        # there in contacts of 40 steps and more, of which a half sine is 1 - cos(pi / 80) = 8e-4 below
        assert force.max() == pytest.approx(event["peak_force"], rel=1e-3)
        # Of a half sine the trapezoids of ten samples miss (pi / 10)^2 / 12 = 0.8 %, unequal ones more
        last = force[-1] if end == time[-1] else 0.0
        impulse = np.trapezoid([0.0, *force, last], [start, *time, end])
        assert impulse == pytest.approx(event["impulse"], rel=0.02)


def test_it_is_the_sum_of_the_corners_forces_at_the_samples(run):
    """Under the law foundation a side is one contact: samples 1 us apart, of five bodies."""
    changes = {"contact.law": "foundation", "drive.cycles": 0.06, "solver.exudyn.step": 5e-7}
    dense = {"output.samples_per_cycle": 400_000, "output.groups": ["corners"]}
    result = run(changes, dense)
    columns, shared = result.columns, 0
    for row, (time, force) in by_contact(result).items():
        corner = result.events["corner"][row]
        normals = [columns[f"corner_{end}{corner[1]}_normal"] for end in "lu"]
        inside = (columns["time"] > time[0]) & (columns["time"] < time[-1])
        shared += np.any((normals[0][inside] > 0.0) & (normals[1][inside] > 0.0))
        at_samples = np.interp(columns["time"][inside], time, force)
        # In contacts samples are states: their times may be rounded differently, by 1e-15 of 1e-6 s
        np.testing.assert_allclose(at_samples, sum(normals)[inside], rtol=0, atol=1e-9 * force.max())
    assert shared > 0


@pytest.mark.parametrize("tree", [None, 1e-9])
def test_a_corner_pressed_in_at_the_start_has_its_force_at_once(run, tree):
    """5 um inside the right wall: the largest force of the run's first contacts is at t = 0."""
    result = run({"drive.cycles": 0.01, "initial.slider_offset": 2.05e-4}, tree=tree)
    time, force = by_contact(result)[0]
    assert time[0] == 0.0
    assert force[0] == result.events["peak_force"][0] == force.max()


def test_without_room_later_contacts_have_none_and_the_run_is_the_same(make_scene, monkeypatch):
    scene = make_scene({"drive.cycles": 0.3}, tree=1e-9)
    whole = simulate(scene)
    count = 300
    monkeypatch.setattr(tables, "_NOTES", count)
    cut = simulate(scene)
    for name, column in whole.events.items():
        np.testing.assert_array_equal(cut.events[name], column)
    lost = np.setdiff1d(whole.pulses["row"], cut.pulses["row"])
    assert 0 < lost.size < len(whole.events["start"])
    for corner in np.unique(whole.events["corner"][lost]):
        rows = np.flatnonzero(whole.events["corner"] == corner)
        have = np.isin(rows, cut.pulses["row"])
        assert have.tolist() == sorted(have, reverse=True)  # the first ones
        sizes = np.bincount(whole.pulses["row"])[rows]
        assert sizes[have].sum() < count <= sizes[: have.sum() + 1].sum()
    kept = np.isin(whole.pulses["row"], cut.pulses["row"])
    for name, column in cut.pulses.items():
        np.testing.assert_array_equal(column, whole.pulses[name][kept])


def test_a_time_is_noted_once_and_neither_what_is_no_number_nor_what_follows_a_contact():
    contacts = tables.Contacts(CORNERS, shared=False)
    contacts.note(1, np.array([0.1, 0.1, 0.2, 0.25, 0.3]), np.array([1.0, 1.0, 2.0, 0.0, np.nan]))
    events = {
        "corner": np.array(["ul", "lr", "lr"]),
        "start": np.array([0.05, 0.1, 0.3]),
        "end": np.array([0.4, 0.2, 0.4]),
    }
    assert {name: column.tolist() for name, column in contacts.pulses(events).items()} == {
        "row": [1, 1], "time": [0.1, 0.2], "force": [1.0, 2.0]
    }  # fmt: skip


def test_an_ideal_slider_has_none(run):
    pulses = run({"drive.cycles": 0.01, "joints.slider": "ideal"}).pulses
    assert {name: column.size for name, column in pulses.items()} == {"row": 0, "time": 0, "force": 0}
