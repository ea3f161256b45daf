"""The package by itself: imports, and the cache of its compiled kernels."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba

import exudyn_model

PACKAGE = Path(exudyn_model.__file__).parent


def run_python(code, path, cache):
    environment = os.environ | {"PYTHONPATH": str(path), "XDG_CACHE_HOME": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=environment,
        cwd=cache,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_simulates_where_the_other_packages_cannot_be_imported(make_scene, tmp_path):
    scene = json.dumps(make_scene({"drive.cycles": 0.01}))
    code = f"""
import json, sys
sys.modules["reference_model"] = sys.modules["comparison"] = None
import exudyn_model
result = exudyn_model.simulate(json.loads({scene!r}))
print(result.status, len(result.columns["time"]))
"""
    assert run_python(code, PACKAGE.parent, tmp_path).split() == ["success", "11"]


def test_an_edit_of_a_called_kernel_is_noticed(tmp_path):
    """A compiled caller is cached; then a function in a sub-package that it calls gets another constant."""
    copy = tmp_path / "source" / "exudyn_model"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    cache = tmp_path / "cache"
    cache.mkdir()
    code = """
from exudyn_model.caller import call
print(call(2.0), sum(call.compiled.stats.cache_hits.values()))
"""
    callee = copy / "contact" / "callee.py"
    header = "from exudyn_model.compiled import kernel\n"
    callee.write_text(header + "@kernel\ndef scale(x):\n    return 3.0 * x\n")
    (copy / "caller.py").write_text(
        header + "from exudyn_model.contact.callee import scale\n@kernel\ndef call(x):\n    return scale(x)\n"
    )
    assert run_python(code, copy.parent, cache).split() == ["6.0", "0"]
    assert run_python(code, copy.parent, cache).split() == ["6.0", "1"]
    callee.write_text(callee.read_text().replace("3.0", "5.0"))
    assert run_python(code, copy.parent, cache).split() == ["10.0", "0"]


def test_numba_s_own_cache_setting_is_left_alone():
    assert "exudyn_model" not in numba.config.CACHE_DIR


def rooms(folder):
    return {path.name for path in folder.iterdir() if path.is_dir() and any(path.glob("*.py"))}


def test_tests_lie_as_their_sources_do():
    assert rooms(Path(__file__).parent) == rooms(PACKAGE)


def test_compiled_functions_of_two_records_have_different_symbols_in_all_processes(tmp_path):
    """Else a process that loads what two others have compiled would call the one in place of the other."""
    code = """
import sys
import numba
from exudyn_model.contact import point

for name in {order}:
    print(name, *numba.from_dtype(point.law_type(name)).mangling_args)
"""
    order = ["guide", "pin"]
    first, second = (
        sorted(run_python(code.format(order=names), PACKAGE.parent, tmp_path).splitlines())
        for names in (order, order[::-1])
    )
    assert first == second
    assert len({line.split(maxsplit=1)[1] for line in first}) == 2
