"""Sentences: an instant, what is expected of a run and which error it has, and the verdict card."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bouncing_press import make_scene

from comparison.accuracy.levels import expected, plan
from comparison.accuracy.refine import Limit, accurate_run, expected_cost
from comparison.execution.run import Job
from comparison.scene import load_scene
from comparison.verdict.results import Confirmation, SceneComparison
from comparison.words.accuracy import accuracy_line, cost_before, expectation, plan_lines, unmeasured
from comparison.words.causes import causes
from comparison.words.differences import contact, instant_of
from comparison.words.verdicts import card, scene_reason
from tests.helpers.known_error import USUAL, KnownError, growing

PAGE = Path(__file__).parents[3] / "docs" / "accuracy.md"
OWN = USUAL.with_values({"clearance.slider": 2.1e-4})
EVENTS = pd.DataFrame(
    [
        ("ul", 0.010, 0.011),
        ("ll", 0.010, 0.012),
        ("ur", 0.020, 0.021),
        ("ll", 0.030, 0.031),
        ("pin", 0.040, 0.050),
        ("ll", 0.045, 0.046),
    ],
    columns=["corner", "start", "end"],
)
BOTH = "the first contact of the lower left corner and the first contact of the upper left corner"
SAME = "0.0201 s, during the first contact of the upper right corner"


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (0.005, "before the first contact"),
        (0.0105, f"during {BOTH}"),
        (0.0115, "during the first contact of the lower left corner"),
        (0.015, f"after {BOTH}"),  # both may have made what is seen
        (0.025, "after the first contact of the upper right corner"),
        (0.0455, "during the third contact of the lower left corner and the first contact of the crank pin"),
        (0.050, "during the first contact of the crank pin"),
    ],
)
def test_the_contact_in_progress_or_the_last_one_counted_by_corner(time, words):
    assert contact(time, EVENTS) == words
    assert contact(time, EVENTS.iloc[::-1]) == words  # whatever the order of the rows


@pytest.mark.parametrize(
    ("count", "word"), [(1, "first"), (10, "tenth"), (11, "11th"), (22, "22nd"), (111, "111th")]
)
def test_many_contacts_are_counted_in_figures(count, word):
    starts = np.arange(1.0, count + 1.0)
    events = pd.DataFrame({"corner": "lr", "start": starts, "end": starts + 0.5})
    assert contact(count + 0.1, events).split()[2] == word


def compared(events=(None, None), scene=None):
    period = scene and 60.0 / abs(scene["drive"]["speed_rpm"])
    return SceneComparison(("a", "b"), "differ", np.empty(0), {}, events=events, period=period, scene=scene)


@pytest.mark.parametrize(
    ("events", "words"),
    [
        ((EVENTS, EVENTS.copy()), SAME),
        ((None, EVENTS), SAME),
        ((EVENTS, EVENTS.assign(corner="lr")),
         f"{SAME} (a), during the third contact of the lower right corner (b)"),
        ((None, None), "0.0201 s"),
    ],
)  # fmt: skip
def test_both_models_are_named_only_where_they_are_in_different_contacts(events, words):
    assert instant_of(0.0201, compared(events)) == words


@pytest.mark.parametrize(("speed", "angle"), [(150.0, 8), (-150.0, 332)])
def test_cycle_and_angle_of_the_crank_follow_the_scene_and_chatter_is_told(speed, angle):
    # 0.42 s at 0.4 s a cycle: 18 degrees into the second.
    start = {"mechanism.crank_angle_deg": 350.0, "drive.speed_rpm": speed}
    scene = load_scene("150rpm-0.2mm", start).data
    where = f"0.42 s (cycle 2, crank at {angle}°)"
    assert instant_of(0.42, compared(scene=scene)) == where
    starts = np.array([0.401, 0.405, 0.41, 0.414, 0.419])
    events = pd.DataFrame({"corner": "ll", "start": starts, "end": starts + 1e-4})
    said = "after the fifth contact of the lower left corner"
    chatter = "just after chatter (5 contacts in the 20 ms before)"
    assert instant_of(0.42, compared((events, None), scene)) == f"{where}, {said}, {chatter}"
    assert "chatter" not in instant_of(0.42, compared((events.iloc[1:], None), scene))


# Accuracy


def test_an_error_is_stated_where_it_was_measured_and_elsewhere_how_to_find_it():
    here = "2e-09 m of slider_x over the first cycle"
    radau = USUAL.with_values({"solver.reference.method": "Radau"})
    for scene, said in ((USUAL, here), (OWN, "estimate it by --check"), (radau, "by --check")):
        known = expected(scene, "reference")
        assert said in expectation(known)
        (line,) = (text for text in plan_lines(plan(scene, "reference")) if text.startswith("  error "))
        assert said in line
        assert ("--check" in unmeasured(known)) == ("--check" in said)
    assert unmeasured(expected(USUAL, "mine")) == ""
    longer = load_scene("both-clearances", {"drive.cycles": 2.0})  # than what was measured of it
    assert "slider_x over the first 0.06 cycles, and" in expectation(expected(longer, "exudyn"))
    assert any(
        "  time  " in text and "as on 150rpm-0.2mm" in text for text in plan_lines(plan(OWN, "exudyn"))
    )


def test_the_expected_cost_is_that_of_the_whole_family():
    head = (
        r"begins at solver\.reference\.tolerance = 1e-10, with 4 further runs: some (\S+) s of processor time"
    )
    text = cost_before(expected_cost(OWN, "reference", 1e-8))
    (seconds,) = re.fullmatch(f"{head}, more if it has to be refined", text).groups()
    assert 4 < float(seconds) / expected(OWN, "reference").seconds < 7
    assert cost_before(expected_cost(OWN, "reference", "draft")).endswith(" s of processor time")


def coarse(tolerance):
    return "chatter" if tolerance < 0.9e-10 else ""


@pytest.mark.parametrize(
    ("wanted", "known", "said"),
    [
        (1e-8, {}, r"is within 1e-08 m on all of the run \(solver.reference.tolerance = 1e-10; 5 runs,"),
        # Half of two cycles, and the window of u before it
        (1e-8, {"magnification": growing},
         r"is within 1e-08 m on 49\.5% of the run, without a gap up to 0\.396 s \(0\.99 cycles\); .*"
         r"since trajectories from starts 2e-13 m apart diverge by up to 2\.1e-05 m"),
        (1e-8, {"magnification": lambda phase: np.where(phase < 0.1, 1.0, 1e9)},
         r"1e-08 m is not reachable: it holds on 9\.5% of the run, without a gap up to 0\.076 s \(0\.19 "
         r"cycles\); .* m is reached on 25% of the run\. No setting does better, since trajectories from "),
        (1e-9, {"error": 1e4, "fails": coarse},
         "it holds nowhere; .*Finer settings have no result: chatter, as told"),
        (1e-11, {"error": 1e4}, "No finer setting is measured"),
        ("draft", {}, "estimated error of slider_x: at most "),
        (1e-6, {"fails": lambda t: "" if t == 1e-8 else "chatter"}, "the error is unknown: chatter, as told"),
    ],
)  # fmt: skip
def test_one_line_has_what_was_reached_until_when_and_why_not_more(wanted, known, said):
    assert re.search(said, accuracy_line(accurate_run(OWN, "reference", wanted, run=KnownError(**known))))


@pytest.mark.usefixtures("own_cache")
def test_the_page_has_every_reason_and_its_python_runs(capsys):
    text = PAGE.read_text("utf-8")
    assert [limit for limit in Limit if f"`{limit}`" not in text] == []
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(block, {"__name__": "__main__"})  # our own text
    kept, coverage, largest, _ = capsys.readouterr().out.split()
    assert kept == "True"
    assert 0.5 < float(coverage) <= 1.0
    assert float(largest) > 0.0


# Cards


def test_a_card_has_the_reason_the_confirmation_and_what_to_do():
    scene = make_scene()
    differing = make_scene(
        "stiff", alter=lambda columns: {k: 1.03 * v if "normal" in k else v for k, v in columns.items()}
    )
    confirmed = replace(differing, confirmation=Confirmation("confirmed", members=(99, 30)))
    corrected = replace(scene, confirmation=Confirmation("underestimated", members=(99, 30), factor=6.4))
    suspicious = replace(corrected, confirmation=replace(corrected.confirmation, clustered=True))
    strict = "sixbar validate press --accuracy strict"
    undecided = replace(scene, verdict="indeterminate", closer_command=strict)
    failed = Job(load_scene("150rpm-0.2mm"), "exudyn")
    crashed = replace(scene, verdict="cannot compare", channels={}, error="it crashed", failed=failed)
    for comparison, said, advice, command in (
        (scene, "", "", ""),
        (confirmed, "confirmed by at least 30 runs", "Find which model errs, by a third opinion:", "--set "),
        (corrected, "uncertainty underestimated 6.4 times", "", ""),
        (suspicious, "uncertainty underestimated 6.4 times", "A discontinuous event decides.", ""),
        (undecided, "", "See whether finer settings decide it:", strict),
        (crashed, "", "Repeat the run that failed, alone:", "sixbar run 150rpm-0.2mm --model exudyn --out "),
        (replace(crashed, failed=None), "", "Run the scene again once the cause is removed:", scene.command),
    ):
        shown = card(comparison)
        parts = *causes(comparison), scene_reason(comparison, brief=True), said
        assert shown.sentence == "; ".join(filter(None, parts)) + "."
        assert shown.advice == advice
        assert bool(shown.commands) == bool(command)
        assert command in " ".join(shown.commands)
    assert len(card(confirmed).commands) == 3  # a third formulation, the one to compare it with, and both
