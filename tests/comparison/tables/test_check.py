"""Tables and contacts that cannot be meant are refused, with the place and the rule."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.tables.table import LARGEST_NUMBER, Table, TableError, check

TIME = np.linspace(-0.5, 1.5, 21)
CONTACT = {
    "corner": "ll", "start": 0.1, "end": 0.2, "normal_speed": 0.1, "impulse": 0.02, "peak_force": 40.0,
    "largest_depth": 1e-6,
}  # fmt: skip


def table(changes: dict[str, object] | None = None, **columns) -> Table:
    frame = pd.DataFrame({"time": TIME, "slider_x": np.sin(TIME)} | columns)
    events = None if changes is None else pd.DataFrame([CONTACT, CONTACT | changes])
    return Table(frame, events)


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
        ({"end": 0.05}, "t: contact 2 ends at 0.05 s, before its start at 0.1 s"),
        ({"impulse": -1e-9}, "t: impulse = -1e-09 of contact 2 must be >= 0"),
        ({"normal_speed": -0.1}, "t: normal_speed = -0.1 of contact 2 must be >= 0"),
        ({"peak_force": -1}, "t: peak_force = -1 of contact 2 must be >= 0"),
        ({"largest_depth": -1e-6}, "t: largest_depth = -1e-06 of contact 2 must be >= 0"),
        ({"start": 5.0, "end": 6.0}, "contact 2, 5 to 6 s, is outside the times of the table, -0.5 to 1.5 s"),
        ({"end": 1.6}, "contact 2, 0.1 to 1.6 s, is outside"),
        ({"start": -0.6}, "contact 2, -0.6 to 0.2 s, is outside"),
        ({"impulse": np.inf}, "impulse of contact 2 is not a number"),
    ],
)
def test_contacts_that_cannot_be_meant_are_refused(changes, reported):
    with pytest.raises(TableError) as refused:
        check(table(changes), ["slider_x"], name="t")
    assert reported in str(refused.value)


def test_truth_values_are_no_numbers():
    found = table({})
    found.events["impulse"] = [True, False]
    with pytest.raises(TableError, match="impulse of contact 1 is not a number: True"):
        check(found, ["slider_x"])
    with pytest.raises(TableError, match="slider_x is not a number in data row 1"):
        check(table(slider_x=TIME > 9.0), ["slider_x"])


@pytest.mark.parametrize("channel", ["time", "slider_x"])
def test_numbers_whose_squares_overflow_are_refused(channel):
    values = {"time": TIME * LARGEST_NUMBER, "slider_x": np.where(TIME > 1.0, -1.1 * LARGEST_NUMBER, 0.0)}
    with pytest.raises(
        TableError, match=rf"{channel} = -?1\.\S+e\+30 in data row \d+ must be at most 1e\+30"
    ):
        check(table(**{channel: values[channel]}), ["slider_x"])
    check(table(slider_x=np.full(21, LARGEST_NUMBER)), ["slider_x"])
    assert np.isfinite(np.float32(LARGEST_NUMBER))
