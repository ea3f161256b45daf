"""Both models' compiled code on disk: damage, and folders that cannot be written, cost time only."""

import os
import shutil
import subprocess
import sys
from importlib import import_module
from itertools import product
from pathlib import Path

PATH = os.environ.get("PYTHONPATH") or str(Path(__file__).parents[2])
IMPORTS = {
    "reference_model": "from reference_model.compiled import inner, kernel, seal\n",
    "exudyn_model": "from exudyn_model.kernels import entry as kernel, kernel as inner, seal\n",
}
SCALE = "@inner\ndef {0}_scale(x):\n    return 3.0 * x\n"
KERNEL = "@kernel\ndef {0}_{1}(x):\n    return {0}_scale(x)\n\nkernels.append({0}_{1})\n"
CALLER = """
import numba
assert "cache" not in numba.config.CACHE_DIR  # numba's own setting is left alone
for each in kernels:
    print(each.__name__, each(2.0), sum(each.stats.cache_hits.values()))
for seal in seals:
    seal()
"""


def flip(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "emptied": lambda content: content[:0],
    "zeroed": lambda content: bytes(len(content)),
    "bit": flip,
}


def call(folder, cache, *names, scale=SCALE, value=6.0, env=None):
    """Call kernels of both packages in a process; return flags of those from the cache, and stderr.

    Their file is in ``folder``; ``cache`` is its SIXBAR_CACHE_DIR, ``env`` more of its environment,
    ``scale`` the text that defines or imports the function which they call with 2, to get ``value``.
    """
    script, text = folder / "caller.py", "kernels, seals = [], []\n"
    for package, imports in IMPORTS.items():
        text += imports + scale.format(package) + "seals.append(seal)\n"
        text += "".join(KERNEL.format(package, name) for name in names or ("scaled",))
    if not script.exists():
        script.write_text(text + CALLER)
    variables = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment = {**variables, "PYTHONPATH": PATH, "SIXBAR_CACHE_DIR": str(cache), **(env or {})}
    command = [sys.executable, str(script)]
    run = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    kernels, results, hits = zip(*(line.split() for line in run.stdout.splitlines()), strict=True)
    assert {*map(float, results)} == {value}
    return dict(zip(kernels, (hit == "1" for hit in hits), strict=True)), run.stderr


def every(stored, *names):
    """The flags of `call` if all of these kernels came from the cache, or none."""
    return {f"{package}_{name}": stored for package in IMPORTS for name in names or ("scaled",)}


def files(cache, suffix="nb[ic]", name="*"):
    return sorted(cache.rglob(f"caller.{name}-*.{suffix}"))


def test_a_damaged_file_is_compiled_anew_and_what_replaces_it_is_trusted(tmp_path):
    cache, damages = tmp_path / "cache", [*product(("nbc", "nbi"), DAMAGES)]
    names = [*map("_".join, damages)]
    call(tmp_path, cache, "sound", *names)
    for package, (suffix, damage) in product(IMPORTS, damages):
        (path,) = files(cache, suffix, f"{package}_{suffix}_{damage}")
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
    first, second = (call(tmp_path, cache, "sound", *names)[0] for _ in range(2))
    assert first == every(True, "sound") | every(False, *names)
    assert second == every(True, "sound", *names)


def test_an_edit_of_a_function_that_a_kernel_calls_is_noticed(tmp_path):
    """The kernel's own file stays as it is, which is all that numba looks at."""
    for package in IMPORTS:
        source, ignore = Path(import_module(package).__file__).parent, shutil.ignore_patterns("__pycache__")
        shutil.copytree(source, tmp_path / package, ignore=ignore)
    env = {"PYTHONPATH": os.pathsep.join([str(tmp_path), PATH])}
    for factor, stored in ((3.0, False), (3.0, True), (5.0, False)):
        for package, imports in IMPORTS.items():
            (tmp_path / package / "callee.py").write_text(
                imports + SCALE.format(package).replace("3.0", str(factor))
            )
        scale = "from {0}.callee import {0}_scale\n"
        answer = call(tmp_path, tmp_path / "cache", env=env, scale=scale, value=2.0 * factor)
        assert answer[0] == every(stored)


def test_an_empty_variable_is_one_that_is_not_set(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    variables = {"HOME": str(home), "XDG_CACHE_HOME": "", "SIXBAR_CACHE_DIR": "", "NUMBA_CACHE_DIR": ""}
    call(tmp_path, tmp_path, env=variables)
    assert all(files(home, name=f"{package}_scaled") for package in IMPORTS)
    assert not [path for path in files(tmp_path) if home not in path.parents]


def test_where_nothing_can_be_stored_a_process_compiles_and_says_so_in_one_warning(tmp_path):
    """The cache is below a file, or at the home of a user without an entry in the password file."""
    (tmp_path / "file").touch()
    (tmp_path / "sitecustomize.py").write_text("import pwd\npwd.getpwuid = {}.__getitem__\n")
    variables = {"HOME": "", "XDG_CACHE_HOME": "", "PYTHONPATH": os.pathsep.join([str(tmp_path), PATH])}
    for cache, env, place in (
        (tmp_path / "file", {}, str(tmp_path / "file")),
        ("", variables, "home folder"),
    ):
        _, err = call(tmp_path, cache, env=env)
        assert err.count("RuntimeWarning") == len(IMPORTS)
        assert err.count(place) >= len(IMPORTS)
        assert "SIXBAR_CACHE_DIR" in err
    assert not files(tmp_path)
