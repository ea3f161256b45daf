"""The third engine decides what the models' own opinions leave open, and changes nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_campaign import as_it_is

from comparison.execution.run import Outcome
from comparison.models import MODELS
from comparison.studies.campaign import third_engine
from comparison.studies.campaign.adjudication import OPEN
from comparison.studies.campaign.stages import examine
from comparison.studies.campaign.third_engine import ENGINE, ask, weighed, with_third_opinions

APART = 1e-3


@pytest.fixture
def open_row(models, case, install, fake_model):
    """The row of an open difference; the engine is one more fake model."""
    install("pinocchio_press", Path(fake_model.__file__).read_text(), {ENGINE: "pinocchio_press:simulate"})
    models.stretch["exudyn"] = APART
    row = examine(case, models, as_it_is)
    assert row["adjudication"]["errs"] == OPEN
    models.asked[ENGINE], models.spoil[ENGINE] = 0, lambda table: table
    return row


@pytest.mark.parametrize(
    ("stretch", "errs"), [(0.0, "exudyn"), (APART, "reference"), (APART / 2, OPEN), (3 * APART, OPEN)]
)
def test_the_model_errs_with_whose_run_the_engine_does_not_stand(models, case, open_row, stretch, errs):
    models.stretch[ENGINE] = stretch
    evidence = ask(case.scene, open_row["adjudication"], models)
    found = weighed(open_row["adjudication"], vars(evidence))
    assert found["errs"] == errs
    assert found["why"].startswith(f"{ENGINE} stands with ")
    assert found["evidence"][:-1] == open_row["adjudication"]["evidence"]
    assert found["evidence"][-1]["distances"] == evidence.distances
    assert models.asked[ENGINE] == 1


def test_an_engine_that_refuses_or_fails_leaves_it_open(models, case, open_row):
    models.status[ENGINE] = Outcome("bad input", "no clearance at the crank pin")
    found = weighed(open_row["adjudication"], vars(ask(case.scene, open_row["adjudication"], models)))
    assert (found["errs"], found["why"][: len(ENGINE) + 11]) == (OPEN, f"{ENGINE}: bad input")


def test_only_what_is_open_is_asked_and_only_where_the_engine_is_installed(
    case, open_row, fake_models, monkeypatch
):
    decided = open_row | {"adjudication": open_row["adjudication"] | {"errs": "exudyn"}}
    agreed = open_row | {"outcome": "agree", "adjudication": None}
    found = [(case, decided), (case, open_row), (case, agreed)]
    with monkeypatch.context() as without:
        without.setattr(third_engine, "engine_names", lambda: list(MODELS))
        assert with_third_opinions(found, 1) == found
    assert with_third_opinions(found[::2], 1) == found[::2]
    assert not fake_models.read_text()
    # In a worker process: its fake has the error of the fake tree, to the last bit.
    heard = with_third_opinions(found, 1)
    assert [row for _, row in heard[::2]] == [decided, agreed]
    evidence = heard[1][1]["adjudication"]["evidence"][-1]
    assert (evidence["model"], evidence["stands"], evidence["distances"][1]) == (ENGINE, "exudyn", 0.0)
    assert heard[1][1]["adjudication"]["errs"] == "reference"
    assert fake_models.read_text().count("\n") == 3
