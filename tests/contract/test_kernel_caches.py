"""Both models' compiled code on disk: damage, and folders that cannot be written, cost time only."""

import os
import shutil
import stat
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from itertools import product
from pathlib import Path

import pytest
from kernel_cache import (
    AS_FOREIGN,
    DAMAGES,
    IMPORTS,
    PATH,
    SCALE,
    call,
    files,
    interpreter,
    open_to_others,
)

pytestmark = pytest.mark.parametrize("package", ["reference_model", "exudyn_model"])


def test_a_damaged_file_is_compiled_anew_and_what_replaces_it_is_trusted(package, tmp_path):
    cache = tmp_path / "cache"
    call(package, tmp_path, cache)
    for suffix, (name, damage) in product(("nbc", "nbi"), DAMAGES.items()):
        (path,) = files(cache, suffix)
        path.write_bytes(damage(path.read_bytes()))
        assert [call(package, tmp_path, cache)[0] for _ in range(2)] == [False, True], (suffix, name)


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


@pytest.mark.slow
def test_folders_are_its_users_alone(package, tmp_path):
    cache = tmp_path / "new" / "cache"
    call(package, tmp_path, cache)
    (folder,) = {path for path in cache.rglob("*model-*") if path.is_dir()} | {
        path for path in cache.rglob("reference-*") if path.is_dir()
    }
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_where_nothing_can_be_stored_a_process_compiles_and_says_so_in_one_warning(package, tmp_path):
    (tmp_path / "file").touch()
    for _ in range(2):
        stored, err = call(package, tmp_path, tmp_path / "file")
        assert not stored
        assert err.count("RuntimeWarning") == 1
        assert str(tmp_path / "file") in err
        assert "SIXBAR_CACHE_DIR" in err
    assert not files(tmp_path)


@pytest.mark.slow
def test_a_user_without_home_and_entry(package, tmp_path):
    """As in a container with a foreign user."""
    program, path = interpreter()
    open_to_others(tmp_path)
    unset = {"HOME": None, "SIXBAR_CACHE_DIR": None, "XDG_CACHE_HOME": None}
    env = unset | {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": path}
    _, err = call(package, tmp_path, Path(), env=env, program=program, **AS_FOREIGN)
    assert err.count("RuntimeWarning") == 1
    assert "home" in err
    assert not (tmp_path / "~").exists()
