"""A model from another package, and what a bad one costs; tests/cli has more of both as a black box."""

import shutil
from pathlib import Path

import pytest

from comparison.accuracy.levels import finer, with_declared
from comparison.cli import main
from comparison.execution.run import Job, run_all, run_one
from comparison.models import EngineError, declared_settings, engine_names, find, load
from comparison.scene import load_scene
from comparison.verdict.compare import recorded_scene
from comparison.verdict.validate import validate

ODD = Path(__file__).with_name("odd_press.py").read_text("utf-8")
POINTS = {"odd": "odd_press:simulate", "even": "odd_press:even"}
GROUPS = {"output.groups": [], "output.samples_per_cycle": 100, "drive.cycles": 1.0}


@pytest.fixture(autouse=True)
def odd(install):
    """Install the odd press, with further code; it is installed to begin with."""

    def make(more=""):
        return install("odd_press", ODD + more, POINTS)

    make()
    return make


def compared(changes=None):
    (result,) = validate([load_scene("ideal", GROUPS | (changes or {}))], models=("odd", "even"))
    return result


def test_declared_settings_are_refined_and_decide_and_a_scene_s_go_first(odd):
    odd("simulate.settings = even.settings = {'tolerance': 1e-8}\n")
    same = compared()
    assert same.comparison.verdict == "agree"
    # There is no reliability of a model that has no ideal run.
    assert compared({"solver.odd.what": "no ideal"}).comparison.reliability is None
    runs = same.runs["odd"]
    tables = runs.base, runs.finer, runs.coarser
    used = [table.provenance["scene"]["solver"]["odd"]["tolerance"] for table in tables]
    assert used == pytest.approx([1e-8, 1e-9, 1e-7], rel=1e-14)
    # Ten times the error of either, and so outside what 1.25 * 10/9 of both explain.
    assert compared({"solver.odd.bias": 1e-6}).comparison.verdict == "differ"
    scene = load_scene("ideal", {"solver.odd.tolerance": 1e-5})
    assert with_declared(scene, ["odd"]).data["solver"]["odd"]["tolerance"] == 1e-5
    # An integer is a setting as well.
    whole = load_scene("ideal", {"solver.odd.tolerance": 1})
    assert finer("odd", whole).data["solver"]["odd"]["tolerance"] == 0.1
    assert declared_settings("reference") == {}
    for faulty, rule in (
        ("3", "settings must be a mapping, not int"),
        ("{'order': [4]}", r"settings\['order'\] = \[4\] must be a string"),
        ("{'step': float('nan')}", r"settings\['step'\] = nan must be"),
    ):
        odd(f"simulate.settings = {faulty}\n")
        with pytest.raises(EngineError, match=rule):
            declared_settings("odd")


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("one more", "channel slider_z is unexpected"),
        ("arrays", "extrema or provenance: Object of type ndarray is not JSON serializable"),
        ("nothing", "columns must be a dict, not NoneType"),
        ("exits", "its process ended with code 4"),
    ],
)
def test_a_bad_model_gets_one_line(what, message):
    job = Job(load_scene("ideal", GROUPS | {"solver.odd.what": what}), "odd")
    (outcome,) = run_all([job], 1 if what == "exits" else 0)
    assert outcome.status == ("crashed" if what == "exits" else "unusable")
    assert (message in outcome.message, "\n" in outcome.message) == (True, False)


def test_a_progress_that_is_no_share_does_no_harm():
    (outcome,) = run_all([Job(load_scene("ideal", GROUPS | {"solver.odd.what": "no share"}), "odd")], 1)
    assert outcome.status == "success"


def test_what_a_model_prints_or_does_to_its_scene_is_not_among_the_results(odd, capfd, monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # with it nothing waits to be lost
    path = odd("print('licence found')\n")  # while it is imported
    changes = [f"--set={key}={value}" for key, value in (GROUPS | {"solver.odd.what": "prints"}).items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 0
    out, err = capfd.readouterr()
    assert (out, {*err.splitlines()}) == ("a.events.csv\na.json\na.csv\n", {"licence found", "hello"})
    scene = load_scene("ideal", GROUPS | {"solver.odd.tolerance": 1e-8})
    table = run_one(scene, "odd")
    assert table.provenance["scene"]["drive"]["speed_rpm"] == 150.0
    # The table is compared where the model is not installed.
    shutil.rmtree(path.parent / "odd_press.dist-info")
    assert "odd" not in engine_names()
    recorded, warnings = recorded_scene(table, table)
    assert (recorded.data["output"], warnings) == (scene.data["output"], ())


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ({"mine": "nowhere:simulate"}, "'mine' cannot be imported from 'nowhere:simulate': ModuleNotFound"),
        ({"mine": "thing:absent"}, "from 'thing:absent': AttributeError: module 'thing'"),
        ({"mine": "thing:number"}, "'mine': 'thing:number' is not a function but a int"),
        ({"mine": "thing:f", "reference": "thing:f"}, "twice: reference_model:simulate and thing:f"),
        ({"yours": "thing:f"}, "model 'mine' is not known; available: reference, exudyn, even, odd, yours"),
    ],
)
def test_a_model_that_cannot_be_had_is_one_line(install, points, message):
    install("thing", "number = 3\ndef f(scene): pass\n", points)
    with pytest.raises(EngineError) as refused:
        find("reference") if len(points) > 1 else load("mine")
    assert (message in str(refused.value), "\n" in str(refused.value)) == (True, False)


@pytest.mark.parametrize("fault", ["raise ValueError('no\\nlicence')", "import sys; sys.exit(3)", "1 +"])
def test_a_package_that_cannot_be_imported_is_one_line(odd, fault):
    odd(f"\n{fault}")
    with pytest.raises(EngineError, match="model 'odd' cannot be imported from 'odd_press:simulate': ") as no:
        load("odd")
    assert "\n" not in str(no.value)
