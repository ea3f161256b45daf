"""Models that cannot be loaded; the files and settings on which a stored result depends."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from comparison import models
from comparison.execution.run import Job, run_key
from comparison.models import ROOT, EngineError, fingerprint
from comparison.scene import load_scene


@pytest.mark.parametrize(
    ("source", "points", "message"),
    [
        ("f = 3", {"mine": "thing:f"}, "'mine': 'thing:f' is not a function but a int"),
        ("print('hello')\nraise ValueError('no\\nlicence')", {"mine": "thing:f"}, "ValueError: no licence"),
        ("import sys; sys.exit(3)", {"mine": "thing:f"}, "cannot be imported from 'thing:f': SystemExit"),
    ],
)
def test_a_model_that_cannot_be_had_is_one_line(install, source, points, message, capfd):
    install("thing", source, points)
    with pytest.raises(EngineError) as refusal:
        models.load("mine")
    assert (message in str(refusal.value), "\n" in str(refusal.value)) == (True, False)
    assert capfd.readouterr().out == ""


def test_two_packages_with_a_model_of_one_name_are_refused(install):
    install("thing", "", {"reference": "thing:f"})
    with pytest.raises(EngineError, match="twice: reference_model:simulate and thing:f"):
        models.find("reference")


@pytest.mark.parametrize("settings", ["3", "{'step': float('nan')}"])
def test_settings_that_are_none_are_refused(install, settings):
    install("thing", f"def f(scene): pass\nf.settings = {settings}\n", {"mine": "thing:f"})
    with pytest.raises(EngineError, match=r"'mine': settings.* must be"):
        models.declared_settings("mine")


PRESSES = (ROOT / "tests" / "cli" / "presses.py").read_text("utf-8")
POINTS = {name: f"presses:{name}" for name in ("alpha", "beta")}
IMPORTS = """
import sys
from importlib import import_module
for name in sys.argv[1:]:
    import_module(name)
print(*(m.__file__ for n, m in sys.modules.items() if n.partition(".")[0] == "comparison"), sep="\\n")
"""


@pytest.mark.slow
def test_the_closures_hold_whatever_python_imports():
    """The modules of runs and of all measures of studies, except packages without code."""
    studies = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in (ROOT / "comparison" / "studies").rglob("*.py")
        if "comparison.execution.tasks" in path.read_text("utf-8")
    }
    assert studies
    names = ["comparison.execution.run", *studies]
    command = [sys.executable, "-c", IMPORTS, *names]
    paths = subprocess.run(command, text=True, capture_output=True, check=True).stdout.splitlines()
    trees = {Path(path): ast.parse(Path(path).read_bytes()) for path in paths}
    code = {path for path, tree in trees.items() if len(tree.body) > (ast.get_docstring(tree) is not None)}
    assert len(code) > 30
    assert code <= set().union(*map(models.closure, names))


def reword(source):
    """Change every docstring, and with it all comments and the layout."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        text = node.value if isinstance(node, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            text.value = f"Reworded: {text.value}"
    return ast.unparse(tree)


def test_every_file_in_a_closure_counts_by_its_code_or_its_data_and_no_other(tmp_path):
    """No result depends on the reports."""
    shutil.copytree(ROOT / "comparison", tmp_path / "comparison")
    module = "comparison.execution.run"
    files = models.closure(module, tmp_path)
    assert {path.suffix for path in files} == {".py", ".toml"}
    assert tmp_path / "comparison" / "report" / "page.py" not in files
    before = models.code_hash(module, root=tmp_path)
    for path in files:
        content = path.read_bytes()
        if path.suffix == ".py":
            path.write_text(reword(content.decode()), "utf-8")
            assert models.code_hash.__wrapped__(module, root=tmp_path) == before, path
        path.write_bytes(content + b"\nedited = 1")
        assert models.code_hash.__wrapped__(module, root=tmp_path) != before, path
        path.write_bytes(content)
    (tmp_path / "comparison" / "report" / "page.py").write_text("edited = 1")
    assert models.code_hash.__wrapped__(module, root=tmp_path) == before


def test_a_model_counts_with_all_its_files_and_what_is_installed(install, tmp_path):
    install("thing", "", {"mine": "pack.deep:simulate"})
    folder, digest = tmp_path / "site" / "pack", fingerprint("reference")
    (folder / "__pycache__").mkdir(parents=True)
    prints = []
    for name, text in (("law.csv", "1"), ("__pycache__/deep.pyc", "compiled"), ("law.csv", "2")):
        (folder / name).write_text(text)
        prints.append(fingerprint("mine"))
    install("another", "", {}, version="2")
    assert prints[0] == prints[1]
    assert len({*prints, fingerprint("mine")}) == 3
    assert fingerprint("reference") == digest  # it imports nothing of that


def test_the_key_of_a_run_knows_the_model_the_scene_and_the_settings_that_count(install):
    install("presses", PRESSES, POINTS)
    scene = load_scene("ideal")
    material = scene.with_values({"contact.poisson": 0.3})
    jobs = [Job(scene, "reference"), Job(scene, "exudyn"), Job(material, "reference")]
    jobs.append(Job(scene, "exudyn", dense=True))
    assert len({*(run_key(job, "a") for job in jobs), run_key(jobs[0], "b")}) == 5
    variants = [scene.with_values({key: 1e-9}) for key in ("solver.reference.tolerance", "solver.beta.does")]
    assert {run_key(Job(each, "exudyn"), "") for each in variants} == {run_key(Job(scene, "exudyn"), "")}
    # An installed model may be made of the others.
    assert len({run_key(Job(each, "alpha"), "") for each in (scene, *variants)}) == 3
