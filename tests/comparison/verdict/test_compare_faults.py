"""What is wrong with a table is never agreement: shifts, spikes, holes, nothing at all."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare
from comparison.words.verdicts import scene_reason

LABELS = ("reference", "exudyn")


def slider(time: np.ndarray, names: tuple[str, ...]) -> Table:
    """y driven by the crank, x flying from wall to wall of 0.2 mm clearance, as at 150 rpm."""
    phase = 2 * np.pi * time / 0.4
    beats = 12 * time / 0.4 + 1.5 * np.sin(phase)
    x = 2e-4 * (2 * np.abs(2 * (beats % 1) - 1) - 1)
    vx = 8e-4 * (12 + 3 * np.pi * np.cos(phase)) / 0.4 * np.where(beats % 1 < 0.5, -1.0, 1.0)
    columns = {
        "slider_x": x - 0.55,
        "slider_y": 0.112 * np.cos(phase) - 0.3 + 0.2 * x,
        "slider_vx": vx,
        "slider_vy": -0.112 * 2 * np.pi / 0.4 * np.sin(phase) + 0.2 * vx,
    }
    return Table(pd.DataFrame({"time": time} | {name: columns[name] for name in names}))


POSITIONS, ALL = ("slider_x", "slider_y"), ("slider_x", "slider_y", "slider_vx", "slider_vy")


@pytest.mark.parametrize("names", [POSITIONS, ALL, ("slider_x",)])
@pytest.mark.parametrize("shift", [1e-4, -1e-4])
@pytest.mark.parametrize("finer", [1, 3])
def test_a_shift_of_a_tenth_of_a_millisecond_never_agrees(names, shift, finer):
    time = np.arange(2001) * 4e-4
    other = np.arange(2000 * finer + 1) * (4e-4 / finer)
    a, b = slider(time, names), slider(other - shift, names)
    b.frame["time"] = other
    result = compare(Runs(a), Runs(b), tolerance=0.01, labels=LABELS)
    assert result.verdict == "differ"
    assert result.shift.value == pytest.approx(shift, abs=1e-6)
    if "slider_y" in names:  # 0.2 mm of 0.22 m: by itself within the tolerance
        assert result.channels["slider_y"].verdict == "agree"
    # It is not applied.
    if finer == 1:
        np.testing.assert_array_equal(
            result.channels[names[0]].difference, a.values(names[0]) - b.values(names[0])
        )
    unshifted = slider(other, names)
    assert compare(Runs(a), Runs(unshifted), tolerance=0.01).verdict == "agree"


def test_a_shift_is_held_against_the_tolerance_and_a_scene_sharpens_it(scene):
    time = np.arange(401) * 2e-3
    names = ("slider_y", "slider_vy")

    def verdict(shift: float, **options) -> str:
        # Not from an instant at which x turns round: vy would jump at whole multiples of the sample.
        a, b = slider(time + 3.7e-4, names), slider(time + 3.7e-4 - shift, names)
        a.frame["time"] = b.frame["time"] = time
        return compare(Runs(a), Runs(b), tolerance=0.01, only=names, **options).verdict

    # y passes its range at the range of its rate in T / (2 pi) = 64 ms: 0.64 ms at 1 %.
    assert (verdict(5e-4), verdict(8e-4)) == ("agree", "differ")
    # With the scene's scales every difference of y counts, by clearance * tan(beta) = 42 um.
    assert (verdict(1e-7, scene=scene), verdict(1e-4, scene=scene)) == ("agree", "differ")


def test_a_shift_outside_the_tolerance_is_the_reason():
    time = np.arange(401) * 2e-3
    b = slider(time - 8e-4, ("slider_y",))
    b.frame["time"] = time
    result = compare(Runs(slider(time, ("slider_y",))), Runs(b), tolerance=0.01, labels=LABELS)
    assert result.channels["slider_y"].verdict == "agree"
    assert scene_reason(result).startswith("exudyn is later than reference by 0.0008 s")
    assert "The tolerance allows 0.00064 s" in scene_reason(result)


# Contacts between samples


def test_samples_that_follow_from_nothing_are_not_judged_and_the_reader_is_informed():
    coarse, fine = np.linspace(0, 1, 51), np.linspace(0, 1, 151)
    hits = np.arange(5, 46, 5)  # each within one fine interval, at a coarse sample

    def hammer(time: np.ndarray, force: float) -> Table:
        frame = pd.DataFrame({"time": time, "slider_y": np.sin(9 * time), "corner_ll_normal": 0.0 * time})
        frame.loc[np.isclose(time % 0.1, 0.1) | np.isclose(time % 0.1, 0), "corner_ll_normal"] = force
        events = pd.DataFrame({"corner": "ll", "start": coarse[hits] - 1e-3, "end": coarse[hits] + 1e-3})
        rest = {"normal_speed": 0.1, "impulse": 0.1, "peak_force": force, "largest_depth": 1e-6}
        return Table(frame, events.assign(**rest))

    # 20/3 ms do not divide the instants but every third one, where a force of zero stands.
    result = compare(Runs(hammer(coarse, 50.0)), Runs(hammer(fine + 1e-9, 0.0)), tolerance=0.01)
    channel = result.channels["corner_ll_normal"]
    assert channel.verdict != "agree"
    assert result.verdict != "agree"
    assert "not judged: a contact starts or ends" in "".join(result.warnings)
    assert channel.coverage < 1


# Nothing that is wrong with a table passes


FAULTS = ("nan", "inf", "truncated", "missing", "duplicated time", "zero force", "unexcited", "unexpected")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    fault=st.sampled_from(FAULTS),
    channel=st.integers(0, 20),
    row=st.integers(1, 399),
    first=st.booleans(),
    known=st.booleans(),
)
def test_a_fault_in_a_table_is_never_agreement(scene, make_table, fault, channel, row, first, known):
    whole, bad = make_table(), make_table()
    frame = bad.frame
    name = bad.channels[channel]
    if fault in {"nan", "inf"}:
        frame.loc[row, name] = float(fault)
    elif fault == "truncated":
        frame = frame.iloc[: row - 1]
    elif fault == "missing":
        frame = frame.drop(columns=name)
    elif fault == "duplicated time":
        frame.loc[row, "time"] = frame.loc[row - 1, "time"]
    elif fault == "zero force":
        frame[f"corner_{('ll', 'lr', 'ul', 'ur')[channel % 4]}_normal"] = 0.0
    elif fault == "unexcited":
        frame[name] = frame[name].mean()
    else:
        frame[f"{name}_2"] = 0.0
    pair = (Runs(Table(frame)), Runs(whole))
    try:
        result = compare(*(pair if first else pair[::-1]), scene=scene if known else None, tolerance=0.01)
    except TableError as error:
        assert "\n" not in str(error)  # noqa: PT017
        assert fault not in {"zero force", "unexcited"}
    else:
        assert result.verdict == "differ"
        assert fault in {"zero force", "unexcited"}


def test_a_table_in_which_nothing_happens_agrees_with_nothing(make_table):
    table = make_table()
    for name in table.channels:
        table.frame[name] = 0.0
    assert compare(Runs(table), Runs(table), tolerance=0.01).verdict == "indeterminate"
