"""Scenes of a made-up press."""

import pytest
from bouncing_press import make_scene


@pytest.fixture(scope="session")
def scene():
    """Two crank cycles on which both models agree."""
    return make_scene()


@pytest.fixture(scope="session")
def differing():
    """The same with the second model's normal forces 3 % too large."""
    return make_scene(
        "stiff", alter=lambda columns: {k: 1.03 * v if "normal" in k else v for k, v in columns.items()}
    )
