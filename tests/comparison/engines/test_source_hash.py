"""What a measure depends on: its rows are stale after an edit of code, and kept after one of words."""

import ast
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

from comparison.engines import source_hash
from comparison.engines.source_hash import ROOT, closure, file_hash, hash_of
from comparison.execution.cache import _WRITES
from comparison.execution.task_store import Task

MEASURES = (
    "comparison.execution.run",  # kept tables
    "comparison.studies.campaign.tasks",
    "comparison.studies.campaign.third_engine",
    "comparison.studies.detection.limits",
    "comparison.studies.detection.pairs",
    "comparison.studies.detection.rounding",
    "comparison.studies.detection.tasks",
    "comparison.studies.extremes.runs",
    "comparison.studies.nonlinear.chains",
    "comparison.studies.random_inputs.draws",
    "comparison.studies.sweep.runs",
    "comparison.studies.tradeoff.measure",
)
"""The modules of all measures and tasks: the key of a row hashes the closures of both."""


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    """A copy of the package, to be edited and mended again."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "comparison", folder / "comparison", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def names() -> Iterator[str]:
    """Names of all modules of the package."""
    for path in (ROOT / "comparison").rglob("*.py"):
        if path.stem not in ("__init__", "__main__"):
            yield ".".join(path.relative_to(ROOT).with_suffix("").parts)


def tasks(kind: type[Task] = Task) -> set[str]:
    """Modules that define a task that can be measured."""
    below = set().union(*(tasks(each) for each in kind.__subclasses__()), set())
    return below if kind.__abstractmethods__ else below | {kind.__module__}


def measures(name: str) -> Iterator[str]:
    """Modules of the functions that a module has called by the store."""
    tree = ast.parse(Path(sys.modules[name].__file__).read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("measure_all"):
            yield eval(ast.unparse(node.args[0]), vars(sys.modules[name])).__module__


def test_every_measure_and_task_is_looked_at():
    modules = list(names())
    for name in modules:
        import_module(name)
    called = {module for name in modules for module in measures(name)}
    assert len(called) >= 7
    mine = {module for module in tasks() if module.startswith("comparison.")}
    assert called | mine | {_WRITES} == set(MEASURES)


IMPORTED = """
import json, sys
from importlib import import_module
found = {}
for name in json.load(sys.stdin):
    for module in [each for each in sys.modules if each.partition(".")[0] == "comparison"]:
        del sys.modules[module]
    import_module(name)
    modules = [module for each, module in sys.modules.items() if each.partition(".")[0] == "comparison"]
    found[name] = [module.__file__ for module in modules]
print(json.dumps(found))
"""


def has_code(path: Path) -> bool:
    tree = ast.parse(path.read_bytes())
    return len(tree.body) > (ast.get_docstring(tree) is not None)


def test_the_closure_holds_whatever_python_imports():
    """But for a package of data that has no code."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED],
        input=json.dumps(MEASURES),
        text=True,
        capture_output=True,
        check=True,
    )
    for name, imported in json.loads(done.stdout).items():
        assert len(imported) > 20
        assert {path for path in map(Path, imported) if has_code(path)} <= set(closure(name)), name


def edited(source: str) -> str:
    """Add a statement to the first function, or to a module that has none."""
    tree = ast.parse(source)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    (functions[0] if functions else tree).body.append(ast.parse("edited = 1").body[0])
    return ast.unparse(tree)


def reworded(source: str) -> str:
    """Change every docstring, and with it all comments and the layout."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        text = node.value if isinstance(node, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            text.value = f"Reworded: {text.value}"
    return ast.unparse(tree)


def test_a_file_counts_by_its_code_and_by_its_data(root):
    files = {path for module in MEASURES for path in closure.__wrapped__(module, root)}
    assert {path.suffix for path in files} >= {".py", ".toml"}
    for path in files:
        before, content = file_hash(path), path.read_bytes()
        if path.suffix == ".py":
            path.write_text(reworded(content.decode()), "utf-8")
            assert file_hash(path) == before, path
            path.write_text(edited(content.decode()), "utf-8")
        else:
            path.write_bytes(content + b"\n# read like the rest")
        assert file_hash(path) != before, path
        path.write_bytes(content)


@pytest.mark.parametrize("module", MEASURES)
def test_rows_are_stale_after_an_edit_of_any_module_they_depend_on_and_of_no_other(module, root, monkeypatch):
    files = closure.__wrapped__(module, root)
    before = hash_of(files, root)
    assert root.joinpath(*module.split(".")).with_suffix(".py") in files
    outside = root / "comparison" / "report" / "page.py"
    assert outside not in files
    source = outside.read_text("utf-8")
    outside.write_text(edited(source), "utf-8")
    assert hash_of(closure.__wrapped__(module, root), root) == before
    outside.write_text(source, "utf-8")
    hashes = {path: file_hash(path) for path in files}
    monkeypatch.setattr(source_hash, "file_hash", lambda path: hashes[path])
    assert hash_of(files, root) == before
    for path in files:
        hashes[path] += "edited"
        assert hash_of(files, root) != before, path
        hashes[path] = hashes[path].removesuffix("edited")


@pytest.mark.parametrize(
    ("module", "file"),
    [
        ("comparison.studies.tradeoff.measure", "studies/tradeoff/measure.py"),
        ("comparison.studies.detection.limits", "studies/detection/limits.py"),
        ("comparison.studies.random_inputs.draws", "studies/sweep/runs.py"),
    ],
)
def test_what_lists_by_hand_once_forgot_is_in_the_closure(module, file):
    assert ROOT / "comparison" / file in closure(module)


def test_imports_are_followed_through_packages_and_within_functions(tmp_path):
    package = tmp_path / "house"
    (package / "room").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "room" / "__init__.py").write_text("from house.room.inner import f\n")
    (package / "room" / "inner.py").write_text("def f():\n    import house.late\n")
    (package / "late.py").write_text('from importlib.resources import files\nfiles("house.room")\n')
    (package / "room" / "numbers.toml").write_text("a = 1")
    (package / "apart.py").write_text("")
    (package / "start.py").write_text("import numpy\nfrom house import room\n")
    names = {path.relative_to(package).as_posix() for path in closure("house.start", tmp_path)}
    assert names == {
        "__init__.py", "start.py", "late.py", "room/__init__.py", "room/inner.py", "room/numbers.toml"
    }  # fmt: skip


def test_a_changed_number_a_name_or_an_order_is_a_change(tmp_path):
    path = tmp_path / "code.py"

    @cache
    def of(text: str) -> str:
        path.write_text(text)
        return file_hash(path)

    usual = 'def f(x):\n    """Doc."""\n    return 2 * x + 1\n'
    assert of(usual) == of(usual.replace("Doc.", "Other words")) == of(usual.replace("2 * x", "2*x  "))
    for other in (usual.replace("2", "3"), usual.replace("x", "y"), usual.replace("2 * x", "x * 2")):
        assert of(other) != of(usual)
