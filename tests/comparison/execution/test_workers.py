"""Worker processes: what they may print."""

from __future__ import annotations

import warnings
from contextlib import closing

from comparison.execution.workers import work


def warn(_task, _report):
    warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
    return "done"


def test_warnings_of_python_do_not_reach_the_terminal(capfd, monkeypatch):
    monkeypatch.setattr("sys.warnoptions", [])
    with closing(work(warn, [("one", None)], 1)) as events:
        assert list(events) == [("one", "done")]
    assert capfd.readouterr() == ("", "")
