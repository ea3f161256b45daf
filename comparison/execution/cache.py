"""Cache of finished runs on disk: an interrupted validation resumes, an unchanged run is not repeated.

Every run is a folder with one table and its companions (no pickle), named by a hash of everything that can
change it: the scene, its model (`comparison.engines.registry.fingerprint`), the sources of what writes the
table, the machine's kind (its processor too: a CI service restores a cache on another machine than the one
that wrote it). It is complete or absent, and used only if its files have the checksums it was stored with.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import platform
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

from comparison.engines.platform import platform_name
from comparison.engines.registry import OWN
from comparison.engines.source_hash import code_hash
from comparison.files import FolderError, write_json
from comparison.scene import Scene, digest
from comparison.tables.table import Table, TableError, check
from comparison.tables.table_files import read, write

KEEP_DAYS = 30
RUNS, TABLE, SUMS = "runs", "run.csv", "sha256.json"
_WRITES = "comparison.execution.run"
"""Module that converts a model's result to a table."""
_LOG = logging.getLogger(__name__)


def cache_folders() -> Iterator[Path]:
    """Yield ``$SIXBAR_CACHE_DIR`` or this package's folder in the user's cache, then a temporary one.

    The temporary one is this user's alone: what another user may have written is not used.
    """
    named = os.environ.get("SIXBAR_CACHE_DIR")
    with suppress(RuntimeError):  # no home folder
        usual = Path(named) if named else user_cache_path("sixbar-crossval", appauthor=False)
        if named or usual.is_absolute():
            yield usual
    with suppress(OSError):
        user = os.getuid() if hasattr(os, "getuid") else 0
        temporary = Path(tempfile.gettempdir()) / f"sixbar-crossval-{user}"
        temporary.mkdir(mode=0o700, exist_ok=True)
        found = temporary.lstat()
        if stat.S_ISDIR(found.st_mode) and (
            os.name != "posix" or (found.st_uid == user and not found.st_mode & 0o077)
        ):
            yield temporary


def cache_folder() -> Path:
    """Return the first of `cache_folders` that can be written, made if missing.

    Raises
    ------
    FolderError
        If there is none.
    """
    for folder in cache_folders():
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
    raise FolderError("no cache folder can be written; SIXBAR_CACHE_DIR names one")


def cache_warnings() -> list[str]:
    """Say in one line where runs and compiled code are stored, if not where they should be."""
    tried = list(cache_folders())
    try:
        found = cache_folder()
    except FolderError:
        return ["no cache folder can be written: nothing is cached; SIXBAR_CACHE_DIR names one"]
    if found == tried[0] and found.name.rpartition("-")[0] != "sixbar-crossval":
        return []
    unusable = "there is no home folder" if found == tried[0] else f"{tried[0]} cannot be written"
    return [f"{unusable}: the cache is in {found}; SIXBAR_CACHE_DIR names another"]


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
    """Return the cached run, or None if there is none that is sound and passes `check`.

    A damaged one is reported to this module's logger and deleted. A cache that can only be read is used.
    """
    for folder in _searched():
        path = folder / RUNS / key
        try:
            if not path.is_dir():
                continue
            if _sums(path) == json.loads((path / SUMS).read_text("utf-8")):
                table = read(path / TABLE)
                check(table, channels, span)
                with suppress(OSError):  # a read-only cache remains usable
                    os.utime(path)
                return table
            reason = "its files are not as they were stored"
        except (OSError, ValueError) as error:  # of JSON and of tables: ValueErrors
            reason = str(error)
        _LOG.warning("the cached run %s is damaged and is run again: %s", path, " ".join(reason.split()))
        shutil.rmtree(path, ignore_errors=True)
    return None


def _searched() -> list[Path]:
    """Return `cache_folders` down to the one that is written."""
    folders = list(cache_folders())
    with suppress(FolderError):
        return folders[: folders.index(cache_folder()) + 1]
    return folders


def keep(key: str, table: Table) -> None:
    """Store a run and delete those not used for a month; do nothing if that is impossible."""
    try:
        folder = cache_folder()
    except FolderError:
        return
    with suppress(OSError, TableError):
        (folder / RUNS).mkdir(mode=0o700, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder / RUNS))
        try:
            write(table, part / TABLE)
            write_json(_sums(part), part / SUMS)
            part.rename(folder / RUNS / key)  # fails if another process was first
        finally:
            shutil.rmtree(part, ignore_errors=True)
    oldest = time.time() - KEEP_DAYS * 86400
    for path in (*folder.glob("*.jsonl"), *(folder / RUNS).glob("*")):
        with suppress(OSError):
            if path.stat().st_mtime < oldest:
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def _sums(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of a run but that of the sums themselves."""
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.iterdir())
        if path.name != SUMS
    }
