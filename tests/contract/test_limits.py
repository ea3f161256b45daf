"""A limit with a known answer: no clearance."""

import math

import numpy as np
import pytest

CENTRE = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}


def test_small_clearance_tends_to_the_ideal_mechanism_at_first_order(run, variant):
    """A quarter of the clearance, a quarter of the deviation; y moves tan(beta) times as far as x."""
    # Through the largest tan(beta), 0.2093, with x at both walls.
    common = {**CENTRE, "drive.cycles": 0.2, "output.groups": []}
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
