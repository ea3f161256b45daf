"""How far the constraints are violated: what a solver's tolerance and its steps leave of Eq. 16."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import (
    ANGLE,
    COORDINATES,
    CRANK,
    FRAME,
    PER_BODY,
    SLIDER,
    SLIDER_ANGLE,
    SLIDER_X,
    Pin,
    X,
    pins,
)
from exudyn_model.parameters import Parameters

CONSTRAINTS = ("position", "velocity")

_BODIES = COORDINATES // PER_BODY
_COSINE, _SINE, _TERMS = 2, 3, 4


class Constraints:
    """The joints, the drive and an ideal slider's line of one scene.

    Parameters
    ----------
    parameters : Parameters
        A crank pin with clearance is none of them.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._mechanism, self._drive = parameters.mechanism, parameters.drive
        self._rows, self._fixed = _distances(joints(parameters))

    def violation(
        self, times: NDArray[np.float64], q: NDArray[np.float64], v: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return at each time the largest violation (m and rad alike), and that of a rate (m/s and rad/s).

        For many states at once: of a single one it takes as long as Exudyn's step.

        Parameters
        ----------
        times : ndarray, shape (n,)
            s.
        q, v : ndarray, shape (n, 15)
            Coordinates of the five bodies, the slider's x from the guide's centre line, and their rates.

        Returns
        -------
        ndarray, shape (2, n)
            In the order of `CONSTRAINTS`.
        """
        mechanism, omega = self._mechanism, self._drive.omega
        shape = len(times), _BODIES
        coordinates, velocities = q.reshape(*shape, PER_BODY), v.reshape(*shape, PER_BODY)
        angles, speeds = coordinates[..., ANGLE], velocities[..., ANGLE]
        cosines, sines = np.cos(angles), np.sin(angles)
        # x, y, cosine and sine of the angle of each body; their rates
        places, rates = np.empty((2, *shape, _TERMS))
        places[..., :ANGLE], rates[..., :ANGLE] = coordinates[..., :ANGLE], velocities[..., :ANGLE]
        places[:, SLIDER, X] += mechanism.guide_x
        places[..., _COSINE], places[..., _SINE] = cosines, sines
        rates[..., _COSINE], rates[..., _SINE] = -speeds * sines, speeds * cosines
        gaps = [
            *np.abs(self._rows @ places.reshape(len(times), -1).T - self._fixed[:, None]),
            np.abs(angles[:, CRANK] - mechanism.crank_angle - omega * times),
        ]
        opening = [
            *np.abs(self._rows @ rates.reshape(len(times), -1).T),
            np.abs(speeds[:, CRANK] - omega),
        ]
        if mechanism.ideal_slider:
            gaps += [np.abs(q[:, SLIDER_X] - mechanism.reference_offset), np.abs(q[:, SLIDER_ANGLE])]
            opening += [np.abs(v[:, SLIDER_X]), np.abs(v[:, SLIDER_ANGLE])]
        return np.array([np.max(gaps, axis=0), np.max(opening, axis=0)])


def joints(parameters: Parameters) -> list[Pin]:
    """Return the pins that are constraints: one with clearance is none."""
    return [pin for pin in pins(parameters.mechanism) if pin.name != "A" or parameters.journal is None]


def arm(angle: float, point: tuple[float, float]) -> tuple[float, float]:
    """Return a body's point from its centre in the fixed frame, m, for a body turned by an angle (rad)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]


def _distances(found: list[Pin]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matrix that makes the pins' distances of the bodies' terms, and what these have to be.

    A point is linear in x, y, cosine and sine of its body: two rows a pin, shape (2 n, 20) and (2 n,).
    """
    rows, fixed = np.zeros((len(found), 2, _BODIES, _TERMS)), np.zeros((len(found), 2))
    for number, pin in enumerate(found):
        for body, (along, across), sign in (
            (pin.first, pin.first_point, -1.0),
            (pin.second, pin.second_point, 1.0),
        ):
            if body == FRAME:
                fixed[number] = -sign * along, -sign * across
            else:
                rows[number, :, body] = sign * np.array(
                    [[1.0, 0.0, along, -across], [0.0, 1.0, across, along]]
                )
    return rows.reshape(2 * len(found), -1), fixed.ravel()
