"""Worker processes: what they inherit, and when they end (tests/cli has what their end costs).

How long a task may take is in test_tasks.
"""

import multiprocessing
import os
import signal
import time
from contextlib import closing

import pytest

from comparison.execution.pool import Share, kept_workers, work


def do(_task, report):
    """Return the process, and what it inherited."""
    for share in (-1.0, 0.5, 2.0):
        report(share)
    return os.getpid(), os.environ["OMP_NUM_THREADS"]


def test_workers_have_one_thread_and_live_on_where_they_are_kept_and_no_longer(monkeypatch):
    """One thread, whatever this process has: a sum over threads has no order of its own."""
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = dict(os.environ)

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
        another = pid_of()
        assert another != first
    for pid in (first, another):
        with pytest.raises(ProcessLookupError):  # one that ended and is not waited for is there
            os.kill(pid, 0)
    assert os.environ == before
