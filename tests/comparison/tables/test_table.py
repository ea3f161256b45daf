"""Tables, contacts, pulses and results that cannot be meant are refused; by what a difference is measured."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError, check, thinned

TIME = np.linspace(-0.5, 1.5, 21)
MEASURES = ("normal_speed", "impulse", "peak_force", "largest_depth")
CONTACT = {"corner": "ll", "start": 0.1, "end": 0.2} | dict.fromkeys(MEASURES, 0.1)


def table(x=np.sin(TIME), **contact):  # noqa: B008
    """A table with two contacts, the second one changed."""
    frame = pd.DataFrame({"time": TIME, "slider_x": x})
    return Table(frame, pd.DataFrame([CONTACT, CONTACT | contact]))


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


def test_contacts_up_to_half_a_sample_behind_the_end_are_accepted():
    for good in ({"start": 0.2}, {"start": -0.5, "end": 1.55}, dict.fromkeys(MEASURES, 0.0)):
        check(table(**good), ["slider_x"])


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"x": -np.inf}, "slider_x is -inf in data row 1"),
        ({"x": TIME > 9}, "slider_x is False in data row 1, and must be a number"),
        ({"x": "oops"}, "slider_x is 'oops' in data row 1, and must be a number"),
        ({"x": -1.1e30}, r"slider_x is -1.1e\+30 in data row 1, .* at most 1e\+30"),
        ({"corner": "top"}, "contact at 'top', which is none of ll, lr, ul, ur, pin"),
        ({"end": 0.05}, "contact 2 ends at 0.05 s, before its start at 0.1 s"),
        *(({name: -1e-9}, f"{name} of contact 2 must be a number >= 0, not -1e-09") for name in MEASURES),
        ({"end": 1.6}, "contact 2, 0.1 to 1.6 s, is outside the times of the table, -0.5 to 1.5 s"),
        ({"start": -0.6}, "contact 2, -0.6 to 0.2 s, is outside"),
        ({"impulse": np.inf}, "impulse of contact 2 must be a number >= 0, not inf"),
    ],
)
def test_what_cannot_be_meant_is_refused_by_channel_and_row(changed, rule):
    with pytest.raises(TableError, match=f"^run: .*{rule}") as error:
        check(table(**changed), ["slider_x"], name="run")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"status": 0}, "result: status must be a str, not int"),
        ({"provenance": {"counters": 5}}, "extrema or provenance: counters must be an object"),
        ({"cycle_extrema": {"a": np.zeros(2), "b": np.zeros(3)}}, "columns differ in length"),
        ({"pulses": pulses(3) | {"row": np.zeros(3)}}, "row must be an array of integers, shape (n,)"),
        ({"pulses": pulses(3) | {"force": np.zeros((3, 1))}}, "force must be an array of real numbers"),
        ({"pulses": pulses(3) | {"force": np.array([0, np.nan, 0])}}, "force is not finite in sample 2"),
        ({"pulses": pulses(3) | {"row": np.array([0, 1, 0])}}, "not sorted by row and time at sample 3"),
        ({"pulses": pulses(3) | {"time": np.array([1.0, 1.1, 1.1])}}, "not sorted by row and time at"),
    ],
)
def test_what_is_no_result_is_refused_in_one_line(changed, rule):
    with pytest.raises(TableError) as error:
        Table.from_result(result(1, **changed))
    message = str(error.value)
    assert message.startswith("the model's ")
    assert rule in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("count", "parts", "first"), [(32, 32, 1), (33, 16, 1), (399, 16, 1), (5000, 96, 32)]
)
def test_thinning_keeps_the_ends_and_the_extrema_of_equal_parts(count, parts, first):
    """And of a long contact the impact."""
    given = pulses(count)
    force, edges = given["force"], np.ceil(np.arange(parts + 1) * count / parts).astype(int)
    spans = [range(start, end) for start, end in pairwise(edges)]
    extrema = {best(span, key=force.__getitem__) for span in spans for best in (min, max)}
    kept = np.searchsorted(given["time"], thinned(given)["time"])
    assert {*kept} == {count - 1, *range(first)} | extrema


def test_pulses_of_a_result_are_of_its_events():
    whole = Table.from_result(result(3, pulses=pulses(20, 50, 1)))
    check(whole, ["slider_x"])
    np.testing.assert_array_equal(whole.pulses["time"], thinned(pulses(20, 50, 1))["time"])
    for events, rule in ((whole.events[:2], "row 2 is none of 2 events"), (None, "row 0 is none of 0")):
        with pytest.raises(TableError, match=f"its pulses: {rule}"):
            check(replace(whole, events=events), ["slider_x"])


C_SLIDER, C_PIN = 3e-4, 2e-4  # m


@pytest.mark.parametrize(
    ("joints", "x", "y"),
    [
        ({}, C_SLIDER, 0.2093 * C_SLIDER),
        ({"joints.slider": "ideal", "joints.crank_pin": "clearance"}, C_PIN, C_PIN),
        ({"joints.crank_pin": "clearance"}, C_SLIDER, 0.2093 * C_SLIDER),
    ],
)
def test_a_difference_is_measured_by_the_clearance_that_moves_it_else_by_the_range(joints, x, y):
    sizes = {"clearance.slider": C_SLIDER, "clearance.crank_pin": C_PIN}
    scene = load_scene("paper", sizes | joints).data
    scales = {name: channel.scale_value(scene, 7.0) for name, channel in channels().items()}
    # A cycle at 150 rpm takes 0.4 s. Products and quotients of a few numbers: some units of the last place.
    exact = {"slider_x": x, "slider_y": y, "slider_angle": x / 0.07, "slider_vy": y / 0.004}
    assert {name: scales[name] for name in exact} == pytest.approx(exact, rel=1e-14, abs=0.0)
    assert (scales["slider_ay"], scales["journal_x"], scales["journal_y"]) == (7.0, C_PIN, C_PIN)
