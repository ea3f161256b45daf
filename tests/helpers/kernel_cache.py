"""A model's cache of compiled kernels, seen from processes that have one kernel each."""

import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable
from pathlib import Path

PATH = os.environ.get("PYTHONPATH") or str(Path(__file__).parents[2])
FOREIGN = 12345
"""A user without an entry in the password file."""
CALLER = """
from {package}.compiled import kernel

@kernel
def triple(x):
    return 3.0 * x

value = triple(2.0)
print(value, sum(getattr(triple, "compiled", triple).stats.cache_hits.values()))
"""
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda content: content[: len(content) // 2],
    "emptied": lambda _: b"",
    "zeroed": lambda content: bytes(len(content)),
    "one bit": lambda content: (
        content[: len(content) // 2]
        + bytes([content[len(content) // 2] ^ 1])
        + content[len(content) // 2 + 1 :]
    ),
}


def damaged(package: str, folder: Path, cache: Path) -> dict[str, list[bool]]:
    """Damage each file in each way: whether a kernel comes from the cache before, after and a second time."""
    call(package, folder, cache)
    found = {}
    for suffix in ("nbi", "nbc"):
        for name, damage in DAMAGES.items():
            before, _ = call(package, folder, cache)
            (path,) = cache.rglob(f"caller.triple*.{suffix}")
            path.write_bytes(damage(path.read_bytes()))
            found[f"{suffix} {name}"] = [before, *(call(package, folder, cache)[0] for _ in range(2))]
    return found


def interpreter() -> list[tuple[str, str]]:
    """Return an interpreter that other users may start, with its PYTHONPATH; none if there is none."""
    system = f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}"
    packages = os.pathsep.join([PATH, sysconfig.get_path("purelib")])
    own = (sys.executable, PATH)
    for program, path in (own, (system, packages)):
        try:
            done = subprocess.run(
                [program, "-c", "import numba"], user=FOREIGN, group=FOREIGN, extra_groups=[], cwd="/",
                env={"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, check=False,
            )  # fmt: skip
        except OSError:
            continue
        if done.returncode == 0:
            return [(program, path)]
    return []


def open_to_others(folder: Path) -> None:
    """Let other users enter a folder and those between it and the temporary one."""
    for place in (folder, *folder.parents):
        if Path(tempfile.gettempdir()) in place.parents:
            place.chmod(0o755)


def call(
    package: str, folder: Path, cache: Path, *, program: str = sys.executable, **options
) -> tuple[bool, str]:
    """Call a kernel in a process; whether it came from the cache, and what stderr says.

    The kernel is in a file of ``folder``; ``cache`` is this process's SIXBAR_CACHE_DIR, and more of its
    environment may be given as ``env`` (None: without this variable).
    """
    script = folder / "caller.py"
    script.write_text(CALLER.format(package=package))
    changes = {"SIXBAR_CACHE_DIR": str(cache), "NUMBA_CACHE_DIR": None} | options.pop("env", {})
    environment = {k: v for k, v in {**os.environ, "PYTHONPATH": PATH, **changes}.items() if v is not None}
    done = subprocess.run(
        [program, str(script)],
        env=environment, cwd=folder, capture_output=True, text=True, check=False, **options,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()
    assert value == "6.0"
    return hits == "1", done.stderr


def files(cache: Path, suffix: str = "nb[ic]") -> list[Path]:
    return sorted(cache.rglob(f"caller.*{suffix}"))
