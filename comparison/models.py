"""Models that run a scene: their entry points, their formulations, and hashes of all that changes results.

A package registers a model by an entry point (``docs/engine.md``); our two are available without one.
"""

import ast
import hashlib
import os
import platform
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from copy import deepcopy
from functools import cache
from importlib.metadata import EntryPoint, PackageNotFoundError, distributions, entry_points, version
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import Any

GROUP = "sixbar.models"
OURS = {  # available without a registered entry point
    name: EntryPoint(name, target, GROUP)
    for name, target in (("reference", "reference_model:simulate"), ("exudyn", "exudyn_model:simulate"))
}
MODELS = ("reference", "exudyn")
"""Default pair of models."""
ROOT = Path(__file__).parents[1]
"""Folder that contains the packages."""

_LIBRARIES = ("numpy", "scipy", "numba", "exudyn")
# The C mathematical library and numba's compiler select code paths with different rounding by these features.
_FEATURES = ("avx2", "avx512f", "fma", "asimd", "sve")
# Variables that override this selection; other tunables of glibc only make stored results useless.
_OVERRIDES = {
    "OPENBLAS_CORETYPE": "OpenBLAS for",
    "GLIBC_TUNABLES": "glibc with",
    "NUMBA_CPU_NAME": "numba for",
    "NUMBA_CPU_FEATURES": "numba with",
}


class EngineError(ValueError):
    """Unusable model; the message is one line."""


# A driven crank and ideal joints leave no degree of freedom; every clearance adds two coordinates. A model's
# smallest formulation integrates only these, a larger one all bodies, constrained.


@cache
def declared_formulations(model: str) -> dict[str, dict[str, Any]]:
    """Return the formulations that ``formulations.toml`` of a model's package declares, the smallest first.

    Each has the key of its solver that controls the error, ``setting``, and what it requires; none where the
    package has no such file. The package is not imported.
    """
    spec = find_spec((OURS.get(model) or find(model)).module.partition(".")[0])
    for folder in (spec and spec.submodule_search_locations) or ():
        if (path := Path(folder, "formulations.toml")).is_file():
            return tomllib.loads(path.read_text("utf-8"))
    return {}


def formulations(model: str, scene: Mapping[str, Any]) -> list[str]:
    """Return a model's formulations that can run the joints of a scene; all record the slider's motion."""
    free = {name for name, kind in scene["joints"].items() if kind == "clearance"}
    return [
        name
        for name, each in declared_formulations(model).items()
        if (free or not each.get("clearance")) and not free & set(each.get("ideal", ()))
    ]


def smallest(model: str, scene: Mapping[str, Any]) -> str:
    """Return the first formulation that has a scene's channels and method, else the last; "auto" if none."""
    declarations, groups = declared_formulations(model), set(scene["output"]["groups"])
    method = scene["solver"].get(model, {}).get("method", "auto")
    names = formulations(model, scene)
    for name in names:
        each = declarations[name]
        if not groups & set(each.get("without", ())) and method in ("auto", *each.get("methods", [method])):
            return name
    return names[-1] if names else "auto"


def plan_of(model: str, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's plan of a scene, by its function's ``plan``; errors are those of `check`.

    It has ``formulation`` as the model records it, ``bodies``, the numbers of ``coordinates`` and
    ``constraints``, possibly a ``note``; of a linkage ``freedom`` and ``start`` (m, rad) of each body.
    """
    plan = getattr(load(model), "plan", None)
    if plan is None:
        raise EngineError(f"model {model!r} declares no plan of a scene")
    return dict(plan(deepcopy(scene)))


def engine_names() -> list[str]:
    """Return the names of all models, our own first."""
    return [*OURS, *sorted({point.name for point in entry_points(group=GROUP)} - OURS.keys())]


def find(name: str) -> EntryPoint:
    """Look up a model by name without importing it; `EngineError` if none or more than one has it."""
    if not isinstance(name, str):
        raise EngineError(f"model {name!r} must be a name, such as {', '.join(OURS)}")
    targets = {point.value: point for point in entry_points(group=GROUP) if point.name == name}
    points = [*([OURS[name]] if name in OURS else []), *targets.values()]
    if not points:
        raise EngineError(f"model {name!r} is not known; available: {', '.join(engine_names())}")
    if len(points) > 1:
        raise EngineError(f"model {name!r} is registered twice: {' and '.join(p.value for p in points)}")
    return points[0]


def distinct_models(names: str | Sequence[str]) -> list[str]:
    """Return two or more different models, also from ``"reference,exudyn"``; else an `EngineError`."""
    entries = [name.strip() for name in names.split(",")] if isinstance(names, str) else names
    models = [find(name).name for name in (entries if isinstance(entries, Sequence) else [entries])]
    if len(set(models)) < max(2, len(models)):
        raise EngineError(f"models {names!r} must be two or more different names, as in reference,exudyn")
    return models


def load(name: str) -> Callable[..., Any]:
    """Import a model and return its ``simulate``; an `EngineError` if it cannot be imported or called."""
    point = OURS.get(name) or find(name)  # a search of all packages takes a sixth of a short run
    try:
        with redirect_stdout(sys.stderr):  # its output must not mix with results
            simulate = point.load()
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise EngineError(f"model {name!r} cannot be imported from {point.value!r}: {reason}") from error
    if not callable(simulate):
        kind = type(simulate).__name__
        raise EngineError(f"model {name!r}: {point.value!r} is not a function but a {kind}")
    return simulate  # type: ignore[no-any-return] # the result is checked on return


def check(name: str, scene: Mapping[str, Any]) -> dict[str, float]:
    """Let a model check a scene without running it, by its function's ``check``, if any.

    Returns
    -------
    dict
        Forces of the workpiece, N: ``load_at_start`` and ``largest_load``; empty where the model states none.

    Raises
    ------
    ValueError
        One line, where the model refuses the scene.
    EngineError
        If it cannot be imported.
    """
    model_check = getattr(load(name), "check", None)
    return dict(model_check(deepcopy(scene)) or {}) if model_check is not None else {}


def declared_settings(name: str) -> dict[str, Any]:
    """Return the default settings that an installed model declares: its function's ``settings``, if any."""
    settings: Any = {}
    with suppress(EngineError):  # if it cannot be imported its run says why
        settings = {} if name in OURS else getattr(load(name), "settings", {})
    if not isinstance(settings, Mapping):
        raise EngineError(f"model {name!r}: settings must be a mapping, not {type(settings).__name__}")
    for key, value in settings.items():
        if not is_setting(value):
            message = f"settings[{key!r}] = {value!r} must be a string, a boolean or a finite number"
            raise EngineError(f"model {name!r}: {message}")
    return dict(settings)


def is_setting(value: object) -> bool:
    """Return whether a value can be a setting of an installed model."""
    return isinstance(value, str | int) or (isinstance(value, float) and isfinite(value))


def raw_hash(path: Path) -> str:
    """Return the hash of a file with its comments, in a hundredth of the time of `file_hash`."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def fingerprint(name: str, hash_of: Callable[[Path], str] | None = None) -> str:
    """Return the hash of all that can change a model: the files of its package, the versions of its imports.

    Of models of other packages the versions of all installed distributions count. Other inputs (a program
    that a model starts, a file in the user's folder) are not detected. ``hash_of``: by default `file_hash`.
    """
    point = OURS.get(name) or find(name)
    total = hashlib.sha256(point.value.encode())
    for place, path in sorted(_files(point.module.partition(".")[0]).items()):
        total.update(f"{place}\0{(hash_of or file_hash)(path)}\0".encode())
    if name in OURS:
        lines = [f"{library} {_version(library)}" for library in _LIBRARIES]
    else:
        lines = sorted({f"{installed.name} {installed.version}" for installed in distributions()})
    total.update("".join(f"{line}\n" for line in lines).encode())
    return total.hexdigest()


def _files(package: str) -> dict[Path, Path]:
    """Return the files of a package, compiled modules and data included, by their places in it."""
    spec = find_spec(package)
    if spec is None:
        return {}
    folders = spec.submodule_search_locations
    if folders is None:  # a single module
        module = Path(spec.origin or "")
        return {Path(module.name): module} if module.is_file() else {}
    places = [(path.relative_to(folder), path) for folder in folders for path in Path(folder).rglob("*")]
    return {place: path for place, path in places if path.is_file() and "__pycache__" not in path.parts}


@cache
def code_hash(*modules: str, root: Path = ROOT) -> str:
    """Return the hash of the code and data that modules of this package depend on."""
    total = hashlib.sha256()
    for path in sorted({path for module in modules for path in closure(module, root)}):
        total.update(f"{path.relative_to(root)}\0{file_hash(path)}\0".encode())
    return total.hexdigest()


@cache
def package_hash() -> str:
    """Return the hash of all files of the comparison, comments included, and of its libraries."""
    names = ("pandas", "matplotlib", *_LIBRARIES)
    total = hashlib.sha256(repr((sys.version, *map(_version, names))).encode())
    for place, path in sorted(_files("comparison").items()):
        total.update(f"{place}\0{raw_hash(path)}\0".encode())
    return total.hexdigest()


@cache
def closure(module: str, root: Path = ROOT) -> frozenset[Path]:
    """Return the files of a module, of all that it imports of its package, and of the data that these read.

    The package is below the root; data are read by ``importlib.resources.files("a.package")``.
    """
    package = module.partition(".")[0]
    paths: set[Path] = set()
    queue, visits = [module], set[str]()
    while queue:
        name = queue.pop()
        base = root.joinpath(*name.split("."))
        path = next((p for p in (base.with_suffix(".py"), base / "__init__.py") if p.is_file()), None)
        if name in visits or name.partition(".")[0] != package or path is None:  # None: an object in a module
            continue
        visits.add(name)
        paths.add(path)
        queue.append(name.rpartition(".")[0])  # its parent packages are imported too
        for node in ast.walk(ast.parse(path.read_bytes())):
            match node:
                case ast.Import(names=names):
                    queue += [alias.name for alias in names]
                case ast.ImportFrom(module=str(source), names=names):
                    queue += [source, *(f"{source}.{alias.name}" for alias in names)]
                case ast.Call(func=ast.Name(id="files"), args=[ast.Constant(value=str(folder))]):
                    data = root.joinpath(*folder.split(".")).glob("*")
                    paths.update(path for path in data if path.suffix in (".toml", ".csv"))
    return frozenset(paths)


def file_hash(path: Path) -> str:
    """Return the hash of a file; for Python files that of the code without comments and docstrings."""
    return _code_hash(path.read_bytes()) if path.suffix == ".py" else raw_hash(path)


@cache
def _code_hash(source: bytes) -> str:
    with suppress(SyntaxError, ValueError):  # the import reports the fault
        source = ast.dump(_WithoutTexts().visit(ast.parse(source))).encode()
    return hashlib.sha256(source).hexdigest()


class _WithoutTexts(ast.NodeTransformer):
    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        is_text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if is_text else node


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


@cache
def platform_name() -> str:
    """Return system, C library, processor, and the processor that the environment makes libraries assume."""
    parts = (
        f"{platform.system()} {platform.machine()}",
        " ".join(platform.libc_ver()).strip(),
        _processor(Path("/proc/cpuinfo")),
        *(f"{words} {setting}" for name, words in _OVERRIDES.items() if (setting := os.environ.get(name))),
    )
    return ", ".join(part for part in parts if part)


def _processor(cpuinfo: Path) -> str:
    try:
        lines = cpuinfo.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    pairs = [line.partition(":") for line in reversed(lines)]  # the first value of a key counts
    first = {key.strip(): value.strip() for key, _, value in pairs}
    flags = first.get("flags", first.get("Features", "")).split()
    numbers = "/".join(first[key] for key in ("cpu family", "model") if key in first)
    parts = (first.get("model name", ""), numbers, *(name for name in _FEATURES if name in flags))
    return " ".join(part for part in parts if part)


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute."""
    return {"python": platform.python_version()} | {name: _version(name) for name in _LIBRARIES}


def machine_and_versions() -> str:
    """Return machine and versions in one line, to print below numbers that depend on them."""
    return f"{platform_name()}; {', '.join(f'{name} {number}' for name, number in versions().items())}"
