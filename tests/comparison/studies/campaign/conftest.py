"""Two models that play errors back, and a scene for them."""

from __future__ import annotations

import pytest
from fake_campaign import Models

from comparison.accuracy.levels import tight
from comparison.models import MODELS
from comparison.scene import load_scene
from comparison.studies.campaign.population import Case


@pytest.fixture
def models(make_table):
    return Models(make_table)


@pytest.fixture
def case():
    values = {"output.samples_per_cycle": 200, "output.groups": ["accelerations"]}
    return Case(7, tight(load_scene("150rpm-0.2mm", values), MODELS))
