"""Where in a step of a tree a contact begins or ends: located, so that the step ends there."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact.foundation import in_contact
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.journal import pin_motion
from exudyn_model.contact.states import CORNERS, PIN
from exudyn_model.tree.isolation import GAP_TOLERANCE, NEVER, change_within
from exudyn_model.tree.motion import crank_and_rod2_at, interpolate, slider_motion
from exudyn_model.tree.step_bounds import (
    corner_acceleration_bounds,
    pin_acceleration_bounds,
    rotation_bounds,
    slider_acceleration_bounds,
)

_CORNERS = len(CORNERS)


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
    """Return the fraction of the step up to the first contact that begins or ends; 1: it can be accepted.

    Of the law "foundation" also up to where a corner goes into its wall, or out of it, while the other one of
    its side is inside.

    A contact that touches sooner than ``least`` (s) after the start touches *at* the start: its impact speed
    is frozen here, and the step is to be tried again with it. At separation the force is 0 already but has a
    kink, across which no interpolation is accurate.
    """
    constants, step = linkage[0], end.time - start.time
    laws = constants, law[0], pin_law[0]
    state = interpolate(start, end, 1.0, constants)
    rotation3 = rotation_bounds(start.theta3, start.w3, start.a3, end.theta3, end.w3, end.a3, step)
    first = 1.0
    if not constants.ideal_slider:
        rotation4 = rotation_bounds(start.theta4, start.w4, start.a4, end.theta4, end.w4, end.a4, step)
        rotation5 = rotation_bounds(start.theta5, start.w5, start.a5, end.theta5, end.w5, end.a5, step)
        x_least, x_greatest = slider_acceleration_bounds(step, state, rotation3, rotation4, constants)
        x, _, vx, vy = slider_motion(state, constants)
        for number in range(_CORNERS):
            gap = corner_motion(number, x, state.theta5, vx, vy, state.w5, law[0]).gap
            bounds = corner_acceleration_bounds(number, x_least, x_greatest, state.theta5, rotation5, law[0])
            fraction = change_within(number, contacts[number], gap, *bounds, start, end, *laws)
            accepted = accepted_fraction(number, contacts, gap, fraction, start, step, least, law[0])
            first = min(first, accepted)
    if not constants.ideal_pin:
        rotation2 = rotation_bounds(start.theta2, start.w2, start.a2, end.theta2, end.w2, end.a2, step)
        journal = pin_motion(crank_and_rod2_at(state, constants, pin_law[0]), pin_law[0])
        bounds = pin_acceleration_bounds(journal, step, rotation2, rotation3, state.w2, constants, pin_law[0])
        fraction = change_within(PIN, contacts[PIN], journal.gap, *bounds, start, end, *laws)
        accepted = accepted_fraction(PIN, contacts, journal.gap, fraction, start, step, least, pin_law[0])
        first = min(first, accepted)
    return first


@kernel
def accepted_fraction(
    number: int,
    contacts: NDArray[np.void],
    gap: float,
    fraction: float,
    start: Any,
    step: float,
    least: float,
    law: Any,
) -> float:
    """Return the fraction of the step up to which one contact lets it be accepted: see :func:`locate`.

    ``fraction`` is from :func:`change_within`, ``gap`` (m) that at the step's end.
    """
    contact = contacts[number]
    if np.isnan(fraction):
        return 0.5
    if fraction == NEVER or fraction * step >= least:
        return min(fraction, 1.0)
    if contact.closed > 0.0:
        # It separates at once. What comes back is another contact: the step must end before
        return 1.0 if gap > GAP_TOLERANCE else 0.5
    # Exudyn calls back before it judges a step's error: the end of one far too long is arbitrary, and only
    # the start shows what is at the wall
    if contact.gap <= GAP_TOLERANCE - 2.0 * least * contact.rate:
        close(number, contacts, start.time, law)
    return 0.5


@kernel
def close(number: int, contacts: NDArray[np.void], time: float, law: Any) -> None:
    """Close one of ``CONTACTS`` at its wall; begin its contact, if it is not yet that of its side.

    The present speed, floored, is frozen as impact speed; both laws have the same floor.
    """
    contact = contacts[number]
    contact.closed = 1.0
    if in_contact(number, contacts, law):
        return
    contact.impact_speed = max(-contact.rate, law.impact_speed_floor)
    contact.start = time
    contact.impulse, contact.peak, contact.depth = 0.0, 0.0, 0.0
