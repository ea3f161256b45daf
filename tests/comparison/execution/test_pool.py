"""Worker processes: what they inherit, and when they end (tests/cli has what their end costs).

How long a task may take is in test_tasks.
"""

import multiprocessing
import os
import signal
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from comparison.execution.pool import Share, kept_workers, work


def do(task, report):
    """Do what a task says; return the process, and what it inherited."""
    match task:
        case "report":
            for share in (-1.0, 0.5, 2.0):
                report(share)
        case partial():
            task()
        case Path():  # prepare until it is there, and report nothing
            while not task.exists():
                time.sleep(0.01)
    return os.getpid(), os.environ["OMP_NUM_THREADS"]


def test_of_a_kind_one_task_works_alone_until_it_reports(tmp_path):
    """The first one prepares until the file is there, which a task behind the waiting ones makes."""
    made, alone = tmp_path / "made", {"prepare": "a", "same": "a"}
    tasks = [("prepare", made), ("same", "report"), ("make", partial(made.touch)), ("last", "report")]
    with closing(work(do, tasks, 2, kinds=alone)) as results:
        events = list(results)
    order = [name for name, event in events if not isinstance(event, Share)]
    assert order.index("same") > order.index("prepare")
    assert {*order} == {name for name, _ in tasks}
    # Shares are bounded and come before the result.
    assert [event for name, event in events if name == "same"][:-1] == [Share(0.0), Share(0.5), Share(1.0)]


def test_workers_have_one_thread_and_live_on_where_they_are_kept_and_no_longer(monkeypatch):
    """One thread, whatever this process has: a sum over threads has no order of its own."""
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = dict(os.environ)

    def pid_of():
        with closing(work(do, [("one", "")], 1)) as events:
            [(_, (pid, threads))] = events
        assert threads == "1"
        return pid

    with kept_workers():
        with kept_workers():
            first = pid_of()
        assert pid_of() == first
        os.kill(first, signal.SIGKILL)
        while any(child.pid == first for child in multiprocessing.active_children()):
            time.sleep(0.01)
        another = pid_of()
        assert another != first
    for pid in (first, another):
        with pytest.raises(ProcessLookupError):  # one that ended and is not waited for is there
            os.kill(pid, 0)
    assert os.environ == before
