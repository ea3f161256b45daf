"""Both models' compiled code on disk: damage, and folders that cannot be written, cost time only."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from itertools import product
from pathlib import Path

import pytest

pytestmark = pytest.mark.parametrize("package", ["reference_model", "exudyn_model"])
PATH = os.environ.get("PYTHONPATH") or str(Path(__file__).parents[2])
IMPORTS = {
    "reference_model": "from reference_model.compiled import inner, kernel, seal\n",
    "exudyn_model": "from exudyn_model.kernels import entry as kernel, kernel as inner, seal\n",
}
SCALE = "@inner\ndef scale(x):\n    return 3.0 * x\n"
KERNEL = "@kernel\ndef {}(x):\n    return scale(x)\n"
CALLER = """
import numba
assert "cache" not in numba.config.CACHE_DIR  # numba's own setting is left alone
for each in [{}]:
    print(each(2.0), sum(each.stats.cache_hits.values()))
seal()
"""


def flipped(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "emptied": lambda content: content[:0],
    "zeroed": lambda content: bytes(len(content)),
    "bit": flipped,
}


def call(package, folder, cache, *names, scale=SCALE, value=6.0, env=None):
    """Call kernels in a process; whether they all came from the cache, of several each, and its stderr.

    They are in a file of ``folder``; ``cache`` is its SIXBAR_CACHE_DIR, ``env`` more of its environment,
    ``scale`` the text that defines or imports the function which they call with 2, to get ``value``.
    """
    names = names or ("scaled",)
    script, kernels = folder / "caller.py", "".join(map(KERNEL.format, names))
    if not script.exists():
        script.write_text(IMPORTS[package] + scale + kernels + CALLER.format(", ".join(names)))
    usual = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment = {**usual, "PYTHONPATH": PATH, "SIXBAR_CACHE_DIR": str(cache), **(env or {})}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    returned, hits = zip(*(line.split() for line in done.stdout.splitlines()), strict=True)
    assert [*map(float, returned)] == [value] * len(names)
    stored = dict(zip(names, (hit == "1" for hit in hits), strict=True))
    return stored if len(names) > 1 else stored[names[0]], done.stderr


def files(cache, suffix="nb[ic]", name="*"):
    return sorted(cache.rglob(f"caller.{name}-*.{suffix}"))


def test_a_damaged_file_is_compiled_anew_and_what_replaces_it_is_trusted(package, tmp_path):
    cache, damages = tmp_path / "cache", [*product(("nbc", "nbi"), DAMAGES)]
    names = ["sound", *map("_".join, damages)]
    call(package, tmp_path, cache, *names)
    for suffix, damage in damages:
        (path,) = files(cache, suffix, f"{suffix}_{damage}")
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
    first, second = (call(package, tmp_path, cache, *names)[0] for _ in range(2))
    assert first == dict.fromkeys(names, False) | {"sound": True}
    assert second == dict.fromkeys(names, True)


def test_processes_that_compile_at_once_leave_one_cache(package, tmp_path):
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda _: call(package, tmp_path, tmp_path / "cache"), range(2)))
    assert call(package, tmp_path, tmp_path / "cache")[0]


def test_an_edit_of_a_function_that_a_kernel_calls_is_noticed(package, tmp_path):
    """The kernel's own file stays as it is, which is all that numba looks at."""
    copy, unbuilt = tmp_path / package, shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(import_module(package).__file__).parent, copy, ignore=unbuilt)
    env = {"PYTHONPATH": os.pathsep.join([str(tmp_path), PATH])}
    for factor, stored in ((3.0, False), (3.0, True), (5.0, False)):
        (copy / "callee.py").write_text(IMPORTS[package] + SCALE.replace("3.0", str(factor)))
        scale = f"from {package}.callee import scale\n"
        called = call(package, tmp_path, tmp_path / "cache", env=env, scale=scale, value=2.0 * factor)
        assert called[0] == stored


def test_an_empty_variable_is_one_that_is_not_set(package, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    unset = {"HOME": str(home), "XDG_CACHE_HOME": "", "SIXBAR_CACHE_DIR": "", "NUMBA_CACHE_DIR": ""}
    call(package, tmp_path, tmp_path, env=unset)
    assert files(home)
    assert not [path for path in files(tmp_path) if home not in path.parents]


def test_where_nothing_can_be_stored_a_process_compiles_and_says_so_in_one_warning(package, tmp_path):
    (tmp_path / "file").touch()
    _, err = call(package, tmp_path, tmp_path / "file")
    assert err.count("RuntimeWarning") == 1
    assert str(tmp_path / "file") in err
    assert "SIXBAR_CACHE_DIR" in err
    assert not files(tmp_path)
