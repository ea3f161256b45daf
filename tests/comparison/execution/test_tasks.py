"""Tasks of studies: their rows are found again by what can change them, and by nothing else."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import pytest

from comparison.execution import tasks as module
from comparison.execution.pool import Died
from comparison.execution.run import Outcome, RunError
from comparison.execution.store import LedgerError, read_rows
from comparison.execution.tasks import CRASHED, LATE, SUCCESS, Task, measure_all, on_processes
from comparison.scene import RandomInput, Scene, SceneError, load_scene


@dataclass(frozen=True)
class Square(Task):
    """A number to be squared."""

    number: float
    environment: tuple[tuple[str, str], ...] = ()
    models = ("reference",)

    @property
    def cost(self) -> float:
        return self.number


@dataclass(frozen=True)
class Part:
    """Something that a task holds."""

    scene: Scene
    sizes: tuple[float, ...]


@dataclass(frozen=True)
class Whole(Task):
    """A task that says nothing of what distinguishes it."""

    part: Part
    inputs: tuple[RandomInput, ...]
    named: Mapping[str, object]
    models = ("reference",)


def test_a_task_is_identified_by_all_its_fields_and_a_scene_by_what_changes_its_results():
    scene = load_scene("150rpm-0.2mm")
    one = RandomInput(key="clearance.slider", distribution="normal", deviation=1e-6)
    task = Whole(Part(scene, (1.0, 2.0)), (one,), {"a": 1})
    found = task.identity
    part = {"scene": scene.hash, "sizes": [1.0, 2.0]}
    assert json.loads(json.dumps(found)) == {"part": part, "inputs": [one.model_dump()], "named": {"a": 1}}
    renamed = replace(task, part=replace(task.part, scene=scene.with_values({"scene.title": "another"})))
    assert renamed.identity == found
    slower = scene.with_values({"drive.speed_rpm": 100.0})
    for change in (
        {"part": replace(task.part, scene=slower)},
        {"part": replace(task.part, sizes=(1.0, 3.0))},
        {"inputs": (one.model_copy(update={"deviation": 2e-6}),)},
        {"named": {"a": 2}},
    ):
        assert replace(task, **change).identity != found


def square(task, progress):
    progress(0.0)
    if task.number == 13.0:
        raise ValueError("thirteen\nof all numbers")
    if task.number == 7.0:
        raise SceneError("seven is refused")
    if task.number == 5.0:
        job = type("Job", (), {"scene": type("S", (), {"name": "five"}), "model": "reference"})
        raise RunError(Outcome("chatter", "lower the tolerance"), job)
    return {"square": task.number**2}


def attempted(task, progress):
    if task.number == 11.0:
        os.kill(os.getpid(), signal.SIGKILL)
    progress(0.0)
    while task.number == 17.0:
        time.sleep(0.01)
    return square(task, progress)


@pytest.fixture
def here(monkeypatch, tmp_path):
    """Spread in this process, in a folder of its own; what was worked off, environment by environment."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(module, "code_hash", lambda *modules: " ".join(modules))
    log = []

    def spread(attempt, tasks):
        for key, task in tasks.items():
            log.append((task.number, task.environment))
            yield key, Died("its process was killed") if task.number == 3.0 else attempt(task, lambda _: None)

    return spread, log


def measured(here, *numbers, **options):
    return measure_all(square, [Square(number) for number in numbers], here[0], **options)


def test_rows_come_in_the_order_of_the_tasks_and_equal_ones_are_measured_once(here, tmp_path):
    rows = measured(here, 2.0, 4.0, 2.0)
    assert [row["square"] for row in rows] == [4.0, 16.0, 4.0]
    assert [number for number, _ in here[1]] == [4.0, 2.0]  # the longest first
    assert {row["status"] for row in rows} == {SUCCESS}
    assert all(row["seconds"] >= 0.0 for row in rows)
    # What was measured is not measured again.
    assert measured(here, 4.0, 6.0, 2.0)[::2] == rows[1:]
    assert [number for number, _ in here[1]] == [4.0, 2.0, 6.0]
    assert len(list(tmp_path.glob("*.jsonl"))) == 1


def test_other_code_of_measure_or_task_another_model_or_machine_makes_rows_stale(here, monkeypatch):
    monkeypatch.setattr(Square, "__module__", "tasks")
    measured(here, 2.0)
    for name, value in (
        ("code_hash", lambda *names: " ".join(name.replace(square.__module__, "other") for name in names)),
        ("code_hash", lambda *names: " ".join(name.replace("tasks", "other") for name in names)),
        ("fingerprint", lambda _: "another model"),
        ("platform_name", lambda: "another machine"),
        ("versions", lambda: {"numpy": "another"}),
        ("version", lambda _: "another"),
    ):
        with monkeypatch.context() as changed:
            changed.setattr(module, name, value)
            measured(here, 2.0)
    measured(here, 2.0)
    assert len(here[1]) == 7


def test_what_goes_wrong_is_a_row_and_is_kept_but_not_that_a_process_died(here):
    expected = {5.0: "chatter", 7.0: "bad input", 13.0: CRASHED, 3.0: CRASHED}
    for _ in range(2):
        rows = dict(zip(expected, measured(here, *expected), strict=True))
        assert {number: row["status"] for number, row in rows.items()} == expected
    assert rows[13.0]["message"] == "ValueError: thirteen of all numbers"
    assert rows[5.0]["message"] == "lower the tolerance"
    assert rows[3.0]["message"] == "its process was killed"
    assert sorted(number for number, _ in here[1]) == [3.0, 3.0, 5.0, 7.0, 13.0]


def test_tasks_of_one_environment_follow_one_another(here):
    variants = ((), (("A", "1"),))
    rows = measure_all(square, [Square(n, variant) for n in (1.0, 2.0) for variant in variants], here[0])
    assert [row["square"] for row in rows] == [1.0, 1.0, 4.0, 4.0]
    first, second, third, fourth = (environment for _, environment in here[1])
    assert first == second != third == fourth


def test_progress_goes_by_the_expected_time(here):
    shares = []
    measured(here, 1.0, 3.0)
    measured(here, 1.0, 3.0, 4.0, on_progress=shares.append)
    assert shares == [pytest.approx(5.0 / 8.0), pytest.approx(1.0)]  # the one that died is tried again


def test_rows_are_kept_where_one_asks_and_a_folder_that_is_not_there_is_reported(here, tmp_path):
    ledger = tmp_path / "mine.jsonl"
    measured(here, 2.0, ledger=ledger)
    assert [row["square"] for row in read_rows(ledger).values()] == [4.0]
    with pytest.raises(LedgerError, match="cannot be written"):
        measured(here, 4.0, ledger=tmp_path / "nowhere" / "mine.jsonl")


def test_on_processes_one_that_dies_is_lost_and_one_that_is_late_is_a_row():
    tasks = {name: Square(number) for name, number in (("usual", 2.0), ("dies", 11.0), ("hangs", 17.0))}
    rows = dict(on_processes(1, limit=4.0)(attempted, tasks))  # each has 40 s to start
    assert rows["usual"] == {"square": 4.0}
    assert rows["dies"] == Died("its process was killed by SIGKILL")
    assert rows["hangs"] == {"status": LATE, "message": "stopped after 4 s", "share": 0.0}
