"""Where in a step of a tree a contact touches or leaves: located, so that a step ends there.

The gap is that of the interpolated state (``tree_motion``), not a polynomial of its own.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.point_contact import CONTACTS
from exudyn_model.tree_motion import can_touch, contact_motion, interpolate

_COUNT = len(CONTACTS)

# A gap (m) that counts as none: some roundings of the sums of lengths near 0.6 m that it comes from. The
# second corner of a side rests at 1e-11 m under the "strip" law, and far less where it bears little
GAP_TOLERANCE = 2e-15


@kernel
def gap_within(
    number: int, start: Any, end: Any, share: float, linkage: Any, law: Any, pin_law: Any
) -> tuple[float, float]:
    """Gap (m) of one of ``CONTACTS`` and its rate (m/s) at a share of the step."""
    return contact_motion(number, interpolate(start, end, share), linkage, law, pin_law)


@kernel
def crossing_within(
    number: int, start: Any, end: Any, low: float, high: float, linkage: Any, law: Any, pin_law: Any
) -> float:
    """Share of the step at which the gap is zero; its signs at ``low`` and ``high`` must differ.

    Newton's method, safeguarded by bisection.
    """
    step = end.time - start.time
    open_at_low = gap_within(number, start, end, low, linkage, law, pin_law)[0] > 0.0
    share = 0.5 * (low + high)
    for _ in range(100):
        gap, rate = gap_within(number, start, end, share, linkage, law, pin_law)
        if (gap > 0.0) == open_at_low:
            low = share
        else:
            high = share
        change = -gap / (step * rate) if rate != 0.0 else 2.0
        if not low < share + change < high:
            change = 0.5 * (low + high) - share
        share += change
        if abs(change) < 1e-14 or abs(gap) < 1e-16:
            break
    return share


@kernel
def touch_within(
    number: int, contact: Any, start: Any, end: Any, linkage: Any, law: Any, pin_law: Any
) -> float:
    """Share of the step at which an open contact touches, 2 if it does not.

    Also where it comes and goes inside the step: then the gap has a minimum between.
    """
    gap, rate = gap_within(number, start, end, 1.0, linkage, law, pin_law)
    high = 1.0
    if gap >= -GAP_TOLERANCE:
        if not contact.rate < 0.0 < rate:
            return 2.0
        low = 0.0
        for _ in range(50):
            middle = 0.5 * (low + high)
            if gap_within(number, start, end, middle, linkage, law, pin_law)[1] < 0.0:
                low = middle
            else:
                high = middle
        if gap_within(number, start, end, high, linkage, law, pin_law)[0] >= -GAP_TOLERANCE:
            return 2.0
    if contact.gap <= GAP_TOLERANCE:
        return 0.0  # at the wall already
    return crossing_within(number, start, end, 0.0, high, linkage, law, pin_law)


@kernel
def locate(
    start: Any,
    end: Any,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
    least: float,
) -> float:
    """Share of the step up to the first contact that touches or leaves; 1 if the step can be accepted.

    A contact that touches sooner than ``least`` (s) after the start touches *at* the start: its impact speed
    is frozen here, and the step is to be tried again with it. Leaving, its force is 0 already but has a kink,
    across which no interpolation is accurate.
    """
    first, step = 2.0, end.time - start.time
    laws = linkage[0], law[0], pin_law[0]
    for number in range(_COUNT):
        contact = contacts[number]
        if not can_touch(number, linkage[0]):
            continue
        if contact.impact_speed > 0.0:
            gap = gap_within(number, start, end, 1.0, *laws)[0]
            if contact.gap < -GAP_TOLERANCE and gap > GAP_TOLERANCE:
                share = crossing_within(number, start, end, 0.0, 1.0, *laws)
                if share * step >= least:
                    first = min(first, share)
        else:
            share = touch_within(number, contact, start, end, *laws)
            if share * step < least:
                # Exudyn calls back before it judges a step's error: the end of one far too long may be any,
                # and only the start says what is at the wall
                if contact.gap <= GAP_TOLERANCE - 2.0 * least * contact.rate:
                    freeze(contact, start.time, law[0])
                first = min(first, 0.5)
            else:
                first = min(first, share)
    return min(first, 1.0)


@kernel
def freeze(contact: Any, time: float, law: Any) -> None:
    """Begin a contact: its impact speed is that of now, floored; both laws have the same floor."""
    contact.impact_speed = max(-contact.rate, law.impact_speed_floor)
    contact.start = time
    contact.impulse, contact.peak, contact.depth = 0.0, 0.0, 0.0
