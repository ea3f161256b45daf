"""A third model from another package: the example of the documentation, and the messages for a bad one."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from comparison.accuracy.levels import AccuracyError, solver_values
from comparison.cli import main
from comparison.engines import registry
from comparison.engines.registry import EngineError, engine_names, find, fingerprint
from comparison.execution.cache import run_key
from comparison.execution.job import Job
from comparison.execution.run import run_all
from comparison.scene import SceneError, load_scene
from comparison.verdict.compare import recorded_scene
from comparison.verdict.validate import validate
from comparison.words.verdicts import scene_reason

PAGE = (Path(__file__).parents[3] / "docs" / "engine.md").read_text("utf-8")
Install = Callable[..., Path]

ODD = Path(__file__).with_name("odd_press.py").read_text("utf-8")
GROUPS = {"output.groups": [], "output.samples_per_cycle": 100, "drive.cycles": 1.0}


@pytest.fixture
def odd(install: Install) -> Path:
    return install("odd_press", ODD, {"odd": "odd_press:simulate", "even": "odd_press:even"})


def run_odd(what: str) -> int:
    changes = [f"--set={key}={value}" for key, value in (GROUPS | {"solver.odd.what": what}).items()]
    return main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes])


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)


def test_the_documented_model_agrees_with_the_reference(install, tmp_path, capsys):
    registration, scene = blocks("toml")
    source, *_ = blocks("python")
    points = tomllib.loads(registration)["project"]["entry-points"][registry.GROUP]
    install("my_press", source, points)
    (tmp_path / "mine.toml").write_text(scene)
    (commands,) = blocks("sh")
    for command in commands.splitlines():
        assert main(shlex.split(command)[1:]) == 0, command
    out, err = capsys.readouterr()
    assert err == ""
    assert "agree" in out
    assert "3 of 3" not in out  # only y and its rate move
    assert "2 of 2 excited channels agree" in out
    assert (tmp_path / "reports/out/mine/tables/mine-mine.csv").is_file()


@pytest.mark.usefixtures("odd")
def test_two_installed_models_are_refined_and_judged_by_their_uncertainty():
    settings = {"solver.odd.tolerance": 1e-8, "solver.even.tolerance": 1e-8}
    scene = load_scene("ideal", GROUPS | settings)
    (same,) = validate([scene], models=("odd", "even"))
    assert same.comparison.verdict == "agree", scene_reason(same.comparison)
    assert same.comparison.command == scene.command("validate", "--models", "odd,even")
    tolerances = [run.provenance["scene"]["solver"]["odd"]["tolerance"] for run in (
        same.runs["odd"].base, same.runs["odd"].finer, same.runs["odd"].coarser)]  # fmt: skip
    assert tolerances == pytest.approx([1e-8, 1e-9, 1e-7], rel=1e-14)
    # Ten times the error of either, and so outside what 1.25 * 10/9 of both explain.
    (other,) = validate([scene.with_values({"solver.odd.bias": 1e-6})], models=("odd", "even"))
    assert other.comparison.verdict == "differ"


@pytest.mark.usefixtures("odd")
def test_without_anything_to_refine_the_tolerance_of_the_scene_decides():
    # 2e-6 m in y, of which the scale is 4.2e-5 m.
    scene = load_scene("ideal", GROUPS | {"solver.odd.bias": 1e-6})
    (unknown,) = validate([scene], models=("odd", "even"))
    assert unknown.comparison.verdict == "indeterminate"
    for tolerance, verdict in ((1e-1, "agree"), (1e-2, "differ")):
        (judged,) = validate([scene.with_values({"compare.tolerance": tolerance})], models=("odd", "even"))
        assert judged.comparison.verdict == verdict


@pytest.mark.parametrize(
    ("what", "code", "message"),
    [
        ("raises", 70, "crashed; KeyError: 'no\\nsuch thing'"),
        ("exits", 70, "its process ended with code 4"),
        ("refuses", 2, "': joints.slider = 'clearance' is beyond this model"),
        ("no channel", 2, "the odd run: channel slider_vy is missing"),
        ("one more", 2, "channel slider_z is unexpected"),
        ("not finite", 2, "slider_y is nan in data row 6"),
        ("uneven", 2, "columns are inconsistent: All arrays must be of the same length"),
        ("short", 2, "truncated: it spans 0 to 0.388 s and must span 0 to 0.4 s"),
        ("no contacts' end", 2, "its events have no column end"),
        ("elsewhere", 2, "contact at 'roof', which is none of ll, lr, ul, ur, pin"),
        ("nan contact", 2, "impulse of contact 1 is not a number: nan"),
        ("no events", 2, "events must be a dict, not NoneType"),
        ("list", 2, "columns must be a dict, not list"),
        ("arrays", 2, "extrema or provenance: Object of type ndarray is not JSON serializable"),
        ("nothing", 2, "columns must be a dict, not NoneType"),
        ("status", 2, "stalled; push it"),
    ],
)
@pytest.mark.usefixtures("odd")
def test_a_bad_model_gets_one_line(what, code, message, capfd):
    assert run_odd(what) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1
    assert not Path("a.csv").exists()


@pytest.mark.usefixtures("odd")
def test_what_a_model_prints_is_not_among_the_results(capfd, monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # with it nothing waits to be lost
    assert run_odd("prints") == 0
    assert capfd.readouterr() == ("a.events.csv\na.json\na.csv\n", "hello\n")


@pytest.mark.usefixtures("odd")
def test_what_a_model_does_to_its_scene_is_not_recorded():
    (outcome,) = run_all([Job(load_scene("ideal", GROUPS), "odd")], 1)
    assert outcome.table.provenance["scene"]["drive"]["speed_rpm"] == 150.0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ({"mine": "nowhere:simulate"}, "'mine' cannot be imported from 'nowhere:simulate': ModuleNotFound"),
        (
            {"mine": "thing:absent"},
            "'mine' cannot be imported from 'thing:absent': AttributeError: module 'thing'",
        ),
        ({"mine": "thing:number"}, "'mine': 'thing:number' is not a function but a int"),
        (
            {"mine": "thing:f", "reference": "thing:f"},
            "twice: reference_model:simulate and thing:f",
        ),
        ({"yours": "thing:f"}, "model 'mine' is not known; available: reference, exudyn, yours"),
    ],
)
def test_a_model_that_cannot_be_had_is_one_line(install, points, message, capfd):
    install("thing", "number = 3\ndef f(scene): pass\n", points)
    assert (
        main(["run", "ideal", "--model", "reference" if len(points) > 1 else "mine", "--out", "a.csv"]) == 2
    )
    err = capfd.readouterr().err
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.usefixtures("odd")
@pytest.mark.parametrize("models", ["reference", "odd,odd", "reference,adams", ","])
def test_validate_takes_models_that_there_are(models, capsys):
    assert main(["validate", "ideal", "--models", models]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "two names" in err or "is not known" in err


@pytest.mark.usefixtures("odd")
def test_a_change_of_the_model_or_of_what_is_installed_runs_it_again(install):
    scene = load_scene("ideal", GROUPS)

    def sample() -> float:
        (outcome,) = run_all([Job(scene, "odd")], 1)
        return float(outcome.table.values("slider_x")[0])

    first, before = sample(), fingerprint("odd")
    install("odd_press", ODD.replace("1.1 +", "1.2 +"), {"odd": "odd_press:simulate"})
    assert sample() == pytest.approx(first + 0.1, abs=1e-12)
    changed = fingerprint("odd")
    install("another", "", {}, version="2")
    assert len({before, changed, fingerprint("odd")}) == 3
    ours = fingerprint("reference")
    install("another", "", {}, version="3")
    assert fingerprint("reference") == ours  # it imports nothing of that


@pytest.mark.usefixtures("odd")
def test_settings_of_all_models_count_for_one_that_may_be_made_of_them():
    keys = set()
    for changes in ({}, {"solver.reference.tolerance": 1e-9}, {"solver.even.what": "x"}):
        scene = load_scene("ideal", changes)
        keys.add(run_key(scene, "odd", ""))
        assert run_key(scene, "exudyn", "") == run_key(load_scene("ideal"), "exudyn", "")
    assert len(keys) == 3


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


@pytest.mark.usefixtures("odd")
def test_settings_of_an_installed_model_are_single_values():
    own = {"what": "x", "order": 5, "stiff": True, "tolerance": 1e-8}
    scene = load_scene("ideal", {f"solver.odd.{key}": value for key, value in own.items()})
    assert scene.data["solver"]["odd"] == own
    for changes, message in (
        (
            {"solver.odd.tolerance": float("inf")},
            "odd.tolerance = inf must be a string, a boolean or a",
        ),
        ({"solver.odd.list": [1]}, r"solver.odd.list = \[1\] must be"),
        ({"solver.odd": 3}, "solver.odd = 3 must be a section"),
        ({"solver.exudin.step": 1.0}, "solver.exudin is not a known key: no model .* mean solver.exudyn"),
        ({"solver.adams.step": 1.0}, "solver.adams is not a known key: no model of this name is installed"),
    ):
        with pytest.raises(SceneError, match=message):
            load_scene("ideal", changes)


def test_a_table_is_compared_where_its_model_is_not_installed(odd):
    scene = load_scene("ideal", GROUPS | {"solver.odd.tolerance": 1e-8})
    (outcome,) = run_all([Job(scene, "odd")], 1)
    shutil.rmtree(odd.parent / "odd_press.dist-info")
    assert "odd" not in engine_names()
    found, warnings = recorded_scene(outcome.table, outcome.table)
    assert warnings == ()
    assert found.data["output"] == scene.data["output"]


@pytest.mark.usefixtures("odd")
def test_nobody_has_measured_the_accuracy_of_an_installed_model(capsys):
    with pytest.raises(AccuracyError, match="that of the model 'odd' is not recorded"):
        solver_values("odd", "strict", load_scene("ideal"))
    assert main(["validate", "ideal", "--models", "reference,odd", "--accuracy", "strict"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_packages_are_searched_for_models_again_only_where_one_came_or_went(install, monkeypatch):
    searches = []
    search = registry.entry_points
    monkeypatch.setattr(registry, "entry_points", lambda **group: searches.append(group) or search(**group))
    site = install("one_press", ODD, {"one": "one_press:simulate"}).parent
    assert [find(name).name for name in ("reference", "one", "one")] == ["reference", "one", "one"]
    assert len(searches) == 1
    install("two_press", ODD, {"two": "two_press:simulate"})
    os.utime(site, ns=(1, 1))  # the clock of the disk may not have ticked since the first came
    assert [find(name).name for name in ("two", "one")] == ["two", "one"]
    assert len(searches) == 2


def test_an_unknown_model_is_refused_in_python_too():
    with pytest.raises(EngineError, match="model 'adams' is not known"):
        run_all([Job(load_scene("ideal"), "adams")], 1)
