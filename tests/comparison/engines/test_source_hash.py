"""What a measure depends on: its rows are stale after an edit of code, and kept after one of words."""

import ast
import re
import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from comparison.engines.source_hash import ROOT, closure, file_hash, hash_of

MEASURES = (
    "comparison.execution.run",  # kept tables
    "comparison.studies.campaign.tasks",
    "comparison.studies.detection.limits",
    "comparison.studies.detection.pairs",
    "comparison.studies.detection.rounding",
    "comparison.studies.extremes.runs",
    "comparison.studies.nonlinear.chains",
    "comparison.studies.random_inputs.draws",
    "comparison.studies.sweep.runs",
    "comparison.studies.tradeoff.measure",
)
"""The modules of all measures and tasks."""


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    """A copy of the package, to be edited and mended again."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "comparison", folder / "comparison", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def modules() -> Iterator[str]:
    """Names of all modules that define a task or call the store."""
    for path in (ROOT / "comparison").rglob("*.py"):
        text = path.read_text("utf-8")
        if re.search(r"^class \w+\((Task|Comparison)\)", text, re.M):
            yield ".".join(path.relative_to(ROOT).with_suffix("").parts)


def test_every_task_is_looked_at():
    abstract = {"comparison.studies.detection.tasks"}
    found = set(modules()) - abstract
    assert len(found) >= 8
    assert found <= set(MEASURES)


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


@pytest.mark.parametrize("module", MEASURES)
def test_rows_are_stale_after_an_edit_of_any_module_they_depend_on_and_of_no_other(module, root):
    files = closure.__wrapped__(module, root)
    before = hash_of(files, root)
    mine = [path for path in files if path.suffix == ".py"]
    assert root.joinpath(*module.split(".")).with_suffix(".py") in mine
    for path in mine:
        source = path.read_text("utf-8")
        path.write_text(edited(source), "utf-8")
        assert hash_of(files, root) != before, path
        path.write_text(reworded(source), "utf-8")
        assert hash_of(files, root) == before, path
        path.write_text(source, "utf-8")
    for path in (path for path in files if path.suffix == ".toml"):
        content = path.read_bytes()
        path.write_bytes(content + b"\n# read like the rest")
        assert hash_of(files, root) != before, path
        path.write_bytes(content)
    outside = root / "comparison" / "report" / "page.py"
    assert outside not in files
    source = outside.read_text("utf-8")
    outside.write_text(edited(source), "utf-8")
    assert hash_of(closure.__wrapped__(module, root), root) == before
    outside.write_text(source, "utf-8")


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
