"""Cache of finished runs on disk: an interrupted validation resumes, an unchanged run is not repeated.

Every run is one table with its companions (no pickle), named by a hash of everything that can change it: the
scene, its model (`comparison.engines.registry.fingerprint`), the sources of what writes the table, the
machine's kind (its processor too: a CI service restores a cache on another machine than the one that wrote
it).
"""

from __future__ import annotations

import os
import platform
import time
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

from comparison.engines.platform import platform_name
from comparison.engines.registry import OWN
from comparison.engines.source_hash import code_hash
from comparison.scene import Scene, digest
from comparison.tables.check import check
from comparison.tables.table import Table, TableError, read, write

KEEP_DAYS = 30
_WRITES = "comparison.execution.run"
"""Module that converts a model's result to a table."""


def cache_folder() -> Path:
    """Return ``$SIXBAR_CACHE_DIR``, or this package's folder in the user's cache directory."""
    named = os.environ.get("SIXBAR_CACHE_DIR")
    return Path(named) if named else user_cache_path("sixbar-crossval", appauthor=False)


def run_key(scene: Scene, model: str, fingerprint: str) -> str:
    """Return the hash of everything that can change the run of ``scene`` by ``model`` with this fingerprint.

    Of the solver settings only the model's own count, but all of them for a model of another package, which
    may build on the others.
    """
    solver = scene.data["solver"]
    physics = {key: part for key, part in scene.data.items() if key not in ("scene", "solver")}
    return digest(
        {
            "scene": physics,
            "solver": solver[model] if model in OWN else solver,
            "model": model,
            "fingerprint": fingerprint,
            "code": code_hash(_WRITES),
            "python": platform.python_version(),
            "machine": platform_name(),
        }
    )


def fetch(key: str, channels: list[str], span: tuple[float, float]) -> Table | None:
    """Return the cached run, or None if there is none that can be read and passes `check`."""
    path = cache_folder() / f"{key}.csv"
    if not path.is_file():
        return None
    try:
        table = read(path)
        check(table, channels, span)
    except TableError:
        return None
    with suppress(OSError):  # a read-only cache remains usable
        for part in path.parent.glob(f"{key}.*"):
            part.touch()
    return table


def keep(key: str, table: Table) -> None:
    """Store a run and delete those not used for a month; do nothing if that is impossible."""
    with suppress(TableError):
        write(table, cache_folder() / f"{key}.csv")
    oldest = time.time() - KEEP_DAYS * 86400
    with suppress(OSError):
        for path in cache_folder().glob("*.*"):
            if path.stat().st_mtime < oldest:
                path.unlink()
