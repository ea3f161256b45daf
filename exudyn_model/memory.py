"""Memory of the contacts: impact speeds, for the damping of Eq. 11, and times, for the table of contacts.

There is one record for each corner of a slider, in the order of ``corners.CORNERS``, and for each journal.
Only accepted states update it, never trial states of an iteration or of a rejected step. Where a side has one
contact (``Law.shared``), it is in the record of the lower corner, whatever corner it is named after.
"""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.corners import UPPER
from exudyn_model.laws import CornerMotion, Law, foundation_normals


class Memory:
    """Memory of a contact: SI units, times in s from t = 0."""

    gap: float
    rate: float
    slip: float  # Where friction acts
    normal: float
    friction: float
    closed: float  # 1: inside the wall
    impact_speed: float  # 0: no contact is in progress
    start: float
    name: float  # Row after which the table of contacts names this one
    end: float  # Of the last contact; while its side is in contact, time at which this corner last came out
    # Energy of the contact, or of the side in the record of its lower corner; dissipated powers
    stored: float
    damping_power: float
    friction_power: float
    regime: float  # Of a journal's friction in an iteration: see `laws.slip_regime`


FIELDS = tuple(Memory.__annotations__)
MEMORY = np.dtype([(name, np.float64) for name in FIELDS])

ROUNDED = 2e-15
"""A gap (m) that counts as zero: some roundings of the sums of lengths near 0.6 m that it comes from."""
ROUNDED_SPEED = 4e-15
"""A speed (m/s) that counts as zero at t = 0: some roundings of rates of some m/s."""


def new_contacts(count: int) -> NDArray[Any]:
    """Return the memory of ``count`` contacts before the first state, shape (count,), of ``MEMORY``."""
    return np.zeros(count, MEMORY)


def start_side(side: int, lower: CornerMotion, upper: CornerMotion, contacts: NDArray[Any], law: Law) -> None:
    """Begin at t = 0 the contacts of a side with a corner inside its wall, or on it and moving in.

    The one contact of a side has the speed at its resultant, and the name of the deeper corner. On the wall,
    where rounding would decide both, it has speed and name of the faster corner.

    Parameters
    ----------
    side : int
        Row of its lower corner.
    lower, upper : CornerMotion
    contacts : ndarray, shape (n,), of ``MEMORY``
        Changed in place.
    law : Law
    """
    touching = [
        row
        for row, corner in ((side, lower), (side + UPPER, upper))
        if corner.gap < -ROUNDED or (corner.gap <= ROUNDED and corner.rate < -ROUNDED_SPEED)
    ]
    if not law.shared:
        for row in touching:
            rate = lower.rate if row == side else upper.rate
            contacts["impact_speed"][row], contacts["name"][row] = max(-rate, law.speed_floor), row
    elif touching:
        rate, upper_leads = min(lower.rate, upper.rate), upper.rate < lower.rate
        if min(lower.gap, upper.gap) < -ROUNDED:
            # Not compiled for a single call
            normals = cast(Any, foundation_normals).py_func
            f1, f2 = normals(-lower.gap, -upper.gap, law.side_stiffness)
            rate = (f1 * lower.rate + f2 * upper.rate) / (f1 + f2)
            upper_leads = upper.gap < lower.gap
        name = side + UPPER if upper_leads else side
        contacts["impact_speed"][side], contacts["name"][side] = max(-rate, law.speed_floor), name
