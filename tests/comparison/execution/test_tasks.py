"""Tasks of studies are measured once, and again after each change that counts; their processes.

Rows are in test_sweep; the cost of the end of a process is in tests/cli.
"""

import multiprocessing
import os
import signal
import time
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from comparison.execution.pool import Share, kept_workers, work
from comparison.execution.tasks import LATE, Task, measure_all, on_processes
from comparison.scene import Reliability, Scene, load_scene

PAPER = load_scene("150rpm-0.2mm")


@dataclass(frozen=True)
class Part:
    scene: Scene = PAPER
    sizes: tuple[float, ...] = (1.0, 2.0)
    input: Reliability = Reliability()  # noqa: RUF009 # it cannot be changed


@dataclass(frozen=True)
class Square(Task):
    number: float
    part: Part = Part()
    flag: Path | None = None
    models = ("reference",)

    @property
    def cost(self):
        return self.number


class ForeignTask(Square):
    """A task that another module would define."""

    __module__ = "comparison.formatting"


def square(task, progress):
    while task.flag and not task.flag.exists():  # it prepares
        time.sleep(0.01)
    progress(0.0)
    if task.number == 17.0:
        progress(0.25)
        time.sleep(600)
    return {"square": task.number**2}


def foreign_square(task, progress):
    return square(task, progress)


foreign_square.__module__ = "comparison.files"


def test_whatever_can_change_a_row_makes_it_stale_and_nothing_else(tmp_path):
    def count(*tasks, measure=square, folder=tmp_path):
        """Return the number of tasks whose rows were not stored."""
        log = []

        def spread(attempt, waiting):
            for key, task in waiting.items():
                log.append(key)
                yield key, attempt(task, abs)

        measure_all(measure, tasks, spread, folder=folder)
        return len(log)

    task, other = Square(2.0), PAPER.variant({"drive.speed_rpm": 100.0})
    bins = Reliability().model_copy(update={"bins": 11})
    parts = (Part(), Part(other), Part(sizes=(1.0, 3.0)), Part(input=bins))
    tasks = [*(replace(task, part=part) for part in parts), replace(task, number=3.5)]
    assert count(*tasks, *tasks) == len(tasks)
    assert (count(task, measure=foreign_square), count(ForeignTask(2.0))) == (1, 1)
    twin = replace(task, part=Part(PAPER.with_values({"scene.title": "another"})))
    assert count(task, twin) == 0
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):  # what cannot be stored is not lost in silence
        count(task, folder=tmp_path / "file" / "mine")


def test_one_that_is_late_is_a_row_and_preparing_may_take_ten_times_as_long(tmp_path):
    """The working process is stopped first, with its share; the preparing one then has 27 s more."""
    flag, rows = tmp_path / "made", {}
    tasks = {"late": Square(17.0), "prepares": Square(2.0, flag=flag)}
    for name, row in on_processes(2, limit=3.0)(square, tasks):
        rows[name] = row
        if name == "late":
            flag.touch()
    assert rows == {
        "late": {"status": LATE, "message": "stopped after 3 s", "share": 0.25},
        "prepares": {"square": 4.0},
    }


def do(_task, report):
    """Return the number of the process, and a variable that it inherited."""
    for share in (-1.0, 0.5, 2.0):
        report(share)
    return os.getpid(), os.environ["OMP_NUM_THREADS"]


def test_workers_have_one_thread_and_live_on_where_they_are_kept_and_no_longer(monkeypatch):
    """One thread: a sum over threads has no order of its own."""
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    environment = dict(os.environ)

    def pid_of():
        with closing(work(do, [("one", "")], 1)) as events:
            *shares, (pid, threads) = (event for _, event in events)
        assert (shares, threads) == ([Share(0.0), Share(0.5), Share(1.0)], "1")
        return pid

    with kept_workers():
        with kept_workers():
            first = pid_of()
        assert pid_of() == first
        os.kill(first, signal.SIGKILL)
        while any(child.pid == first for child in multiprocessing.active_children()):
            time.sleep(0.01)
        second = pid_of()
        assert second != first
    with pytest.raises(ProcessLookupError):  # a process that ended unawaited would be there
        os.kill(second, 0)
    assert os.environ == environment
