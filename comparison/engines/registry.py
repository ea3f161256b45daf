"""The models that can run a scene: the two of this project, and those that other packages register.

A package joins with an entry point, read when it is asked for (``docs/engine.md`` shows a whole one):

    [project.entry-points."sixbar.models"]
    mine = "my_package:simulate"

The two of this project stand here and not among its entry points, so that they are there without an
installation, and so that nobody else can take their names.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from importlib.metadata import EntryPoint, PackageNotFoundError, distributions, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from comparison.engines.source_hash import file_hash

GROUP = "sixbar.models"
OWN = {
    name: EntryPoint(name, target, GROUP)
    for name, target in (("reference", "reference_model:simulate"), ("exudyn", "exudyn_model:simulate"))
}
_IMPORTED = ("numpy", "scipy", "numba", "exudyn")


class EngineError(ValueError):
    """A model that cannot be used; the message is one line."""


def engine_names() -> list[str]:
    """Names of all models, our own first."""
    others = {point.name for point in entry_points(group=GROUP)}
    return [*OWN, *sorted(others - OWN.keys())]


def find(name: str) -> EntryPoint:
    """Look a model up by its name; nothing is imported.

    Raises
    ------
    EngineError
        If there is none, or more than one.
    """
    registered = {point.value: point for point in entry_points(group=GROUP, name=name)}
    points = [*([OWN[name]] if name in OWN else []), *registered.values()]
    if not points:
        raise EngineError(f"model {name!r} is not known; there are {', '.join(engine_names())}")
    if len(points) > 1:
        raise EngineError(f"model {name!r} is registered twice: {' and '.join(p.value for p in points)}")
    return points[0]


def pair(names: str) -> tuple[str, str]:
    """Read the names of two models that are to be compared, as in ``"reference,exudyn"``.

    Raises
    ------
    EngineError
        If these are not two different ones that there are.
    """
    first, _, second = names.partition(",")
    if not second or first == second:
        raise EngineError(f"models {names!r} must be two names, as in reference,exudyn")
    return find(first).name, find(second).name


def load(name: str) -> Callable[..., Any]:
    """Import a model and return its ``simulate``.

    Raises
    ------
    EngineError
        If there is no such model, or what its entry point names cannot be imported or called.
    """
    point = find(name)
    try:
        simulate = point.load()
    except (ImportError, AttributeError) as error:
        raise EngineError(f"model {name!r} cannot be imported from {point.value!r}: {error}") from error
    if not callable(simulate):
        raise EngineError(f"model {name!r}: {point.value!r} is no function but a {type(simulate).__name__}")
    return simulate  # type: ignore[no-any-return] # what it returns is checked when it does


def fingerprint(name: str) -> str:
    """Hash of what can change a model: every file of its package, and the versions of what it may import.

    Of Python files the code counts, without comments and docstrings. Of another package the versions are
    those of all that is installed, as nobody knows what it imports. What it reads from elsewhere (a program
    that it starts, a file in the user's folder) is not noticed.
    """
    point = find(name)
    total = hashlib.sha256(point.value.encode())
    package = point.module.partition(".")[0]
    for path in _files(package):
        # Its place in the package, wherever that is installed.
        place = str(path).rpartition(f"{os.sep}{package}{os.sep}")[2]
        total.update(f"{place if package in path.parts else path.name}\0{file_hash(path)}\0".encode())
    for line in [f"{package} {_version(package)}" for package in _IMPORTED] if name in OWN else _installed():
        total.update(f"{line}\n".encode())
    return total.hexdigest()


def _files(package: str) -> list[Path]:
    """List the files of a package, compiled modules and data included, or the one file of a module."""
    found = find_spec(package)
    if found is None:
        return []
    if found.submodule_search_locations is None:
        return [Path(found.origin)] if found.origin and Path(found.origin).is_file() else []
    files = [path for folder in found.submodule_search_locations for path in Path(folder).rglob("*")]
    return sorted(path for path in files if path.is_file() and "__pycache__" not in path.parts)


def _installed() -> list[str]:
    return sorted({f"{found.name} {found.version}" for found in distributions()})


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
