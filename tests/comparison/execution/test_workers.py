"""Worker processes: what they may print, and when they end."""

from __future__ import annotations

import os
import threading
import time
import warnings
from contextlib import closing
from pathlib import Path

from comparison.execution.workers import Died, Late, Share, work


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


def compiles(task, report):
    """Compile until the awaited file is there; then say so, and what was compiled when this began."""
    own, awaited = (Path(name) for name in task)
    found = sorted(path.name for path in own.parent.iterdir())
    own.with_suffix(".begun").touch()
    while not awaited.exists():
        time.sleep(0.01)
    own.touch()
    report(0.5)
    return found


def test_no_code_is_compiled_by_two_workers_at_once(tmp_path):
    """One waits for what the other compiles, and what needs other code overtakes it."""
    first, second, other = (str(tmp_path / name) for name in ("first", "second", "other"))
    tasks = [("first", (first, f"{other}.begun")), ("second", (second, first)), ("other", (other, first))]
    same = frozenset([("some", "code")])
    kernels = {"first": same, "second": same, "other": frozenset([("other", "code")])}
    with closing(work(compiles, tasks, 2, until=time.monotonic() + 60.0, kernels=kernels)) as events:
        ended = {name: event for name, event in events if not isinstance(event, Share)}
    assert "first" not in ended["other"]
    assert "first" in ended["second"]


def die(task, _report):
    if task == "first":
        os._exit(1)
    return "done"


def test_code_whose_compilation_died_is_not_waited_for():
    kernels = dict.fromkeys(("first", "second"), frozenset([("some", "code")]))
    with closing(work(die, [(name, name) for name in kernels], 2, kernels=kernels)) as events:
        ended = dict(events)
    assert isinstance(ended["first"], Died)
    assert ended["second"] == "done"
