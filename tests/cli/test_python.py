"""Names of Python in README.md and docs/*.md: the examples run, and do what their page says."""

import doctest
import io
import re
import subprocess
import sys
from contextlib import redirect_stdout

import numpy as np
import pandas as pd
import pytest
from doc_pages import ROOT, block, commands
from installed import write_package

import sixbar as package
from comparison.tables.table import Table


def output_of(code):
    out = io.StringIO()
    with redirect_stdout(out):
        exec(code, {"__name__": "__main__"})  # our own text
    return out.getvalue()


def test_the_five_lines_of_the_readme():
    contacts, *_, largest = output_of(block("README.md", "python")).split()
    assert int(contacts) > 10
    assert -0.5503 < float(largest) < -0.5497  # within the guide: 0.2 mm to either side, and a depth


SLOW = [pytest.param("validate", marks=pytest.mark.slow)]


@pytest.mark.parametrize("name", [*(name for name in package.__all__ if name != "validate"), *SLOW])
def test_the_example_in_the_docstring_of_a_name_of_sixbar(name):
    assert name in dir(package)
    assert getattr(package, name).__name__ == name
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(package, name), name, globs={})
    output = io.StringIO()
    assert doctest.DocTestRunner().run(example, out=output.write).failed == 0, output.getvalue()


def test_the_import_of_sixbar_imports_none_of_what_its_names_need():
    code = "import sys; before = set(sys.modules); import sixbar; print(*set(sys.modules) - before)"
    call = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert {name.partition(".")[0] for name in call.stdout.split()} - sys.stdlib_module_names == {"sixbar"}


def test_the_channels_of_a_scene():
    names = output_of(block("docs/engine.md", "python", 2))
    assert names.startswith("['slider_x', 'slider_y'")
    assert names.count("'") == 2 * 21


def test_a_run_is_a_table_that_is_drawn_and_printed_in_a_few_lines():
    run = package.simulate(package.load_scene("150rpm-0.2mm", {"drive.cycles": 0.02}))
    assert list(run.frame)[:2] == ["time", "slider_x"]
    assert list(run.events)[:3] == ["corner", "start", "end"]
    assert run.plot("slider_x") is not None
    assert str(run).startswith("RunTable: 21 samples, 0 contacts (reference success) of time, slider_x, ")
    comparison = package.compare(run, run, tolerance=1e-3)
    for each in (comparison, comparison.channels["slider_x"], run.scene):
        assert len(str(each)) < 100
        assert type(each).__name__ in str(each)


TIME = np.arange(101) * 0.004
A = pd.DataFrame({"time": TIME, "slider_x": np.sin(TIME), "slider_vx": np.cos(TIME)})
B = A.assign(slider_vx=A.slider_vx * 1.0001)
SPIKE = A.assign(slider_x=A.slider_x + 8.0 * (A.index == 3))


def test_the_fixture_of_pytest_has_tolerances_of_single_channels(assert_agree):
    """One channel is off by 1e-4 of at most 1; its range is 0.08."""
    tolerance, override = {"tolerance": 1e-9}, {"tolerances": {"slider_vx": 1.01e-4}, "absolute": True}
    assert_agree(A, B, channels=["slider_x"], **tolerance)
    assert_agree(A, B, tolerances={"slider_vx": 1e-2}, **tolerance)
    assert_agree(A, B, **tolerance, **override)
    for options in ({}, override | {"tolerances": {"slider_vx": 9e-5}}):
        with pytest.raises(AssertionError, match="1 of 2 channels differ, most of all slider_vx"):
            assert_agree(A, B, **tolerance, **options)
    assert_agree(A, B, tolerances={"slider_x": 1e-9}, allow_indeterminate=True)


@pytest.mark.parametrize(
    ("other", "options", "pieces"),
    [
        (B, {}, "indeterminate: "),
        # One channel that nothing limits: any value of it would pass.
        (B, {"tolerances": {"slider_x": 1e-9}}, "indeterminate: |1 of 2 channels|neither an uncertainty nor"),
        # A spike of 20 ranges in the table obtained does not widen what is allowed.
        (SPIKE, {"tolerance": 0.5}, "differ: 1 of 2 channels"),
        (B, {"tolerance": 1e-5, "allow_indeterminate": True}, "differ: |slider_vx"),
        (A.drop(columns="slider_vx"), {"tolerance": 1.0}, "slider_vx"),
        (A.iloc[:50], {"tolerance": 1.0}, "truncated"),
        ("nowhere.mat", {"tolerance": 1.0}, "nowhere.mat"),
        (A, {"tolerence": 1.0}, "did you mean tolerance?"),
    ],
)
def test_the_fixture_of_pytest_fails_with_the_verdict(other, options, pieces, assert_agree):
    with pytest.raises(AssertionError) as error:
        assert_agree(A, other, **options)
    assert all(piece in str(error.value).splitlines()[0] for piece in pieces.split("|"))


ROUND_TRIPS = {
    "units in the names": A.rename(columns={"time": "time [ms]", "slider_x": "slider_x [mm]"}),
    "an index": A.set_index("time"),
    "a run": Table(A, provenance={"model": "mine"}),
    "commas in a name": pd.DataFrame({"time": TIME, "x, of the slider": A.slider_x}),
}


@pytest.mark.filterwarnings("ignore:.*no unit is stated")
@pytest.mark.parametrize("kind", ROUND_TRIPS)
@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_a_written_expected_table_is_accepted_by_the_next_test(kind, end, assert_agree, tmp_path):
    table, path = ROUND_TRIPS[kind], tmp_path / "expected" / f"run.{end}"
    units = end == "parquet" and kind == "units in the names"
    message = r"a Parquet file states no units.*name it \.csv$" if units else "was missing, and is written"
    with pytest.raises(AssertionError, match=message):
        assert_agree(path, table, tolerance=1e-9)
    assert path.exists() != units
    if not units:
        assert_agree(path, table, tolerance=1e-15)  # every digit


def test_a_mapping_of_the_second_table_serves_the_fixture(assert_agree, tmp_path):
    """The mapping is from mm with the other sign; the expected table is given or written."""
    table = pd.DataFrame({"Time": TIME, "disp": -1e3 * A.slider_x, "vel": -1e3 * A.slider_vx})
    rules = (("disp", "x", "mm"), ("vel", "vx", "mm/s"))
    lines = [f'[b.{key}]\nchannel = "slider_{name}"\nunit = "{unit}"\nsign = -1' for key, name, unit in rules]
    mapping, path = tmp_path / "m.toml", tmp_path / "written.csv"
    mapping.write_text("\n".join(lines))
    assert_agree(A, table, mapping=mapping, tolerance=1e-9)
    with pytest.raises(AssertionError, match="was missing, and is written"):
        assert_agree(path, table, mapping=mapping, tolerance=1e-9)
    assert path.read_text().startswith("time [s],slider_x [m],slider_vx [m/s]")
    assert_agree(path, table, mapping=mapping, tolerance=1e-9)
    # Rules for the first table alone: a table written from the second cannot follow them.
    mapping.write_text('[a.ours]\nchannel = "slider_x"\nunit = "m"')
    with pytest.raises(AssertionError, match=r"'ours' is not in .*late\.csv is not written$"):
        assert_agree(tmp_path / "late.csv", A, mapping=mapping, tolerance=1e-9)


FRAMES = {
    "index named time": A.set_index("time"),
    "index named Time with a unit": A.set_index((1e3 * A.time).rename("Time [ms]")).drop(columns="time"),
    "index of timedeltas": A.set_index(pd.to_timedelta(A.time, unit="s").rename(None)).drop(columns="time"),
    "numpy's text names": A.rename(columns=np.str_),
}


@pytest.mark.parametrize("kind", FRAMES)
def test_a_frame_says_in_any_way_what_is_its_time(kind):
    assert package.compare(A, FRAMES[kind], tolerance=1e-9).verdict == "agree"
    other = FRAMES[kind].iloc[:, :-1].assign(slider_vx=B.slider_vx.to_numpy() + 1)
    assert package.compare(A, other, tolerance=1e-9).verdict == "differ"


X = A[["time", "slider_x"]]
MISUSES = [
    *(
        (f"compare(A, B, share={value})", "share = ")
        for value in ("0", "nan", "True", "'1e-3'", "array([1, 2])")
    ),
    ("compare(A, B, tolerances={'slider_x': 0})", "slider_x = "),
    ("compare(A, B, tolerances=[('slider_x', 1)])", "must be a dict"),
    ("compare(A, B, tolerances={'slider_z': 1.0})", "'slider_z' is not among the compared channels"),
    ("compare(A, B, gate={'rms': 1})", "gate: 'rms' is not a metric"),
    ("compare(A, B, gate={'max_scaled': nan})", "gate.max_scaled = nan must be finite"),
    ("compare(A, B, channels='slider_x')", "channels = 'slider_x' must be a list of names"),
    ("compare(A, B, labels=('a',))", "must be two names"),
    ("compare(A, B, scene=3)", "scene = 3 must be a name, a path"),
    ("compare(A, B, mapping={})", "mapping = {} must be a mapping or the path"),
    ("compare(A, {'time': [0, 1]})", "b: must be a path, a table or a pandas data frame, not of type dict"),
    ("compare(A, A.assign(**{'slider_x [mm]': 1.0}))", "b: columns 'slider_x' and 'slider_x' are"),
    ("compare(A, pd.concat({'press': A}, axis=1))", "2 levels of names"),
    ("compare(A, A.set_index(pd.date_range('2020', periods=101)).drop(columns='time'))", "time is missing"),
    ("reliability(X, ideal=X, limits={'velocity': 3})", "limits.velocity = 3 must be two numbers"),
    ("validate([])", "scenes names none"),
    ("validate('ideal', n_jobs=-1)", "n_jobs = -1 must be >= 0"),
    ("validate('ideal', tiers='tihgt')", "tiers.0 = 'tihgt'"),
    ("simulate(SHORT).plot(3)", "channel 3 is missing"),
    ("load_scene('ideal', 'drive.speed_rpm=3')", "overrides = 'drive.speed_rpm=3' must be a dict"),
]


@pytest.mark.parametrize(("call", "message"), MISUSES, ids=[call[:60] for call, _ in MISUSES])
def test_a_misuse_of_a_name_of_sixbar_is_one_line_of_this_package(call, message):
    names = {name: getattr(package, name) for name in package.__all__}
    names |= {"A": A, "B": B, "X": X, "pd": pd, "array": np.array, "nan": np.nan, "inf": np.inf}
    names["SHORT"] = package.load_scene("ideal", {"drive.cycles": 0.02})
    with pytest.raises(ValueError, match=re.escape(message)) as error:
        eval(call, names)
    assert type(error.value).__module__.startswith("comparison.")
    assert "\n" not in str(error.value)


def test_a_scene_is_a_name_a_path_or_a_scene_and_numbers_may_be_numpys(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text('[scene]\nextends = "ideal"\n[drive]\ncycles = 0.02\n')
    first = package.simulate(package.load_scene(path))
    values = {"drive.cycles": np.float64(0.02), "output.samples_per_cycle": np.int64(500)}
    assert package.load_scene("ideal", values).name == "ideal+drive.cycles=0.02+output.samples_per_cycle=500"
    for each in (path, str(path)):
        pd.testing.assert_frame_equal(package.simulate(each).frame, first.frame)
        comparison = package.compare(first, first, scene=each, tolerance=np.float32(1e-3), share=np.int64(1))
        assert (comparison.verdict, comparison.name) == ("agree", "short")
    results = package.validate([path, package.load_scene(path)], n_jobs=0, tiers="standard")
    assert [result.comparison.verdict for result in results] == ["agree", "agree"]


@pytest.mark.slow
def test_the_model_of_the_page_on_engines_agrees(sixbar, tmp_path):
    write_package(tmp_path, "my_press", block("docs/engine.md", "python"), {"mine": "my_press:simulate"})
    sixbar.sites.append(str(tmp_path))
    sixbar.write("mine.toml", block("docs/engine.md", "toml", 1))
    *others, validate = commands("docs/engine.md")
    assert [words[0] for words in (*others, validate)] == ["run", "run", "compare", "validate"]
    for words in others:
        sixbar(*words)
    sixbar(*validate, "--quick", "--jobs", "1", "--set", "drive.cycles=0.05")


def test_the_mapping_of_the_page_on_tables(sixbar):
    head, mapping = block("docs/foreign-tables.md", "text", 1), block("docs/foreign-tables.md", "toml", 1)
    time = np.arange(801) * 1e-3
    x, y, angle = 1e-4 * np.sin(9 * time), 0.19 + 0.01 * np.cos(9 * time), 1e-3 * np.sin(5 * time)
    rows = zip(time * 1e3, -x * 1e3, y * 1e3, -np.degrees(angle), 0 * x, 0 * x, strict=True)
    sixbar.write("adams.tab", head + "".join("\t".join(repr(float(v)) for v in row) + "\n" for row in rows))
    sixbar.write("adams.toml", mapping)
    sixbar.table("ours.csv", time=time, slider_x=-0.55 + x, slider_y=y, slider_angle=angle)
    (words,) = commands("docs/foreign-tables.md")
    assert words[:2] == ["compare", "ours.csv"]
    sixbar(*words, "--json")
    assert list(sixbar.numbers["channels"]) == ["slider_x", "slider_y", "slider_angle"]
