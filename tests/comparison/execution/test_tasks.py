"""Tasks of studies: measured once, and again where anything that counts is another (rows: test_sweep)."""

import os
import signal
import time
from dataclasses import dataclass, field, replace

import pytest

from comparison.execution.pool import Died
from comparison.execution.tasks import LATE, Task, measure_all, on_processes
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


def test_whatever_can_change_a_row_makes_it_stale_and_nothing_else(tmp_path):
    def elsewhere(task, progress):
        return square(task, progress)

    def measured(*tasks, by=square, folder=tmp_path):
        """Count those whose rows were not there."""
        log = []

        def spread(attempt, waiting):
            for key, task in waiting.items():
                log.append(key)
                yield key, attempt(task, abs)

        measure_all(by, tasks, spread, folder=folder)
        return len(log)

    elsewhere.__module__ = "comparison.files"
    task = Square(2.0)
    parts = (
        Part(PAPER.variant({"drive.speed_rpm": 100.0})),
        Part(sizes=(1.0, 3.0)),
        Part(input=INPUT.model_copy(update={"bins": 11})),
    )
    changes = [{}, *({"part": part} for part in parts)]
    changes += [{"named": {"a": [2]}}, {"number": 3.5}]
    tasks = [replace(task, **change) for change in changes]
    assert measured(*tasks, *tasks) == len(changes)
    assert (measured(task, by=elsewhere), measured(Elsewhere(2.0))) == (1, 1)
    same = replace(task, part=Part(PAPER.with_values({"scene.title": "another"})))
    assert measured(task, same) == 0
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):  # what cannot be stored is not lost in silence
        measured(task, folder=tmp_path / "file" / "mine")


def test_on_processes_one_that_dies_is_lost_and_one_that_is_late_is_a_row():
    tasks = {name: Square(number) for name, number in (("usual", 2.0), ("dies", 11.0), ("hangs", 17.0))}
    rows = dict(on_processes(1, limit=4.0)(square, tasks))  # each has 40 s to start
    assert rows["usual"] == {"square": 4.0}
    assert rows["dies"] == Died("its process was killed by SIGKILL")
    assert rows["hangs"] == {"status": LATE, "message": "stopped after 4 s", "share": 0.0}
