"""Finished runs kept on disk, so that an interrupted validation resumes and an unchanged run is not repeated.

Every run is one table with its companions (no pickle), named by a hash of all that can change it: the scene,
the sources of its model and of what writes the table, the versions of what they import, the machine's kind.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import time
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from comparison.scene import Scene, digest
from comparison.table import Table, TableError, check, read, write

KEEP_DAYS = 30
_IMPORTED = ("numpy", "scipy", "numba", "exudyn")


def cache_folder() -> Path:
    """Return ``$SIXBAR_CACHE_DIR``, or a folder of ours where the system keeps a user's caches."""
    if named := os.environ.get("SIXBAR_CACHE_DIR"):
        return Path(named)
    home = Path.home()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", home / "AppData/Local")) / "sixbar-crossval" / "Cache"
    if sys.platform == "darwin":
        return home / "Library/Caches/sixbar-crossval"
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "sixbar-crossval"


def run_key(scene: Scene, model: str, package: str) -> str:
    """Hash of all that can change the run of ``scene`` by ``model``, whose package is named ``package``."""
    physics = {key: part for key, part in scene.data.items() if key not in ("scene", "solver")}
    return digest(
        {
            "scene": physics,
            "solver": scene.data["solver"].get(model),
            "model": model,
            "sources": _sources(package),
            "versions": {name: _version(name) for name in _IMPORTED},
            "python": platform.python_version(),
            "machine": platform.platform(),
        }
    )


def fetch(key: str, channels: list[str], span: tuple[float, float]) -> Table | None:
    """Return the kept run, or None where there is none that can be read and passes `check`."""
    path = cache_folder() / f"{key}.csv"
    if not path.is_file():
        return None
    try:
        table = read(path)
        check(table, channels, span)
    except TableError:
        return None
    with suppress(OSError):  # a cache that cannot be written still serves
        for part in path.parent.glob(f"{key}.*"):
            part.touch()
    return table


def keep(key: str, table: Table) -> None:
    """Keep a run and drop those that nobody asked for in a month; where that cannot be done, do nothing."""
    with suppress(TableError):
        write(table, cache_folder() / f"{key}.csv")
    oldest = time.time() - KEEP_DAYS * 86400
    with suppress(OSError):
        for path in cache_folder().glob("*.*"):
            if path.stat().st_mtime < oldest:
                path.unlink()


def _sources(package: str) -> str:
    """Hash of the package's sources and of the modules that turn its result into a table."""
    found = find_spec(package)
    folders = list(found.submodule_search_locations or ()) if found else []
    paths = [path for folder in folders for path in sorted(Path(folder).rglob("*.py"))]
    here = Path(__file__).parent
    total = hashlib.sha256()
    for path in (*paths, here / "table.py", here / "run.py"):
        total.update(f"{path.name}\0".encode() + path.read_bytes() + b"\0")
    return total.hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
