"""What an animation shows, in the units of its drawing: shared by the page and by the film."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.report.pictures.motion import Motion
from comparison.tables.arrays import Array

GAP = 24.0
"""Units of the drawing that a clearance is wide."""
SLIDER = (80.0, 130.0)
"""Width and length of the enlarged slider; to scale it would be wider than the page."""
ARROW = 60.0
"""Length of the largest force."""


@dataclass(frozen=True)
class Box:
    """Limits of the press, m: left, bottom, width, height."""

    left: float
    bottom: float
    width: float
    height: float


def press_box(motion: Motion) -> Box:
    """Return what encloses the press at all frames, with a margin."""
    points = np.concatenate(list(motion.links.values()))
    half = 0.5 * np.array(motion.size)
    low, high = points.min(axis=0) - half, points.max(axis=0) + half
    margin = 0.04 * float((high - low).max())
    return Box(*(low - margin).tolist(), *(high - low + 2 * margin).tolist())


def corners(motion: Motion, label: str) -> Array:
    """Return the enlarged slider's corners ll, lr, ur, ul about the guide's centre, shape (n, 4, 2), y up.

    Displacements across the guide are magnified so that a clearance is `GAP` units; the slider is not.
    """
    x, angle = motion.sliders[label][:, 0], motion.sliders[label][:, 2]
    scale = GAP / motion.clearance if motion.clearance else 0.0
    half_width, half_length = SLIDER[0] / 2, SLIDER[1] / 2
    lean = 0.5 * motion.size[1] * np.sin(angle)  # a counter-clockwise slider leans to the left at its top
    below, above = scale * (x + lean), scale * (x - lean)
    return np.stack(
        [
            np.stack([across + side * half_width, np.full_like(across, height)], axis=1)
            for across, side, height in (
                (below, -1.0, -half_length),
                (below, 1.0, -half_length),
                (above, 1.0, half_length),
                (above, -1.0, half_length),
            )
        ],
        axis=1,
    )


def largest_force(motion: Motion) -> float:
    """Return the largest normal force of all corners, N; 0 if there is none."""
    return max(float(force.max()) for of in motion.forces.values() for force in of.values())
