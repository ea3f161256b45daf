"""Both models and a validation in odd environments: a foreign user, no home, no terminal, no locale."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
PATH = os.environ.get("PYTHONPATH") or str(ROOT)
FOREIGN = 12345
"""A user without an entry in the password file."""
AS_FOREIGN = {"user": FOREIGN, "group": FOREIGN, "extra_groups": []}
COMMANDS = {
    "validate": ["validate", "ideal", "--jobs", "1", "--out", "v"],
    "reference": ["run", "wedge", "--model", "reference", "--out", "reference.csv"],
    "exudyn": ["run", "wedge", "--model", "exudyn", "--out", "exudyn.csv"],
}


@pytest.fixture
def sixbar(tmp_path):
    """Return what runs the commands in an environment and a folder of their own, and checks the results."""
    work = tmp_path / "work"
    work.mkdir()

    def run(changes, warnings=0, **options):
        usual = {"PYTHONPATH": PATH, "SIXBAR_CACHE_DIR": str(tmp_path / "cache")}
        merged = os.environ | usual | changes
        environment = {name: value for name, value in merged.items() if value is not None}
        program = options.pop("program", sys.executable)
        for name, command in COMMANDS.items():
            ended = subprocess.run(
                [program, "-m", "comparison", *command],
                env=environment, cwd=work, capture_output=True, text=True, check=False, **options,
            )  # fmt: skip
            # On a busy machine there are lines of progress as well.
            lines = [line for line in ended.stderr.splitlines() if not re.match(r"sixbar: \S+.*: \d+%", line)]
            assert (ended.returncode, len(lines)) == (0, warnings), (name, ended.stderr)
            assert all(line.startswith("sixbar: warning: ") for line in lines)
            assert "\x1b" not in ended.stdout
        assert (work / "v" / "report.html").is_file()
        assert not (work / "~").exists()

    return run


ODD = {
    "XDG_CACHE_HOME": "", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "COLUMNS": "20",
    "TERM": "dumb",
}  # fmt: skip


@pytest.mark.parametrize("home", [None, "/nowhere"])
def test_variables(home, sixbar):
    sixbar(ODD | {"HOME": home})


def interpreter():
    """Return an interpreter that a foreign user may start, with its PYTHONPATH; skip the test without."""
    if not hasattr(os, "getuid") or os.getuid() != 0:
        pytest.skip("only root may become another user")
    system = f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}"
    for program, path in ((sys.executable, PATH), (system, f"{PATH}:{sysconfig.get_path('purelib')}")):
        environment = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        with suppress(OSError, subprocess.CalledProcessError):
            subprocess.run(
                [program, "-c", "import numba"], **AS_FOREIGN, cwd="/", env=environment, check=True
            )
            return program, path
    return pytest.skip("no interpreter with the packages is open to other users")


@pytest.fixture
def foreign(tmp_path):
    """A user whom nobody knows: may write in the working folder and the temporary one alone."""
    program, path = interpreter()
    for place in (tmp_path, *tmp_path.parents):
        if Path(tempfile.gettempdir()) in place.parents:
            place.chmod(0o755)
    for package in ("comparison", "exudyn_model", "reference_model"):
        shutil.copytree(ROOT / package, tmp_path / "package" / package)
    for name in ("tmp", "home"):
        (tmp_path / name).mkdir()
    (tmp_path / "tmp").chmod(0o777)
    simulated = os.pathsep.join([str(tmp_path / "package"), *path.split(os.pathsep)[1:]])
    return {"program": program, "path": simulated}


def test_a_foreign_user_with_read_only_home_and_package(foreign, sixbar, tmp_path):
    """As in a container that is started with an arbitrary user: one warning, and results."""
    (tmp_path / "work").chmod(0o777)
    changes = {
        "HOME": str(tmp_path / "home"), "TMPDIR": str(tmp_path / "tmp"), "PYTHONPATH": foreign["path"],
        "NUMBA_CACHE_DIR": None, "SIXBAR_CACHE_DIR": None, "XDG_CACHE_HOME": None,
    }  # fmt: skip
    sixbar(changes, warnings=1, program=foreign["program"], **AS_FOREIGN)
    assert not list((tmp_path / "home").iterdir())
