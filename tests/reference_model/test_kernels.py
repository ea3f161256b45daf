"""Compiled code on disk: processes that compile at once, and sources that change."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import reference_model

_RUN = """
import json, sys
from reference_model import integrate, simulate
result = simulate(json.loads(sys.argv[1]))
stored = sum(integrate.advance.stats.cache_hits.values())
print(json.dumps([stored, result.status, result.columns["slider_x"].tolist()]))
"""
_CALL = """
from reference_model.compiled import kernel
from reference_model.laws import point_force

@kernel
def force(depth):
    return point_force(1.0, 1.0, depth)

print(force(3.0))
"""


def started(cache: Path, *command: str, **environment: str) -> "subprocess.Popen[str]":
    variables = {**os.environ, **environment, "SIXBAR_CACHE_DIR": str(cache)}
    variables.pop("NUMBA_CACHE_DIR", None)
    return subprocess.Popen([sys.executable, *command], env=variables, stdout=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_two_processes_that_compile_at_once_agree_and_leave_one_cache(scene, tmp_path) -> None:
    command = ("-c", _RUN, json.dumps(scene({"drive.cycles": 0.02})))
    both = [started(tmp_path, *command) for _ in range(2)]
    first, second = (json.loads(process.communicate()[0]) for process in both)
    assert first == second
    assert first[:2] == [0, "success"]
    assert json.loads(started(tmp_path, *command).communicate()[0]) == [1, *first[1:]]


def test_a_changed_function_that_a_kernel_calls_is_noticed(tmp_path) -> None:
    """The kernel's own file stays as it is, which is all that numba looks at."""
    package = shutil.copytree(Path(reference_model.__file__).parent, tmp_path / "reference_model")
    script, laws = tmp_path / "caller.py", package / "laws.py"
    script.write_text(_CALL)
    for factor, force in (("K", "3.0"), ("2.0 * K", "6.0")):
        laws.write_text(laws.read_text().replace("return K * (", f"return {factor} * ("))
        process = started(tmp_path / "cache", str(script), PYTHONPATH=str(tmp_path))
        assert process.communicate()[0].strip() == force
