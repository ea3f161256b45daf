"""The fixture that the package brings to other people's tests."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path

import numpy as np

from comparison.tables.table_files import write

ROOT = Path(str(files("comparison"))).parent
TESTS = """
import pandas as pd
import pytest
from pathlib import Path

from comparison.tables.table_files import read


def test_equal(assert_agree):
    assert_agree("a.csv", read("a.csv"), scene="150rpm-0.2mm", tolerance=1e-12)
    assert_agree(Path("a.csv"), pd.read_csv("a.csv"), tolerance=1e-12)
    assert_agree("a.csv", "b.csv", tolerance=1e-2)


def test_differ(assert_agree):
    assert_agree("a.csv", "b.csv", scene="150rpm-0.2mm", tolerance=1e-5)


def test_no_tolerance(assert_agree):
    assert_agree("a.csv", "b.csv")


def test_no_tolerance_allowed(assert_agree):
    assert_agree("a.csv", "b.csv", allow_indeterminate=True)
    with pytest.raises(AssertionError, match="differ"):
        assert_agree("a.csv", "b.csv", tolerance=1e-5, allow_indeterminate=True)


def test_missing(assert_agree):
    assert_agree("a.csv", pd.read_csv("a.csv").drop(columns="slider_vy"), tolerance=1.0)


def test_one_channel(assert_agree):
    assert_agree("a.csv", "still.csv", tolerance=1e-6)


def test_no_file(assert_agree):
    assert_agree("a.csv", "nowhere.csv", tolerance=1.0)
"""


def test_the_fixture_passes_and_fails_with_the_verdict(pytester, make_table, monkeypatch):
    # The plugin is named here, whether or not the package is installed with its entry point.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for name in ("CI", "BUILD_NUMBER"):  # with them pytest says every message twice
        monkeypatch.delenv(name, raising=False)
    write(make_table(), pytester.path / "a.csv")
    write(make_table(stretch=1e-3), pytester.path / "b.csv")
    write(make_table(slider_omega=np.zeros(401)), pytester.path / "still.csv")
    pytester.makepyfile(TESTS)
    # A process of its own: numpy cannot be imported twice in one.
    inner = pytester.runpytest_subprocess("-p", "comparison.pytest_plugin", "-W", "error", "--tb=short")
    inner.assert_outcomes(passed=2, failed=5)
    output = inner.stdout.str()
    assert "a.csv and b.csv on scene '150rpm-0.2mm': differ: 21 of 21 channels differ" in output
    assert "  slider_x: differ: 396 of 401 samples" in output
    assert "a.csv and b.csv: indeterminate: 21 of 21 channels are indeterminate" in output
    assert "a.csv and still.csv: differ: 1 of 21 channels differ, most of all slider_omega" in output
    assert output.count("slider_omega: differ: ") == 2  # in b.csv and here
    assert output.count("slider_x: differ: ") == 1  # in b.csv
    assert "cannot compare: table b: channel slider_vy is missing" in output
    assert "cannot compare: nowhere.csv: No such file" in output
    assert "pytest_plugin.py" not in output  # the traceback ends in the test


def test_the_entry_point_names_the_plugin_and_its_import_is_cheap():
    points = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["entry-points"]
    module = points["pytest11"]["sixbar"]
    code = (
        f"import sys, pytest; before = set(sys.modules); import {module}; print(*set(sys.modules) - before)"
    )
    output = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert set(output.stdout.split()) <= {"comparison", module, "__future__"}
