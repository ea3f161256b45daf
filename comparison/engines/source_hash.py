"""Hashes of the code that a result depends on, insensitive to comments and docstrings.

The code that a function of this package can call is the import closure of its module. Data that a module of
the closure reads by `importlib.resources.files` is included.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
"""Folder that contains the packages."""
_DATA = (".toml", ".csv")


@cache
def code_hash(*modules: str) -> str:
    """Return the hash of the code and data that modules of this package depend on."""
    return hash_of(tuple(sorted({path for module in modules for path in closure(module)})))


def hash_of(files: tuple[Path, ...], root: Path = ROOT) -> str:
    """Return the hash of files and of their paths below the root; modules count by their code."""
    total = hashlib.sha256()
    for path in files:
        total.update(f"{path.relative_to(root)}\0{file_hash(path)}\0".encode())
    return total.hexdigest()


@cache
def closure(module: str, root: Path = ROOT) -> tuple[Path, ...]:
    """Return the files that a module depends on, itself and data included, sorted.

    Parameters
    ----------
    module
        Dotted name; only modules of the same package are followed.
    root
        Folder that contains the package.
    """
    package = module.partition(".")[0]
    found: set[Path] = set()
    waiting = [module]
    seen: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        path = _path(name, root)
        if path is None:
            continue
        found.add(path)
        tree = ast.parse(path.read_bytes())
        waiting += [each for each in _imports(tree) if each.partition(".")[0] == package]
        # Importing a module imports its parent packages.
        waiting += [name.rpartition(".")[0]] if "." in name else []
        for folder in _data_folders(tree):
            where = root.joinpath(*folder.split("."))
            found.update(each for each in where.glob("*") if each.suffix in _DATA)
    return tuple(sorted(found))


def file_hash(path: Path) -> str:
    """Return the hash of a file; for Python files that of the code without comments and docstrings."""
    content = path.read_bytes()
    return _code_hash(content) if path.suffix == ".py" else hashlib.sha256(content).hexdigest()


@cache
def _code_hash(source: bytes) -> str:
    try:
        code = ast.dump(_without_docstrings(ast.parse(source))).encode()
    except (SyntaxError, ValueError):  # why it cannot be run its import says
        code = source
    return hashlib.sha256(code).hexdigest()


def _path(module: str, root: Path) -> Path | None:
    """Return the file of a module, None if the name is that of an object within one."""
    base = root.joinpath(*module.split("."))
    return next((each for each in (base.with_suffix(".py"), base / "__init__.py") if each.is_file()), None)


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{each.name}" for each in node.names)


def _data_folders(tree: ast.Module) -> Iterator[str]:
    """Yield the packages whose data a module reads by ``files("a.package")``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "files":
            yield from (str(each.value) for each in node.args if isinstance(each, ast.Constant))


def _without_docstrings(tree: ast.Module) -> ast.Module:
    """Remove all string statements, including attribute docstrings."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    return tree


def _is_text(node: ast.stmt) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
