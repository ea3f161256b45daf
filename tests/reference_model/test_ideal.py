"""The ideal mechanism: without the compiler, and where it cannot be assembled."""

import subprocess
import sys

import numpy as np
import pytest

from comparison.scene import load_scene
from reference_model import simulate
from reference_model.linkage import ideal_motion
from reference_model.parameters import read_parameters

GROUPS = ["accelerations", "joints", "energy"]
RUN = f"""
import sys
from comparison.scene import load_scene
from reference_model import simulate
simulate(load_scene("ideal", {{"output.groups": {GROUPS}}}).data)
sys.exit("numba" in sys.modules)
"""


def test_an_ideal_run_imports_no_compiler():
    """Which takes longer than the run: 0.5 s of processor time where it was written."""
    assert subprocess.run([sys.executable, "-c", RUN], check=False).returncode == 0


def test_where_rod_4_does_not_reach_there_is_no_number_and_no_warning():
    """Warnings are errors here."""
    data = load_scene("ideal").data
    data["mechanism"]["rod4"] |= {"length": 0.02, "centroid": 0.01}
    p = read_parameters(data)
    times = np.linspace(0.0, p.period, 100)
    angles = ideal_motion(p.mechanism, times)[3, 2]
    assert np.isnan(angles).any()
    with pytest.raises(ValueError, match="rod 4 is too short"):
        simulate(data)
