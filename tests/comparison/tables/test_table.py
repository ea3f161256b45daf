"""Ambiguous tables are refused in one line; tables are read to the bit; two are put on one grid."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.tables.align import Hole, align, cut, holes
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError, check, thin
from comparison.tables.table_files import companions, read, write

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


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
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
def test_what_cannot_be_meant_is_refused_by_channel_and_row(changes, rule):
    with pytest.raises(TableError, match=f"^run: .*{rule}") as error:
        check(table(**changes), ["slider_x"], name="run")
    assert "\n" not in str(error.value)


def test_contacts_up_to_half_a_sample_behind_the_end_are_accepted():
    check(table(start=0.2), ["slider_x"])
    check(table(start=-0.5, end=1.55, **dict.fromkeys(MEASURES, 0.0)), ["slider_x"])


@pytest.mark.parametrize(("count", "parts", "first"), [(32, 32, 1), (33, 16, 1), (5000, 96, 32)])
def test_thinning_keeps_the_ends_and_the_extrema_of_equal_parts(count, parts, first):
    """Of a long contact the impact is kept, too."""
    samples = pulses(count)
    force, edges = samples["force"], np.ceil(np.arange(parts + 1) * count / parts).astype(int)
    spans = [range(start, end) for start, end in pairwise(edges)]
    extrema = {best(span, key=force.__getitem__) for span in spans for best in (min, max)}
    rows = np.searchsorted(samples["time"], thin(samples)["time"])
    assert {*rows} == {count - 1, *range(first)} | extrema


def test_pulses_of_a_result_are_of_its_events():
    start = 1.0 + np.arange(3)
    events = {"corner": np.array(["ll"] * 3), "start": start, "end": start + 0.5}
    result = SimpleNamespace(
        columns={"time": np.linspace(0.0, 10.0, 101), "slider_x": np.zeros(101)},
        events=events | dict.fromkeys(MEASURES, np.ones(3)),
        pulses=pulses(20, 50, 1),
        extrema={},
        provenance={"model": "mine"},
        status="success",
        remedy="",
    )
    whole = Table.from_result(result)
    check(whole, ["slider_x"])
    np.testing.assert_array_equal(whole.pulses["time"], thin(pulses(20, 50, 1))["time"])
    part = cut(whole, 1.8, 9.0)  # behind the first contact
    check(part, ["slider_x"])
    assert part.pulses["time"].tolist() == whole.pulses["time"][whole.pulses["row"] > 0].tolist()
    assert set(part.pulses["row"]) == {0, 1}
    for events, rule in ((whole.events[:2], "row 2 is none of 2 events"), (None, "row 0 is none of 0")):
        with pytest.raises(TableError, match=f"its pulses: {rule}"):
            check(replace(whole, events=events), ["slider_x"])


def test_where_the_pin_alone_has_clearance_a_difference_of_the_slider_is_measured_by_that():
    joints = {"joints.slider": "ideal", "joints.crank_pin": "clearance", "clearance.crank_pin": 2e-4}
    scene = load_scene("paper", joints).data
    scales = {name: channel.scale_value(scene, 7.0) for name, channel in channels().items()}
    assert [scales[name] for name in ("slider_x", "slider_y", "journal_x", "slider_ay")] == [2e-4] * 3 + [7.0]


PARTS = {
    "events": pd.DataFrame({"corner": ["ll", "ur"], "start": [0.0, 0.1], "end": [0.01, 0.2]}),
    "extrema": {"slider_x": {"min": -1.0, "time_of_min": 0.1, "max": 1.0, "time_of_max": 0.2}},
    "provenance": {"model": "reference", "status": "success"},
    "pulses": {"row": np.array([0, 1]), "time": np.array([0.005, 0.1]), "force": np.array([1.0, 2.0])},
    "cycle_extrema": {"slider_x_min": np.array([-1.0, -0.1 - 2e-17])},
}


@pytest.mark.parametrize("ending", ["parquet", "CSV"])
def test_what_is_written_is_read_bit_for_bit(tmp_path, make_table, ending):
    any_exponent = np.nan_to_num(np.frombuffer(np.random.default_rng(0).bytes(8 * 401)))
    table = replace(make_table(**{'a "quoted", name': any_exponent}), **PARTS)
    path = write(table, tmp_path / "deep" / f"run.{ending}")
    names = {f"run.{end}" for end in ("events.csv", "pulses.csv", "extrema.csv", "json")}
    assert {file.name for file in companions(table, path)} == names
    assert {file.name for file in path.parent.iterdir()} == names | {path.name}
    copy = read(path)
    assert list(copy.frame) == list(table.frame)
    assert copy.frame.to_numpy().tobytes() == table.frame.to_numpy().tobytes()
    pd.testing.assert_frame_equal(copy.events, table.events, check_exact=True)
    assert (copy.extrema, copy.provenance) == (table.extrema, table.provenance)
    for one, other in ((copy.pulses, table.pulses), (copy.cycle_extrema, table.cycle_extrema)):
        assert list(one) == list(other)
        for name in other:
            assert (one[name].dtype, one[name].tobytes()) == (other[name].dtype, other[name].tobytes())
    rest = read(write(make_table(), path))  # companions of an earlier table go
    assert {file.name for file in path.parent.iterdir()} == {path.name, "run.json"}
    assert (rest.events, rest.pulses, rest.cycle_extrema) == (None, None, None)


@pytest.mark.parametrize(
    ("name", "text", "rule"),
    [
        ("csv", "time,slider_x\n0,1,2\n1,2,3\n", "more values than its header"),
        ("csv", "time,slider_x,slider_x\n0,1,2\n1,2,3\n", "channel slider_x.1 is unexpected"),
        ("extrema.csv", "slider_x_min\nlow\n", "its cycle_extrema: slider_x_min must be an array of real"),
        ("pulses.csv", "row,time\n0,1.0\n", "its pulses: force must be an array of real numbers"),
        ("pulses.csv", "row,time,force\n0,1.0,2\n0,1.1,inf\n", "time or force is not finite in sample 2"),
        ("pulses.csv", "row,time,force\n1,1.0,2\n0,1.1,2\n", "not sorted by row and time at sample 2"),
        ("pulses.csv", "row,time,force\n0,1.1,2\n0,1.1,2\n", "not sorted by row and time at sample 2"),
        ("json", '{"extrema": {"slider_x": 1}}', "extrema of slider_x must be an object of numbers"),
        ("json", '{"wall_time_s": "long"}', "wall_time_s must be a number"),
        ("json", '{"counters": 5}', "counters must be an object"),
        ("json", '{"scene": {"solver": 5}}', r"scene\.solver must be an object"),
    ],
)
def test_files_that_are_no_tables_and_companions_that_are_none_are_one_line(
    tmp_path, make_table, name, text, rule
):
    path = write(make_table().only(["slider_x"]), tmp_path / "run.csv")
    (tmp_path / "run.events.csv").write_text("corner,start,end\n")  # without it no pulses are read
    (tmp_path / f"run.{name}").write_text(text)
    with pytest.raises(TableError, match=rule) as refusal:
        check(read(path), ["slider_x"], name="run")
    assert "\n" not in str(refusal.value)


NAMES = ["slider_x", "slider_vx", "slider_angle"]


def wave(time, **columns):
    """x = sin t with its derivative; an angle without its rate."""
    frame = {"time": time, "slider_x": np.sin(time), "slider_vx": np.cos(time), "slider_angle": np.cos(time)}
    return Table(pd.DataFrame(frame | columns))


@pytest.mark.parametrize("every", [1, 11])
def test_the_finer_table_tells_how_often_an_angle_has_turned_and_the_first_one_how_it_is_counted(every):
    time = np.arange(0, 1.54, 0.01)
    angle = 7.3 * 2 * np.pi * time  # of the coarsest table eight tenths of a turn from row to row
    remainder = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    fine = wave(time, slider_angle=remainder)
    for series in (remainder, angle, angle + 6 * np.pi):
        coarse = wave(time[::every], slider_angle=series[::every])
        for pair in ((fine, coarse), (coarse, fine)):
            grid = align(*pair, NAMES)
            # 70 rad round at 1e-14, and a line between two samples is as exact.
            a, b = grid.a["slider_angle"], grid.b["slider_angle"]
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
            np.testing.assert_allclose(np.diff(a), np.diff(angle[::every]), rtol=0, atol=1e-12)
            assert a[0] == pytest.approx(pair[0].values("slider_angle")[0], abs=1e-12)


EVEN = np.arange(201) * 0.01
VARYING = np.cumsum(np.random.default_rng(0).uniform(0.5e-3, 2e-3, 1000))


@pytest.mark.parametrize(
    ("time", "result"),
    [
        (np.delete(np.round(np.arange(100) / 30, 4), [40, 41]), [Hole(1.3, 1.4, 2)]),  # few digits
        (np.delete(EVEN, np.arange(1, 151)), [Hole(0.0, EVEN[151], 150)]),
        (np.delete(VARYING, np.arange(300, 800)), [Hole(VARYING[299], VARYING[800], 0)]),
        # Steps of a solver are no holes.
        (VARYING, []),
        (np.geomspace(1e-6, 1.0, 50), []),  # a solver that gets faster
        (np.sort(np.concatenate([EVEN, [0.1234, 1.2345]])), []),  # rows at events
        (np.concatenate([k + np.append(np.arange(20) * 1e-5, 0.1) for k in range(10)]), []),  # bursts
    ],
)
def test_what_is_a_hole(time, result):
    assert holes(time) == result
