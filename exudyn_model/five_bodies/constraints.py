"""How far the constraints are violated: what a solver's tolerance and its steps leave of Eq. 16."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, CRANK, FRAME, PER_BODY, SLIDER, SLIDER_ANGLE, SLIDER_X, Pin, X, pins
from exudyn_model.parameters import Parameters

CONSTRAINTS = ("position", "velocity")

# m, and its rate, m/s
_PointAndRate = tuple[NDArray[np.float64], NDArray[np.float64]]


class Constraints:
    """The joints, the drive and an ideal slider's line of one scene.

    Parameters
    ----------
    parameters : Parameters
        A crank pin with clearance is none of them.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._mechanism, self._drive = parameters.mechanism, parameters.drive
        self._pins = joints(parameters)

    def violation(self, time: float, q: NDArray[np.float64], v: NDArray[np.float64]) -> tuple[float, float]:
        """Return the largest violation, m and rad alike, and that of a rate, m/s and rad/s alike.

        Parameters
        ----------
        time : float
            s.
        q, v : ndarray, shape (15,)
            Coordinates of the five bodies, the slider's x from the guide's centre line, and their rates.
        """
        places = q.reshape(-1, PER_BODY).copy()
        places[SLIDER, X] += self._mechanism.guide_x
        rates = v.reshape(-1, PER_BODY)
        gaps, speeds = [], []
        for pin in self._pins:
            first, first_rate = _point(places, rates, pin.first, pin.first_point)
            second, second_rate = _point(places, rates, pin.second, pin.second_point)
            gaps.append(np.abs(second - first).max())
            speeds.append(np.abs(second_rate - first_rate).max())
        gaps.append(abs(places[CRANK, ANGLE] - self._mechanism.crank_angle - self._drive.omega * time))
        speeds.append(abs(rates[CRANK, ANGLE] - self._drive.omega))
        if self._mechanism.ideal_slider:
            gaps += [abs(q[SLIDER_X] - self._mechanism.reference_offset), abs(q[SLIDER_ANGLE])]
            speeds += [abs(v[SLIDER_X]), abs(v[SLIDER_ANGLE])]
        return float(max(gaps)), float(max(speeds))


def joints(parameters: Parameters) -> list[Pin]:
    """Return the pins that are constraints: one with clearance is none."""
    return [pin for pin in pins(parameters.mechanism) if pin.name != "A" or parameters.journal is None]


def arm(angle: float, point: tuple[float, float]) -> tuple[float, float]:
    """Return a body's point from its centre in the fixed frame, m, for a body turned by an angle (rad)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]


def _point(
    places: NDArray[np.float64], rates: NDArray[np.float64], body: int, point: tuple[float, float]
) -> _PointAndRate:
    """Return place and velocity of a body's point."""
    if body == FRAME:
        return np.array(point), np.zeros(2)
    x, y, angle = places[body]
    vx, vy, omega = rates[body]
    along, across = arm(angle, point)
    return np.array([x + along, y + across]), np.array([vx - omega * across, vy + omega * along])
