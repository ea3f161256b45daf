"""Tasks of studies: each is measured once, and again where anything that counts is another."""

import os
import signal
import time
from dataclasses import dataclass, field, replace

import pytest

from comparison.execution import tasks as module
from comparison.execution.pool import Died
from comparison.execution.run import Outcome, RunError
from comparison.execution.tasks import CRASHED, LATE, SUCCESS, Task, measure_all, on_processes
from comparison.scene import RandomInput, Scene, SceneError, load_scene

PAPER = load_scene("150rpm-0.2mm")
INPUT = RandomInput(key="clearance.slider", distribution="normal", deviation=1e-6)


@dataclass(frozen=True)
class Part:
    """Something that a task holds."""

    scene: Scene = PAPER
    sizes: tuple[float, ...] = (1.0, 2.0)
    input: RandomInput = INPUT


@dataclass(frozen=True)
class Square(Task):
    number: float
    part: Part = Part()
    named: dict[str, object] = field(default_factory=lambda: {"a": [1]})
    models = ("reference",)

    @property
    def cost(self):
        return self.number


def square(task, progress):
    progress(0.0)
    match task.number:
        case 13.0:
            raise ValueError("thirteen\nof all numbers")
        case 7.0:
            raise SceneError("seven is refused")
        case 5.0:
            job = type("Job", (), {"scene": type("S", (), {"name": "five"}), "model": "reference"})
            raise RunError(Outcome("chatter", "lower the tolerance"), job)
        case 11.0:
            os.kill(os.getpid(), signal.SIGKILL)
        case 17.0:
            time.sleep(600)
    return {"square": task.number**2}


@pytest.fixture
def here(monkeypatch, tmp_path):
    """Spread in this process, in a folder of its own; what was worked off."""
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(module, "code_hash", lambda *modules: " ".join(modules))
    log = []

    def spread(attempt, tasks):
        for key, task in tasks.items():
            log.append(task.number)
            yield key, Died("its process was killed") if task.number == 3.0 else attempt(task, lambda _: None)

    return spread, log


def measured(here, *numbers, **options):
    return measure_all(square, [Square(number) for number in numbers], here[0], **options)


def test_rows_come_in_the_order_of_the_tasks_and_equal_ones_are_measured_once(here, tmp_path):
    rows = measured(here, 2.0, 4.0, 2.0)
    assert [row["square"] for row in rows] == [4.0, 16.0, 4.0]
    assert here[1] == [4.0, 2.0]  # the longest first
    assert {row["status"] for row in rows} == {SUCCESS}
    assert all(row["seconds"] >= 0.0 for row in rows)
    # What was measured is not measured again.
    assert measured(here, 4.0, 6.0, 2.0)[::2] == rows[1:]
    assert here[1] == [4.0, 2.0, 6.0]
    assert len(list(tmp_path.glob("rows-*/*"))) == 3
    measured(here, 2.0, folder=tmp_path / "mine")  # or where one asks
    assert len(list(tmp_path.glob("mine/*"))) == 1
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        measured(here, 4.0, folder=tmp_path / "file" / "mine")


def test_whatever_can_change_a_row_makes_it_stale_and_nothing_else(here, monkeypatch):
    def count(task):
        before = len(here[1])
        measure_all(square, [task], here[0])
        return len(here[1]) - before

    monkeypatch.setattr(Square, "__module__", "tasks")
    task = Square(2.0)
    assert count(task) == 1
    for part in (
        Part(PAPER.variant({"drive.speed_rpm": 100.0})),
        Part(sizes=(1.0, 3.0)),
        Part(input=INPUT.model_copy(update={"deviation": 2e-6})),
    ):
        assert count(replace(task, part=part)) == 1
    for change in ({"named": {"a": [2]}}, {"number": 3.5}):
        assert count(replace(task, **change)) == 1
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
            assert count(task) == 1
    for same in (task, replace(task, part=Part(PAPER.with_values({"scene.title": "another"})))):
        assert count(same) == 0


def test_what_goes_wrong_is_a_row_and_is_kept_but_not_that_a_process_died(here):
    expected = {5.0: "chatter", 7.0: "bad input", 13.0: CRASHED, 3.0: CRASHED}
    for _ in range(2):
        rows = dict(zip(expected, measured(here, *expected), strict=True))
        assert {number: row["status"] for number, row in rows.items()} == expected
    assert rows[13.0]["message"] == "ValueError: thirteen of all numbers"
    assert rows[5.0]["message"] == "lower the tolerance"
    assert rows[3.0]["message"] == "its process was killed"
    assert sorted(here[1]) == [3.0, 3.0, 5.0, 7.0, 13.0]


def test_on_processes_one_that_dies_is_lost_and_one_that_is_late_is_a_row():
    tasks = {name: Square(number) for name, number in (("usual", 2.0), ("dies", 11.0), ("hangs", 17.0))}
    rows = dict(on_processes(1, limit=4.0)(square, tasks))  # each has 40 s to start
    assert rows["usual"] == {"square": 4.0}
    assert rows["dies"] == Died("its process was killed by SIGKILL")
    assert rows["hangs"] == {"status": LATE, "message": "stopped after 4 s", "share": 0.0}
