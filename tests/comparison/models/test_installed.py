"""A model from another package: the example of the documentation, and what a bad one costs."""

from __future__ import annotations

import re
import shlex
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from comparison.accuracy.levels import AccuracyError, solver_values, with_declared
from comparison.cli import main
from comparison.execution.run import Job, run_all
from comparison.models import GROUP, EngineError, declared, engine_names, load
from comparison.scene import SceneError, load_scene
from comparison.verdict.compare import recorded_scene
from comparison.verdict.validate import validate

PAGE = (Path(__file__).parents[3] / "docs" / "engine.md").read_text("utf-8")
ODD = Path(__file__).with_name("odd_press.py").read_text("utf-8")
POINTS = {"odd": "odd_press:simulate", "even": "odd_press:even"}
GROUPS = {"output.groups": [], "output.samples_per_cycle": 100, "drive.cycles": 1.0}
DECLARED = "simulate.settings = even.settings = {'tolerance': 1e-8}\n"


@pytest.fixture
def odd(install: Callable[..., Path]) -> Callable[..., Path]:
    """Install the odd press, with further code or code replaced; it is installed to begin with."""

    def make(more: str = "", replaced: tuple[str, str] = ("", "")) -> Path:
        return install("odd_press", ODD.replace(*replaced, 1) + more, POINTS)

    make()
    return make


def run_odd(what: str = "", *options: str) -> int:
    changes = [f"--set={key}={value}" for key, value in (GROUPS | {"solver.odd.what": what}).items()]
    return main(["run", "ideal", "--model", "odd", "--out", "a.csv", *options, *changes])


def compared(changes: dict[str, object] | None = None):
    scene = load_scene("ideal", GROUPS | (changes or {}))
    (result,) = validate([scene], models=("odd", "even"))
    return result


def tolerances(*tables) -> list[float]:
    return [table.provenance["scene"]["solver"]["odd"]["tolerance"] for table in tables]


def test_the_documented_model_agrees_with_the_reference(install, tmp_path, capsys):
    registration, scene = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    source, declaration, call = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    install("my_press", source, tomllib.loads(registration)["project"]["entry-points"][GROUP])
    (tmp_path / "mine.toml").write_text(scene)
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    for command in commands.splitlines():
        assert main(shlex.split(command)[1:]) == 0, command
    out, err = capsys.readouterr()
    assert err == ""
    assert "2 of 2 excited channels agree" in out  # only y and its rate move
    assert (tmp_path / "reports/out/mine/tables/mine-mine.csv").is_file()
    simulate = SimpleNamespace()
    exec(declaration, {"simulate": simulate})  # our own text
    assert simulate.settings == {"tolerance": 1e-10}
    exec(call, {})
    assert "'corner_ll_gap'" in capsys.readouterr().out


@pytest.mark.usefixtures("odd")
def test_two_installed_models_are_refined_and_judged_by_their_uncertainty():
    settings = {"solver.odd.tolerance": 1e-8, "solver.even.tolerance": 1e-8}
    same = compared(settings)
    assert same.comparison.verdict == "agree", same.comparison.reason
    scene = load_scene("ideal", GROUPS | settings)
    assert same.comparison.command == scene.command("validate", "--models", "odd,even")
    runs = same.runs["odd"]
    assert tolerances(runs.base, runs.finer, runs.coarser) == pytest.approx([1e-8, 1e-9, 1e-7], rel=1e-14)
    # Ten times the error of either, and so outside what 1.25 * 10/9 of both explain.
    assert compared(settings | {"solver.odd.bias": 1e-6}).comparison.verdict == "differ"


@pytest.mark.usefixtures("odd")
def test_without_anything_to_refine_the_tolerance_of_the_scene_decides():
    # 2e-6 m in y, of which the scale is 4.2e-5 m.
    bias = {"solver.odd.bias": 1e-6}
    assert compared(bias).comparison.verdict == "indeterminate"
    for tolerance, verdict in ((1e-1, "agree"), (1e-2, "differ")):
        assert compared(bias | {"compare.tolerance": tolerance}).comparison.verdict == verdict


def test_a_model_that_declares_its_settings_is_refined_on_a_scene_that_says_nothing_of_it(odd, capsys):
    odd(DECLARED)
    result = compared()
    assert result.comparison.verdict == "agree"
    base, finer = result.runs["odd"].base, result.runs["odd"].finer
    assert tolerances(base, finer) == [1e-8, pytest.approx(1e-9, rel=1e-14)]
    scene = load_scene("ideal", {"solver.odd.tolerance": 1e-5})
    assert with_declared(scene, ["odd"]).data["solver"]["odd"]["tolerance"] == 1e-5  # the scene's stays
    assert declared("reference") == {}
    # Its error, a value of 2.1 at most times its tolerance, is estimated from its own setting on.
    assert run_odd("", "-q", "--accuracy", "1e-8") == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "begins at solver.odd.tolerance = 1e-08, with 2 further runs: no time recorded" in out
    assert "slider_x is within 1e-08 m on all of the run (solver.odd.tolerance = 1e-09; " in out
    odd()
    assert run_odd("", "-q", "--accuracy", "1e-8") == 3
    out = " ".join(capsys.readouterr().out.split())
    assert "the error is unknown: the model has neither a step nor a tolerance" in out


@pytest.mark.parametrize(
    ("settings", "rule"),
    [
        ("3", "settings must be a mapping, not int"),
        ("{'order': [4]}", r"settings\['order'\] = \[4\] must be a string"),
        ("{'step': float('nan')}", r"settings\['step'\] = nan must be"),
    ],
)
def test_a_declaration_that_is_none_is_one_line(odd, settings, rule):
    odd(f"simulate.settings = {settings}\n")
    with pytest.raises(EngineError, match=rule):
        declared("odd")


def test_a_run_uses_the_declared_settings(odd, capfd):
    odd("simulate.settings = {'what': 'refuses'}\n")
    changes = [f"--set={key}={value}" for key, value in GROUPS.items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 2
    assert "is beyond this model" in capfd.readouterr().err


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


@pytest.mark.parametrize(
    ("share", "code"),
    [("float('nan')", 0), ("2.0", 0), ("-1.0", 0), ("True", 0), ("None", 70)],  # None is the model's fault
)
def test_a_progress_that_is_no_share_does_no_harm(odd, share, code, capfd):
    odd(replaced=("    del progress", f"    progress({share})"))
    assert run_odd() == code
    err = capfd.readouterr().err
    assert err.count("\n") == (code == 70)
    assert ("the odd run did not succeed: crashed; TypeError" in err) == (code == 70)


@pytest.mark.usefixtures("odd")
def test_what_a_model_prints_or_does_to_its_scene_is_not_among_the_results(capfd, monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # with it nothing waits to be lost
    assert run_odd("prints") == 0
    assert capfd.readouterr() == ("a.events.csv\na.json\na.csv\n", "hello\n")
    (outcome,) = run_all([Job(load_scene("ideal", GROUPS), "odd")], 1)
    assert outcome.table.provenance["scene"]["drive"]["speed_rpm"] == 150.0


def test_what_a_package_prints_while_it_is_imported_is_not_either(install, capsys):
    install("odd_press", "print('licence found')\n" + ODD, POINTS)
    load("odd")
    assert capsys.readouterr() == ("", "licence found\n")


@pytest.mark.usefixtures("wide")
def test_a_traceback_stands_in_the_report_folder_and_beside_a_table(odd, capfd):
    assert odd()
    text = "[scene]\nextends = 'ideal'\n[output]\ngroups = []\n[solver.odd]\nwhat = 'raises'\n"
    Path("own.toml").write_text(text)
    command = ["validate", "own.toml", "--models", "odd,even", "--out", "v"]
    assert main(command) == 70
    path = Path("v/own.standard-odd-base.traceback.txt")
    assert path.read_text().startswith("Traceback")
    assert "odd_press.py" in path.read_text()
    assert f"the traceback of the standard odd base run is in {path}" in capfd.readouterr().out
    assert main(["run", "own.toml", "--model", "odd", "--out", "a.csv"]) == 70
    assert "its traceback is in a.traceback.txt" in capfd.readouterr().err
    assert Path("a.traceback.txt").read_text().startswith("Traceback")
    # One from an earlier call would appear to belong to this report.
    Path("own.toml").write_text(text.replace("raises", ""))
    main(command)
    assert not path.exists()


@pytest.mark.usefixtures("odd")
@pytest.mark.parametrize("what", ["", "no ideal"])
def test_there_is_no_reliability_of_a_model_that_has_no_ideal_run(what):
    """It never has the accelerations that an ideal run is to hold."""
    assert compared({"solver.odd.what": what}).comparison.reliability is None


@pytest.mark.usefixtures("odd")
def test_contacts_of_zeros_are_noticed(capfd):
    warned = "impulse, peak_force of all its 1 contacts are zero"
    assert f"odd: {warned}" in "".join(compared({"solver.odd.what": "zeros"}).comparison.warnings)
    assert not compared().comparison.warnings
    assert run_odd("zeros") == 0
    assert warned in capfd.readouterr().err


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
    model = "reference" if len(points) > 1 else "mine"
    assert main(["run", "ideal", "--model", model, "--out", "a.csv"]) == 2
    err = capfd.readouterr().err
    assert message in err
    assert err.count("\n") == 1


def test_an_unknown_model_is_refused_in_python_too():
    with pytest.raises(EngineError, match="model 'adams' is not known"):
        run_all([Job(load_scene("ideal"), "adams")], 1)


@pytest.mark.parametrize(
    "fault",
    ["raise ValueError('no\\nlicence')", "import sys; sys.exit(3)", "1 +", "import nowhere", "1 / 0"],
)
@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize(
    "command",
    [
        ["run", "ideal", "--model", "odd", "--out", "a.csv"],
        ["validate", "ideal", "--models", "odd,reference", "--out", "v", "--jobs", "1", "-v"],
    ],
    ids=["run", "validate"],
)
def test_a_package_that_cannot_be_imported_is_one_line(odd, command, fault, capfd):
    odd(f"\n{fault}")
    code = main(command)
    out, err = capfd.readouterr()
    assert code == 2
    assert "model 'odd' cannot be imported from 'odd_press:simulate': " in out + err
    assert "Traceback" not in out + err
    assert err.count("\n") == (command[0] == "run")


@pytest.mark.usefixtures("odd")
@pytest.mark.parametrize("models", ["reference", "odd,odd", "reference,adams", ","])
def test_validate_takes_models_that_there_are(models, capsys):
    assert main(["validate", "ideal", "--models", models]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "two names" in err or "is not known" in err


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
    shutil.rmtree(odd().parent / "odd_press.dist-info")
    assert "odd" not in engine_names()
    recorded, warnings = recorded_scene(outcome.table, outcome.table)
    assert warnings == ()
    assert recorded.data["output"] == scene.data["output"]


@pytest.mark.usefixtures("odd")
def test_nobody_has_measured_the_accuracy_of_an_installed_model(capsys):
    with pytest.raises(AccuracyError, match="that of the model 'odd' is not recorded"):
        solver_values("odd", "strict", load_scene("ideal"))
    assert main(["validate", "ideal", "--models", "reference,odd", "--accuracy", "strict"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
