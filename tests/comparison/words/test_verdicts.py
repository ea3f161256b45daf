"""The verdict card: one plain sentence, the order, what to do next."""

import shlex
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.cli.main import app
from comparison.execution.run import Job
from comparison.formatting import number, quantity
from comparison.scene import load_scene
from comparison.verdict.results import Attribution, Confirmation, Refinement, SceneComparison
from comparison.words.cards import card


def confirmed(scene: SceneComparison, **changes: object) -> SceneComparison:
    found = Confirmation("confirmed", members=(99, 30))
    return replace(scene, confirmation=replace(found, **changes))


def test_a_difference_is_one_sentence_with_numbers_instant_and_confirmation(
    differing: SceneComparison,
) -> None:
    attribution = Attribution(outside_from=0.25, outside_in="corner_ll_normal")
    of = confirmed(replace(differing, attribution=attribution))
    said = card(of).sentence
    worst = of.worst_channel
    assert worst is not None
    size, limit = abs(worst.worst_difference), worst.worst_threshold
    assert (
        f"|E|/2u (99%) is {number(worst.ratio, 2)}, the maximum {number(size / limit, 2)}: "
        f"{quantity(size, 'N', 2)} against {quantity(limit, 'N', 2)}; " in said
    )
    assert "the trajectories diverge at 0.25 s (cycle 1" in said
    assert said.endswith("confirmed by at least 30 runs.")
    assert said.count(". ") == 0  # one sentence


def test_chatter_before_the_difference_is_said(differing: SceneComparison) -> None:
    starts = np.array([0.231, 0.235, 0.24, 0.244, 0.249])
    contacts = pd.DataFrame({"corner": "ll", "start": starts, "end": starts + 1e-4})
    of = replace(
        differing, attribution=Attribution(outside_from=0.25, outside_in="slider_x"), events=(contacts, None)
    )
    assert "just after chatter (5 contacts in the 20\u00a0ms before)" in card(of).sentence
    assert "chatter" not in card(replace(of, events=(contacts.iloc[1:], None))).sentence


def test_a_corrected_uncertainty_and_an_undecided_verdict_say_so(scene: SceneComparison) -> None:
    corrected = confirmed(scene, outcome="underestimated", factor=6.4)
    assert "had been underestimated 6.4 times and is corrected" in card(corrected).sentence
    undecided = replace(scene, verdict="indeterminate")
    assert card(undecided).sentence.startswith("Not decided: ")
    assert "at least 50% are required" in card(undecided).sentence


def test_a_crashed_run_is_its_reason_and_how_to_repeat_it(broken: SceneComparison) -> None:
    reason = "scene 'broken': the exudyn run did not succeed: crashed; exit code 3"
    finer = load_scene("ideal", {"drive.cycles": 0.5}).variant({"solver.exudyn.step": 1e-6})
    found = card(replace(broken, error=reason, failed=Job(finer, "exudyn")))
    assert found.sentence == f"{reason}."
    (command,) = found.commands
    assert command == (
        "sixbar run ideal --set drive.cycles=0.5 --set solver.exudyn.step=1e-06 "
        "--model exudyn --out broken-exudyn.csv"
    )


@pytest.mark.parametrize(("formulation", "third"), [("full", "multiplier"), ("tree", "full")])
def test_what_to_do_about_a_difference_are_commands_that_exist(
    differing: SceneComparison, formulation: str, third: str
) -> None:
    ran = load_scene("150rpm-0.2mm", {"clearance.slider": 4e-4, "solver.exudyn.formulation": formulation})
    found = card(replace(differing, ran=ran))
    # The file's own formulation, to which the third opinion returns, needs no --set.
    named = {word for word in shlex.split(found.commands[0]) if word.endswith(f"formulation={third}")}
    assert bool(named) == (third != "full")
    assert all("--set clearance.slider=0.0004" in command for command in found.commands[:2])
    assert (
        found.commands[2] == f"sixbar compare {' '.join(shlex.split(c)[-1] for c in found.commands[1::-1])}"
    )
    known = {command.name or command.callback.__name__ for command in app.registered_commands}
    for command in found.commands:
        assert shlex.split(command)[0] == "sixbar"
        assert shlex.split(command)[1] in known


def test_agreement_asks_for_nothing(scene: SceneComparison) -> None:
    assert card(scene).commands == ()


def test_the_known_orders_of_both_models_are_shown(scene: SceneComparison) -> None:
    changes = (
        Refinement("reference", {"tolerance": 1e-10}, 10.0, 1.0),
        Refinement("exudyn", {"step": 2e-6}, 2.0, 2.0, observed=1.98),
    )
    ordered = replace(scene, attribution=replace(scene.attribution, refinements=changes))
    unknown = replace(scene, attribution=Attribution())
    assert [card(each).order for each in (unknown, ordered)] == ["", "exudyn 2.0 (expected 2)"]
