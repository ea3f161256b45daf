"""Studies of fake models."""

import pytest


@pytest.fixture
def here(fake_models, tmp_path, monkeypatch):
    """Fake models, and an empty working folder; the log of what ran."""
    monkeypatch.chdir(tmp_path)
    return fake_models
