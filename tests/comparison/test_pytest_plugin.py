"""The fixture for other people's tests, and the recipes of docs/ci.md: they pass as they are written."""

import shutil
import subprocess
import sys
import tomllib

import pytest
from doc_pages import ROOT, block

import sixbar

# The plugin imports these when a test uses it: pytest inside pytest forgets its own imports.
from comparison.report import figures, page  # noqa: F401
from comparison.scene import load_scene
from comparison.tables.table_files import write
from comparison.verdict import recorded  # noqa: F401

EXAMPLE = """
import subprocess, sys

def test_press(assert_agree, tmp_path):
    subprocess.run([sys.executable, "simulate.py", tmp_path / "result.csv"], check=True)
    assert_agree("tables/new.csv", tmp_path / "result.csv", tolerance=1e-3)
"""


@pytest.fixture(autouse=True)
def _no_autoload(monkeypatch):
    """The options of `run` name the plugin: the entry point of an installed package must not."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for name in ("CI", "BUILD_NUMBER"):  # with them pytest says every message twice
        monkeypatch.delenv(name, raising=False)


def run(pytester, *options, **outcomes):
    result = pytester.runpytest_inprocess("-p", "comparison.pytest_plugin", "-W", "error", *options)
    result.assert_outcomes(**outcomes)
    return result.stdout.str()


def test_the_tests_of_the_recipe_pass_and_others_fail_with_the_verdict(pytester, make_table):
    pytester.makepyfile(block("docs/ci.md", "python"))
    for stretch, outcomes in ((1e-6, {"passed": 2}), (1e-3, {"passed": 1, "failed": 1})):
        write(make_table(), pytester.path / "reference.csv")
        write(make_table(stretch=stretch), pytester.path / "mine.csv")
        output = run(pytester, "--tb=short", **outcomes)
    assert "pytest_plugin.py" not in output  # the traceback ends in the test


def test_an_expected_table_through_its_life_in_the_example_of_a_repository(pytester):
    shutil.copytree(ROOT / "examples" / "ci", pytester.path, dirs_exist_ok=True)
    program = pytester.path / "simulate.py"
    (test,) = (pytester.makepyfile(EXAMPLE),)
    expected, folder = pytester.path / "tables" / "new.csv", pytester.path / "tables" / "obtained"
    assert "tables/new.csv was missing, and is written from " in run(pytester, failed=1)
    first = expected.read_bytes()
    assert first.startswith(b"time [s],angle [rad],speed [rad/s]")
    run(pytester, passed=1)
    # A longer pendulum: the new table is put beside the expected one, which stays.
    program.write_text(program.read_text("utf-8").replace("STEP = 0.5,", "STEP = 0.51,"), "utf-8")
    output = run(pytester, failed=1)
    assert f"to accept it: pytest --sixbar-update {test.name}::test_press" in output
    assert "obtained: tables/obtained/new.csv" in output
    assert sorted(path.name for path in folder.iterdir()) == ["new.csv", "new.html"]
    result = (folder / "new.csv").read_bytes()
    assert expected.read_bytes() == first != result
    # A table with nan is not accepted.
    source = program.read_text("utf-8")
    program.write_text(source + 'Path(sys.argv[1]).write_text("time,angle\\n0,nan\\n1,2\\n")', "utf-8")
    output = run(pytester, "--sixbar-update", failed=1)
    assert "angle is nan in data row 1" in output
    assert expected.read_bytes() == first
    program.write_text(source, "utf-8")
    run(pytester, "--sixbar-update", f"{test.name}::test_press", passed=1)
    assert expected.read_bytes() == result
    assert not folder.exists()
    run(pytester, passed=1)
    assert sorted(path.name for path in expected.parent.iterdir()) == ["new.csv"]
    # Nor is a table without a limit: the next run would fail.
    test.write_text(EXAMPLE.replace(", tolerance=1e-3", ""), "utf-8")
    output = run(pytester, "--sixbar-update", failed=1)
    assert "is not written: read again, it would be indeterminate" in output
    assert expected.read_bytes() == result


def test_what_is_accepted_has_all_files_of_what_was_obtained(pytester):
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1, "output.groups": ["corners"]})
    write(sixbar.simulate(scene, "reference"), pytester.path / "run.csv")
    pytester.makepyfile("def test(assert_agree): assert_agree('tables/new.csv', 'run.csv', tolerance=1e-3)")
    run(pytester, failed=1)
    for options in ((), ("--sixbar-update",)):
        run(pytester, *options, passed=1)
        for path in pytester.path.glob("run.*"):
            copy = pytester.path / "tables" / path.name.replace("run", "new")
            assert copy.is_file(), path.name


SHARED = """
import pandas as pd, pytest
@pytest.mark.parametrize("size", [1.0, 1.1, 1.0])
def test(assert_agree, size):
    rows = range(0, 41, 2) if size == 1.0 else range(41)  # a peak between them would not be judged
    table = pd.DataFrame({"time": [n * 0.1 for n in rows], "force": [size * n % 7.0 for n in rows]})
    assert_agree("../tables/shared.csv", table, tolerance=1e-3)
"""


def test_what_a_passing_test_warns_of_and_a_table_of_several_tests(pytester, monkeypatch):
    rows = "".join(f"{n * 0.1},{n % 7.0 + 99.0 * (n == 21)}\n" for n in range(41))
    (pytester.mkdir("tables") / "shared.csv").write_text(f"time,force\n{rows}")
    (pytester.mkdir("below") / "test_shared.py").write_text(SHARED)
    pytester.makeini("[pytest]")
    monkeypatch.chdir("below")
    output = run(pytester, "-W", "default", passed=2, failed=1, warnings=6)
    assert "samples between the compared times are not judged; some stand out from their neighbours" in output
    assert "to accept it: pytest --sixbar-update 'test_shared.py::test[1.1]'" in output
    assert (pytester.path / "tables" / "obtained" / "shared.csv").exists()  # one of its tests still fails
    run(pytester, "-W", "default", "--sixbar-update", passed=2, failed=1)  # the first test writes it


def test_the_version_is_the_same_where_it_stands():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_the_entry_point_names_the_plugin_and_its_import_is_cheap():
    points = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["entry-points"]
    module = points["pytest11"]["sixbar"]
    code = (
        f"import sys, pytest; before = set(sys.modules); import {module}; print(*set(sys.modules) - before)"
    )
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert set(child.stdout.split()) <= {"comparison", module, "__future__"}
