"""Runs whose errors are known, and two models that play errors back."""

import fake_model
import pytest
from fake_ensemble import COARSE, MODELS, Fake

from comparison.accuracy.levels import tight
from comparison.accuracy.uncertainty import Runs
from comparison.scene import load_scene


@pytest.fixture
def make_runs(make_table):
    """Runs of a second-order method with an error: ``make_runs(error, ...)``, the rest as of `make_table`."""

    def make(error, refinement=(2.0, 2.0), **options):
        tables = [make_table(part * error, **options) for part in (1.0, 0.25, 4.0, 4.0, 4.0)]
        return Runs(*tables, refinement=refinement)

    return make


@pytest.fixture
def small():
    """Two cycles with few samples, Exudyn's tree: both models have an ensemble."""
    tree = tight(load_scene("150rpm-0.2mm", COARSE), MODELS)
    assert tree is not None
    return tree


@pytest.fixture
def fake(small):
    def make(draw, of=small, **options):
        return Fake(fake_model.signals, of, draw, **options)

    return make
