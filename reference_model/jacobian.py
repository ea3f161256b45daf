"""The derivative of the right-hand side with respect to the state, by differences."""

import numpy as np

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.forces import Array, no_contacts
from reference_model.formulations import coordinates, free, right_hand_side, state_size

_POSITION, _VELOCITY = 1e-9, 1e-6
"""Increments, m or rad and m/s or rad/s. Contacts are some um deep, so a thousandth of that leaves both the
curvature of the force and the round-off of the gap (1e-16 m) below 1e-3 of it: plenty for Newton's method."""


@kernel
def jacobian(c: Constants, t: float, y: Array, modes: Array) -> Array:
    """Return the derivative of dy/dt in frozen modes, shape (state_size, state_size).

    The columns of the integrals behind the coordinates are zero: nothing depends on them.
    """
    size = state_size(c)
    moved, rate, reference = y.copy(), np.empty(size), np.empty(size)
    contacts, out = no_contacts(), np.zeros((size, size))
    right_hand_side(c, t, y, modes, reference, contacts)
    for j in range(free(c)):
        moved[j] = y[j] + (_POSITION if j < coordinates(c) else _VELOCITY)
        right_hand_side(c, t, moved, modes, rate, contacts)
        for i in range(size):
            out[i, j] = (rate[i] - reference[i]) / (moved[j] - y[j])
        moved[j] = y[j]
    return out
