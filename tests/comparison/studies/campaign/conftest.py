"""Two models that play errors back, and a scene for them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fake_campaign import Models

from comparison.accuracy.levels import tight
from comparison.models import MODELS
from comparison.scene import load_scene
from comparison.studies.campaign import stages
from comparison.studies.campaign.population import Case
from comparison.verdict.results import Confirmation


@pytest.fixture
def models(make_table):
    return Models(make_table)


@pytest.fixture
def case():
    values = {"output.samples_per_cycle": 200, "output.groups": ["accelerations"]}
    return Case(7, tight(load_scene("150rpm-0.2mm", values), MODELS))


@pytest.fixture
def confirmed(monkeypatch):
    """Let ensembles confirm every difference; called with a verdict and a confirmation, say that instead."""

    def say(verdict="differ", confirmation=None):
        def confirm(result, *_, **__):
            channels = {name: replace(one, verdict=verdict) for name, one in result.channels.items()}
            made = confirmation or Confirmation("confirmed", members=(99, 30))
            channels = result.channels if verdict == "differ" else channels
            return replace(result, verdict=verdict, channels=channels, confirmation=made)

        monkeypatch.setattr(stages, "confirm", confirm)

    say()
    return say


@pytest.fixture
def unconfirmed(monkeypatch):
    """Nothing is to be confirmed."""
    monkeypatch.setattr(stages, "confirm", lambda *_, **__: pytest.fail("nothing was to be confirmed"))
