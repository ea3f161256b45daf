"""Worker processes: what they may print, and when they end."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
import time
import warnings
from contextlib import closing
from pathlib import Path

from comparison.execution.worker_process import Share, kept_workers
from comparison.execution.workers import Died, Late, work


def warn(_task, _report):
    warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
    return "done"


def test_warnings_of_python_do_not_reach_the_terminal(capfd, monkeypatch):
    monkeypatch.setattr("sys.warnoptions", [])
    with closing(work(warn, [("one", None)], 1)) as events:
        assert list(events) == [("one", "done")]
    assert capfd.readouterr() == ("", "")


def threshold(_task, _report):
    return gc.get_threshold()[0]


def test_a_worker_looks_for_garbage_rarely_and_the_process_that_starts_it_as_before():
    before = gc.get_threshold()
    with closing(work(threshold, [("one", None)], 1)) as events:
        assert dict(events)["one"] >= 10_000
    assert gc.get_threshold() == before


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


def process(task, _report):
    """Return the process, and a variable of its environment; end it if so asked."""
    if task == "die":
        os._exit(1)
    return os.getpid(), os.environ.get("SIXBAR_TEST_VARIABLE")


def last_events(*tasks, environment=None):
    named = [(str(n), task) for n, task in enumerate(tasks)]
    with closing(work(process, named, 1, environment=environment)) as events:
        return [event for _, event in events]


def running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_workers_live_on_where_they_are_kept_and_no_longer():
    with kept_workers():
        [(first, _)], [(second, _)] = last_events("one"), last_events("two")
        assert first == second
        assert running(first)
    assert not running(first)
    [(alone, _)] = last_events("three")
    assert not running(alone)


def test_a_kept_worker_is_taken_for_its_own_environment_alone():
    with kept_workers():
        [(usual, _)] = last_events("one")
        [(other, value)] = last_events("two", environment={"SIXBAR_TEST_VARIABLE": "set"})
        assert (other != usual, value) == (True, "set")
        assert not running(usual)
        [(again, value)] = last_events("three", environment={"SIXBAR_TEST_VARIABLE": "set"})
        assert (again, value) == (other, "set")


def test_a_worker_that_died_is_not_kept():
    with kept_workers():
        died, (after, _) = last_events("die", "one")
        assert isinstance(died, Died)
        os.kill(after, signal.SIGKILL)
        while any(child.pid == after for child in multiprocessing.active_children()):
            time.sleep(0.01)
        [(another, _)] = last_events("two")
        assert another != after
