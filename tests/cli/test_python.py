"""Names that README.md and docs/*.md give to programs: the examples run, and do what is said of them."""

import doctest
import importlib
import io
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import sixbar as package
from comparison.report.pictures.notebook import tabulated
from comparison.scene import load_scene
from comparison.tables.table import Table

ROOT = Path(__file__).parents[2]


def block(name, language, number=0):
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / name).read_text("utf-8"), re.DOTALL)[number]


def printed(code):
    out = io.StringIO()
    with redirect_stdout(out):
        exec(code, {"__name__": "__main__"})  # our own text
    return out.getvalue()


def test_the_five_lines_of_the_readme():
    contacts, *_, largest = printed(block("README.md", "python")).split()
    assert int(contacts) > 10
    assert -0.5503 < float(largest) < -0.5497  # within the guide: 0.2 mm to either side, and a depth


@pytest.mark.parametrize("name", package.__all__)
def test_the_example_in_the_docstring_of_a_name_of_sixbar(name):
    assert name in dir(package)
    assert getattr(package, name).__name__ == name
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(package, name), name, globs={})
    assert len(example.examples) > 1
    said = io.StringIO()
    assert doctest.DocTestRunner().run(example, out=said.write).failed == 0, said.getvalue()


def test_the_import_of_sixbar_imports_none_of_what_its_names_need():
    code = "import sys; before = set(sys.modules); import sixbar; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert {name.partition(".")[0] for name in done.stdout.split()} - sys.stdlib_module_names == {"sixbar"}


def test_the_channels_of_a_scene():
    names = printed(block("docs/engine.md", "python", 2))
    assert names.startswith("['slider_x', 'slider_y'")
    assert names.count("'") == 2 * 21


@pytest.mark.parametrize("model", ["reference_model", "exudyn_model"])
def test_a_result_becomes_a_table_for_notebooks(model):
    changes = {"drive.cycles": 0.02, "output.samples_per_cycle": 2000, "solver.exudyn.formulation": "tree"}
    simulate, shares = importlib.import_module(model).simulate, []
    result = simulate(load_scene("150rpm-0.2mm", changes).data, progress=shares.append)
    assert (result.status, result.remedy) == ("success", "")
    assert all(0 <= share <= 1 for share in shares)
    table = tabulated(result)
    assert list(table.frame)[:2] == ["time", "slider_x"]
    assert table.frame["slider_x"].to_numpy() == pytest.approx(result.columns["slider_x"], abs=0)
    assert list(table.events)[:3] == ["corner", "start", "end"]
    assert table.plot("slider_x") is not None


TIME = np.arange(101) * 0.004
A = pd.DataFrame({"time": TIME, "slider_x": np.sin(TIME), "slider_vx": np.cos(TIME)})
B = A.assign(slider_vx=A.slider_vx * 1.0001)


def test_the_fixture_of_pytest_passes(assert_agree, tmp_path):
    A.to_csv(tmp_path / "a.csv", index=False)
    assert_agree(str(tmp_path / "a.csv"), Table(A), tolerance=1e-12)
    assert_agree(A, B, tolerance=1e-2)
    assert_agree(A, B, allow_indeterminate=True)
    outlier = B.assign(slider_vx=B.slider_vx + 0.3 * (np.arange(101) == 3))
    assert_agree(A, outlier, tolerance=1e-2, share=0.98)


def test_the_fixture_of_pytest_reads_what_compare_reads(assert_agree, tmp_path):
    """MATLAB's own names and units by a mapping, one channel of several, tolerances of single channels."""
    savemat(
        tmp_path / "a.mat", {"t": 1e3 * TIME, "x": 1e3 * np.sin(TIME), "v": B.slider_vx.to_numpy(), "n": TIME}
    )
    rules = {"t": ("time", "ms"), "x": ("slider_x", "mm"), "v": ("slider_vx", "m/s")}
    lines = [f'[a.{own}]\nchannel = "{name}"\nunit = "{unit}"' for own, (name, unit) in rules.items()]
    (tmp_path / "m.toml").write_text("\n".join(lines))
    given = {"mapping": tmp_path / "m.toml", "tolerance": 1e-9}
    assert_agree(tmp_path / "a.mat", A, channels=["slider_x"], **given)
    # v is off by 1e-4 of at most 1, and its range is 0.08.
    assert_agree(tmp_path / "a.mat", A, tolerances={"slider_vx": 1e-2}, **given)
    assert_agree(tmp_path / "a.mat", A, tolerances={"slider_vx": 1.01e-4}, absolute=True, **given)
    for options in (
        {},
        {"tolerances": {"slider_vx": 1e-3}},
        {"tolerances": {"slider_vx": 9e-5}, "absolute": True},
    ):
        with pytest.raises(AssertionError, match="1 of 2 channels differ, most of all slider_vx"):
            assert_agree(tmp_path / "a.mat", A, **given, **options)
    with pytest.raises(AssertionError, match="'slider_y' is not among the compared channels"):
        assert_agree(A, A, tolerances={"slider_y": 1.0})


@pytest.mark.parametrize(
    ("other", "options", "pieces"),
    [
        (B, {"tolerance": 1e-5}, "differ: |slider_vx"),
        (B, {}, "indeterminate: "),
        (B, {"tolerance": 1e-5, "allow_indeterminate": True}, "differ: "),
        (A.drop(columns="slider_vx"), {"tolerance": 1.0}, "slider_vx"),
        (A.assign(slider_vx=float("nan")), {"tolerance": 1.0}, "slider_vx|nan"),
        (A.iloc[:50], {"tolerance": 1.0}, "truncated"),
        ("nowhere.mat", {"tolerance": 1.0}, "nowhere.mat"),
        (A, {"tolerance": 1.0, "channels": "slider_x"}, "channels 'slider_x' must be a list of names"),
    ],
    ids=["differ", "no tolerance", "no doubt", "missing", "nan", "truncated", "no file", "no list"],
)
def test_the_fixture_of_pytest_fails_with_the_verdict(other, options, pieces, assert_agree):
    with pytest.raises(AssertionError) as failed:
        assert_agree(A, other, **options)
    assert all(piece in str(failed.value).splitlines()[0] for piece in pieces.split("|"))


def test_the_model_of_the_page_on_engines_agrees(sixbar, install):
    """docs/engine.md as a reader would follow it: a package, a scene, four commands."""
    sixbar.sites.append(str(install("my_press", block("docs/engine.md", "python"), mine="simulate")))
    sixbar.write("mine.toml", block("docs/engine.md", "toml", 1))
    commands = [shlex.split(line) for line in block("docs/engine.md", "sh").splitlines()]
    assert [command[1] for command in commands] == ["run", "run", "compare", "validate"]
    for _, *arguments in commands:
        sixbar(*arguments, *(["--quick", "--jobs", "1"] if arguments[0] == "validate" else []))


def test_the_mapping_of_the_page_on_tables(sixbar):
    """The file of Adams that docs/foreign-tables.md shows, and its mapping."""
    head, mapping = block("docs/foreign-tables.md", "text"), block("docs/foreign-tables.md", "toml")
    time = np.arange(801) * 1e-3
    x, y, angle = 1e-4 * np.sin(9 * time), 0.19 + 0.01 * np.cos(9 * time), 1e-3 * np.sin(5 * time)
    rows = zip(time * 1e3, -x * 1e3, y * 1e3, -np.degrees(angle), 0 * x, 0 * x, strict=True)
    sixbar.write("adams.tab", head + "".join("\t".join(repr(float(v)) for v in row) + "\n" for row in rows))
    sixbar.write("adams.toml", mapping)
    sixbar.table("ours.csv", time=time, slider_x=-0.55 + x, slider_y=y, slider_angle=angle)
    command = block("docs/foreign-tables.md", "sh").split()
    assert command[:3] == ["sixbar", "compare", "ours.csv"]
    sixbar(*command[1:], "--json")
    assert list(sixbar.numbers["channels"]) == ["slider_x", "slider_y", "slider_angle"]
