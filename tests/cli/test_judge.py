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
from doc_pages import ROOT, block

PAGE = "docs/judge.md"
PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
SCRIPT = """
import math, sys
tolerance, start = map(float, sys.argv[1:3])
with open(sys.argv[3], "w") as file:
    print("time,y", file=file)
    for t in (k / 20 for k in range(101)):
        print(t, math.exp(-t) * (1 + start + 1e-3 * tolerance), sep=",", file=file)
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


@pytest.fixture
def pair(sixbar):
    sixbar.write("a.py", SCRIPT)

    def make(old="", new=""):
        assert old in PAIR
        sixbar.write("pair.toml", PAIR.replace(old, new) if old else PAIR)
        return "judge", "pair.toml", "-q"

    return make


@pytest.fixture(scope="module")
def judge_page(make):
    sixbar, (program, *command) = make(), shlex.split(block(PAGE, "sh"))
    for name, number in (("pendulum.py", 0), ("solver.py", 1)):
        sixbar.write(name, block(PAGE, "python", number))
    sixbar.write("pair.toml", block(PAGE, "toml"))
    assert program == "sixbar"
    assert sixbar(*command, PATH=PATH).err.count("warning") == 0
    return sixbar, command


RUN = """
import runpy, sys
runpy.run_path("pendulum.py", run_name="__main__")
print(*{name.partition(".")[0] for name in sys.modules})
"""


def test_the_two_functions_of_the_page_load_neither_a_model_nor_a_compiler(judge_page):
    sixbar, _ = judge_page
    options = {"cwd": sixbar.folder, "capture_output": True, "text": True, "check": True}
    out = subprocess.run([sys.executable, "-c", RUN], **options).stdout
    source = (ROOT / PAGE).read_text("utf-8")
    until, reference = (re.search(r"agree until (\S+) s", text)[1] for text in (out, source))
    # The end of the agreement follows the machine's rounding: a chaotic motion grows e-fold in some 0.5 s.
    assert float(until) == pytest.approx(float(reference), abs=1.0)
    page = re.sub(r"(?s)<(script|style).*?</\1>|<[^>]*>", " ", sixbar.text("pendulum.html"))
    assert not re.findall(r"\b(press|slider|crank|tier|Exudyn)\b", page)
    modules = set(out.splitlines()[-1].split())
    assert not {"exudyn", "numba", "llvmlite", "reference_model", "exudyn_model"} & modules


def test_the_pair_of_the_page_and_its_step_of_ci(judge_page):
    sixbar, command = judge_page
    run, upload = yaml.safe_load(block(PAGE, "yaml"))
    assert shlex.split(run["run"])[1:] == command
    assert {path.name for path in (sixbar.folder / upload["with"]["path"]).iterdir()} == {
        "report.html", "junit.xml", "summary.md", "summary.json", "tables",
    }  # fmt: skip
    # Runs are stored until a file has changed, or a module beside it.
    for name, until, code in (("solver.py", "any", 0), ("pendulum.py", "10", 3)):
        text = sixbar.text(name)
        sixbar.write(name, "raise SystemExit('it runs again')")
        assert "it runs again" in sixbar(*command, PATH=PATH, code=2).err
        sixbar.write(name, text)
        process = sixbar(*command, "--until", until, PATH=PATH, code=code)
        assert "LSODA: stored runs of the same command and files are used" in process.err
        cases = sixbar.junit("report/junit.xml").items()
        assert [tag for (_, case), (tag, _) in cases if "verdict" in case] == ["failure" if code else ""]
    assert {path.name for path in (sixbar.folder / "report" / "tables").glob("*.csv")} == {
        "pair-DOP853.csv", "pair-LSODA.csv",
    }  # fmt: skip


def test_the_fmu_of_the_page(judge_page):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    sixbar, _ = judge_page
    sixbar.write("slave.py", SLAVE)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "slave.py", "-d", ".", "pendulum.py"]
    subprocess.run(build, cwd=sixbar.folder, check=True, capture_output=True)
    head, _, tail = block(PAGE, "toml").partition("[side.b]")
    text = head + block(PAGE, "toml", 1) + tail[tail.index("[start]") :]
    for old, new, code, message in (
        ("", "", 0, "The two agree until"),
        ("tolerance = 1e-8   #", "step = 5e-3\norder = 4.0\n#", 0, "The two agree until"),
        ('"phi1", ', '"phi3", ', 2, "'phi3' is no variable with a start value; did you mean phi"),
    ):
        assert old in text
        sixbar.write("fmu.toml", text.replace(old, new))
        process = sixbar("judge", "fmu.toml", PATH=PATH, code=code)
        assert message in process.out + process.err
        assert "scale is taken as 1" not in process.err


SLAVE = """
import numpy as np
from pendulum import rates, run
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Real

STATES = ("phi1", "phi2", "u", "v")

class pendulum(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.phi1, self.phi2, self.u, self.v, self.tolerance = 2.0, 2.5, 0.0, 0.0, None
        self.default_experiment = DefaultExperiment(start_time=0.0, stop_time=10.0, step_size=0.01)
        for name in STATES:
            self.register_variable(Real(name, causality=Fmi2Causality.output, initial=Fmi2Initial.exact))

    def setup_experiment(self, start_time, stop_time, tolerance):
        self.tolerance = tolerance

    def exit_initialization_mode(self):
        self.y = np.array([getattr(self, name) for name in STATES])
        if self.tolerance:
            self.rows = run("LSODA", self.tolerance, self.y - [2.0, 2.5, 0, 0]).to_numpy()[:, 1:]

    def do_step(self, current_time, h):
        if self.tolerance:
            self.y = self.rows[round((current_time + h) / 0.01)]
        else:
            k = [np.array(rates(0, self.y))]
            for share in (0.5, 0.5, 1.0):
                k.append(np.array(rates(0, self.y + share * h * k[-1])))
            self.y = self.y + h * (k[0] + 2 * k[1] + 2 * k[2] + k[3]) / 6
        for name, value in zip(STATES, map(float, self.y)):
            setattr(self, name, value)
        return True
"""
REFERENCE = np.linspace(0, 5, 101), np.exp(-np.linspace(0, 5, 101))


@pytest.mark.parametrize(
    ("side", "verdict"),
    [
        (block(PAGE, "toml", 2).replace("phi1 = 1e-3, phi2 = 1e-3", "y = 1e-3"), "agree"),
        ('[side.a]\nfile = "measured.csv"\nu = { y = 3e-3 }\n', "agree"),
        ('[side.a]\nfile = "measured.csv"\n', "differ"),
    ],
)
def test_a_reference_that_is_only_a_file(sixbar, pair, side, verdict):
    """The file is off by 1e-3, its repetitions by -1e-3 and 0."""
    for name, error in (("measured", 1e-3), ("second", -1e-3), ("third", 0.0)):
        sixbar.table(f"{name}.csv", time=REFERENCE[0], y=REFERENCE[1] + error)
    command = pair(PAIR[: PAIR.index("[side.b]")], side)
    process = sixbar(*command, "--json", PATH=PATH, code=int(verdict == "differ"))
    (scene,) = sixbar.numbers["scenes"]
    assert (scene["verdict"], scene["labels"]) == (verdict, ["measured", "b"])
    assert ("only the error of b is known" in process.err) == (verdict == "differ")
    assert "only one state is moved" in process.err


def test_the_error_of_a_file_for_compare(sixbar):
    """The tables are 1e-3 apart, and only b has a finer run."""
    time, y = REFERENCE
    for name, error in (("a", 1e-3), ("one", -1e-3), ("b", 1e-9), ("fine", 0.0)):
        sixbar.table(f"{name}.csv", time=time, y=y + error)
    for name, text in (("u", "y = 3e-3"), ("less", "y = 1e-6"), ("x", "x = 3e-3"), ("zero", "y = 0.0")):
        sixbar.write(f"{name}.toml", text)
    command = "compare a.csv b.csv --finer-b fine.csv"
    for options, code in (("", 1), ("--u-a u.toml", 0), ("--u-a less.toml", 1), ("--repeat-a one.csv", 0)):
        err = sixbar(*command.split(), *options.split(), code=code).err
        assert ("only the error of b is known" in err) == (not options)
    err = sixbar(*command.split(), "--repeat-a", "a.csv", code=1).err
    assert "a: no error is known of y, which counts as exact apart from its round-off" in err
    sixbar(*["compare", "a.csv", "b.csv", "--u-a", "u.toml", "--u-b", "less.toml"])
    for name, error in (("two", 0.0), ("other", 1e-9), ("finer", 0.0)):
        sixbar.table(f"{name}.csv", time=time, y=y + error, v=y**2)
    err = sixbar(*["compare", "two.csv", "other.csv", "--finer-b", "finer.csv", "--u-a", "u.toml"]).err
    assert "two: no error is known of v, which counts as exact" in err
    sixbar.refusal("compare a.csv b.csv --finer-a one.csv --u-a u.toml", "has a finer run")
    sixbar.refusal(f"{command} --u-a x.toml", "'x'", "is not a channel")
    sixbar.refusal(f"{command} --u-a zero.toml", "zero.toml: y = 0.0 must be a number > 0")


EMPTY = "python -c 'import sys; open(sys.argv[1], chr(119))' {out} {tolerance} {start}"
KILL = "python -c 'import os; os.kill(os.getpid(), 9)'"
SLOW = "limit = 0.2\n[side.a]\ncommand = \"python -c 'import time; time.sleep(60)'"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tolerance = 1e-7", "tolerence = 1e-7", "is not a known key; did you mean side.b.tolerance?"),
        ("tolerance = 1e-7", "tolerance = 1e-7\nstep = 1.0", "side.b must have a tolerance or a step, not"),
        ("tolerance = 1e-7", "step = 1e-3", "{tolerance} {start} {out}' must hold {step}"),
        ("{tolerance} {start}", "{tolerance}", "'python a.py {tolerance} {out}' must hold {start}"),
        ("[start]", "[demand]\nuntil = 'all'\n[start]", "demand.until = 'all' must be"),
        ("[start]", "[mapping]\ncolums = {}\n[start]", "mapping: colums is not a known key; did you mean"),
        ("[start]", "[mapping]\ncompare = ['z']\n[start]", "'z' is not a channel"),
        ("side.b", "side.c", "side.c is not a known key; did you mean side.b?"),
        ("tolerance = 1e-7", "limit = 9", "side.b.limit is not a known key; did you mean limit?"),
        ('["y"]', '["y", "y"]', "start.states = ['y', 'y'] must not contain a state twice"),
        ("python", "no-such-program", "a, tolerance 1e-06: cannot be run: no program 'no-such-program'"),
        ("a.py", "b.py", "a, tolerance 1e-06: ended with code 2: "),
        ("python a.py", KILL, "a, tolerance 1e-06: was ended by SIGKILL: python -c"),
        ('[side.a]\ncommand = "python a.py', SLOW, "a, tolerance 1e-06: stopped after 0.2 s: python -c"),
        ("{out}", "{out}.csv", "has written no table to {out}"),
        ("python a.py {tolerance} {start} {out}", EMPTY, "sixbar: a: is empty"),
        ("command", "file", "side.a with a file has no other keys than label, u and"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line(sixbar, pair, old, new, message):
    err = sixbar(*pair(old, new), PATH=PATH, code=2).err
    assert message in err
    assert len(err.splitlines()) == 1
