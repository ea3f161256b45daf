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


@pytest.fixture(scope="module")
def foreign():
    """What runs a process as a user whom nobody knows."""
    program, path = interpreter()
    environment = {"HOME": None, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": path}
    return environment, {"program": program, **AS_FOREIGN}


@pytest.fixture
def opened(tmp_path):
    """A folder that others may enter, with one that they may write to."""
    open_to_others(tmp_path)
    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o777)
    return tmp_path


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


def test_a_cache_below_a_file_is_replaced_by_a_temporary_one_with_one_warning(package, tmp_path):
    (tmp_path / "file").touch()
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    env = {"TMPDIR": str(temporary)}
    for stored in (False, True):
        output, err = call(package, tmp_path, tmp_path / "file", env=env)
        assert output == stored
        assert err.count("RuntimeWarning") == 1
        assert str(tmp_path / "file") in err
        assert f"in {temporary}" in err
    (own,) = temporary.glob("sixbar-crossval-*")
    assert stat.S_IMODE(own.stat().st_mode) == 0o700


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["open to others", "a link", "none"])
def test_without_a_temporary_folder_of_its_own_it_compiles_for_the_process_and_says_so(
    package, kind, tmp_path
):
    """Another user could have filled it, or have it lead elsewhere."""
    (tmp_path / "file").touch()
    temporary, env = tmp_path / "tmp", {"PYTHONPATH": os.pathsep.join([str(tmp_path), PATH])}
    temporary.mkdir()
    own = temporary / f"sixbar-crossval-{os.getuid()}"
    if kind == "a link":
        (tmp_path / "theirs").mkdir(mode=0o700)
        own.symlink_to(tmp_path / "theirs")
    elif kind == "open to others":
        own.mkdir()
        own.chmod(0o777)
    else:
        temporary = tmp_path / "file" / "tmp"
        code = f"import tempfile; tempfile.tempdir = {str(temporary)!r}\n"
        (tmp_path / "sitecustomize.py").write_text(code)
    env |= dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(temporary))
    output, err = call(package, tmp_path, tmp_path / "file", env=env)
    assert not output
    assert "process" in err
    assert not files(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("populated", [False, True])
def test_a_read_only_cache_and_no_home(package, populated, opened, foreign):
    """As in a container with a foreign user: what the cache holds is used, else a temporary one is."""
    environment, options = foreign
    cache = opened / "cache"
    cache.mkdir()
    if populated:
        here = {"PYTHONPATH": environment["PYTHONPATH"]}
        call(package, opened, cache, env=here, program=options["program"])
        for path in (cache, *cache.rglob("*")):
            path.chmod(0o755 if path.is_dir() else 0o644)
    output, err = call(package, opened, cache, env=environment | {"TMPDIR": str(opened / "tmp")}, **options)
    assert output == populated
    # Both models take a copy of what the cache holds; the Exudyn model says so
    assert files(opened / "tmp")
    assert err.count("RuntimeWarning") == (not populated or package == "exudyn_model")


@pytest.mark.slow
def test_a_user_without_home_and_entry(package, opened, foreign):
    environment, options = foreign
    unset = {"SIXBAR_CACHE_DIR": None, "XDG_CACHE_HOME": None, "TMPDIR": str(opened / "tmp")}
    _, err = call(package, opened, Path(), env=environment | unset, **options)
    assert err.count("RuntimeWarning") == 1
    assert "home" in err
    assert not (opened / "~").exists()
