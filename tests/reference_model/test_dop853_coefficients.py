"""The method's coefficients against scipy's, and nothing of scipy's integrators imported for them."""

import subprocess
import sys

import numpy as np
from scipy.integrate import DOP853

from reference_model import dop853_coefficients as ours


def test_they_are_scipys_to_the_last_bit():
    """Also of those beyond the zeros that are left out."""
    np.testing.assert_array_equal(ours.A, np.vstack([DOP853.A, DOP853.B]))
    np.testing.assert_array_equal(ours.STAGE_SHARES, np.append(DOP853.C, 1.0))
    for name in ("E3", "E5", "A_EXTRA", "C_EXTRA", "D"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(DOP853, name))


def test_a_default_run_imports_no_solver_of_scipys():
    """Which would take longer than the run."""
    code = "import sys, reference_model.simulation; sys.exit('scipy.integrate' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
