"""Both models refuse the same scenes, plan refuses what a run refuses, and absurd loads are named."""

from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.cli import main
from comparison.models import check
from comparison.scene import SceneError, load_scene
from comparison.scene.keys import scene_keys

CASES = Path(__file__).parents[1] / "cases" / "physics"
MODELS = {"reference": reference_model, "exudyn": exudyn_model}
PAPER = "150rpm-0.2mm"
SHORT = {"drive.cycles": 0.002, "output.groups": []}
HUGE, ABSURD = (CASES / f"{name}.toml" for name in ("load-surface-huge", "absurd-load-2e9N"))
TABLE = [[0.0, 0.0], [1e-3, 1e9]]


@pytest.fixture
def sixbar(capsys, monkeypatch, tmp_path):
    """A command with changes of its scene: its exit code and the lines on stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "2000")

    def call(*arguments, changes):
        assignments = (part for key, value in changes.items() for part in ("--set", f"{key}={value}"))
        code = main([*map(str, arguments), *assignments])
        return code, capsys.readouterr().err

    return call


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mechanism.crank.length": 45.0}, "assembled"),
        ({"mechanism.rod2.length": 0.05}, "assembled"),
        ({"mechanism.rod4.length": 0.04}, "rod 4"),
        ({"mechanism.guide_x": -2.0}, "rod 4"),
        ({"mechanism.reference_offset": 0.5, "initial.slider_offset": 0.0}, "rod 4"),
        ({"joints.slider": "ideal", "mechanism.reference_offset": 0.5}, "rod 4"),
        ({"initial.slider_offset": 0.6}, "initial.slider_offset"),
        ({"load.force": 1e3, "load.surface": 1e20, "load.exponent": 30.0}, "load.surface"),
        ({"load.force": 1e3, "load.depth": 1e-20, "load.exponent": 30.0}, "load.surface"),
    ],
)
def test_what_both_models_refuse_plan_refuses_in_one_line(sixbar, changes, words):
    scene = load_scene(PAPER, SHORT | changes)
    for name, model in MODELS.items():
        for ask in (partial(check, name), model.simulate):
            with pytest.raises(ValueError, match=words) as refusal:
                ask(scene.data)
            assert "\n" not in str(refusal.value)
    code, err = sixbar("plan", PAPER, changes=SHORT | changes)
    assert (code, err.splitlines()[-1][:8]) == (2, "sixbar: ")
    assert words in err.splitlines()[-1]


@pytest.mark.parametrize("changes", [{}, {"load.surface": -1e31}, {"load.depth": 1e-31}])
def test_a_number_beyond_any_machine_is_refused_by_its_key(changes):
    with pytest.raises(SceneError, match=r"load\.\w+ = \S+ m must be 0 or between 1e-30 and 1e\+30"):
        load_scene(HUGE, changes)


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({}, "2.3e+09 N at the start"),
        ({"load.force": 0.0, "load.table": TABLE}, "1e+09 N at the start"),
        ({"load.surface": -0.0346, "load.force": 1e9}, "N at bottom dead centre"),
    ],
)
def test_a_load_that_is_absurd_is_named_by_plan_and_by_the_failure(sixbar, changes, place):
    scene = load_scene(ABSURD, changes)
    forces = [check(name, scene.data) for name in MODELS]
    # In 1000 and in 720 positions, 0.5 degrees apart: the height errs by 1e-6 m where the depth is 2e-4 m.
    for name, share in (("load_at_start", 1e-9), ("largest_load", 0.03)):
        assert forces[0][name] == pytest.approx(forces[1][name], rel=share)
    code, err = sixbar("plan", ABSURD, changes=changes)
    assert code == 0
    assert place in err
    if not changes:
        code, err = sixbar("run", ABSURD, "--model", "exudyn", "--out", "a.csv", changes={})
        assert code == 2
        assert "newton-failed" in err
        assert place in err


KEYS = [
    key.name
    for key in scene_keys()
    if key.name.partition(".")[0]
    in ("mechanism", "drive", "initial", "clearance", "contact", "friction", "load", "environment")
    and not key.name.endswith(("branch", "law", "pivot", "table"))
]
EXTREMES = [0.0, *(10.0**power for power in (-30, -12, -9, -6, -4, -3, -2, -1, 0, 1, 2, 3, 6, 9, 12, 20, 30))]
BASES = [PAPER, "both-clearances", "crank-pin", "ideal", "workpiece", "adams-impact", "surface"]


def draw_scene(seed, number):
    """A scene with one to three keys at an extreme, or a few times what they were; None if it is invalid."""
    rng = np.random.default_rng([seed, number])
    base, changes = str(rng.choice(BASES)), dict(SHORT)
    for key in map(str, rng.choice(KEYS, rng.integers(1, 4), replace=False)):
        value = load_scene(base).data
        for part in key.split("."):
            value = value[part]
        factor = float(rng.choice([0.1, 0.5, 0.8, 1.2, 2.0, 10.0, -1.0]))
        usual = isinstance(value, float) and rng.uniform() < 0.4
        changes[key] = value * factor if usual else float(rng.choice(EXTREMES) * rng.choice([1, 1, 1, -1]))
    if rng.uniform() < 0.2:
        changes["load.force"] = float(rng.choice(EXTREMES))
    try:
        return load_scene(base, changes)
    except SceneError:
        return None


def test_random_scenes_at_the_ends_of_every_key_are_refused_by_both_models_or_by_none():
    """Keys of a solver do not count, as the reference's tolerance beside a clearance over a rod's length."""
    ends = Counter()
    for number in range(300):
        if (scene := draw_scene(1, number)) is None:
            continue
        lines = {}
        for name in MODELS:
            try:
                lines[name] = check(name, scene.data) and None
            except ValueError as error:
                lines[name] = str(error)
                with pytest.raises(ValueError, match=r"."):
                    MODELS[name].simulate(scene.data)
        refusals = {name for name, line in lines.items() if line and "solver." not in line}
        ends[len(refusals)] += 1
        assert len(refusals) != 1 or any("solver." in str(line) for line in lines.values()), (number, lines)
    assert ends[0] > 100
    assert ends[2] > 25


@pytest.mark.parametrize(
    ("base", "changes"),
    [
        ("both-clearances", {"mechanism.rod2.centroid": -1e12}),  # rounds by 1e-4 m
        ("workpiece", {"mechanism.rod2.mass": 1e20}),  # turns at an instant that is no number
    ],
)
def test_five_bodies_run_what_both_checks_let_through(base, changes):
    """Any status will do; an internal error or a kind of refusal will not."""
    scene = load_scene(base, SHORT | {"solver.exudyn.formulation": "full"} | changes)
    assert exudyn_model.simulate(scene.data).provenance["formulation"] == "five bodies"
