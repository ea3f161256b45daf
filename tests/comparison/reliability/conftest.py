"""A slider that follows a sine of the crank, with errors as asked."""

import numpy as np
import pandas as pd
import pytest

from comparison.tables.table import Table

PERIOD = 0.4


@pytest.fixture
def press():
    """Make tables: ``press(error)`` adds to the acceleration alone what is given for each sample.

    Then without the velocity, of which it would not be the rate any more.
    """

    def make(error=0.0, cycles=2, per_cycle=1000):
        time = np.arange(round(cycles * per_cycle) + 1) * (PERIOD / per_cycle)
        phase, w = 2 * np.pi * time / PERIOD, 2 * np.pi / PERIOD
        columns = {"time": time, "slider_y": 0.1 * np.cos(phase)}
        if not np.any(error):
            columns["slider_vy"] = -0.1 * w * np.sin(phase)
        return Table(pd.DataFrame(columns | {"slider_ay": -0.1 * w**2 * np.cos(phase) + error}))

    return make
