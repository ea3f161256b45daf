"""Memory of the contacts: what the damping of Eq. 11 refers to, and what the table of contacts says.

One row a contact: of the four corners of a slider, in the order of ``corners.CORNERS``, and of a journal. It
is updated with accepted states alone: nothing that a trial state of an iteration or of a rejected step does
is ever kept. Where a law has the side remember (``laws.REMEMBERED_BY_SIDE``), the touch stands in the row of
its lower corner, whatever corner it is named after.
"""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    ACROSS_X,
    ACROSS_Y,
    BEARING_RADIUS,
    CLEARANCE,
    DAMPING,
    DAMPING_DEPTH,
    DIRECTION,
    EXPONENT,
    FRICTION_COEFFICIENT,
    HALF_LENGTH,
    HALF_WIDTH,
    IMPACT_SPEED,
    LAW,
    LAW_COLUMNS,
    MASS,
    MEMORY_COLUMNS,
    NAME,
    SHARED,
    SIDE_STIFFNESS,
    SPEED_FLOOR,
    STATIC_SPEED,
    STIFFNESS,
    TRANSITION_SPEED,
)
from exudyn_model.corners import UPPER
from exudyn_model.laws import LAWS, REMEMBERED_BY_SIDE, CornerMotion, foundation_normals
from exudyn_model.parameters import Contact

ROUNDED = 2e-15
"""A gap (m) that counts as none: some roundings of the sums of lengths near 0.6 m that it comes from."""
ROUNDED_SPEED = 4e-15
"""A speed (m/s) that counts as none at t = 0: some roundings of rates of some m/s."""


def law_array(
    contact: Contact,
    mass: float,
    half_width: float = 0.0,
    half_length: float = 0.0,
    direction: float = 0.0,
) -> NDArray[np.float64]:
    """Collect the constants of a contact law for the kernels: see ``columns``.

    Parameters
    ----------
    contact : Contact
    mass : float
        Of the body that the contact carries, kg.
    half_width, half_length : float
        Of a slider, m.
    direction : float
        Of the axis across its guide, rad.
    """
    law = np.zeros(LAW_COLUMNS)
    law[LAW], law[SHARED] = LAWS.index(contact.law), contact.law in REMEMBERED_BY_SIDE
    law[STIFFNESS], law[EXPONENT], law[DAMPING] = contact.stiffness, contact.exponent, contact.damping
    law[DAMPING_DEPTH] = contact.damping_depth
    law[SPEED_FLOOR], law[SIDE_STIFFNESS] = contact.impact_speed_floor, contact.side_stiffness
    law[FRICTION_COEFFICIENT] = contact.friction
    law[STATIC_SPEED], law[TRANSITION_SPEED] = contact.static_speed, contact.transition_speed
    law[CLEARANCE], law[MASS] = contact.clearance, mass
    law[HALF_WIDTH], law[HALF_LENGTH], law[DIRECTION] = half_width, half_length, direction
    # Exact in the press, whose guide is vertical: its gaps keep all digits
    law[ACROSS_X], law[ACROSS_Y] = (1.0, 0.0) if direction == 0.0 else (np.cos(direction), np.sin(direction))
    law[BEARING_RADIUS] = contact.journal_radius + contact.clearance
    return law


def new_contacts(rows: int) -> NDArray[np.float64]:
    """Return the memory of so many contacts before the first state, shape (rows, columns)."""
    return np.zeros((rows, MEMORY_COLUMNS))


def start_side(
    side: int,
    lower: CornerMotion,
    upper: CornerMotion,
    contacts: NDArray[np.float64],
    law: NDArray[np.float64],
) -> None:
    """Begin at t = 0 the contacts of a side with a corner inside its wall, or on it and moving in.

    One contact of a side that remembers has the speed of its resultant; of a side on its wall, where
    rounding would decide where that is, the faster corner's. It is named after the deeper or faster one.

    Parameters
    ----------
    side : int
        Row of its lower corner.
    lower, upper : CornerMotion
    contacts : ndarray, shape (n, columns)
        Changed in place.
    law : ndarray
    """
    touching = [
        row
        for row, corner in ((side, lower), (side + UPPER, upper))
        if corner.gap < -ROUNDED or (corner.gap <= ROUNDED and corner.rate < -ROUNDED_SPEED)
    ]
    if law[SHARED] == 0.0:
        for row in touching:
            rate = lower.rate if row == side else upper.rate
            contacts[row, [IMPACT_SPEED, NAME]] = max(-rate, law[SPEED_FLOOR]), row
    elif touching:
        rate, upper_leads = min(lower.rate, upper.rate), upper.rate < lower.rate
        if min(lower.gap, upper.gap) < -ROUNDED:
            # Not compiled for a single call
            normals = cast(Any, foundation_normals).py_func
            f1, f2 = normals(-lower.gap, -upper.gap, law[SIDE_STIFFNESS])
            rate = (f1 * lower.rate + f2 * upper.rate) / (f1 + f2)
            upper_leads = upper.gap < lower.gap
        name = side + UPPER if upper_leads else side
        contacts[side, [IMPACT_SPEED, NAME]] = max(-rate, law[SPEED_FLOOR]), name
