"""What a stored result depends on: it is stale after an edit of code or data, and kept after one of words."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from comparison.execution.run import Job, run_all, run_key
from comparison.execution.tasks import Task
from comparison.models import ROOT, closure, file_hash, fingerprint, hash_of
from comparison.scene import load_scene

ODD = Path(__file__).with_name("odd_press.py").read_text("utf-8")
RUNS = "comparison.execution.run"
MEASURES = (
    RUNS,
    "comparison.studies.campaign.tasks",
    "comparison.studies.campaign.third_engine",
    "comparison.studies.detection.limits",
    "comparison.studies.detection.pairs",
    "comparison.studies.detection.rounding",
    "comparison.studies.detection.tasks",
    "comparison.studies.extremes.runs",
    "comparison.studies.nonlinear.press",
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


def tasks(kind: type[Task] = Task) -> set[str]:
    """Modules that define a task that can be measured."""
    below = set().union(*(tasks(subclass) for subclass in kind.__subclasses__()), set())
    return below if kind.__abstractmethods__ else below | {kind.__module__}


def measures(name: str) -> Iterator[str]:
    """Modules of the functions that a module has measured."""
    tree = ast.parse(Path(sys.modules[name].__file__).read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("measure_all"):
            yield eval(ast.unparse(node.args[0]), vars(sys.modules[name])).__module__


def test_every_measure_and_task_is_looked_at():
    paths = [path for path in (ROOT / "comparison").rglob("*.py") if not path.stem.startswith("__")]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths]
    for name in names:
        import_module(name)
    called = {module for name in names for module in measures(name)}
    assert len(called) >= 7
    own = {module for module in tasks() if module.startswith("comparison.")}
    assert called | own | {RUNS} == set(MEASURES)


IMPORTED = """
import json, sys
from importlib import import_module
paths = {}
for name in json.load(sys.stdin):
    for module in [module for module in sys.modules if module.partition(".")[0] == "comparison"]:
        del sys.modules[module]
    import_module(name)
    paths[name] = [m.__file__ for n, m in sys.modules.items() if n.partition(".")[0] == "comparison"]
print(json.dumps(paths))
"""


def test_the_closure_holds_whatever_python_imports():
    """But for a package of data that has no code."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED],
        input=json.dumps(MEASURES),
        text=True,
        capture_output=True,
        check=True,
    )
    for name, paths in json.loads(done.stdout).items():
        assert len(paths) > 12
        trees = {Path(path): ast.parse(Path(path).read_bytes()) for path in paths}
        code = {
            path for path, tree in trees.items() if len(tree.body) > (ast.get_docstring(tree) is not None)
        }
        assert code <= set(closure(name)), name


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


def test_every_file_in_a_closure_counts_by_its_code_or_its_data_and_no_other(root):
    """Of the reports no result depends."""
    closures = {module: closure.__wrapped__(module, root) for module in MEASURES}
    files = {path for closure in closures.values() for path in closure}
    assert {path.suffix for path in files} >= {".py", ".toml"}
    assert root / "comparison" / "report" / "page.py" not in files
    for module, paths in closures.items():
        assert root.joinpath(*module.split(".")).with_suffix(".py") in paths
        assert (
            len({hash_of(paths, root), *(hash_of(paths[:n] + paths[n + 1 :], root) for n in range(9))}) == 10
        )
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


def test_imports_are_followed_through_packages_and_within_functions(tmp_path):
    package = tmp_path / "house"
    (package / "room").mkdir(parents=True)
    for name, text in {
        "__init__.py": "",
        "room/__init__.py": "from house.room.inner import f\n",
        "room/inner.py": "def f():\n    import house.late\n",
        "late.py": 'from importlib.resources import files\nfiles("house.room")\n',
        "room/numbers.toml": "a = 1",
        "apart.py": "",
        "start.py": "import numpy\nfrom house import room\n",
    }.items():
        (package / name).write_text(text)
    names = {path.relative_to(package).as_posix() for path in closure("house.start", tmp_path)}
    assert names == {
        "__init__.py", "start.py", "late.py", "room/__init__.py", "room/inner.py", "room/numbers.toml"
    }  # fmt: skip


def test_a_changed_number_a_name_or_an_order_is_a_change(tmp_path):
    usual = 'def f(x):\n    """Doc."""\n    return 2 * x + 1\n'
    same = (usual.replace("Doc.", "Other words"), usual.replace("2 * x", "2*x  "))
    others = (usual.replace("2", "3"), usual.replace("x", "y"), usual.replace("2 * x", "x * 2"))
    hashes = {}
    for text in (usual, *same, *others):
        (tmp_path / "code.py").write_text(text)
        hashes[text] = file_hash(tmp_path / "code.py")
    assert {hashes[text] for text in same} == {hashes[usual]}
    assert hashes[usual] not in {hashes[text] for text in others}


def test_a_change_of_the_model_or_of_what_is_installed_runs_it_again(install):
    points = {"odd": "odd_press:simulate"}
    install("odd_press", ODD, points)
    scene = load_scene("ideal", {"output.groups": [], "output.samples_per_cycle": 100, "drive.cycles": 1.0})

    def sample() -> float:
        (outcome,) = run_all([Job(scene, "odd")], 1)
        return float(outcome.table.values("slider_x")[0])

    first, before = sample(), fingerprint("odd")
    install("odd_press", ODD.replace("1.1 +", "1.2 +"), points)
    assert sample() == pytest.approx(first + 0.1, abs=1e-12)  # written in CSV with 17 digits
    changed, ours = fingerprint("odd"), fingerprint("reference")
    install("another", "", {}, version="2")
    assert len({before, changed, fingerprint("odd")}) == 3
    assert fingerprint("reference") == ours  # it imports nothing of that


def test_a_package_counts_with_all_its_files(install, tmp_path):
    install("thing", "", {"mine": "pack.deep:simulate"})
    folder = tmp_path / "site" / "pack"
    (folder / "__pycache__").mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "law.csv").write_text("1")
    before = fingerprint("mine")
    (folder / "__pycache__" / "deep.pyc").write_text("compiled")
    assert fingerprint("mine") == before
    (folder / "law.csv").write_text("2")
    assert fingerprint("mine") != before


def test_the_key_of_a_run_knows_the_model_the_scene_and_the_settings_that_count(install):
    install("odd_press", ODD, {"odd": "odd_press:simulate", "even": "odd_press:even"})
    scene = load_scene("ideal")
    assert len({
        run_key(scene, "reference", "a"),
        run_key(scene, "reference", "b"),
        run_key(scene, "exudyn", "a"),
        run_key(scene.with_values({"contact.poisson": 0.3}), "reference", "a"),
    }) == 4  # fmt: skip
    other = [scene.with_values({key: 1e-9}) for key in ("solver.reference.tolerance", "solver.even.what")]
    assert {run_key(each, "exudyn", "") for each in (scene, *other)} == {run_key(scene, "exudyn", "")}
    # An installed model may be made of the others.
    assert len({run_key(each, "odd", "") for each in (scene, *other)}) == 3
