r"""Numerical uncertainty of a run as a function of time.

Three runs of one model give it: the run itself (S), one at a finer setting (S_f), and a twin whose start is
moved by a billionth of the clearance (S_t). With the window W(t) of one hundredth of a crank turn to either
side,

.. math:: u(t) = \max\bigl(F_s \max_{W(t)} \max(|S - S_f|, |S - S_t|),\; u_0\bigr),

F_s = 3 being the factor of safety for two levels of P. J. Roache (J. Fluids Eng. 116, 1994, 405-413), and
u_0 the channel's round-off. The window, and not a running maximum, because neighbouring runs that have
spread come together again in sustained contact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from comparison.scene import Scene

Array = NDArray[np.float64]

SAFETY_FACTOR = 3.0
WINDOW = 0.01  # of a crank turn, to either side
TWIN_SHIFT = 1e-9  # of the clearance, across the guide; of clearance / slider length in the angle
ROUND_OFF = 4 * float(np.finfo(np.float64).eps)  # of the largest value: storing it and a few operations
# Of the run's duration: N additions of a step may add up to N eps / 2, i.e. 4e-11 for the 4e5 steps of two
# cycles at 1e-6 s; measured there (slider_y of the ideal mechanism, known in closed form) is 4e-12.
TIME_ROUND_OFF = 1e-11


def twin(scene: Scene) -> Scene | None:
    """Return the scene with its start moved by 1e-9 of the clearance; None where there is no clearance."""
    if scene.data["joints"]["slider"] != "clearance":
        return None
    clearance = scene.data["clearance"]["slider"]
    start = scene.data["initial"]
    return scene.with_values(
        {
            "initial.slider_offset": start["slider_offset"] + TWIN_SHIFT * clearance,
            "initial.slider_angle": start["slider_angle"]
            + TWIN_SHIFT * clearance / scene.data["mechanism"]["slider"]["length"],
        }
    )


def window_samples(period: float, interval: float) -> int:
    """Half-width of the window in samples, rounded up, at least one.

    Parameters
    ----------
    period
        Of a crank turn, s.
    interval
        Between samples, s.
    """
    # The subtracted share keeps 1 % of 0.4 s at 0.4 ms at ten samples, whichever way the quotient rounds.
    return max(1, int(np.ceil(WINDOW * period / interval - 1e-6)))


def round_off(values: Array, time: Array, absolute: float) -> float:
    """Return what double precision leaves open in one sample, in the channel's unit.

    The largest of three: the channel's absolute number, some epsilon of its largest value, and the change
    within the error of time itself, which a solver with fixed steps sums up from thousands of them.

    Parameters
    ----------
    values, time
        The channel and its times (s), shape (n,).
    absolute
        ``round_off`` of ``channels.toml``.
    """
    rate = float(np.abs(np.diff(values) / np.diff(time)).max())
    clock = TIME_ROUND_OFF * float(time[-1] - time[0])
    largest = float(np.abs(values).max())
    return max(absolute, ROUND_OFF * largest, clock * rate)


def uncertainty(base: Array, finer: Array, twin: Array | None, half_width: int, floor: float) -> Array:
    """Evaluate u(t) for one channel, in its unit.

    Parameters
    ----------
    base, finer, twin
        The channel in the three runs at the same times, shape (n,); twin None: the start cannot be moved.
    half_width
        Of the window, samples.
    floor
        What u never falls below: see `round_off`.

    Returns
    -------
    ndarray
        Shape (n,), positive.
    """
    spread = np.abs(base - finer)
    if twin is not None:
        np.maximum(spread, np.abs(base - twin), out=spread)
    spread = maximum_filter1d(spread, 2 * half_width + 1, mode="nearest")
    return np.maximum(SAFETY_FACTOR * spread, floor)


def combined(u_a: Array, u_b: Array) -> Array:
    """Return the uncertainty of a difference of independent results, sqrt(u_a^2 + u_b^2); shape (n,)."""
    return np.hypot(u_a, u_b)
