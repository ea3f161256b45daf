"""The search for the press: its kinematics, and its results from facts of a known press and the paper's."""

import numpy as np
import pandas as pd
import pytest

from comparison.studies.paper import fitting, numerics
from comparison.studies.paper import identification as study
from comparison.studies.paper.fitting import TOPOLOGIES, Geometry, Topology

LENGTHS, _ = fitting.table_1()
PRESS = Topology(crank=1, rocker=1, slider=-1, pin="centroid", side=-1)
ANGLE = 2 * np.pi * np.arange(720) / 720


def test_rods_of_every_arrangement_stay_rigid():
    count = 0
    places = {
        "centroid": (LENGTHS.rocker_centroid, 0.2568, 0.2, 0.55),
        "tip": (LENGTHS.rocker, 0.535, -0.126, 0.179),
    }
    for topology in TOPOLOGIES:
        arm, x, y, guide = places[topology.pin]
        geometry = Geometry(-topology.side * x, y, topology.side * guide)
        press = fitting.motion(geometry, topology, LENGTHS, ANGLE)
        if press.margin < 1e-3:
            continue  # it does not turn all round
        count += 1
        H = complex(geometry.pivot_x, geometry.pivot_y)
        rods = press.A, press.B - press.A, press.B - H, press.C - H, press.F - press.C
        lengths = LENGTHS.crank, LENGTHS.rod2, arm, LENGTHS.rocker, LENGTHS.rod4
        for rod, length in zip(rods, lengths, strict=True):
            assert np.abs(np.abs(rod) - length).max() < 1e-15  # round-off of coordinates below 1 m
        assert np.all(press.F.real == geometry.guide)
        assert np.all(np.sign((press.F - press.C).imag) == topology.slider)
        # Central differences over half a degree each way are off by a sixth of its square times the third
        # derivative, less than 1e-4 of the largest rate where harmonics up to the eighth matter; the
        # acceleration has more of these.
        step = 2 * topology.crank * ANGLE[1]
        velocity, acceleration = (
            (np.roll(each, -1) - np.roll(each, 1)) / step for each in (press.F.imag, press.velocity)
        )
        assert np.abs(velocity - press.velocity).max() < 1e-4 * np.abs(press.velocity).max()
        assert np.abs(acceleration - press.acceleration).max() < 1e-3 * np.abs(press.acceleration).max()
    assert count >= 16


NEIGHBOURS = [PRESS, PRESS._replace(slider=1), Topology(1, -1, -1, "centroid", 1), PRESS._replace(crank=-1)]


def test_the_shipped_geometry_is_within_the_uncertainty_of_the_best_fit_and_others_are_far_behind():
    # Of 300 random geometries the best five are fitted; the study draws 1000, for all arrangements.
    fits = [fitting.fit(topology, fitting.printed_facts(), 300) for topology in NEIGHBOURS]
    best, *others = sorted((each for each in fits if each is not None), key=lambda each: each.misfit)
    assert best.topology == PRESS
    assert best.misfit < 1  # allowances: the misfit of a right model
    assert all(each.misfit > 1.5 for each in others)
    difference = np.subtract(fitting.shipped_geometry(), best.geometry)
    deviations = np.sqrt(np.diag(best.covariance))
    assert np.all(np.abs(difference) < deviations)
    # Three unknowns: 7.8 is passed by chance once in 20 times.
    assert difference @ np.linalg.pinv(best.covariance) @ difference < 7.8
    assert np.all(deviations < 1e-3)


def test_bounds_that_geometry_sets():
    """The slope of y in x, half-way to the far wall, times the way there; the pin's is a second program's."""
    middle = fitting.shipped_geometry()._replace(guide=fitting.shipped_geometry().guide - 1.25e-4)
    slope = fitting.motion(middle, PRESS, LENGTHS, ANGLE).tangent.max()
    assert numerics.bound("150rpm-0.2mm") == pytest.approx(2.5e-4 * slope, rel=1e-4)
    assert numerics.bound("crank-pin") == pytest.approx(5.668e-4, rel=1e-4)


def test_printed_errors_place_line_and_start():
    # tan β = 5.226e-5 / 2.497e-4: the highest y error is that at the left wall, the lowest that of the start.
    positions = fitting.implied_positions()
    assert positions["line by x"] == pytest.approx(5.005e-5, rel=1e-12)
    assert positions["line by y"] == pytest.approx(4.97e-5, rel=1e-3)
    assert positions["start"] == pytest.approx(50.05e-6 + 24.82e-6 / 0.2093, rel=1e-3)


def test_the_radius_at_which_peaks_that_follow_hertz_meet_the_print():
    scatter = np.array([0.5, 1.0, 2.0])
    peaks = pd.DataFrame((np.array(study.RADII)[:, None] / 2e-3) ** 0.2 * scatter, index=study.RADII)
    # Three scenes a factor of 2 apart: ln 2 / sqrt 3 / 0.2 = 2.0 in the logarithm of the radius.
    power, radius, factor = study.fit_radius(peaks)
    assert (power, radius, np.log(factor)) == pytest.approx((0.2, 2e-3, 2.0), rel=1e-3)
    assert np.isnan(study.fit_radius(1 / peaks)[1])
