"""Tables of other programs, each test in a folder of its own."""

import pytest


@pytest.fixture(autouse=True)
def _elsewhere(elsewhere):
    """Files are named as they lie in the working folder."""
