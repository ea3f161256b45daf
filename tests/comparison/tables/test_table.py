"""Tables, contacts, pulses and results that cannot be meant are refused, with the place and the rule."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.files import FolderError, check_folder
from comparison.tables.channels import expected
from comparison.tables.result import check_record, thinned
from comparison.tables.table import LARGEST_NUMBER, Table, TableError, check

ROOT = Path(__file__).parents[3]
TIME = np.linspace(-0.5, 1.5, 21)
CONTACT = {
    "corner": "ll", "start": 0.1, "end": 0.2, "normal_speed": 0.1, "impulse": 0.02, "peak_force": 40.0,
    "largest_depth": 1e-6,
}  # fmt: skip


def table(changes: dict[str, object] | None = None, **columns) -> Table:
    frame = pd.DataFrame({"time": TIME, "slider_x": np.sin(TIME)} | columns)
    events = None if changes is None else pd.DataFrame([CONTACT, CONTACT | changes])
    return Table(frame, events)


def pulses(*counts: int) -> dict[str, np.ndarray]:
    """Contacts from the times 1, 2, ... s on for 0.5 s, with so many samples each."""
    force = np.random.default_rng(2).uniform(0.0, 40.0, sum(counts))
    times = [1.0 + number + np.linspace(0.0, 0.5, count) for number, count in enumerate(counts)]
    return {"row": np.repeat(np.arange(len(counts)), counts), "time": np.concatenate(times), "force": force}


def result(contacts: int = 0, **changed) -> SimpleNamespace:
    """A model's result with contacts at the times of `pulses`."""
    start = 1.0 + np.arange(contacts)
    events = {"corner": np.array(["ll"] * contacts), "start": start, "end": start + 0.5} | {
        name: np.ones(contacts) for name in ("normal_speed", "impulse", "peak_force", "largest_depth")
    }
    parts = {
        "columns": {"time": np.linspace(0.0, 10.0, 101), "slider_x": np.zeros(101)},
        "events": events if contacts else {},
        "extrema": {},
        "provenance": {"model": "mine"},
        "status": "success",
        "remedy": "",
    }
    return SimpleNamespace(**(parts | changed))


# Channels and times


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        (lambda f: f.assign(slider_vy=f.slider_vy.where(f.index != 16, np.nan)),
         r"slider_vy is nan in data row 17 \(1 such rows\)"),
        (lambda f: f.assign(slider_vy=f.slider_vy.where(f.index != 16, -np.inf)),
         r"slider_vy is -inf in data row 17 \(1 such rows\)"),
        (lambda f: f.drop(columns=["slider_ax", "corner_ul_gap"]),
         r"channel slider_ax is missing \(and 1 more\)"),
        (lambda f: f.assign(crank_torque=0.0), "channel crank_torque is unexpected"),
        (lambda f: f.assign(time=f.time.where(f.index != 5, f.time[4])), "does not increase in data row 6"),
        (lambda f: f.assign(time=f.time.where(f.index != 5, f.time[4] - 1e-9)), "increase in data row 6"),
        (lambda f: f.iloc[:-1], r"truncated: it spans .* and must span 0 to 0\.8 s"),
        (lambda f: f.iloc[1:], r"truncated: it spans .* and must span 0 to 0\.8 s"),
        (lambda f: f.iloc[:1], "1 data rows; at least 2"),
        (lambda f: f.assign(slider_x=f.time > 9), "slider_x is not a number in data row 1: 'False'"),
        (lambda f: f.assign(slider_x="oops"), "slider_x is not a number in data row 1: 'oops'"),
        (lambda f: f.assign(time=f.time * 1e32), r"time = \S+e\+30 in data row \d+ must be at most 1e\+30"),
        (lambda f: f.assign(slider_x=-1.1e30), r"slider_x = -1.1e\+30 in data row 1 must be at most 1e\+30"),
    ],
)  # fmt: skip
def test_a_table_that_cannot_be_compared_is_refused_by_channel_and_row(scene, make_table, changed, rule):
    wanted, span = expected(scene.data), (0.0, scene.duration)
    check(make_table(), wanted, span)
    with pytest.raises(TableError, match=f"^run: .*{rule}") as refused:
        check(Table(changed(make_table().frame)), wanted, span, name="run")
    assert "\n" not in str(refused.value)


def test_the_largest_number_has_a_square():
    check(table(slider_x=np.full(21, LARGEST_NUMBER)), ["slider_x"])
    assert np.isfinite(np.float32(LARGEST_NUMBER))
    assert np.isfinite(LARGEST_NUMBER**2)


# Contacts


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"start": 0.2},
        {"start": -0.5, "end": 1.5},
        {"end": 1.5 + 0.05},  # half a sample: that of its last sample
        dict.fromkeys(["normal_speed", "impulse", "peak_force", "largest_depth"], 0.0),
    ],
)
def test_contacts_of_a_run_are_accepted(changes):
    check(table(changes), ["slider_x"])


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"corner": "top"}, "t: contact at 'top', which is none of ll, lr, ul, ur, pin"),
        ({"end": 0.05}, "t: contact 2 ends at 0.05 s, before its start at 0.1 s"),
        ({"impulse": -1e-9}, "t: impulse = -1e-09 of contact 2 must be >= 0"),
        ({"normal_speed": -0.1}, "t: normal_speed = -0.1 of contact 2 must be >= 0"),
        ({"peak_force": -1}, "t: peak_force = -1 of contact 2 must be >= 0"),
        ({"largest_depth": -1e-6}, "t: largest_depth = -1e-06 of contact 2 must be >= 0"),
        ({"start": 5.0, "end": 6.0}, "contact 2, 5 to 6 s, is outside the times of the table, -0.5 to 1.5 s"),
        ({"end": 1.6}, "contact 2, 0.1 to 1.6 s, is outside"),
        ({"start": -0.6}, "contact 2, -0.6 to 0.2 s, is outside"),
        ({"impulse": np.inf}, "impulse of contact 2 is not a number: inf"),
    ],
)
def test_contacts_that_cannot_be_meant_are_refused(changes, reported):
    with pytest.raises(TableError) as refused:
        check(table(changes), ["slider_x"], name="t")
    assert reported in str(refused.value)


def test_truth_values_and_a_missing_column_are_no_contacts():
    contacts = table({})
    contacts.events["impulse"] = [True, False]
    with pytest.raises(TableError, match="impulse of contact 1 is not a number: True"):
        check(contacts, ["slider_x"])
    lacking = replace(contacts, events=contacts.events.drop(columns=["impulse", "end"]))
    with pytest.raises(TableError, match=r"its events have no column end \(and 1 more\)"):
        check(lacking, ["slider_x"])


# Results of a model


def test_a_table_holds_the_numbers_of_a_result_and_survives_pickling():
    made = result(2, extrema={"slider_x": {"min": 0.0}}, cycle_extrema={"slider_x_min": np.zeros(2)})
    whole = Table.from_result(made)
    for each in (whole, pickle.loads(pickle.dumps(whole))):  # noqa: S301
        assert (each.names, each.channels) == (["time", "slider_x"], ["slider_x"])
        pd.testing.assert_frame_equal(each.frame, pd.DataFrame(made.columns))
        pd.testing.assert_frame_equal(each.events, pd.DataFrame(made.events))
        assert each.provenance == {"model": "mine", "status": "success", "remedy": ""}
        assert (each.extrema, list(each.cycle_extrema)) == (made.extrema, ["slider_x_min"])
    check(whole, ["slider_x"])
    assert whole.only(["slider_y"]).names == ["time"]
    assert Table.from_result(result()).events is None


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"columns": None}, "result: columns must be a dict, not NoneType"),
        ({"status": 0}, "result: status must be a str, not int"),
        ({"columns": {"time": np.zeros(2), "slider_x": np.zeros(3)}}, "columns are inconsistent: "),
        ({"events": {"corner": np.array(["ll"]), "start": np.zeros(3)}}, "columns are inconsistent: "),
        ({"provenance": {"counters": 5}}, "extrema or provenance: counters must be an object"),
        ({"provenance": {"model": object()}}, "extrema or provenance: "),
        ({"cycle_extrema": [1.0]}, "result: cycle_extrema must be a dict or None, not list"),
        ({"cycle_extrema": {"a": [1.0]}}, "cycle_extrema: a must be an array of real numbers"),
        ({"cycle_extrema": {"a": np.zeros(2), "b": np.zeros(3)}}, "columns differ in length"),
        ({"pulses": [1.0]}, "result: pulses must be a dict or None, not list"),
        ({"pulses": pulses(3) | {"row": np.zeros(3)}}, "row must be an array of integers, shape (n,)"),
        ({"pulses": pulses(3) | {"time": [1.0]}}, "pulses: time must be an array of real numbers"),
        ({"pulses": pulses(3) | {"force": np.zeros((3, 1))}}, "force must be an array of real numbers"),
        ({"pulses": pulses(3) | {"force": np.zeros(2)}}, "pulses: columns differ in length"),
        ({"pulses": pulses(3) | {"force": np.array([0, np.nan, 0])}}, "force is nan in sample 2"),
        ({"pulses": pulses(3) | {"row": np.array([0, 1, 0])}}, "not sorted by row and time at sample"),
        ({"pulses": pulses(3) | {"time": np.array([1.0, 1.1, 1.1])}}, "not sorted by row and time at sample"),
    ],
)  # fmt: skip
def test_what_is_no_result_is_refused_in_one_line(changed, rule):
    with pytest.raises(TableError) as refused:
        Table.from_result(result(1, **changed))
    assert str(refused.value).startswith("the model's ")
    assert rule in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_mapping_of_the_model_is_a_record_as_well():
    check_record({"extrema": {"slider_x": {"min": np.float64(1.0)}}})


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(FolderError, match="is not a folder"):
        check_folder(tmp_path / "file" / "deeper")


@pytest.mark.parametrize(
    ("scene", "unused"), [("ideal", {"numba", "scipy"}), ("150rpm-0.2mm", {"scipy.integrate"})]
)
def test_a_run_imports_nothing_heavy_that_it_does_not_need(tmp_path, scene, unused):
    """Each takes longer than such a run."""
    arguments = ["run", scene, "--model", "reference", "--out", str(tmp_path / "a.csv")]
    arguments += ["--set", "drive.cycles=0.1"]
    code = f"import sys; from comparison.cli import main; main({arguments}); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert not unused & set(done.stdout.splitlines()[-1].split())
    assert (tmp_path / "a.csv").is_file()


# Pulses


def test_a_contact_of_few_samples_keeps_them_all_and_of_equal_ones_one_is_kept():
    given = pulses(32, 1, 2, 20)
    kept = thinned(given)
    assert list(kept) == ["row", "time", "force"]
    for name, column in kept.items():
        np.testing.assert_array_equal(column, given[name])
    assert thinned(pulses(320) | {"force": np.ones(320)})["row"].size == 17


@pytest.mark.parametrize("counts", [(33,), (399, 5, 399), (400,), (50_000, 30, 301, 400, 33)])
def test_thinning_keeps_ends_and_extrema_of_equal_parts_and_of_a_long_contact_the_impact(counts):
    given = pulses(*counts)
    columns = thinned(given)
    kept = np.searchsorted(given["time"], columns["time"])
    for name, column in columns.items():
        np.testing.assert_array_equal(column, given[name][kept])
    for number, count in enumerate(counts):
        own = np.flatnonzero(given["row"] == number)
        force, places = given["force"][own], kept[columns["row"] == number] - own[0]
        assert {0, count - 1, int(force.argmin()), int(force.argmax())} <= set(places.tolist())
        if count <= 32:
            assert places.size == count
            continue
        parts, first = (16, 1) if count < 400 else (96, 32)
        assert places.size <= 2 * parts + first + 1
        assert set(range(first)) <= set(places.tolist())
        of_part = np.arange(count) * parts // count
        for part in range(parts):
            every, held = force[of_part == part], force[places[of_part[places] == part]]
            assert (held.min(), held.max()) == (every.min(), every.max())


def test_a_table_has_the_thinned_pulses_of_a_result():
    long = Table.from_result(result(3, pulses=pulses(20, 50, 1)))
    check(long, ["slider_x"])
    for name, column in thinned(pulses(20, 50, 1)).items():
        np.testing.assert_array_equal(long.pulses[name], column)
    assert long.only(["slider_x"]).pulses is None
    for none in (None, {}, {name: column[:0] for name, column in pulses(3).items()}):
        assert Table.from_result(result(1, pulses=none)).pulses is None
    with pytest.raises(TableError, match="row 0 is none of 0 events"):
        check(replace(long, events=None), ["slider_x"])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"row": np.array([0, 0, 1])}, "row 1 is none of 1 events"),
        ({"row": np.array([-1, 0, 0])}, "row -1 is none of 1 events"),
        ({"time": np.array([0.9, 1.1, 1.2])}, r"0\.9 s is outside contact 1, 1\.0 to 1\.5 s"),
        ({"time": np.array([1.0, 1.1, 1.6])}, r"1\.6 s is outside contact 1, 1\.0 to 1\.5 s"),
    ],
)
def test_pulses_of_no_contact_are_refused(changed, message):
    with pytest.raises(TableError, match=f"run: its pulses: {message}"):
        check(Table.from_result(result(1, pulses=pulses(3) | changed)), ["slider_x"], name="run")
