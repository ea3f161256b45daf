"""The package in isolation: imports, and the cache of its compiled kernels."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba

import exudyn_model

PACKAGE = Path(exudyn_model.__file__).parent


def start(code, path, cache):
    """Start a process of Python with the package at ``path``, its kernels below ``cache``."""
    environment = os.environ | {"PYTHONPATH": str(path), "XDG_CACHE_HOME": str(cache)}
    for variable in ("NUMBA_CACHE_DIR", "SIXBAR_CACHE_DIR"):
        environment.pop(variable, None)
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.Popen(command, env=environment, cwd=cache, stdout=-1, stderr=-1, text=True)


def output(process):
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out.split()


def test_simulates_where_the_other_packages_cannot_be_imported(make_scene, tmp_path):
    """Two processes at once, which compile the same kernels into one folder; a third one finds them there."""
    code = f"""
import json, sys
sys.modules["reference_model"] = sys.modules["comparison"] = None
import exudyn_model
result = exudyn_model.simulate(json.loads({json.dumps(make_scene({"drive.cycles": 0.01}))!r}))
from exudyn_model.five_bodies.contact_forces import slider_force
print(result.status, len(result.columns["time"]), sum(slider_force.stats.cache_hits.values()))
"""
    for process in [start(code, PACKAGE.parent, tmp_path) for _ in range(2)]:
        assert output(process)[:2] == ["success", "11"]
    assert output(start(code, PACKAGE.parent, tmp_path)) == ["success", "11", "1"]
    assert "exudyn_model" not in numba.config.CACHE_DIR  # numba's own setting is left alone


def test_an_edit_of_a_called_kernel_is_noticed(tmp_path):
    """A compiled caller is cached; then a function that it calls gets another constant."""
    copy, cache = tmp_path / "source" / "exudyn_model", tmp_path / "cache"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    cache.mkdir()
    header = "from exudyn_model.kernels import entry, kernel\n"
    caller = "from exudyn_model.callee import scale\n@entry\ndef call(x):\n    return scale(x)\n"
    (copy / "caller.py").write_text(header + caller)
    code = """
from exudyn_model.caller import call
from exudyn_model.kernels import seal
print(call(2.0), sum(call.stats.cache_hits.values()))
seal()
"""
    for factor, expected in ((3.0, ["6.0", "0"]), (3.0, ["6.0", "1"]), (5.0, ["10.0", "0"])):
        (copy / "callee.py").write_text(header + f"@kernel\ndef scale(x):\n    return {factor} * x\n")
        assert output(start(code, copy.parent, cache)) == expected
