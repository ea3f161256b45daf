"""Pulses of a table: thinned, kept in a file of their own, refused where they fit no contact."""

from __future__ import annotations

import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.tables.result import thinned
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import read, write


def pulses(*counts: int) -> dict[str, np.ndarray]:
    """Contacts from the times 1, 2, ... s on for 0.5 s, with so many samples each."""
    force = np.random.default_rng(2).uniform(0.0, 40.0, sum(counts))
    row = np.repeat(np.arange(len(counts)), counts)
    times = [1.0 + number + np.linspace(0.0, 0.5, count) for number, count in enumerate(counts)]
    return {"row": row, "time": np.concatenate(times), "force": force}


def events(count: int) -> dict[str, np.ndarray]:
    start = 1.0 + np.arange(count)
    measures = ("normal_speed", "impulse", "peak_force", "largest_depth")
    return {"corner": np.array(["ll"] * count), "start": start, "end": start + 0.5} | {
        name: np.ones(count) for name in measures
    }


def result(of: object, contacts: dict[str, np.ndarray]) -> SimpleNamespace:
    columns = {"time": np.linspace(0.0, 10.0, 101), "slider_x": np.zeros(101)}
    return SimpleNamespace(
        columns=columns, events=contacts, extrema={}, provenance={}, status="success", remedy="", pulses=of
    )


@pytest.fixture
def table() -> Table:
    return Table.from_result(result(pulses(20, 50, 1), events(3)))


def test_a_contact_of_few_samples_keeps_them_all() -> None:
    given = pulses(32, 1, 2, 20)
    kept = thinned(given)
    assert list(kept) == ["row", "time", "force"]
    for name, column in kept.items():
        np.testing.assert_array_equal(column, given[name])


@pytest.mark.parametrize("counts", [(33,), (399, 5, 399), (400,), (50_000, 30, 301, 400, 33)])
def test_thinning_keeps_ends_and_extrema_of_equal_parts_and_of_a_long_contact_the_impact(counts) -> None:
    given = pulses(*counts)
    kept_pulses = thinned(given)
    kept = np.searchsorted(given["time"], kept_pulses["time"])
    for name, column in kept_pulses.items():
        np.testing.assert_array_equal(column, given[name][kept])
    assert np.all(np.diff(kept) > 0)
    for number, count in enumerate(counts):
        own = np.flatnonzero(given["row"] == number)
        force, found = given["force"][own], kept[given["row"][kept] == number] - own[0]
        assert {0, count - 1, int(force.argmin()), int(force.argmax())} <= set(found.tolist())
        if count <= 32:
            assert found.size == count
            continue
        parts, first = (16, 1) if count < 400 else (96, 32)
        assert found.size <= 2 * parts + first + 1
        assert set(range(first)) <= set(found.tolist())
        for part in np.split(
            np.arange(count), np.flatnonzero(np.diff(np.arange(count) * parts // count)) + 1
        ):
            inside = force[np.intersect1d(part, found)]
            assert (inside.min(), inside.max()) == (force[part].min(), force[part].max())


def test_of_equal_samples_one_is_kept() -> None:
    same = pulses(320) | {"force": np.ones(320)}
    assert thinned(same)["row"].size == 17


def test_a_table_has_the_thinned_pulses_of_a_result(table) -> None:
    check(table, ["slider_x"])
    short, long, single = np.bincount(table.pulses["row"])
    assert (short, single) == (20, 1)
    # Two extrema of each of 16 parts; the ends, where they are none of them
    assert 32 <= long <= 34
    copied = pickle.loads(pickle.dumps(table))  # noqa: S301
    np.testing.assert_array_equal(copied.pulses["force"], table.pulses["force"])
    assert table.only(["slider_x"]).pulses is None


def test_a_result_need_not_have_any() -> None:
    without = result(None, events(1))
    assert Table.from_result(without).pulses is None
    del without.pulses
    assert Table.from_result(without).pulses is None
    for none in ({}, {name: column[:0] for name, column in pulses(3).items()}):
        assert Table.from_result(result(none, events(1))).pulses is None


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_what_is_written_is_read_bit_for_bit_and_a_stale_file_deleted(tmp_path, table, ending) -> None:
    again = read(write(table, tmp_path / f"run.{ending}"))
    assert list(again.pulses) == ["row", "time", "force"]
    for name, column in again.pulses.items():
        assert column.dtype == table.pulses[name].dtype
        assert column.tobytes() == table.pulses[name].tobytes()
    check(again, ["slider_x"])
    write(replace(table, pulses=None), tmp_path / f"run.{ending}")
    assert {path.name for path in tmp_path.iterdir()} == {f"run.{ending}", "run.events.csv", "run.json"}


def test_whole_numbers_are_read_as_forces_and_times(tmp_path, table) -> None:
    path = write(table, tmp_path / "run.csv")
    (tmp_path / "run.pulses.csv").write_text("row,time,force\n1,2,3\n")
    again = read(path)
    check(again, ["slider_x"])
    assert {name: (column.dtype, *column) for name, column in again.pulses.items()} == {
        "row": (np.int64, 1), "time": (np.float64, 2.0), "force": (np.float64, 3.0)
    }  # fmt: skip


def test_a_file_that_is_none_is_refused(tmp_path, table) -> None:
    path = write(table, tmp_path / "run.csv")
    (tmp_path / "run.pulses.csv").write_text("row,time\n0,1.0\n")
    with pytest.raises(TableError, match="run: its pulses: force must be an array of real numbers"):
        check(read(path), ["slider_x"], name="run")
    (tmp_path / "run.pulses.csv").write_text("row,time,force\n0,1.0\n0,1.0,2.0,3.0\n")
    with pytest.raises(TableError, match=r"run\.pulses\.csv: cannot be read"):
        read(path)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ([1.0], "result: pulses must be a dict or None, not list"),
        ({"row": np.zeros(3)}, r"pulses: row must be an array of integers, shape \(n,\)"),
        ({"time": [1.0, 1.1, 1.2]}, "pulses: time must be an array of real numbers"),
        ({"force": np.zeros((3, 1))}, "pulses: force must be an array of real numbers"),
        ({"force": np.zeros(2)}, "pulses: row, time and force differ in length"),
        ({"force": np.array([0.0, np.nan, 0.0])}, "pulses: force is nan in sample 2"),
        ({"row": np.array([0, 1, 0])}, "pulses: not sorted by row and time at sample 3"),
        ({"time": np.array([1.0, 1.1, 1.1])}, "pulses: not sorted by row and time at sample 3"),
    ],
)
def test_what_are_no_pulses_is_refused_in_one_line(changed, message) -> None:
    given = pulses(3) | changed if isinstance(changed, dict) else changed
    with pytest.raises(TableError, match=f"^the model's {message}") as refused:
        Table.from_result(result(given, events(1)))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"row": np.array([0, 0, 1])}, "row 1 is none of 1 events"),
        ({"row": np.array([-1, 0, 0])}, "row -1 is none of 1 events"),
        ({"time": np.array([0.9, 1.1, 1.2])}, r"0\.9 s is outside contact 1, 1\.0 to 1\.5 s"),
        ({"time": np.array([1.0, 1.1, 1.6])}, r"1\.6 s is outside contact 1, 1\.0 to 1\.5 s"),
    ],
)
def test_pulses_of_no_contact_are_refused(changed, message) -> None:
    table = Table.from_result(result(pulses(3) | changed, events(1)))
    with pytest.raises(TableError, match=f"run: its pulses: {message}"):
        check(table, ["slider_x"], name="run")


def test_pulses_without_events_are_refused() -> None:
    table = replace(Table.from_result(result(pulses(3), events(1))), events=None)
    assert isinstance(table.frame, pd.DataFrame)
    with pytest.raises(TableError, match="row 0 is none of 0 events"):
        check(table, ["slider_x"])
