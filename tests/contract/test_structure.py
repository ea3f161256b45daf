"""The rooms: few at the top, no cycle, data beside what reads it."""

import ast
import re
from collections import defaultdict
from graphlib import TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "comparison"
PACKAGES = ("reference_model", "exudyn_model", "comparison")
TESTS = sorted([*ROOT.glob("tests/**/*.py"), *ROOT.glob("examples/*/tests/**/*.py")])


def test_the_top_of_the_comparison_can_be_taken_in_at_a_glance():
    names = {path.stem for path in PACKAGE.iterdir() if path.suffix == ".py" or path.is_dir()}
    assert len(names - {"__init__", "__main__", "__pycache__"}) <= 16
    assert not [path.name for path in PACKAGE.glob("*.toml")]


def test_no_modules_import_one_another():
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert imported
    TopologicalSorter(imported).prepare()  # CycleError names the cycle


def code(function: ast.FunctionDef) -> str:
    """What a function does: its code without its name, docstring, decorators and annotations."""
    for node in ast.walk(function):
        if isinstance(node, ast.arg):
            node.annotation = None
    body = function.body if ast.get_docstring(function) is None else function.body[1:]
    return ast.dump(ast.Module([function.args, *body], []))  # type: ignore[list-item]


def test_no_helper_of_the_tests_is_defined_twice():
    """Not within a class: a model of a test may answer as another does."""
    found = defaultdict(list)
    for path in TESTS:
        for node in ast.parse(path.read_bytes()).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("test_"):
                found[code(node)].append(f"{path.relative_to(ROOT)}: {node.name}")
    assert not [where for where in found.values() if len(where) > 1]


def test_data_is_read_in_its_own_room():
    for path in PACKAGE.rglob("*.py"):
        for package in re.findall(r'files\("([\w.]+)"\)', path.read_text("utf-8")):
            data = ROOT.joinpath(*package.split("."))
            if not data.is_dir():
                continue  # in a docstring
            assert data == path.parent or data.parent == path.parent, f"{path} reads {package}"


def test_documented_imports_work():
    """Those of the README, the docs and the packages' entry points."""
    from comparison.cli import main
    from comparison.compare import Runs, compare
    from comparison.pytest_plugin import assert_agree
    from comparison.scene import load_scene
    from comparison.tables.table import Table

    assert all(map(callable, (main, compare, Runs, assert_agree, load_scene, Table)))
