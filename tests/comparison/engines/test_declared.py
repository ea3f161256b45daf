"""What an installed model declares of itself, and what is said of one that crashes or leaves out."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from comparison.accuracy.levels import with_declared
from comparison.cli import main
from comparison.engines.registry import EngineError, declared
from comparison.engines.registry import load as load_model
from comparison.scene import load_scene
from comparison.tables.channels import expected
from comparison.verdict.validate import validate

Install = Callable[..., Path]

ODD = Path(__file__).with_name("odd_press.py").read_text("utf-8")
GROUPS = {"output.groups": [], "output.samples_per_cycle": 100, "drive.cycles": 1.0}
POINTS = {"odd": "odd_press:simulate", "even": "odd_press:even"}
DECLARED = "simulate.settings = even.settings = {'tolerance': 1e-8}\n"


def of_ideal(what: str = "", models: tuple[str, str] = ("odd", "even")):
    (found,) = validate([load_scene("ideal", GROUPS | {"solver.odd.what": what})], models=models)
    return found


def test_a_model_that_declares_its_settings_is_refined_on_a_scene_that_says_nothing_of_it(install):
    install("odd_press", ODD, POINTS)
    assert of_ideal().comparison.verdict == "indeterminate"
    install("odd_press", ODD + DECLARED, POINTS)
    found = of_ideal()
    assert found.comparison.verdict == "agree"
    tolerances = [of.provenance["scene"]["solver"]["odd"]["tolerance"] for of in (
        found.runs["odd"].base, found.runs["odd"].finer)]  # fmt: skip
    assert tolerances == [1e-8, pytest.approx(1e-9, rel=1e-14)]
    scene = load_scene("ideal", {"solver.odd.tolerance": 1e-5})
    assert with_declared(scene, ["odd"]).data["solver"]["odd"]["tolerance"] == 1e-5  # the scene's stays
    assert declared("reference") == {}


def test_a_run_uses_them_as_well(install, capfd):
    install("odd_press", ODD + "simulate.settings = {'what': 'refuses'}\n", POINTS)
    changes = [f"--set={key}={value}" for key, value in GROUPS.items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 2
    assert "is beyond this model" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("settings", "rule"),
    [
        ("3", "settings must be a mapping, not int"),
        ("{'order': [4]}", r"settings\['order'\] = \[4\] must be a string"),
        ("{'step': float('nan')}", r"settings\['step'\] = nan must be"),
    ],
)
def test_a_declaration_that_is_none_is_one_line(install, settings, rule):
    install("odd_press", ODD + f"simulate.settings = {settings}\n", POINTS)
    with pytest.raises(EngineError, match=rule):
        declared("odd")


@pytest.mark.usefixtures("wide")
def test_a_traceback_stands_in_the_report_folder_and_beside_a_table(install, capfd):
    install("odd_press", ODD, POINTS)
    Path("own.toml").write_text(
        "[scene]\nextends = 'ideal'\n[output]\ngroups = []\n[solver.odd]\nwhat = 'raises'\n"
    )
    assert main(["validate", "own.toml", "--models", "odd,even", "--out", "v"]) == 70
    path = Path("v/own.standard-odd-base.traceback.txt")
    text = path.read_text()
    assert text.startswith("Traceback")
    assert "odd_press.py" in text
    assert f"the traceback of the standard odd base run is in {path}" in capfd.readouterr().out
    assert main(["run", "own.toml", "--model", "odd", "--out", "a.csv"]) == 70
    assert "its traceback is in a.traceback.txt" in capfd.readouterr().err
    assert Path("a.traceback.txt").read_text().startswith("Traceback")
    # One from an earlier call would appear to belong to this report.
    Path("own.toml").write_text(Path("own.toml").read_text().replace("raises", ""))
    main(["validate", "own.toml", "--models", "odd,even", "--out", "v"])
    assert not path.exists()


@pytest.mark.parametrize("what", ["", "no ideal"])
def test_there_is_no_reliability_of_a_model_that_has_no_ideal_run(install, what):
    install("odd_press", ODD, POINTS)  # it never has the accelerations that an ideal run is to hold
    assert of_ideal(what).comparison.reliability is None


def test_contacts_of_zeros_are_noticed(install, capfd):
    install("odd_press", ODD, POINTS)
    warned = "odd: impulse, peak_force of all its 1 contacts are zero"
    assert warned in "".join(of_ideal("zeros").comparison.warnings)
    assert not of_ideal().comparison.warnings
    changes = [f"--set={key}={value}" for key, value in (GROUPS | {"solver.odd.what": "zeros"}).items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 0
    assert "impulse, peak_force of all its 1 contacts are zero" in capfd.readouterr().err


def test_the_other_code_of_the_page_runs(capsys):
    page = (Path(__file__).parents[3] / "docs" / "engine.md").read_text("utf-8")
    _, declaration, call = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    simulate = SimpleNamespace()
    exec(declaration, {"simulate": simulate})  # our own text
    assert simulate.settings == {"tolerance": 1e-10}
    exec(call, {})
    assert "'corner_ll_gap'" in capsys.readouterr().out


def test_the_channels_of_a_scene_come_from_one_call():
    scene = load_scene("150rpm-0.2mm", {"output.groups": ["joints", "corners"]}).data
    names = expected(scene)
    assert len(names) == 6 + 12 + 13
    assert {"slider_x", "corner_ul_friction", "reaction_F_y", "crank_torque"} < set(names)
    assert expected(load_scene("ideal", GROUPS).data) == names[:6]


@pytest.mark.parametrize(
    "fault",
    ["raise ValueError('no\\nlicence')", "import sys; sys.exit(3)", "1 +", "import nowhere", "1 / 0"],
)
@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize("command", ["run", "validate"])
def test_a_package_that_cannot_be_imported_is_one_line(install, command, fault, capfd):
    install("odd_press", ODD + "\n" + fault, POINTS)
    options = {
        "run": ["--model", "odd", "--out", "a.csv"],
        "validate": ["--models", "odd,reference", "--out", "v", "--jobs", "1", "-v"],
    }[command]
    code = main([command, "ideal", *options])
    out, err = capfd.readouterr()
    assert code == 2
    assert "model 'odd' cannot be imported from 'odd_press:simulate': " in out + err
    assert "Traceback" not in out + err
    assert err.count("\n") == (command == "run")


def test_what_a_package_prints_while_it_is_imported_does_not_stand_among_results(install, capsys):
    install("odd_press", "print('licence found')\n" + ODD, POINTS)
    load_model("odd")
    assert capsys.readouterr() == ("", "licence found\n")


@pytest.mark.parametrize("share", ["float('nan')", "2.0", "-1.0", "True"])
def test_a_progress_that_is_no_share_does_no_harm(install, share, capfd):
    install("odd_press", ODD.replace("    del progress", f"    progress({share})"), POINTS)
    changes = [f"--set={key}={value}" for key, value in GROUPS.items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 0
    assert capfd.readouterr().err == ""


def test_one_that_is_no_number_is_the_model_s_fault(install, capfd):
    install("odd_press", ODD.replace("    del progress", "    progress(None)"), POINTS)
    changes = [f"--set={key}={value}" for key, value in GROUPS.items()]
    assert main(["run", "ideal", "--model", "odd", "--out", "a.csv", *changes]) == 70
    err = capfd.readouterr().err
    assert "the odd run did not succeed: crashed; TypeError" in err
    assert err.count("\n") == 1


def test_an_installed_models_accuracy_is_estimated_from_its_own_setting_on(install, capsys):
    """Its error goes with its tolerance: a value of 2.1 at most, times 1e-8 and less."""
    install("odd_press", ODD + DECLARED, POINTS)
    changes = [f"--set={key}={value}" for key, value in GROUPS.items()]
    run = ["run", "ideal", "--model", "odd", "--out", "a.csv", "-q", *changes]
    assert main([*run, "--accuracy", "1e-8"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "begins at solver.odd.tolerance = 1e-08, with 2 further runs: no time recorded" in said
    assert "slider_x is within 1e-08 m on all of the run (solver.odd.tolerance = 1e-09; " in said
    install("odd_press", ODD, POINTS)
    assert main([*run, "--accuracy", "1e-8"]) == 3
    said = " ".join(capsys.readouterr().out.split())
    assert "the error is unknown: the model has neither a step nor a tolerance" in said
