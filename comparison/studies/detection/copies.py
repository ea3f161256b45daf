"""Copies of a model's package with one place of its code changed, installed as models of their own.

A copy has another package name, so that it stands beside the model it was made from, and registers itself
as any package with a model does. It vanishes at the end, with the kernels that were compiled of it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import invalidate_caches
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from comparison.models import GROUP, OWN, load


@dataclass(frozen=True, kw_only=True)
class Change:
    """One place of a model's code, changed."""

    engine: str = ""
    """Name of the copy."""
    model: str = ""
    """Whose package is copied."""
    file: str = ""
    """Of the package, by its path in it."""
    old: str = ""
    """What stands there once."""
    new: str = ""
    """What stands there instead."""


class CatalogueError(ValueError):
    """A change that does not fit the sources as they are now."""


def package(model: str) -> Path:
    """Return the folder of a model's package."""
    found = find_spec(OWN[model].module)
    if found is None or not found.submodule_search_locations:
        raise CatalogueError(f"model {model!r}: its package is not a folder")
    return Path(next(iter(found.submodule_search_locations)))


def changed(text: str, change: Change) -> str:
    """Return the text of a source file with the change made.

    Raises
    ------
    CatalogueError
        If the text to be replaced is not there exactly once: the code has moved on, and so must the change.
    """
    count = text.count(change.old)
    if count != 1:
        raise CatalogueError(
            f"{change.engine}: {change.old!r} is {count} times in {change.file} of the {change.model} model"
        )
    return text.replace(change.old, change.new)


@contextmanager
def installed(changes: Sequence[Change]) -> Iterator[None]:
    """Install a copy for each change, for this process and the workers that it starts."""
    with TemporaryDirectory(prefix="sixbar-") as folder:
        for change in changes:
            _copy(change, Path(folder))
        sys.path.insert(0, folder)
        invalidate_caches()
        try:
            yield
        finally:
            sys.path.remove(folder)
            invalidate_caches()


def _copy(change: Change, folder: Path) -> None:
    source, name = package(change.model), change.engine
    for path in source.rglob("*.py"):
        text, inside = path.read_text("utf-8"), path.relative_to(source)
        if inside.as_posix() == change.file:
            text = changed(text, change)
        target = folder / name / inside
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text.replace(source.name, name), "utf-8")
    record = folder / f"{name}-1.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n", "utf-8")
    (record / "entry_points.txt").write_text(f"[{GROUP}]\n{name} = {name}:simulate\n", "utf-8")


def load_copy(engine: str) -> None:
    """Import a copy so that its compiled kernels are kept beside it and not among those of the models."""
    found = find_spec(engine)
    before = os.environ.get("NUMBA_CACHE_DIR")
    if found is not None and found.origin:
        os.environ["NUMBA_CACHE_DIR"] = str(Path(found.origin).parents[1])
    try:
        load(engine)
    finally:
        if before is None:
            os.environ.pop("NUMBA_CACHE_DIR", None)
        else:
            os.environ["NUMBA_CACHE_DIR"] = before
