"""Tables, contacts, pulses and results that cannot be meant are refused; by what a difference is measured."""

import os
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.tables.channels import channels, expected
from comparison.tables.table import Table, TableError, check, thinned

ROOT = Path(__file__).parents[3]
TIME = np.linspace(-0.5, 1.5, 21)
MEASURES = ("normal_speed", "impulse", "peak_force", "largest_depth")
CONTACT = {"corner": "ll", "start": 0.1, "end": 0.2} | dict.fromkeys(MEASURES, 0.1)


def table(changes):
    frame = pd.DataFrame({"time": TIME, "slider_x": np.sin(TIME)})
    return Table(frame, pd.DataFrame([CONTACT, CONTACT | changes]))


def pulses(*counts):
    """Contacts from the times 1, 2, ... s on for 0.5 s, with so many samples each."""
    force = np.random.default_rng(2).uniform(0.0, 40.0, sum(counts))
    times = [1.0 + number + np.linspace(0.0, 0.5, count) for number, count in enumerate(counts)]
    return {"row": np.repeat(np.arange(len(counts)), counts), "time": np.concatenate(times), "force": force}


def result(contacts=0, **changed):
    """A model's result with contacts at the times of `pulses`."""
    start = 1.0 + np.arange(contacts)
    events = {"corner": np.array(["ll"] * contacts), "start": start, "end": start + 0.5}
    parts = {
        "columns": {"time": np.linspace(0.0, 10.0, 101), "slider_x": np.zeros(101)},
        "events": events | dict.fromkeys(MEASURES, np.ones(contacts)) if contacts else {},
        "extrema": {},
        "provenance": {"model": "mine"},
        "status": "success",
        "remedy": "",
    }
    return SimpleNamespace(**(parts | changed))


def refused(rule, of, wanted, *span):
    with pytest.raises(TableError, match=f"^run: .*{rule}") as error:
        check(of, wanted, *span, name="run")
    assert "\n" not in str(error.value)


def test_a_table_that_cannot_be_compared_is_refused_by_channel_and_row(scene, make_table):
    def at(name, row, value):
        return lambda f: f.assign(
            **{name: f[name].where(f.index != row, value(f) if callable(value) else value)}
        )

    wanted, span = expected(scene.data), (0.0, scene.duration)
    check(make_table(), wanted, span)
    for changed, rule in (
        (at("slider_vy", 16, np.nan), r"slider_vy is nan in data row 17, .* \(such rows: 1\)"),
        (at("slider_vy", 16, -np.inf), "slider_vy is -inf in"),
        (lambda f: f.drop(columns=["slider_ax", "corner_ul_gap"]), "slider_ax is missing"),
        (lambda f: f.assign(crank_torque=0.0), "channel crank_torque is unexpected"),
        (at("time", 5, lambda f: f.time[4]), "does not increase in data row 6"),
        (at("time", 5, lambda f: f.time[4] - 1e-9), "does not increase in data row 6"),
        (lambda f: f.iloc[:-1], r"truncated: it spans .* and must span 0 to 0\.8 s"),
        (lambda f: f.iloc[1:], r"truncated: it spans .* and must span 0 to 0\.8 s"),
        (lambda f: f.iloc[:1], "1 data rows; at least 2"),
        (lambda f: f.assign(slider_x=f.time > 9), "slider_x is False in data row 1, and must be a number"),
        (lambda f: f.assign(slider_x="oops"), "slider_x is 'oops' in data row 1, and must be a number"),
        (lambda f: f.assign(slider_x=-1.1e30), r"slider_x is -1.1e\+30 in data row 1, .* at most 1e\+30"),
    ):
        refused(rule, Table(changed(make_table().frame)), wanted, span)


def test_contacts_of_a_run_are_accepted_and_what_cannot_be_meant_is_refused():
    # One that ends half a sample later is that of the last sample.
    for good in ({"start": 0.2}, {"start": -0.5, "end": 1.55}, dict.fromkeys(MEASURES, 0.0)):
        check(table(good), ["slider_x"])
    for bad, rule in (
        ({"corner": "top"}, "contact at 'top', which is none of ll, lr, ul, ur, pin"),
        ({"end": 0.05}, "contact 2 ends at 0.05 s, before its start at 0.1 s"),
        *(({name: -1e-9}, f"{name} of contact 2 must be a number >= 0, not -1e-09") for name in MEASURES),
        ({"start": 5.0, "end": 6.0}, "contact 2, 5 to 6 s, is outside the times of the table, -0.5 to 1.5 s"),
        ({"end": 1.6}, "contact 2, 0.1 to 1.6 s, is outside"),
        ({"start": -0.6}, "contact 2, -0.6 to 0.2 s, is outside"),
        ({"impulse": np.inf}, "impulse of contact 2 must be a number >= 0, not inf"),
    ):
        refused(rule, table(bad), ["slider_x"])
    whole = table({})
    truths = replace(whole, events=whole.events.assign(impulse=True))
    refused("impulse of contact 1 must be a number >= 0, not True", truths, ["slider_x"])
    lacking = replace(whole, events=whole.events.drop(columns=["impulse", "end"]))
    refused("its events have no column end", lacking, ["slider_x"])


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
        ({"pulses": pulses(3) | {"row": np.zeros(3)}}, "row must be an array of integers, shape (n,)"),
        ({"pulses": pulses(3) | {"force": np.zeros((3, 1))}}, "force must be an array of real numbers"),
        ({"pulses": pulses(3) | {"force": np.array([0, np.nan, 0])}}, "force is not finite in sample 2"),
        ({"pulses": pulses(3) | {"row": np.array([0, 1, 0])}}, "not sorted by row and time at sample 3"),
        ({"pulses": pulses(3) | {"time": np.array([1.0, 1.1, 1.1])}}, "not sorted by row and time at"),
    ],
)  # fmt: skip
def test_what_is_no_result_is_refused_in_one_line(changed, rule):
    with pytest.raises(TableError) as error:
        Table.from_result(result(1, **changed))
    message = str(error.value)
    assert message.startswith("the model's ")
    assert rule in message
    assert "\n" not in message


def test_a_run_imports_nothing_heavy_that_it_does_not_need(tmp_path):
    """Each takes longer than such a run."""
    arguments = ["run", "ideal", "--set=drive.cycles=0.1", "--model=reference", f"--out={tmp_path}/a.csv"]
    arguments.append('--set=output.groups=["accelerations", "joints", "energy"]')
    code = f"import sys; from comparison.cli import main; main({arguments}); print(*sys.modules)"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True)
    assert not {"numba", "pandas", "scipy"} & set(done.stdout.decode().splitlines()[-1].split())
    assert (tmp_path / "a.csv").is_file()


@pytest.mark.parametrize(
    ("count", "parts", "first"), [(32, 32, 1), (33, 16, 1), (399, 16, 1), (5000, 96, 32)]
)
def test_thinning_keeps_ends_and_extrema_of_equal_parts_and_of_a_long_contact_the_impact(count, parts, first):
    given = pulses(3, count)
    kept = set(np.searchsorted(given["time"], thinned(given)["time"]))
    edges = 3 + np.ceil(np.arange(parts + 1) * count / parts).astype(int)
    force, wanted = given["force"], {0, 1, 2, count + 2, *range(3, 3 + first)}
    for start, end in pairwise(edges):
        wanted |= {start + int(force[start:end].argmin()), start + int(force[start:end].argmax())}
    assert kept == wanted


def test_a_table_has_the_thinned_pulses_of_a_result_and_none_without_a_contact():
    long = Table.from_result(result(3, pulses=pulses(20, 50, 1)))
    check(long, ["slider_x"])
    np.testing.assert_array_equal(long.pulses["time"], thinned(pulses(20, 50, 1))["time"])
    assert long.only(["slider_x"]).pulses is None
    for none in (None, {}, {name: column[:0] for name, column in pulses(3).items()}):
        assert Table.from_result(result(1, pulses=none)).pulses is None
    refused("row 0 is none of 0 events", replace(long, events=None), ["slider_x"])
    for changed, rule in (
        ({"row": np.array([0, 0, 1])}, "row 1 is none of 1 events"),
        ({"row": np.array([-1, 0, 0])}, "row -1 is none of 1 events"),
    ):
        odd = Table.from_result(result(1, pulses=pulses(3) | changed))
        refused(f"its pulses: {rule}", odd, ["slider_x"])


PIN_CLEARANCE = {"joints.slider": "ideal", "joints.crank_pin": "clearance"}
C_SLIDER, C_PIN = 3e-4, 2e-4  # m
SIZES = {"clearance.slider": C_SLIDER, "clearance.crank_pin": C_PIN}


@pytest.mark.parametrize(
    ("joints", "x", "y"),
    [
        ({}, C_SLIDER, 0.2093 * C_SLIDER),
        (PIN_CLEARANCE, C_PIN, C_PIN),
        ({"joints.crank_pin": "clearance"}, C_SLIDER, 0.2093 * C_SLIDER),
    ],
)
def test_a_difference_is_measured_by_the_clearance_that_moves_it_else_by_the_range(joints, x, y):
    scene = load_scene("paper", SIZES | joints).data
    scales = {name: channel.scale_value(scene, 7.0) for name, channel in channels().items()}
    # A cycle at 150 rpm takes 0.4 s. Products and quotients of a few numbers: some units of the last place.
    exact = {"slider_x": x, "slider_y": y, "slider_angle": x / 0.07, "slider_vy": y / 0.004}
    assert {name: scales[name] for name in exact} == pytest.approx(exact, rel=1e-14, abs=0.0)
    assert (scales["slider_ay"], scales["journal_x"], scales["journal_y"]) == (7.0, C_PIN, C_PIN)
    scene["clearance"] = dict.fromkeys(scene["clearance"], 0.0)
    assert channels()["slider_y"].scale_value(scene, 7.0) == 7.0
