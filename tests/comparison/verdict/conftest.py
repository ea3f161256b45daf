"""Two models that play errors back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fake_ensemble import COARSE, MODELS, Fake

from comparison.accuracy.tiers import tight
from comparison.scene import Scene, load_scene


@pytest.fixture
def small() -> Scene:
    """Two cycles with few samples, Exudyn's tree: both models have an ensemble."""
    tree = tight(load_scene("150rpm-0.2mm", COARSE), MODELS)
    assert tree is not None
    return tree


@pytest.fixture
def fake(fake_model, small) -> Callable[..., Fake]:
    def make(draw: Callable[[np.random.Generator], float], of: Scene = small, **options) -> Fake:
        return Fake(fake_model.signals, of, draw, **options)

    return make
