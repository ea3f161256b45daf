"""A model's cache of compiled kernels, seen from processes that have one kernel each."""

import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

import pytest

PATH = os.environ.get("PYTHONPATH") or str(Path(__file__).parents[2])
FOREIGN = 12345
"""A user without an entry in the password file."""
AS_FOREIGN = {"user": FOREIGN, "group": FOREIGN, "extra_groups": []}
IMPORTS = {
    "reference_model": "from reference_model.compiled import inner, kernel, seal\n",
    "exudyn_model": "from exudyn_model.kernels import entry as kernel, kernel as inner, seal\n",
}
SCALE = "@inner\ndef scale(x):\n    return 3.0 * x\n"
CALLER = """
@kernel
def scaled(x):
    return scale(x)

import numba
assert "cache" not in numba.config.CACHE_DIR  # numba's own setting is left alone
print(scaled(2.0), sum(getattr(scaled, "compiled", scaled).stats.cache_hits.values()))
seal()
"""


def flipped(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


DAMAGES = {
    "cut": lambda content: content[: len(content) // 2],
    "emptied": lambda content: content[:0],
    "zeroed": lambda content: bytes(len(content)),
    "one bit": flipped,
}


def interpreter():
    """Return an interpreter that a foreign user may start, with its PYTHONPATH; skip the test without."""
    if not hasattr(os, "getuid") or os.getuid() != 0:
        pytest.skip("only root may become another user")
    system = f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}"
    packages = os.pathsep.join([PATH, sysconfig.get_path("purelib")])
    for program, path in ((sys.executable, PATH), (system, packages)):
        try:
            done = subprocess.run(
                [program, "-c", "import numba"], **AS_FOREIGN, cwd="/",
                env={"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, check=False,
            )  # fmt: skip
        except OSError:
            continue
        if done.returncode == 0:
            return program, path
    return pytest.skip("no interpreter with the packages is open to other users")


def open_to_others(folder):
    """Let other users enter a folder and those between it and the temporary one."""
    for place in (folder, *folder.parents):
        if Path(tempfile.gettempdir()) in place.parents:
            place.chmod(0o755)


def call(package, folder, cache, *, program=sys.executable, scale=SCALE, value=6.0, **options):
    """Call a kernel in a process; whether it came from the cache, and what stderr says.

    The kernel is in a file of ``folder``; ``cache`` is this process's SIXBAR_CACHE_DIR, and more of its
    environment may be given as ``env`` (None: without this variable). ``scale`` is the text that defines or
    imports the function ``scale``, which the kernel calls with 2; ``value`` is what that returns.
    """
    script, text = folder / "caller.py", IMPORTS[package] + scale + CALLER
    if not script.exists():
        script.write_text(text)
    changes = {"SIXBAR_CACHE_DIR": str(cache), "NUMBA_CACHE_DIR": None} | options.pop("env", {})
    environment = {k: v for k, v in {**os.environ, "PYTHONPATH": PATH, **changes}.items() if v is not None}
    done = subprocess.run(
        [program, str(script)],
        env=environment, cwd=folder, capture_output=True, text=True, check=False, **options,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    returned, hits = done.stdout.split()
    assert float(returned) == value
    return hits == "1", done.stderr


def files(cache, suffix="nb[ic]"):
    return sorted(cache.rglob(f"caller.*{suffix}"))
