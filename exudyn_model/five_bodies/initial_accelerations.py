"""Initial accelerations that meet the constraints to rounding.

Exudyn differentiates the constraints' Jacobian along the velocities by a one-sided difference, which leaves
some 1e-9 of the accelerations and of the reactions. The trapezoidal rule does not damp such an error: it
alternates from step to step, as large after two cycles as at t = 0, and no shorter step shows it.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, COORDINATES, CRANK_ANGLE, FRAME, PER_BODY, SLIDER_ANGLE, SLIDER_X
from exudyn_model.energy import mass_diagonal
from exudyn_model.five_bodies.constraints import arm, joints
from exudyn_model.parameters import Parameters

_Array = NDArray[np.float64]


def correct(parameters: Parameters, q: _Array, v: _Array, accelerations: _Array, multipliers: _Array) -> None:
    """Correct accelerations and multipliers in place, so that the accelerations meet the constraints.

    The forces are not at issue: M da + G^T dl = 0 and G (a + da) = g, with the Jacobian G of the constraints.

    Parameters
    ----------
    parameters : Parameters
    q, v, accelerations : ndarray, shape (15,)
        Coordinates of the five bodies, their rates (m/s, rad/s) and accelerations (m/s^2, rad/s^2).
    multipliers : ndarray, shape (n,)
        Of joints, drive and an ideal slider's line, in Exudyn's order.
    """
    jacobian, wanted = _constraints(parameters, q, v)
    weighted = jacobian / mass_diagonal(parameters.mechanism)
    change = np.linalg.solve(weighted @ jacobian.T, jacobian @ accelerations - wanted)
    multipliers += change
    accelerations -= change @ weighted


def _constraints(parameters: Parameters, q: _Array, v: _Array) -> tuple[_Array, _Array]:
    """Return the constraints' Jacobian, shape (n, 15), and what it is to make of the accelerations, (n,)."""
    rows, wanted = [], []
    for pin in joints(parameters):
        joint, centripetal = np.zeros((2, COORDINATES)), np.zeros(2)
        for sign, body, point in ((-1.0, pin.first, pin.first_point), (1.0, pin.second, pin.second_point)):
            if body == FRAME:
                continue
            first = PER_BODY * body
            along, across = arm(q[first + ANGLE], point)
            joint[:, first : first + ANGLE] = sign * np.eye(2)
            joint[:, first + ANGLE] = sign * np.array([-across, along])
            centripetal += sign * v[first + ANGLE] ** 2 * np.array([along, across])
        rows += [*joint]
        wanted += [*centripetal]
    # Drive and line: angle and place of one body
    unit = np.eye(COORDINATES)
    single = [CRANK_ANGLE, *([SLIDER_X, SLIDER_ANGLE] if parameters.mechanism.ideal_slider else [])]
    return np.array([*rows, *unit[single]]), np.array([*wanted, *np.zeros(len(single))])
