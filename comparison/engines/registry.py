"""Registry of the models that can run a scene: the two of this project and those of other packages.

A package registers a model by an entry point, resolved on request (``docs/engine.md`` has a complete
example):

    [project.entry-points."sixbar.models"]
    mine = "my_package:simulate"

The two of this project are listed here rather than as entry points: they are available without installation,
and no other package can take their names.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint, PackageNotFoundError, distributions, entry_points, version
from importlib.util import find_spec
from math import isfinite
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
    """Unusable model; the message is one line."""


def engine_names() -> list[str]:
    """Names of all models, our own first."""
    others = {point.name for point in _registered()}
    return [*OWN, *sorted(others - OWN.keys())]


def find(name: str) -> EntryPoint:
    """Look up a model by name without importing it.

    Raises
    ------
    EngineError
        If no model or more than one has this name.
    """
    registered = {point.value: point for point in _registered() if point.name == name}
    points = [*([OWN[name]] if name in OWN else []), *registered.values()]
    if not points:
        raise EngineError(f"model {name!r} is not known; available: {', '.join(engine_names())}")
    if len(points) > 1:
        raise EngineError(f"model {name!r} is registered twice: {' and '.join(p.value for p in points)}")
    return points[0]


def pair(names: str) -> tuple[str, str]:
    """Parse the names of the two models to compare, as in ``"reference,exudyn"``.

    Raises
    ------
    EngineError
        If these are not two different available models.
    """
    first, _, second = names.partition(",")
    if not second or first == second:
        raise EngineError(f"models {names!r} must be two names, as in reference,exudyn")
    return find(first).name, find(second).name


def several(names: str) -> list[str]:
    """Parse the names of three or more models to compare, as in ``"reference,exudyn,mine"``.

    Raises
    ------
    EngineError
        If one is not available or named twice.
    """
    models = [find(name).name for name in names.split(",")]
    if twice := next((name for name in models if models.count(name) > 1), None):
        raise EngineError(f"models {names!r}: {twice} is named twice")
    return models


def load(name: str) -> Callable[..., Any]:
    """Import a model and return its ``simulate``.

    Raises
    ------
    EngineError
        If there is no such model, or the object of its entry point cannot be imported or called.
    """
    point = find(name)
    try:
        with redirect_stdout(sys.stderr):  # what it prints must not stand among results
            simulate = point.load()
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise EngineError(f"model {name!r} cannot be imported from {point.value!r}: {reason}") from error
    if not callable(simulate):
        kind = type(simulate).__name__
        raise EngineError(f"model {name!r}: {point.value!r} is not a function but a {kind}")
    return simulate  # type: ignore[no-any-return] # the result is checked on return


def declared(name: str) -> dict[str, Any]:
    """Return the default settings that an installed model declares: its function's ``settings``, if any.

    Of a model that cannot be imported none, since its run reports why.

    Raises
    ------
    EngineError
        If they are not names with a string, a boolean or a finite number each.
    """
    if name in OWN:
        return {}
    try:
        settings = getattr(load(name), "settings", {})
    except EngineError:
        return {}
    if not isinstance(settings, Mapping):
        raise EngineError(f"model {name!r}: settings must be a mapping, not {type(settings).__name__}")
    for key, value in settings.items():
        if not (isinstance(value, str | int) or (isinstance(value, float) and isfinite(value))):
            message = f"settings[{key!r}] = {value!r} must be a string, a boolean or a finite number"
            raise EngineError(f"model {name!r}: {message}")
    return dict(settings)


def fingerprint(name: str) -> str:
    """Hash of everything that can change a model: the files of its package and the versions of its imports.

    Python files are hashed without comments and docstrings. For models of other packages the versions of all
    installed distributions count, since their imports are unknown. Other inputs (a program that a model
    starts, a file in the user's folder) are not detected.
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


def _registered() -> tuple[EntryPoint, ...]:
    """Return the entry points of all installed packages, as of now.

    Reading them takes a sixth of a run of two cycles: it is done again only where a package came or went.
    """
    return _read(tuple((folder, _changed(folder)) for folder in sys.path))


@functools.lru_cache(maxsize=1)
def _read(_installed: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=GROUP))


def _changed(folder: str) -> int:
    try:
        return os.stat(folder or ".").st_mtime_ns  # noqa: PTH116 (before every run; a Path takes twice the time)
    except OSError:
        return 0


def _files(package: str) -> list[Path]:
    """List the files of a package, compiled modules and data included, or the single file of a module."""
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
