"""Worker processes: what they may print, and when they end."""

from __future__ import annotations

import threading
import time
import warnings
from contextlib import closing

from comparison.execution.workers import Late, work


def warn(_task, _report):
    warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
    return "done"


def test_warnings_of_python_do_not_reach_the_terminal(capfd, monkeypatch):
    monkeypatch.setattr("sys.warnoptions", [])
    with closing(work(warn, [("one", None)], 1)) as events:
        assert list(events) == [("one", "done")]
    assert capfd.readouterr() == ("", "")


def forever(_task, report):
    report(0.25)
    threading.Event().wait()


def test_at_a_given_time_all_that_runs_is_terminated_and_nothing_else_begins():
    """However long a process takes to start: one that has not begun by then ends too."""
    tasks = [(name, None) for name in "abc"]
    with closing(work(forever, tasks, 2, until=time.monotonic() + 0.5)) as events:
        last = dict(events)
    assert set(last) == {"a", "b"}
    assert all(isinstance(event, Late) for event in last.values())
    with closing(work(forever, tasks, 2, until=time.monotonic())) as events:
        assert list(events) == []
