"""The program as its users have it: exit code, lines and files of a command, and documented names of Python.

Most commands run in this process, as ``comparison.cli.main([...])``, which returns the exit code.
"""

import io
import json
import os
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import fake_model
import pytest
from installed import write_package
from platformdirs import user_cache_path

from comparison.cli import main
from comparison.execution.pool import kept_workers

COMMAND_VARIABLES = {"PATH", "COLUMNS", "HOME", "USERPROFILE"}
"""Variables that a command reads, and a model's run does not."""


class Process(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def lines(self):
        return self.out.splitlines()


class Sixbar:
    """``sixbar`` in a folder of its own; called with the arguments of a command."""

    def __init__(self, folder, environment, site):
        self.folder, self.environment, self.sites = folder, environment, [str(site)]
        self.last = Process(0, "", "")

    @property
    def numbers(self):
        """The JSON that the last command printed."""
        return json.loads(self.last.out)

    def __call__(self, *arguments, code=0, **variables):
        """Run a command in this process and require its exit code.

        A command with packages or other variables of its own is a process: kept workers would not see these.
        """
        if variables.keys() - COMMAND_VARIABLES or len(self.sites) > 1:
            self.last = self.process(*map(str, arguments), code=code, env=variables)
            return self.last
        out, err = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
            patch.chdir(self.folder)
            patch.setattr(sys, "path", [*self.sites, *sys.path])
            for name, value in (self.environment | variables).items():
                patch.setenv(name, value)
            self.last = Process(main([*map(str, arguments)]), out.getvalue(), err.getvalue())
        assert "Traceback" not in self.last.out + self.last.err
        assert self.last.code == code, (arguments, self.last)
        return self.last

    def start(self, *arguments, env=None, **options):
        path = os.pathsep.join([*self.sites, *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = os.environ | self.environment | {"PYTHONPATH": path} | (env or {})
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "cwd": self.folder} | options
        return subprocess.Popen(
            [sys.executable, "-m", "comparison", *arguments], env=environment, text=True, **options
        )

    def process(self, *arguments, code=0, **options):
        """Run a command as a process and require its exit code."""
        with self.start(*arguments, **options) as process:
            out, err = (text or "" for text in process.communicate(timeout=600))  # s: it hangs
        assert "Traceback" not in out + err
        assert process.returncode == code, (arguments, out, err)
        return Process(code, out, err)

    def refusal(self, arguments, *pieces):
        """Require bad input to be one line on stderr with these pieces, and no file to change."""
        files = self.files()
        process = self(*(arguments.split() if isinstance(arguments, str) else arguments), code=2)
        assert (process.out, process.err[:8], process.err.count("\n")) == ("", "sixbar: ", 1), process.err
        assert not [piece for piece in pieces if piece not in process.err], process.err
        assert self.files() == files
        return process.err

    def files(self):
        """All files below the folder, and with an ending slash all folders."""
        paths = {str(path.relative_to(self.folder)): path for path in sorted(self.folder.rglob("*"))}
        return {
            name if path.is_file() else f"{name}/": path.read_bytes() if path.is_file() else b""
            for name, path in paths.items()
        }

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    def table(self, name, **columns):
        """Write a table with all digits of its numbers: ``sixbar.table("a.csv", time=..., x=...)``."""
        rows = [",".join(repr(float(value)) for value in row) for row in zip(*columns.values(), strict=True)]
        return self.write(name, "\n".join([",".join(columns), *rows, ""]))

    def press(self, name, text="", **settings):
        """Write a scene for the models of `presses`: ``sixbar.press("bad", beta='does = "fail"')``."""
        head = f'[scene]\nextends = "150rpm-0.2mm"\n[drive]\ncycles = 1\n{text}'
        output = "[output]\ngroups = []\nsamples_per_cycle = 200\n"
        solvers = [f"[solver.{model}]\n{values}\n" for model, values in settings.items()]
        return self.write(f"{name}.toml", "".join([head, output, *solvers]))

    def text(self, name):
        return (self.folder / name).read_text("utf-8")

    def json(self, name):
        return json.loads(self.text(name))

    def junit(self, name):
        """Test cases by suite and name, each a tag and a message; require the right counts."""
        root, cases = ET.fromstring(self.text(name)), {}
        for suite in root.findall("testsuite"):
            for case in suite.findall("testcase"):
                (tag, message), *_ = [(child.tag, child.get("message") or "") for child in case] or [("", "")]
                cases[suite.get("name"), f"{case.get('classname')} {case.get('name')}"] = tag, message
        tags = [tag for tag, _ in cases.values()]
        counts = (len(tags), *map(tags.count, ("failure", "error", "skipped")))
        assert counts == tuple(int(root.get(key)) for key in ("tests", "failures", "errors", "skipped"))
        return cases


@pytest.fixture(scope="session")
def make(tmp_path_factory):
    """The program in a new folder, with a cache of the session, the models of `presses`, and unbroken lines.

    Machine code may come from the user's own cache: only the first run of a version compiles.
    """
    source, site = Path(__file__).with_name("presses.py").read_text("utf-8"), tmp_path_factory.mktemp("site")
    shutil.copy(fake_model.__file__, site)
    write_package(site, "presses", source, {name: f"presses:{name}" for name in ("alpha", "beta", "gamma")})
    kernels = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("SIXBAR_CACHE_DIR") or user_cache_path()
    cache = tmp_path_factory.mktemp("cache")
    variables = {"SIXBAR_CACHE_DIR": str(cache), "NUMBA_CACHE_DIR": str(kernels), "COLUMNS": "2000"}
    variables["PRESSES_LOG"] = str(cache / "log")
    return lambda: Sixbar(tmp_path_factory.mktemp("here"), variables, site)


@pytest.fixture(scope="package", autouse=True)
def _workers():
    """The workers of a command serve the next ones."""
    with kept_workers():
        yield


@pytest.fixture
def sixbar(make):
    return make()


@pytest.fixture(scope="session")
def runs(make):
    """Short runs of both models: ``a.csv`` of the reference, ``b.csv`` of Exudyn's tree, ``a.parquet``."""
    sixbar, options = make(), "--set drive.cycles=0.02 --set output.samples_per_cycle=2000 -q"
    for out, model in (("a.csv", "reference"), ("a.parquet", "reference"), ("b.csv", "exudyn")):
        tree = "--formulation tree" if model == "exudyn" else ""
        sixbar(*f"run 150rpm-0.2mm --out {out} {options} --model {model} {tree}".split())
    return sixbar
