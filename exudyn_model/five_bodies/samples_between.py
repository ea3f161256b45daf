"""Samples inside a step of five bodies: dense ones are closer than the ends of a step in flight."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import (
    ACCELERATIONS,
    FRICTION,
    GAP,
    NORMAL,
    PER_CONTACT,
    SLIDER_ALPHA,
    SLIDER_ANGLE,
    SLIDER_X,
    STATE,
)
from exudyn_model.compiled import kernel
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.states import ACROSS, CORNERS

# The slider's coordinates and velocities among the channels; from each to its rate
_MOTION, _TO_RATE, _CORNERS = len(STATE), len(ACCELERATIONS), len(CORNERS)


@kernel
def interpolate(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    start: float,
    step: float,
    times: NDArray[np.float64],
    linkage: Any,
    law: Any,
    samples: NDArray[np.float64],
) -> None:
    """Fill the channels at times inside a step.

    Coordinates and velocities by cubic Hermite polynomials of the states and their rates, whose error is of
    fourth order in the step; gaps from these coordinates; all others linearly, with an error of second order,
    as that of the method, but the slider's angular acceleration: that follows from the corners' forces.

    Parameters
    ----------
    before, after : ndarray, shape (channels,)
        All channels at both ends of the step.
    start, step : float
        Its beginning and length, s.
    times : ndarray, shape (n,)
        s.
    linkage : record
        See ``constants``.
    law : record
        Of the guide: see ``contact.gaps``.
    samples : ndarray, shape (n, channels)
        Filled.
    """
    for row in range(len(times)):
        s, values = (times[row] - start) / step, samples[row]
        r = 1.0 - s
        for channel in range(len(values)):
            values[channel] = r * before[channel] + s * after[channel]
        for channel in range(_MOTION):
            change = after[channel] - before[channel]
            leaves = step * before[channel + _TO_RATE] - change
            arrives = change - step * after[channel + _TO_RATE]
            values[channel] += s * r * (r * leaves + s * arrives)
        x, angle, moment = values[SLIDER_X] - linkage.guide_x, values[SLIDER_ANGLE], 0.0
        for number in range(_CORNERS):
            corner = corner_motion(number, x, angle, 0.0, 0.0, 0.0, law)
            values[GAP + PER_CONTACT * number] = corner.gap
            normal = values[NORMAL + PER_CONTACT * number]
            moment += corner.arm_y * ACROSS[number] * normal
            moment += corner.arm_x * values[FRICTION + PER_CONTACT * number]
        values[SLIDER_ALPHA] = moment / linkage.slider_inertia
