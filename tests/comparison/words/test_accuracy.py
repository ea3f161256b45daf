"""Sentences before and after a run: its expected error and cost, its error, and why it is not smaller."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from comparison.accuracy.measured import expected
from comparison.accuracy.plan import plan
from comparison.accuracy.refine import Limit, accurate_run, expected_cost
from comparison.scene import load_scene
from comparison.words.accuracy import accuracy_line, cost_before, expectation, plan_lines, unmeasured
from tests.helpers.known_error import USUAL, KnownError, growing

PAGE = Path(__file__).parents[3] / "docs" / "accuracy.md"
OWN = USUAL.with_values({"clearance.slider": 2.1e-4})
OTHER = "measured on 150rpm-0.2mm; this scene may magnify errors: estimate them by --check"


def line(wanted, **known):
    text = accuracy_line(accurate_run(OWN, "reference", wanted, run=KnownError(**known)))
    return re.sub(r"\(solver\.reference\.tolerance = (\S+); (\d+) runs, \S+ s\)", r"(\1, \2)", text)


def test_every_caution_is_in_the_expectation_and_in_the_plan():
    for scene, model, caution in (
        (OWN, "reference", OTHER),
        (OWN, "exudyn", OTHER),
        (USUAL.with_values({"solver.reference.method": "Radau"}), "reference", "with another method"),
        (load_scene("crank-pin"), "reference", "for y use a named accuracy"),
    ):
        assert caution in expectation(expected(scene, model))
        assert any(caution in text for text in plan_lines(plan(scene, model)) if "  caution  " in text)
    failed = replace(expected(OWN, "reference"), error=np.nan, failed="chatter")
    assert "expected: nothing recorded" in expectation(failed)
    assert "no result at this setting: chatter; measured on" in expectation(failed)


def test_the_measured_part_of_the_run_and_where_there_was_none_are_stated():
    assert "slider_x over the first cycle, and" in expectation(expected(load_scene("69GPa"), "reference"))
    both = expectation(expected(load_scene("both-clearances"), "exudyn"))
    assert "slider_x over the first 0.06 cycles, and" in both
    assert unmeasured(expected(USUAL, "reference")) == unmeasured(expected(USUAL, "mine")) == ""
    error = expected(OWN, "reference").error
    assert f"on this scene (on 150rpm-0.2mm it is {error:.2g} m)" in unmeasured(expected(OWN, "reference"))


def test_the_expected_cost_is_that_of_the_whole_family():
    text = cost_before(expected_cost(OWN, "reference", 1e-8))
    head = "begins at solver.reference.tolerance = 1e-10, with 4 further runs: some "
    tail = " s of processor time, more if it has to be refined"
    seconds = float(text.removeprefix(head).removesuffix(tail))
    assert 4 < seconds / expected(OWN, "reference").seconds < 6
    assert cost_before(expected_cost(OWN, "reference", "draft")).endswith(" s of processor time")
    unknown = OWN.with_values({"solver.exudyn.formulation": "tree", "joints.slider": "ideal"})
    text = cost_before(expected_cost(unknown, "exudyn", 1e-8))
    assert text.endswith("no time recorded, more if it has to be refined")


def test_one_line_has_what_was_reached_until_when_and_why_not_more():
    assert line(1e-8) == "slider_x is within 1e-08 m on all of the run (1e-10, 5)"
    text = line(1e-8, magnification=growing)
    # Half of two cycles, and the window of u before it.
    assert "is within 1e-08 m on 49.5% of the run, without a gap up to 0.396 s (0.99 cycles)" in text
    assert "since trajectories from starts 2e-13 m apart diverge by up to 2.1e-05 m" in text
    text = line(1e-8, magnification=lambda phase: np.where(phase < 0.1, 1.0, 1e9))
    where = "it holds on 9.5% of the run, without a gap up to 0.076 s (0.19 cycles)"
    assert text.startswith(f"1e-08 m is not reachable: {where}; ")
    assert " m is reached on 25% of the run. No setting does better, since trajectories from starts " in text
    text = line(1e-9, error=1e4, fails=lambda tolerance: "chatter" if tolerance < 0.9e-10 else "")
    assert "holds nowhere" in text
    assert "Finer settings have no result: chatter, as told (1e-09, " in text
    assert "No finer setting is measured" in line(1e-11, error=1e4)
    assert line("draft").startswith("estimated error of slider_x: at most ")
    text = line(1e-6, fails=lambda tolerance: "" if tolerance == 1e-8 else "chatter")
    assert text.startswith("the error is unknown: chatter, as told (1e-08")


def test_the_page_has_every_reason():
    text = PAGE.read_text("utf-8")
    assert [limit for limit in Limit if f"`{limit}`" not in text] == []


@pytest.mark.usefixtures("own_cache")
def test_the_python_of_the_page_runs(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    exec(block, {"__name__": "__main__"})  # our own text
    kept, coverage, largest, _ = capsys.readouterr().out.split()
    assert kept == "True"
    assert 0.5 < float(coverage) <= 1.0
    assert float(largest) > 0.0
