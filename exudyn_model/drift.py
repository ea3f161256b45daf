"""How far the constraints are violated: what a solver's tolerance and its steps leave of Eq. 16."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.assembly import CRANK, FRAME, SLIDER, Pin, pins
from exudyn_model.parameters import Parameters


class Constraints:
    """The joints, the drive and an ideal slider's line of one scene.

    Parameters
    ----------
    parameters : Parameters
        With the crank pin loose, that pin is none of them.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._mechanism, self._drive = parameters.mechanism, parameters.drive
        self._pins = [pin for pin in pins(self._mechanism) if pin.name != "A" or parameters.journal is None]

    def violation(self, time: float, q: NDArray[np.float64]) -> float:
        """Return the largest violation, m and rad alike.

        Parameters
        ----------
        time : float
            s.
        q : ndarray, shape (15,)
            Coordinates of the five bodies, the slider's x from the guide's centre line.
        """
        places = q.reshape(5, 3) + np.array([[0.0] * 3] * SLIDER + [[self._mechanism.guide_x, 0.0, 0.0]])
        gaps = [_gap(pin, places) for pin in self._pins]
        gaps.append(abs(places[CRANK, 2] - self._mechanism.crank_angle - self._drive.omega * time))
        if self._mechanism.ideal_slider:
            gaps += [abs(q[3 * SLIDER] - self._mechanism.reference_offset), abs(q[3 * SLIDER + 2])]
        return float(max(gaps))


def _gap(pin: Pin, places: NDArray[np.float64]) -> float:
    first = _point(places, pin.first, pin.first_point)
    return float(np.abs(_point(places, pin.second, pin.second_point) - first).max())


def _point(places: NDArray[np.float64], body: int, point: tuple[float, float]) -> NDArray[np.float64]:
    if body == FRAME:
        return np.array(point)
    x, y, angle = places[body]
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([x + cosine * point[0] - sine * point[1], y + sine * point[0] + cosine * point[1]])
