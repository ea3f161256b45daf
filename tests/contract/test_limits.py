"""Limits with a known answer: no clearance, and steps that only stability limits."""

import math

import numpy as np
import pytest
from scipy.integrate import DOP853

CENTRED = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}


def test_small_clearance_tends_to_the_ideal_mechanism_at_first_order(run, variant):
    """A quarter of the clearance, a quarter of the deviation; y moves tan(beta) times as far as x."""
    # Through the largest tan(beta), 0.2093, with x at both walls.
    common = {**CENTRED, "drive.cycles": 0.2, "output.groups": []}
    ideal, deviations = run("reference-minimal", "ideal", common).columns, []
    for clearance in (4e-5, 1e-5):
        columns = run(variant, "150rpm-0.2mm", {**common, "clearance.slider": clearance}).columns
        across, along = (np.abs(columns[name] - ideal[name]).max() for name in ("slider_x", "slider_y"))
        # The walls give way by up to a micrometre or two.
        assert 0.99 * clearance <= across <= clearance + 2e-6
        assert along <= 0.2093 * 1.02 * across
        deviations.append(along)
    # Less the depth in the walls, which has no part in the limit: 1e-5 m leave room for a tenth of it.
    assert math.log(deviations[0] / deviations[1], 4.0) == pytest.approx(1.0, abs=0.1)


def test_large_gains_of_baumgarte_shorten_steps_to_the_limit_of_stability(run):
    """DOP853 on y' = -y is stable up to h = 6.39; alpha = beta is a double root -alpha."""
    powers, terms = np.ones(len(DOP853.B)), [1.0]
    for _ in DOP853.B:
        terms.append(float(DOP853.B @ powers))
        powers = DOP853.A @ powers
    h = np.linspace(0.0, 8.0, 80_001)
    most = h[np.flatnonzero(np.abs(np.polynomial.Polynomial(terms)(-h)) > 1.0 + 1e-12)[0]]
    assert most == pytest.approx(6.394, abs=1e-3)  # docs/accuracy.md
    gains = {f"solver.reference.baumgarte_{name}": 1e5 for name in ("alpha", "beta")}
    loose = {"solver.reference.tolerance": 5e-6, "drive.cycles": 0.2, "output.groups": []}
    steps = run("reference-multiplier", "ideal", gains | loose).result.provenance["counters"]["steps"]
    assert 0.9 < 0.2 * 0.4 / steps * 1e5 / most < 1.0
