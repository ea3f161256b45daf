"""Worker processes: what they inherit, and when they end (tests/cli has what their end costs)."""

import multiprocessing
import os
import signal
import time
import warnings
from contextlib import closing
from functools import partial
from pathlib import Path

from comparison.execution.pool import Late, Share, kept_workers, work


def do(task, report):
    """Do what a task says; return the process, and what it inherited."""
    match task:
        case "warn":
            warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
        case "interrupt":  # as by a terminal's Ctrl-C, which all processes get
            os.kill(os.getpid(), signal.SIGINT)
        case "wait":
            report(0.0)  # its work begins
            report(0.25)
            time.sleep(600)
        case "report":
            for share in (-1.0, 0.5, 2.0):
                report(share)
        case partial():
            task()
        case Path():  # prepare until it is there, and report nothing
            while not task.exists():
                time.sleep(0.01)
    return os.getpid(), os.environ["OMP_NUM_THREADS"]


def events_of(*tasks, **options):
    named = [(f"{number} {task}", task) for number, task in enumerate(tasks)]
    with closing(work(do, named, 1, **options)) as events:
        return list(events)


def test_of_a_kind_one_task_works_alone_until_it_reports(tmp_path):
    """The first one prepares until the file is there, which a task behind the waiting ones makes."""
    made, alone = tmp_path / "made", {"prepare": "a", "same": "a"}
    tasks = [("prepare", made), ("same", "report"), ("make", partial(made.touch)), ("last", "report")]
    with closing(work(do, tasks, 2, groups=alone)) as events:
        order = [name for name, event in events if not isinstance(event, Share)]
    assert order.index("same") > order.index("prepare")
    assert {*order} == {name for name, _ in tasks}


def running(pid):
    """Return whether there is such a process; one that ended and is not waited for is there."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_warnings_of_python_do_not_reach_the_terminal_nor_an_interrupt_a_worker(capfd, monkeypatch):
    monkeypatch.setattr("sys.warnoptions", [])
    (_, warned), (_, interrupted), *shares, (_, last) = events_of("warn", "interrupt", "report")
    assert warned == interrupted == last  # of one process
    # Shares are bounded and come before the result.
    assert [event for _, event in shares] == [Share(0.0), Share(0.5), Share(1.0)]
    assert capfd.readouterr() == ("", "")


def test_workers_have_one_thread_and_this_process_keeps_its_own(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = dict(os.environ)
    [(_, (_, threads))] = events_of("one")
    # One thread all the same: a sum over threads has no order of its own.
    assert (threads, dict(os.environ)) == ("1", before)


def test_the_limit_counts_from_a_share_of_0_and_preparing_may_take_ten_times_as_long(tmp_path):
    """What works is stopped first, with its share; what still prepares then is not, and has 27 s left."""
    late, last = tmp_path / "late", {}
    tasks = [("works", "wait"), ("prepares", late), ("next", late)]
    with closing(work(do, tasks, 2, limit=3.0)) as events:
        for name, event in events:
            last[name] = event
            if isinstance(event, Late):
                late.touch()
    assert last["works"] == Late(0.25)
    assert all(isinstance(last[name], tuple) for name in ("prepares", "next"))


def test_workers_live_on_where_they_are_kept_and_no_longer():
    def pid_of():
        *_, (_, (pid, *_)) = events_of("one")
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
    assert not running(first)
    assert not running(another)
    assert not running(pid_of())
