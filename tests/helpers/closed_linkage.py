"""The ideal linkage in closed form, by complex numbers: circles that meet."""

import numpy as np


def crank_angle(scene, time):
    """Return the crank's angle (rad) at a time, s."""
    return np.radians(scene["mechanism"]["crank_angle_deg"] + 6.0 * scene["drive"]["speed_rpm"] * time)


def joints(scene, angle):
    """Return A, B, C and H (m) at the crank's angle (rad)."""
    m = scene["mechanism"]
    a, h = m["crank"]["length"] * np.exp(1j * angle), complex(*m["rocker_pivot"])
    r2, r3 = m["rod2"]["length"], m["rocker"]["centroid"]
    d = abs(h - a)
    along = (d**2 + r2**2 - r3**2) / (2 * d)
    b = a + (along + 1j * m["rocker_branch"] * np.sqrt(r2**2 - along**2)) * (h - a) / d
    return a, b, h + (b - h) * m["rocker"]["length"] / r3, h
