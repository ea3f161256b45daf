"""Samples inside a step of five bodies: dense ones are closer than the ends of a step in flight."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import ACCELERATIONS, GAP, PER_CONTACT, SLIDER_ANGLE, SLIDER_X, STATE
from exudyn_model.compiled import kernel
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.states import CORNERS
from exudyn_model.tables import update_extrema

# The slider's coordinates and velocities among the channels; from each to its rate
_MOTION, _TO_RATE, _CORNERS = len(STATE), len(ACCELERATIONS), len(CORNERS)


@kernel
def interpolate(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    start: float,
    step: float,
    times: NDArray[np.float64],
    guide_x: float,
    law: Any,
    extrema: NDArray[np.void],
    samples: NDArray[np.float64],
) -> None:
    """Fill the channels at times inside a step.

    Coordinates and velocities by cubic Hermite polynomials of the states and their rates, whose error is of
    fourth order in the step; gaps from these coordinates; all others linearly, with an error of second order,
    as that of the method.

    Parameters
    ----------
    before, after : ndarray, shape (channels,)
        All channels at both ends of the step.
    start, step : float
        Its beginning and length, s.
    times : ndarray, shape (n,)
        s.
    guide_x : float
        The guide's centre line, m.
    law : record
        Of the guide: see ``contact.gaps``.
    extrema : ndarray, shape (channels,)
        Updated.
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
        x, angle = values[SLIDER_X] - guide_x, values[SLIDER_ANGLE]
        for number in range(_CORNERS):
            values[GAP + PER_CONTACT * number] = corner_motion(number, x, angle, 0.0, 0.0, 0.0, law).gap
        update_extrema(extrema, values, times[row])
