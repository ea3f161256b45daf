"""What is said before and after a run with an estimated error."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from comparison.accuracy.levels import expected
from comparison.agreement.refinement.accurate_run import accurate_run
from comparison.agreement.refinement.words import cost_before, result
from tests.helpers.known_error import USUAL, KnownError, growing

PAGE = Path(__file__).parents[4] / "docs" / "accuracy.md"
OWN = USUAL.with_values({"clearance.slider": 2.1e-4})


def said(wanted, **known):
    line = result(accurate_run(OWN, "reference", wanted, run=KnownError(**known)))
    return re.sub(r"\(solver\.reference\.tolerance = (\S+); (\d+) runs, \S+ s\)", r"(\1, \2)", line)


def test_the_expected_cost_is_that_of_the_whole_family():
    line = cost_before(OWN, "reference", 1e-8)
    head = "begins at solver.reference.tolerance = 1e-10, with 4 further runs: some "
    tail = " s of processor time, more if it has to be refined"
    seconds = float(line.removeprefix(head).removesuffix(tail))
    assert 4 < seconds / expected(OWN, "reference").seconds < 6
    assert cost_before(OWN, "reference", "draft").endswith(" s of processor time")
    unknown = OWN.with_values({"solver.exudyn.formulation": "tree", "joints.slider": "ideal"})
    assert cost_before(unknown, "exudyn", 1e-8).endswith("no time recorded, more if it has to be refined")


def test_one_line_has_what_was_reached_until_when_and_why_not_more():
    assert said(1e-8) == "slider_x is within 1e-08 m on all of the run (1e-10, 5)"
    line = said(1e-8, magnification=growing)
    # Half of two cycles, and the window of u before it.
    assert "is within 1e-08 m on 49.5% of the run, up to 0.396 s (0.99 cycles) without a break" in line
    assert "as starts 2e-13 m apart part by up to 2.1e-05 m" in line
    early = said(1e-8, magnification=lambda phase: np.where(phase < 0.1, 1.0, 1e9))
    reached = "it holds on 9.5% of the run, up to 0.076 s (0.19 cycles) without a break"
    assert early.startswith(f"1e-08 m is not reachable: {reached}; reached is ")
    assert "on 25% of the run. No setting does better, as starts 2e-13 m apart part by up to " in early
    stops = said(1e-9, error=1e4, fails=lambda tolerance: "chatter" if tolerance < 0.9e-10 else "")
    assert "holds nowhere" in stops
    assert "Finer settings have no result: chatter, as told (1e-09, " in stops
    assert "No finer setting is measured" in said(1e-11, error=1e4)
    assert said("draft").startswith("estimated error of slider_x: at most ")
    only = said(1e-6, fails=lambda tolerance: "" if tolerance == 1e-8 else "chatter")
    assert only.startswith("the error is unknown: chatter, as told (1e-08")


def test_the_page_has_every_reason():
    from comparison.agreement.refinement.accurate_run import Limit

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
