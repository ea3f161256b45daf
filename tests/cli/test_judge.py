"""The page on any two solvers, followed literally in an empty folder, and mistakes in a pair file."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

PAGE = (Path(__file__).parents[2] / "docs" / "judge.md").read_text("utf-8")
PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
SCRIPT = """
import sys
import numpy as np
tolerance, start, out = float(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
t = np.linspace(0, 5, 101)
y = np.exp(-t) * (1 + start + 1e-3 * tolerance)
np.savetxt(out, np.column_stack([t, y]), header="time,y", delimiter=",")
"""
PAIR = """
[side.a]
command = "python a.py {tolerance} {start} {out}"
tolerance = 1e-6
[side.b]
command = "python a.py {tolerance} {start} {out}"
tolerance = 1e-7
[start]
states = ["y"]
"""


def block(language, number=0):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)[number]


@pytest.fixture
def pair(sixbar):
    """Return a maker of a pair file with changes."""
    sixbar.write("a.py", SCRIPT)

    def make(*changes):
        text = PAIR
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        sixbar.write("pair.toml", text)
        return "judge", "pair.toml", "-q"

    return make


def test_the_two_functions_of_the_page(sixbar):
    sixbar.write("pendulum.py", block("python"))
    done = subprocess.run(
        [sys.executable, "pendulum.py"], cwd=sixbar.folder, capture_output=True, text=True, check=True
    )
    (said, until), (shown, about) = (
        re.search(r"(agree until) (\S+) s", text).groups() for text in (done.stdout, PAGE)
    )
    assert said == shown
    # Where a chaotic motion is lost follows the rounding of the machine: e-fold in some 0.5 s.
    assert float(until) == pytest.approx(float(about), abs=1.0)
    page = Path(sixbar.folder, "pendulum.html").read_text("utf-8")
    for word in ("press", "slider", "crank", "tier", "Exudyn"):
        assert not re.search(rf"\b{word}\b", re.sub(r"(?s)<(script|style).*?</\1>|<[^>]*>", " ", page)), word


def test_the_pair_of_the_page(sixbar):
    for name, number in (("pendulum.py", 0), ("solver.py", 1)):
        sixbar.write(name, block("python", number))
    sixbar.write("pair.toml", block("toml"))
    command = shlex.split(block("sh"))[1:]
    assert sixbar(*command, PATH=PATH).err.count("warning") == 0
    assert {path.name for path in Path(sixbar.folder, "report").iterdir()} == {
        "report.html", "junit.xml", "summary.md", "summary.json", "tables",
    }  # fmt: skip
    sixbar.write("solver.py", "raise SystemExit('it runs again only where a file has changed')")
    assert "it runs again only where" in sixbar(*command, PATH=PATH, code=2).err
    sixbar.write("solver.py", block("python", 1))
    assert sixbar(*command, "--until", "any", PATH=PATH).code == 0
    sixbar(*command, "--until", "10", PATH=PATH, code=3)
    sixbar.write("pendulum.py", "raise SystemExit('nor is a module beside it forgotten')")
    assert "nor is a module beside it forgotten" in sixbar(*command, PATH=PATH, code=2).err


def test_the_step_of_ci_of_the_page(sixbar, pair):
    pair()
    run, upload = yaml.safe_load(block("yaml"))
    assert "agree" in sixbar(*shlex.split(run["run"])[1:], PATH=PATH).out
    assert Path(sixbar.folder, upload["with"]["path"], "junit.xml").is_file()


def test_the_fmu_of_the_page(sixbar):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    for name, text in (
        ("pendulum.py", block("python")),
        ("solver.py", block("python", 1)),
        ("slave.py", SLAVE_OF_PAGE),
    ):
        sixbar.write(name, text)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slave.py", "-d", ".", "pendulum.py"]
    subprocess.run(build, cwd=sixbar.folder, check=True, capture_output=True)
    before, _, after = block("toml").partition("[side.b]")
    sixbar.write("pair.toml", before + block("toml", 1) + after[after.index("[start]") :])
    ended = sixbar("judge", "pair.toml", PATH=PATH)
    assert "The two agree until" in ended.out
    assert "scale is taken as 1" not in ended.err


SLAVE_OF_PAGE = """
import numpy as np
from pendulum import run
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Real

class pendulum(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.phi1, self.phi2, self.u, self.v, self.tolerance = 2.0, 2.5, 0.0, 0.0, 1e-8
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=10.0, step_size=0.01)
        for name in ("phi1", "phi2", "u", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output, initial=Fmi2Initial.exact))

    def setup_experiment(self, start_time, stop_time, tolerance):
        self.tolerance = tolerance

    def exit_initialization_mode(self):
        start = np.array([self.phi1 - 2.0, self.phi2 - 2.5, self.u, self.v])
        self.rows = run("LSODA", self.tolerance, start).to_numpy()[:, 1:]

    def do_step(self, current_time, step_size):
        row = self.rows[round((current_time + step_size) / 0.01)]
        self.phi1, self.phi2, self.u, self.v = map(float, row)
        return True
"""


def test_columns_of_one_side_are_refused_after_its_first_run(sixbar, pair):
    command = pair(
        (
            'a.py {tolerance} {start} {out}"\ntolerance = 1e-7',
            'b.py {tolerance} {start} {out}"\ntolerance = 1e-7',
        )
    )
    logged = f"{SCRIPT}\nopen('runs', 'a').write('run ')\n"
    sixbar.write("a.py", logged)
    sixbar.write("b.py", logged.replace("time,y", "time,z"))
    said = sixbar(*command, PATH=PATH, code=2).err
    assert "'y' is not a channel, nor a column of both tables" in said
    assert "[mapping] of a pair file" in said
    assert Path(sixbar.folder, "runs").read_text("utf-8") == "run run "


def test_the_reference_of_the_page_that_is_only_a_file(sixbar):
    for name, number in (("pendulum.py", 0), ("solver.py", 1)):
        sixbar.write(name, block("python", number))
    first, *moved = ("measured", "0"), ("second", "1e-9"), ("third", "2e-9")
    for name, start in (first, *moved):
        words = f"solver.py --method DOP853 --tolerance 1e-10 --start {start},0,0,0 --out {name}.csv".split()
        subprocess.run([sys.executable, *words], cwd=sixbar.folder, check=True)
    sixbar.write("pair.toml", f"{block('toml', 2)}[side.b]{block('toml').partition('[side.b]')[2]}")
    assert "The two agree until" in sixbar("judge", "pair.toml", PATH=PATH).out


def test_an_fmu_is_a_side(sixbar):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    sixbar.write("slave.py", SLAVE)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slave.py", "-d", "."]
    subprocess.run(build, cwd=sixbar.folder, check=True, capture_output=True)
    sixbar.write("exact.py", EXACT)
    fmu = '{ fmu = "Oscillator.fmu", tolerance = 1e-6 }'
    text = f"""
start = {{ states = ["x0", "v0"] }}
[side]
a = {{ command = "python exact.py {{tolerance}} {{start}} {{out}}", tolerance = 1e-6 }}
b = {fmu}
"""
    sixbar.write("pair.toml", text)
    assert "2 of 2" in sixbar("judge", "pair.toml", "-q", PATH=PATH).out
    sixbar.write("pair.toml", text.replace("exact.py {", "exact.py --stiffer {"))
    assert "confirmed" in sixbar("judge", "pair.toml", "-q", PATH=PATH, code=1).out
    sixbar.write("pair.toml", text.replace(fmu, fmu.replace("tolerance = 1e-6", "step = 5e-3, order = 4.0")))
    assert sixbar("judge", "pair.toml", "-q", PATH=PATH).code == 0
    sixbar.write("pair.toml", text.replace('"v0"', '"v1"'))
    assert (
        "'v1' is no variable with a start value; did you mean v0?"
        in sixbar("judge", "pair.toml", "-q", PATH=PATH, code=2).err
    )


EXACT = """
import sys
import numpy as np
*more, tolerance, start, out = sys.argv[1:]
x, v = np.array([1.0, 0.0]) + np.array(start.split(","), dtype=float)
t, w = np.linspace(0, 5, 101), 1.00001 if more else 1.0
error = 1 + 1e-2 * float(tolerance)
c, s = error * np.cos(w * t), error * np.sin(w * t)
rows = np.column_stack([t, x * c + v / w * s, v * c - x * w * s])
np.savetxt(out, rows, header="time,x,v", delimiter=",")
"""
SLAVE = """
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

class Oscillator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.v, self.x0, self.v0, self.steps = 1.0, 0.0, 1.0, 0.0, 1
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=5.0, step_size=0.05)
        for name in ("x", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for name in ("x0", "v0"):
            tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
            self.register_variable(Real(name, **tunable))

    def setup_experiment(self, start_time, stop_time, tolerance):
        self.steps = 1 if tolerance is None else max(1, round(0.5 * tolerance**-0.25))

    def exit_initialization_mode(self):
        self.x, self.v = self.x0, self.v0

    def do_step(self, current_time, step_size):
        h = step_size / self.steps
        for _ in range(self.steps):
            x, v = self.x, self.v
            self.x = x * (1 - h**2 / 2 + h**4 / 24) + v * (h - h**3 / 6)
            self.v = v * (1 - h**2 / 2 + h**4 / 24) - x * (h - h**3 / 6)
        return True
"""


REFERENCE = np.linspace(0, 5, 101), np.exp(-np.linspace(0, 5, 101))


@pytest.mark.parametrize(
    ("known", "verdict"),
    [
        ("u = { y = 3e-3 }", "agree"),
        ("u = { y = 1e-6 }", "differ"),
        ('repeat = ["one.csv", "two.csv"]', "agree"),
        ("", "differ"),  # within its round-off
    ],
)
def test_a_reference_that_is_only_a_file(sixbar, pair, known, verdict):
    """The file is off by 1e-3, its repetitions by -1e-3 and 0."""
    for name, error in (("file", 1e-3), ("one", -1e-3), ("two", 0.0)):
        sixbar.table(f"{name}.csv", time=REFERENCE[0], y=REFERENCE[1] + error)
    first = PAIR[: PAIR.index("[side.b]")]
    command = pair((first, f'[side.a]\nfile = "file.csv"\n{known}\n'))
    ended = sixbar(*command, "--json", PATH=PATH, code=int(verdict == "differ"))
    (scene,) = sixbar.numbers["scenes"]
    assert (scene["verdict"], scene["labels"]) == (verdict, ["file", "b"])
    assert ("only the error of b is known" in ended.err) == (not known)


def test_the_error_of_a_file_for_compare(sixbar):
    """The tables are 1e-3 apart, and only b has a finer run."""
    time, y = REFERENCE
    for name, error in (("a", 1e-3), ("one", -1e-3), ("b", 1e-9), ("fine", 0.0)):
        sixbar.table(f"{name}.csv", time=time, y=y + error)
    sixbar.write("u.toml", "y = 3e-3")
    sixbar.write("less.toml", "y = 1e-6")
    judged = "compare", "a.csv", "b.csv", "--finer-b", "fine.csv"
    assert "only the error of b is known" in sixbar(*judged, code=1).err
    for further, code in ((("u.toml"), 0), (("less.toml"), 1)):
        assert "only the error" not in sixbar(*judged, "--u-a", further, code=code).err
    sixbar(*judged, "--repeat-a", "one.csv")
    sixbar("compare", "a.csv", "b.csv", "--u-a", "u.toml", "--u-b", "less.toml")
    sixbar.refused(
        ["compare", "a.csv", "b.csv", "--finer-a", "one.csv", "--u-a", "u.toml"], "has a finer run"
    )
    sixbar.write("u.toml", "x = 3e-3")
    sixbar.refused([*judged, "--u-a", "u.toml"], "'x'", "is not a channel")
    sixbar.write("u.toml", "y = 0.0")
    sixbar.refused([*judged, "--u-a", "u.toml"], "u.toml: y = 0.0 must be a number > 0")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tolerance = 1e-7", "tolerence = 1e-7", "is not a known key; did you mean side.b.tolerance?"),
        ("[start]", "[strat]", "strat is not a known key; did you mean start?"),
        ("tolerance = 1e-7", "tolerance = -1.0", "side.b.tolerance = -1.0 must be > 0"),
        ("tolerance = 1e-7", "tolerance = 1e-7\nstep = 1.0", "side.b must have a tolerance or a step, not"),
        ("tolerance = 1e-7", "step = 1e-3", "{tolerance} {start} {out}' must hold {step}"),
        ("{tolerance} {start}", "{tolerance}", "'python a.py {tolerance} {out}' must hold {start}"),
        ("[start]", "[demand]\nuntil = 'all'\n[start]", "demand.until = 'all' must be"),
        ("[start]", "[mapping]\ncolums = {}\n[start]", "mapping: colums is not a known key; did you mean"),
        ("[start]", "[mapping]\ncompare = ['z']\n[start]", "'z' is not a channel"),
        ("side.b", "side.c", "side.b is missing"),
        ("python", "no-such-program", "a, tolerance 1e-06: cannot be run: no program 'no-such-program'"),
        ("a.py", "b.py", "a, tolerance 1e-06: ended with code 2: "),
        ("{out}", "{out}.csv", "has written no table to {out}"),
        ("[start]", "[[start]]", "start = "),
        ("command", "file", "side.a with a file has no other keys than u and repeat"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line(sixbar, pair, old, new, message):
    said = sixbar(*pair((old, new)), PATH=PATH, code=2).err
    assert message in said
    assert len(said.splitlines()) == 1


def test_a_command_that_takes_too_long_is_stopped(sixbar, pair):
    command = pair(("[side.a]", "limit = 1.0\n[side.a]"))
    sixbar.write("a.py", "import time; time.sleep(60)")
    assert "a, tolerance 1e-06: stopped after 1 s: python a.py" in sixbar(*command, PATH=PATH, code=2).err


def test_the_verdict_says_that_one_state_alone_is_moved(sixbar, pair):
    assert "only one state is moved" in sixbar(*pair(), PATH=PATH).err
