"""Tasks of studies: measured once, and again where anything that counts is another (rows: test_sweep)."""

import os
import signal
import time
from dataclasses import dataclass, field, replace

import pytest

from comparison.execution.pool import Died
from comparison.execution.tasks import LATE, SUCCESS, Task, measure_all, on_processes
from comparison.scene import Reliability, Scene, load_scene

PAPER = load_scene("150rpm-0.2mm")
INPUT = Reliability()


@dataclass(frozen=True)
class Part:
    """Something that a task holds."""

    scene: Scene = PAPER
    sizes: tuple[float, ...] = (1.0, 2.0)
    input: Reliability = INPUT


@dataclass(frozen=True)
class Square(Task):
    number: float
    part: Part = Part()
    named: dict[str, object] = field(default_factory=lambda: {"a": [1]})
    models = ("reference",)

    @property
    def cost(self):
        return self.number


class Elsewhere(Square):
    """A task that another module would define."""

    __module__ = "comparison.formatting"


def square(task, progress):
    progress(0.0)
    match task.number:
        case 11.0:
            os.kill(os.getpid(), signal.SIGKILL)
        case 17.0:
            time.sleep(600)
    return {"square": task.number**2}


@pytest.fixture
def measured(tmp_path):
    """Measure tasks in this process, with a folder of its own; the numbers of those that were not there."""

    def measure(*tasks, by=square, folder=tmp_path):
        log = []

        def spread(attempt, waiting):
            for key, task in waiting.items():
                log.append(task.number)
                yield key, Died("its process was killed") if task.number == 3.0 else attempt(task, abs)

        return measure_all(by, tasks, spread, folder=folder), log

    return measure


def test_rows_come_in_the_order_of_the_tasks_and_equal_ones_are_measured_once(measured, tmp_path):
    rows, log = measured(*map(Square, (2.0, 4.0, 2.0)))
    assert [row["square"] for row in rows] == [4.0, 16.0, 4.0]
    assert log == [4.0, 2.0]  # the longest first
    assert {(row["status"], row["seconds"] >= 0.0) for row in rows} == {(SUCCESS, True)}
    # What was measured is not measured again, unless its process died.
    again, log = measured(*map(Square, (4.0, 3.0, 2.0)))
    assert (again[::2], log) == (rows[1:], [3.0])
    assert measured(Square(3.0))[1] == [3.0]
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        measured(Square(4.0), folder=tmp_path / "file" / "mine")


def test_whatever_can_change_a_row_makes_it_stale_and_nothing_else(measured):
    def elsewhere(task, progress):
        return square(task, progress)

    elsewhere.__module__ = "comparison.files"
    task = Square(2.0)
    parts = (
        Part(PAPER.variant({"drive.speed_rpm": 100.0})),
        Part(sizes=(1.0, 3.0)),
        Part(input=INPUT.model_copy(update={"bins": 11})),
    )
    changes = [{}, *({"part": part} for part in parts)]
    changes += [{"named": {"a": [2]}}, {"number": 3.5}]
    assert [len(measured(replace(task, **change))[1]) for change in changes] == [1] * len(changes)
    assert (len(measured(task, by=elsewhere)[1]), len(measured(Elsewhere(2.0))[1])) == (1, 1)
    same = replace(task, part=Part(PAPER.with_values({"scene.title": "another"})))
    assert measured(task, same)[1] == []


def test_on_processes_one_that_dies_is_lost_and_one_that_is_late_is_a_row():
    tasks = {name: Square(number) for name, number in (("usual", 2.0), ("dies", 11.0), ("hangs", 17.0))}
    rows = dict(on_processes(1, limit=4.0)(square, tasks))  # each has 40 s to start
    assert rows["usual"] == {"square": 4.0}
    assert rows["dies"] == Died("its process was killed by SIGKILL")
    assert rows["hangs"] == {"status": LATE, "message": "stopped after 4 s", "share": 0.0}
