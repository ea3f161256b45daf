"""Runs of the reference alone."""

import pytest

from reference_model import simulate


@pytest.fixture
def run(scene):
    """Simulate the paper's press with dotted keys replaced, of which all runs succeed."""

    def simulated(*changes):
        result = simulate(scene({key: value for part in changes for key, value in part.items()}))
        assert result.status == "success", result.remedy
        return result

    return simulated
