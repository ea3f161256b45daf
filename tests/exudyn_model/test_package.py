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
    environment.pop("NUMBA_CACHE_DIR", None)
    environment.pop("SIXBAR_CACHE_DIR", None)
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code],
        env=environment, cwd=cache, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def run_python(code, path, cache):
    process = start(code, path, cache)
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out.split()


def test_simulates_where_the_other_packages_cannot_be_imported(make_scene, tmp_path):
    """Two processes at once, which compile the same kernels into one folder; a third one finds them there."""
    scene = json.dumps(make_scene({"drive.cycles": 0.01}))
    code = f"""
import json, sys
sys.modules["reference_model"] = sys.modules["comparison"] = None
import exudyn_model
result = exudyn_model.simulate(json.loads({scene!r}))
from exudyn_model.five_bodies.contact_forces import slider_force
print(result.status, len(result.columns["time"]), sum(slider_force.stats.cache_hits.values()))
"""
    both = [start(code, PACKAGE.parent, tmp_path) for _ in range(2)]
    for process in both:
        out, err = process.communicate()
        assert process.returncode == 0, err
        assert out.split()[:2] == ["success", "11"]
    assert run_python(code, PACKAGE.parent, tmp_path) == ["success", "11", "1"]


def test_an_edit_of_a_called_kernel_is_noticed(tmp_path):
    """A compiled caller is cached; then a function that it calls gets another constant."""
    copy = tmp_path / "source" / "exudyn_model"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    cache = tmp_path / "cache"
    cache.mkdir()
    code = """
from exudyn_model.caller import call
from exudyn_model.kernels import seal
print(call(2.0), sum(call.stats.cache_hits.values()))
seal()
"""
    callee, header = copy / "callee.py", "from exudyn_model.kernels import entry, kernel\n"
    callee.write_text(header + "@kernel\ndef scale(x):\n    return 3.0 * x\n")
    (copy / "caller.py").write_text(
        header + "from exudyn_model.callee import scale\n@entry\ndef call(x):\n    return scale(x)\n"
    )
    assert run_python(code, copy.parent, cache) == ["6.0", "0"]
    assert run_python(code, copy.parent, cache) == ["6.0", "1"]
    callee.write_text(callee.read_text().replace("3.0", "5.0"))
    assert run_python(code, copy.parent, cache) == ["10.0", "0"]


def test_numba_s_own_cache_setting_is_left_alone():
    assert "exudyn_model" not in numba.config.CACHE_DIR
