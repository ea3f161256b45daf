"""A slider-crank with clearance in its guide, the y axis: numbers, start, and the reference's lists of it."""

import math

import numpy as np

from reference_model.multiplier import FRAME, assemble

CRANK, ROD, OMEGA, ANGLE, GRAVITY = 0.05, 0.3, 12.0, 0.3, 9.81
"""Lengths in m; rad/s, rad at t = 0; m/s^2."""
WIDTH, LENGTH, CLEARANCE = 0.05, 0.07, 2e-4
"""Of the slider, m."""
BODIES = [(0.1, 2e-5), (0.2, 1.5e-3), (0.3, 5e-5)]
"""Crank, rod, slider: mass, inertia; kg, kg m^2."""


def start():
    """Return x, y, angle of the three bodies at t = 0, and their rates; the slider is on its line."""
    x, y = CRANK * math.cos(ANGLE), CRANK * math.sin(ANGLE)
    vx, vy = -OMEGA * y, OMEGA * x
    rod = math.acos(-x / ROD)
    w = vx / (ROD * math.sin(rod))
    reach, rate = ROD * math.sin(rod), ROD * w * math.cos(rod)
    places = [(x / 2, y / 2, ANGLE), (x / 2, y + reach / 2, rod), (0.0, y + reach, 1e-4)]
    return places, [(vx / 2, vy / 2, OMEGA), (vx / 2, vy + rate / 2, w), (0.0, vy + rate, 0.1)]


def by_lists(law, baumgarte=(0.0, 0.0)):
    """Return the linkage from five lists, the law between its walls, and coordinates and rates at t = 0."""
    model = assemble(
        bodies=BODIES,
        pins=[(0, (-CRANK / 2, 0.0), FRAME, (0.0, 0.0)), (1, (-ROD / 2, 0.0), 0, (CRANK / 2, 0.0)),
              (2, (0.0, 0.0), 1, (ROD / 2, 0.0))],
        guides=[],
        drive=(0, OMEGA, ANGLE),
        slider=(2, True),
        gravity=GRAVITY,
        baumgarte=baumgarte,
    )  # fmt: skip
    wall = WIDTH / 2 + CLEARANCE
    between = law._replace(
        half_width=WIDTH / 2, half_length=LENGTH / 2, corner_mass=BODIES[2][1] / (LENGTH / 2) ** 2,
        wall_left=-wall, wall_right=wall,
    )  # fmt: skip
    return model, between, np.ravel(start())
