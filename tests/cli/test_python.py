"""Names that README.md and docs/*.md give to programs: the examples run, and do what is said of them."""

import doctest
import importlib
import io
import math
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from installed import write_package
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
SPIKE = A.assign(slider_x=A.slider_x + 8.0 * (A.index == 3))


def test_the_fixture_of_pytest_passes(assert_agree):
    assert_agree(A, B, tolerance=1e-2)
    assert_agree(A, B, tolerances={"slider_x": 1e-9}, allow_indeterminate=True)
    outlier = B.assign(slider_vx=B.slider_vx + 0.3 * (np.arange(101) == 3))
    assert_agree(A, outlier, tolerance=1e-2, share=0.98)


def test_the_fixture_of_pytest_reads_what_compare_reads(assert_agree, tmp_path):
    """MATLAB's own names and units by a mapping, one channel of several, tolerances of single channels."""
    signals = {"t": 1e3 * TIME, "x": 1e3 * np.sin(TIME), "v": B.slider_vx.to_numpy(), "n": TIME}
    savemat(tmp_path / "a.mat", signals)
    rules = {"t": ("time", "ms"), "x": ("slider_x", "mm"), "v": ("slider_vx", "m/s")}
    lines = [f'[a.{own}]\nchannel = "{name}"\nunit = "{unit}"' for own, (name, unit) in rules.items()]
    (tmp_path / "m.toml").write_text("\n".join(lines))
    given = {"mapping": tmp_path / "m.toml", "tolerance": 1e-9}
    assert_agree(tmp_path / "a.mat", A, channels=["slider_x"], **given)  # the expected table has the rules
    # v is off by 1e-4 of at most 1, and its range is 0.08.
    assert_agree(tmp_path / "a.mat", A, tolerances={"slider_vx": 1e-2}, **given)
    assert_agree(tmp_path / "a.mat", A, tolerances={"slider_vx": 1.01e-4}, absolute=True, **given)
    own = {"slider_vx": 9e-5}
    for options in ({}, {"tolerances": {"slider_vx": 1e-3}}, {"tolerances": own, "absolute": True}):
        with pytest.raises(AssertionError, match="1 of 2 channels differ, most of all slider_vx"):
            assert_agree(tmp_path / "a.mat", A, **given, **options)
    with pytest.raises(AssertionError, match="'slider_y' is not among the compared channels"):
        assert_agree(A, A, tolerances={"slider_y": 1.0})


@pytest.mark.parametrize(
    ("other", "options", "pieces"),
    [
        (B, {"tolerance": 1e-5}, "differ: |slider_vx"),
        (B, {}, "indeterminate: "),
        # One channel that nothing limits: any value of it would pass.
        (B, {"tolerances": {"slider_x": 1e-9}}, "indeterminate: |1 of 2 channels|neither an uncertainty nor"),
        (A, {"tolerances": {"slider_vx": 1e-9}}, "indeterminate: 1 of 2 channels"),
        # A spike of 20 ranges in the table obtained does not widen what is allowed.
        (SPIKE, {"tolerance": 0.5}, "differ: 1 of 2 channels"),
        (B, {"tolerance": 1e-5, "allow_indeterminate": True}, "differ: "),
        (A.drop(columns="slider_vx"), {"tolerance": 1.0}, "slider_vx"),
        (A.assign(slider_vx=float("nan")), {"tolerance": 1.0}, "slider_vx|nan"),
        (A.iloc[:50], {"tolerance": 1.0}, "truncated"),
        ("nowhere.mat", {"tolerance": 1.0}, "nowhere.mat"),
        (A, {"tolerence": 1.0}, "did you mean tolerance?"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_fixture_of_pytest_fails_with_the_verdict(other, options, pieces, assert_agree):
    with pytest.raises(AssertionError) as failed:
        assert_agree(A, other, **options)
    assert all(piece in str(failed.value).splitlines()[0] for piece in pieces.split("|"))


ROUND_TRIPS = {
    "a frame": A,
    "units in the names": A.rename(columns={"time": "time [ms]", "slider_x": "slider_x [mm]"}),
    "another mechanism": pd.DataFrame({"t": TIME, "angle (rad)": A.slider_x, "x[0]": A.slider_vx}),
    "an index": A.set_index("time"),
    "a run": Table(A, provenance={"model": "mine"}),
    "text without names": "".join(f"{t!r} {x!r}\n" for t, x in zip(TIME.tolist(), A.slider_x, strict=True)),
    "semicolons": A.to_csv(index=False, sep=";", decimal=","),
    "commas in a name": pd.DataFrame({"time": TIME, "x, of the slider": A.slider_x}),
}


@pytest.mark.parametrize("kind", ROUND_TRIPS)
@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_a_written_expected_table_is_accepted_by_the_next_test(kind, end, assert_agree, tmp_path):
    obtained, path = ROUND_TRIPS[kind], tmp_path / "expected" / f"run.{end}"
    if isinstance(obtained, str):
        obtained = tmp_path / "result.txt"
        obtained.write_text(ROUND_TRIPS[kind])
    if end == "parquet" and kind in ("units in the names", "another mechanism"):
        with pytest.raises(AssertionError, match=r"a Parquet file states no units.*name it \.csv$"):
            assert_agree(path, obtained, tolerance=1e-9)
        assert not path.parent.exists()
        return
    with pytest.raises(AssertionError, match="was missing, and is written"):
        assert_agree(path, obtained, tolerance=1e-9)
    assert_agree(path, obtained, tolerance=1e-15)  # every digit


def test_a_mapping_as_compare_suggests_it_serves_the_fixture(assert_agree, sixbar, tmp_path):
    """Rules for the second table alone, in mm with the other sign: of a table expected, given or written."""
    theirs = pd.DataFrame({"Time": TIME, "disp": -1e3 * A.slider_x, "vel": -1e3 * A.slider_vx})
    A.to_csv(sixbar.folder / "expected.csv", index=False)
    theirs.to_csv(sixbar.folder / "obtained.csv", index=False)
    lines = [f'[b.{own}]\nchannel = "slider_{name}"\nunit = "{unit}"\nsign = -1' for own, name, unit in (
        ("disp", "x", "mm"), ("vel", "vx", "mm/s"))]  # fmt: skip
    mapping = sixbar.folder / sixbar.write("m.toml", "\n".join(lines))
    sixbar("compare", "expected.csv", "obtained.csv", "--mapping", "m.toml", "--tolerance", "1e-9")
    given = {"mapping": mapping, "tolerance": 1e-9}
    assert_agree(sixbar.folder / "expected.csv", theirs, **given)
    path = tmp_path / "written.csv"
    with pytest.raises(AssertionError, match="was missing, and is written"):
        assert_agree(path, theirs, **given)
    assert path.read_text().startswith("time [s],slider_x [m],slider_vx [m/s]")
    assert_agree(path, sixbar.folder / "obtained.csv", **given)
    # Rules for the first table alone: what is written from the second cannot follow them.
    other = sixbar.folder / sixbar.write("a.toml", '[a.ours]\nchannel = "slider_x"\nunit = "m"')
    with pytest.raises(AssertionError, match=r"'ours' is not in .*late\.csv is not written$"):
        assert_agree(tmp_path / "late.csv", A, mapping=other, tolerance=1e-9)


FRAMES = {
    "index named time": A.set_index("time"),
    "index named t": A.set_index(A.time.rename("t")).drop(columns="time"),
    "index named Time with a unit": A.set_index((1e3 * A.time).rename("Time [ms]")).drop(columns="time"),
    "index of timedeltas": A.set_index(pd.to_timedelta(A.time, unit="s").rename(None)).drop(columns="time"),
    "column of timedeltas": A.assign(time=pd.to_timedelta(A.time, unit="s")),
    "an index beside the time": A.set_index(pd.Index(range(5, 106), name="sample")),
    "names with units": A.rename(columns={"slider_x": "slider_x [m]", "slider_vx": "slider_vx(m/s)"}),
    "numpy's text names": A.rename(columns=np.str_),
}


@pytest.mark.parametrize("kind", FRAMES)
def test_a_frame_says_in_any_way_what_is_its_time(kind):
    assert package.compare(A, FRAMES[kind], tolerance=1e-9).verdict == "agree"
    apart = FRAMES[kind].iloc[:, :-1].assign(slider_vx=B.slider_vx.to_numpy() + 1)
    assert package.compare(A, apart, tolerance=1e-9).verdict == "differ"


X = A[["time", "slider_x"]]
NAN, INF = math.nan, math.inf
BAD_NUMBERS = (NAN, INF, -1, 0, True, "1e-3", [1e-3], np.array([1e-3, 2.0]))
MISUSES = [
    *((f"compare(A, B, tolerance={value!r})", "tolerance = ") for value in BAD_NUMBERS),
    *((f"compare(A, B, share={value!r})", "share = ") for value in (*BAD_NUMBERS, 99, 1.0001)),
    *((f"compare(A, B, period={value!r})", "period = ") for value in BAD_NUMBERS),
    *((f"compare(A, B, time_tolerance={x!r})", "time_tolerance = ") for x in (NAN, INF, -1, True, "1")),
    *((f"compare(A, B, tolerances={{'slider_x': {value!r}}})", "slider_x = ") for value in BAD_NUMBERS),
    *((f"reliability(X, ideal=X, period={value!r})", "period = ") for value in BAD_NUMBERS),
    ("compare(A, B, tolerances=[('slider_x', 1)])", "must be a dict"),
    ("compare(A, B, tolerances={'slider_z': 1.0})", "'slider_z' is not among the compared channels"),
    ("compare(A, B, gate={'rms': 1})", "gate: 'rms' is not a metric"),
    ("compare(A, B, gate={'max_scaled': nan})", "gate.max_scaled = nan must be finite"),
    ("compare(A, B, gate={'max_scaled': -1})", "gate: max_scaled = -1 must be >= 0"),
    ("compare(A, B, gate={'correlation': 94})", "gate: correlation = 94 must be -1 to 1"),
    ("compare(A, B, gate='max_scaled')", "gate = 'max_scaled' must be a dict"),
    ("compare(A, B, channels='slider_x')", "channels = 'slider_x' must be a list of names"),
    ("compare(A, B, channels=[])", "channels = [] must be a list of names"),
    ("compare(A, B, channels=['slider_q'])", "'slider_q' is not a channel"),
    ("compare(A, B, absolute='no')", "absolute = 'no' must be true or false"),
    ("compare(A, B, at_events='before')", "at_events = 'before'"),
    ("compare(A, B, common_time=1)", "common_time = 1 must be true or false"),
    ("compare(A, B, tolerence=1)", "did you mean tolerance?"),
    ("compare(A, B, labels='ab')", "labels = 'ab' must be two names"),
    ("compare(A, B, labels=('a',))", "must be two names"),
    ("compare(A, B, scene=3)", "scene = 3 must be a name, a path"),
    ("compare(A, B, scene='nowhere')", "neither a shipped scene nor a file"),
    ("compare(A, B, mapping={})", "mapping = {} must be a mapping or the path"),
    ("compare(A, B, mapping='nowhere.toml')", "nowhere.toml: No such file"),
    ("compare(A, {'time': [0, 1]})", "b: must be a path, a table or a pandas data frame, not of type dict"),
    ("compare(None, B)", "not of type NoneType"),
    ("compare(A, A.to_numpy())", "not of type ndarray"),
    ("compare(A, A.slider_x)", "not of type Series"),
    ("compare(A, pd.concat([A, A], axis=1))", "b: columns 'time' and 'time' are"),
    ("compare(A, pd.concat([A, A.slider_x], axis=1))", "b: columns 'slider_x' and 'slider_x' are"),
    ("compare(A, A.assign(**{'slider_x [mm]': 1.0}))", "b: columns 'slider_x' and 'slider_x' are"),
    ("compare(Table(pd.concat([A, A], axis=1)), A)", "a: columns 'time' and 'time' are"),
    ("compare(A, pd.concat({'press': A}, axis=1))", "2 levels of names"),
    ("compare(A, A.drop(columns='time'))", "channel time is missing"),
    ("compare(A, A.set_index(pd.date_range('2020', periods=101)).drop(columns='time'))", "time is missing"),
    ("compare(A, A.assign(slider_x='fast'), tolerance=1)", "'fast'"),
    ("compare(A, A.iloc[:0], tolerance=1)", "0 data rows"),
    ("reliability(X, ideal={})", "table ideal: must be a path"),
    ("reliability(X, ideal=X, limits=3)", "limits = 3 must be a dict"),
    ("reliability(X, ideal=X, limits={'velocity': 3})", "limits.velocity = 3 must be two numbers"),
    ("reliability(X, ideal=X, limits={'velocity': (0, nan)})", "nan must be finite"),
    ("reliability(A.rename(columns={'slider_x': 'slider_y'}), ideal=Y, period=0.4, limits={'speed': (0, 1)})",
     "reliability.speed"),
    ("reliability(X, ideal=X, scene=3)", "scene = 3"),
    ("reliability(X, ideal=X, mapping=3)", "mapping = 3"),
    ("reliability(X, ideal=X, at_events=3)", "at_events = 3"),
    ("validate({})", "scene = {} must be a name, a path"),
    ("validate([])", "scenes names none"),
    ("validate(['ideal', None])", "scene = None must be a name, a path"),
    ("validate('idael')", "did you mean 'ideal'?"),
    ("validate('ideal', n_jobs=-1)", "n_jobs = -1 must be >= 0"),
    ("validate('ideal', n_jobs=True)", "n_jobs = True must be an integer"),
    ("validate('ideal', tiers='tihgt')", "tiers.0 = 'tihgt'"),
    ("validate('ideal', tiers=[])", "tiers = []"),
    ("validate('ideal', models='reference')", "two or more different names"),
    ("validate('ideal', models=('reference', 'adams'))", "model 'adams' is not known"),
    ("validate('ideal', models=('reference', 3))", "model 3 must be a name"),
    ("validate('ideal', models=3)", "model 3 must be a name"),
    *((f"validate('ideal', accuracy={value!r})", "accuracy ") for value in (NAN, -1.0, True, "fine", [1])),
    ("simulate('idael')", "did you mean 'ideal'?"),
    ("simulate({})", "scene = {}"),
    ("simulate('ideal', 'adams')", "model 'adams' is not known"),
    ("simulate('ideal', ['reference'])", "model ['reference'] must be a name"),
    ("simulate(SHORT).plot('slider_x', other={})", "other = {} must be a table"),
    ("simulate(SHORT).plot(3)", "channel 3 is missing"),
    ("load_scene('ideal').with_values(3)", "overrides = 3 must be a dict"),
    ("load_scene(3)", "scene = 3 must be a name or a path"),
    ("load_scene('ideal', 'drive.speed_rpm=3')", "overrides = 'drive.speed_rpm=3' must be a dict"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "said"), MISUSES, ids=[call[:60] for call, _ in MISUSES])
def test_a_misuse_of_a_name_of_sixbar_is_one_line_of_this_package(call, said):
    names = {name: getattr(package, name) for name in package.__all__}
    names |= {"A": A, "B": B, "X": X, "Y": X.rename(columns={"slider_x": "slider_y"}), "Table": Table}
    names |= {"pd": pd, "array": np.array, "nan": NAN, "inf": INF}
    names["SHORT"] = package.load_scene("ideal", {"drive.cycles": 0.02})
    with pytest.raises(ValueError, match=re.escape(said)) as failed:
        eval(call, names)
    assert type(failed.value).__module__.startswith("comparison.")
    assert "\n" not in str(failed.value)


def test_a_scene_is_a_name_a_path_or_a_scene_and_numbers_may_be_numpys(tmp_path):
    (tmp_path / "short.toml").write_text('[scene]\nextends = "ideal"\n[drive]\ncycles = 0.02\n')
    path = tmp_path / "short.toml"
    scene = package.load_scene(path)
    first = package.simulate(scene)
    known = {"drive.cycles": np.float64(0.02), "output.samples_per_cycle": np.int64(500)}
    assert package.load_scene("ideal", known).name == "ideal+drive.cycles=0.02+output.samples_per_cycle=500"
    for each in (path, str(path)):
        pd.testing.assert_frame_equal(package.simulate(each).frame, first.frame)
        compared = package.compare(first, first, scene=each, tolerance=np.float32(1e-3), share=np.int64(1))
        assert (compared.verdict, compared.name) == ("agree", "short")
    results = package.validate([path, scene], n_jobs=0, tiers="standard")
    assert [result.comparison.verdict for result in results] == ["agree", "agree"]


def test_what_is_printed_of_a_result_are_a_few_lines():
    run = package.simulate(package.load_scene("150rpm-0.2mm", {"drive.cycles": 0.02}))
    compared = package.compare(run, run, tolerance=1e-3)
    assert str(run).startswith("RunTable: 21 samples, 0 contacts (reference success) of time, slider_x, ")
    assert len(str(run).splitlines()) <= 5
    for each in (compared, compared.channels["slider_x"], run.scene):
        assert len(str(each)) < 100
        assert type(each).__name__ in str(each)


def test_the_model_of_the_page_on_engines_agrees(sixbar, tmp_path):
    """docs/engine.md as a reader would follow it: a package, a scene, four commands; they end in agree."""
    write_package(tmp_path, "my_press", block("docs/engine.md", "python"), {"mine": "my_press:simulate"})
    sixbar.sites.append(str(tmp_path))
    sixbar.write("mine.toml", block("docs/engine.md", "toml", 1))
    commands = [shlex.split(line) for line in block("docs/engine.md", "sh").splitlines()]
    assert [command[1] for command in commands] == ["run", "run", "compare", "validate"]
    for _, *arguments in commands:
        sixbar(*arguments, *(["--quick", "--jobs", "1"] if arguments[0] == "validate" else []))


def test_the_mapping_of_the_page_on_tables(sixbar):
    """The file of Adams that docs/foreign-tables.md shows, and its mapping."""
    head, mapping = block("docs/foreign-tables.md", "text", 1), block("docs/foreign-tables.md", "toml", 1)
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
