"""The fixture for other people's tests, and the recipes of docs/ci.md: they pass as they are written."""

import re
import shlex
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path

import pandas as pd
import pytest

from comparison.cli import main
from comparison.tables.table_files import write

ROOT = Path(str(files("comparison"))).parent
TEXT = (ROOT / "docs" / "ci.md").read_text("utf-8")
BLOCKS = dict(re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", TEXT, re.DOTALL | re.MULTILINE))
FAILING = """

def test_differ(assert_agree):
    assert_agree("reference.csv", "far.csv", scene="150rpm-0.2mm", tolerance=1e-5)

def test_no_file(assert_agree):
    assert_agree("nowhere.csv", "reference.csv", tolerance=1.0)
"""
EXPECTED = """
import numpy as np
import pandas as pd

time = np.arange(101) * 0.01
made = pd.DataFrame({"time": time, "slider_x": np.sin(time * RATE), "slider_y": time})

def test_expected(assert_agree):
    assert_agree(made, "expected/run.csv", channels=["slider_x"], tolerance=1e-12)
"""
OVER_ANGLE = """
import numpy as np
import pandas as pd

angle = np.arange(101) * 0.01
made = pd.DataFrame({"crank_angle": angle, "crank_speed": np.ones(101), "slider_x": np.sin(angle * RATE)})

def test_expected(assert_agree):
    assert_agree(made, "expected/run.csv", abscissa="crank_angle", tolerance=1e-12)
"""


def block(section, language):
    (code,) = re.findall(rf"```{language}\n(.*?)```", BLOCKS[section], re.DOTALL)
    return code


def test_the_tests_of_the_recipe_pass_and_others_fail_with_the_verdict(pytester, make_table, monkeypatch):
    # The plugin is named here, whether or not the package is installed with its entry point.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for name in ("CI", "BUILD_NUMBER"):  # with them pytest says every message twice
        monkeypatch.delenv(name, raising=False)
    for name, stretch in (("reference", 0.0), ("mine", 1e-6), ("far", 1e-3)):
        write(make_table(stretch=stretch), pytester.path / f"{name}.csv")
    pytester.makepyfile(block("A test of your own", "python") + FAILING)
    # A process of its own: numpy cannot be imported twice in one.
    inner = pytester.runpytest_subprocess("-p", "comparison.pytest_plugin", "-W", "error", "--tb=short")
    inner.assert_outcomes(passed=2, failed=2)
    output = inner.stdout.str()
    head = "reference.csv and far.csv on scene '150rpm-0.2mm': differ: "
    assert re.search(f"{head}.* times those of .*21 of 21 channels differ", output)  # its cause first
    assert "  slider_x: differ: 396 of 401 samples" in output
    assert "cannot compare: nowhere.csv: No such file" in output
    assert "pytest_plugin.py" not in output  # the traceback ends in the test


def test_an_expected_table_is_written_where_it_is_missing_or_asked_for(pytester, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    expected = pytester.path / "expected" / "run.csv"

    def run(rate, *options, **outcomes):
        pytester.makepyfile(EXPECTED.replace("RATE", f"float('{rate}')"))
        inner = pytester.runpytest_subprocess("-p", "comparison.pytest_plugin", "-W", "error", *options)
        inner.assert_outcomes(**outcomes)
        return inner.stdout.str()

    assert "expected/run.csv was missing, and is written from table a" in run(1.0, failed=1)
    assert list(pd.read_csv(expected)) == ["time", "slider_x"]
    run(1.0, passed=1)
    before = expected.read_bytes()
    assert "1 of 1 channels differ" in run(1.01, failed=1)
    assert expected.read_bytes() == before  # what differs is not overwritten
    run(1.01, "--sixbar-update", passed=1)
    run(1.01, passed=1)
    run(1.0, failed=1)
    # A table that could not be compared is no expectation.
    before = expected.read_bytes()
    assert "slider_x is nan" in run(float("nan"), "--sixbar-update", failed=1)
    assert expected.read_bytes() == before


def test_an_expected_table_over_the_crank_angle_is_written_and_read(pytester, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for rate, outcome in ((1.0, "failed"), (1.0, "passed"), (1.01, "failed")):  # written, equal, another
        pytester.makepyfile(OVER_ANGLE.replace("RATE", str(rate)))
        inner = pytester.runpytest_subprocess("-p", "comparison.pytest_plugin", "-W", "error")
        inner.assert_outcomes(**{outcome: 1})
    assert "1 of 1 channels differ" in inner.stdout.str()


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


@pytest.mark.usefixtures("fake_models", "elsewhere")
def test_the_commands_of_the_recipes_pass_one_after_another(capsys):
    extends = '[scene]\nextends = "paper"\n[output]\nsamples_per_cycle = 100\ngroups = []\n'
    Path("tiny.toml").write_text(extends)
    commands = [shlex.split(line) for line in block("The regression gate", "sh").splitlines()]
    assert commands == [["sixbar", "gate", "--update"], ["sixbar", "gate"]]
    for arguments in (
        ["gate", "tiny.toml", "--update"],
        ["gate", "--out", "out/gate"],
        ["validate", "tiny.toml", "--out", "out/validate"],
    ):
        assert main([*arguments, "--jobs", "1"]) == 0, capsys.readouterr()
    for name in re.findall(r"`(\w+\.(?:xml|md|json|html))`", BLOCKS["What both commands write"]):
        assert list(Path("out").glob(f"*/{name}")), name
