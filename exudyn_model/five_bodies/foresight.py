"""What the contacts allow the next step: zeros of gaps foreseen, oscillations of forces resolved.

- Each zero of a gap is foreseen from gap, rate and acceleration, and so are the kinks of friction (Eq. 13):
  no step covers more than half of the time to it.
- Inside a contact, steps are one tick as long as the normal force oscillates about its mean by all of it, as
  in an impact, and grow as the oscillation decays: to ten ticks at a hundredth of the mean.
- What closed in a step nevertheless is found by the gaps' cubic Hermite interpolants, in flight exact to
  1e-15 m.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, SLIDER_X, X, Y
from exudyn_model.compiled import kernel
from exudyn_model.constants import Constants
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.impact_speed import crossing, turning_point
from exudyn_model.contact.journal import crank_and_rod2, pin_motion
from exudyn_model.contact.laws import FOUNDATION
from exudyn_model.contact.states import CONTACTS, PIN

# Part of the time to a foreseen zero that a step may cover
PART = 0.5
# Growth from one step to the next
_GROWTH = 2
# The oscillation of a normal force, relative to its mean, at which steps in a contact begin to grow
RIPPLE = 1.0
# Decay of the observed second derivative of a normal force, over the phase of its oscillation (rad): that
# passes through zero twice a period
_DECAY = 0.25
_NEVER = 2.0
_COUNT = len(CONTACTS)

BEFORE = np.dtype(
    [
        (name, np.float64)
        for name in ("rate", "slip", "normal", "normal_rate", "change", "normal_change", "step")
    ]
)


@kernel
def time_to_zero(distance: float, rate: float, acceleration: float) -> float:
    """Return when (s) a positive distance vanishes, at the latest acceleration if that is towards zero."""
    towards = min(acceleration, 0.0)
    root: float = np.sqrt(rate * rate - 2.0 * towards * distance)
    if rate < 0.0:
        return 2.0 * distance / (root - rate)
    return -(root + rate) / towards if towards < 0.0 else np.inf


@kernel
def time_to_kink(slip: float, slip_rate: float, law: Any) -> float:
    """Return when (s) the slip reaches a speed at which the friction of Eq. 13 has a kink."""
    speed = abs(slip)
    change = slip_rate if slip >= 0.0 else -slip_rate
    found = np.inf
    for kink in (law.static_speed, law.transition_speed):
        if (kink - speed) * change > 0.0:
            found = min(found, (kink - speed) / change)
    if change < 0.0:
        found = min(found, -speed / change)
    return found


@kernel
def resolved_ticks(contact: Any, before: Any, law: Any, ripple: float) -> float:
    """Return the ticks that resolve the oscillation of a closed contact's normal force.

    An oscillation by ``ripple`` times N has N'' = ripple omega^2 N, with the frequency omega of the mass on
    the contact; the error of a step is that of N'' times the square of its length.
    """
    depth, normal = -contact.gap, contact.normal
    if normal <= 0.0:
        return 1.0
    # On an elastic foundation that of a whole side inside: the stiffest
    squared_frequency = (
        law.side_stiffness / law.mass
        if law.kind == FOUNDATION
        else law.exponent * normal / (depth * law.mass)
    )
    decay = np.exp(-_DECAY * np.sqrt(squared_frequency) * before.step)
    before.normal_change = max(before.change, decay * before.normal_change)
    if not before.normal_change > 0.0:
        return np.inf
    ticks: float = np.sqrt(ripple * squared_frequency * normal / before.normal_change)
    return ticks


@kernel
def follow(contact: Any, before: Any, step: float) -> tuple[float, float]:
    """Follow a contact over a step (s); return the accelerations of gap and slip in it (m/s^2)."""
    acceleration = (contact.rate - before.rate) / step
    slip_rate = (contact.slip - before.slip) / step
    normal_rate = (contact.normal - before.normal) / step
    if before.step > 0.0:
        before.change = 2.0 * abs(normal_rate - before.normal_rate) / (step + before.step)
    before.rate, before.slip, before.normal = contact.rate, contact.slip, contact.normal
    before.normal_rate, before.step = normal_rate, step
    return acceleration, slip_rate


@kernel
def foreseen_ticks(
    ticks: float,
    tick: float,
    longest: int,
    ripple: float,
    constants: Constants,
    contacts: NDArray[np.void],
    before: NDArray[np.void],
) -> int:
    """Return the length of the next step, in ticks, from the contacts in the accepted state.

    Parameters
    ----------
    ticks : float
        Of the last step; 0 before the first one.
    tick : float
        s.
    constants : Constants
    contacts : ndarray, shape (5,)
        See ``contact.states``.
    before : ndarray, shape (5,)
        From :class:`StepChoice`; changed in place.
    """
    linkage = constants.linkage[0]
    law = constants.law[0]
    allowed, span = min(_GROWTH * ticks, float(longest)), np.inf
    for number in range(_COUNT):
        if linkage.ideal_pin if number == PIN else linkage.ideal_slider:
            continue
        contact, last = contacts[number], before[number]
        if ticks == 0.0:
            last.rate, last.slip, last.normal = contact.rate, contact.slip, contact.normal
            continue
        acceleration, slip_rate = follow(contact, last, ticks * tick)
        closed = contact.closed > 0.0
        sign = -1.0 if closed else 1.0
        if not closed:
            last.normal_change = 0.0
        span = min(span, time_to_zero(abs(contact.gap), sign * contact.rate, sign * acceleration))
        if closed:
            if number == PIN:
                # Its friction reverses within a step: see `contact.journal`
                allowed = 1.0
            else:
                allowed = min(allowed, resolved_ticks(contact, last, law, ripple))
                span = min(span, time_to_kink(contact.slip, slip_rate, law))
    return max(int(min(allowed, PART * span / tick)), 1)


@kernel
def zero_within(distance0: float, rate0: float, distance1: float, rate1: float, step: float) -> float:
    """Return the fraction of a step at which a positive distance first vanishes, or ``_NEVER``.

    Of its cubic Hermite interpolant.
    """
    if distance1 <= 0.0:
        return crossing(distance0, rate0, distance1, rate1, step) if distance0 > 0.0 else 0.0
    if rate0 >= 0.0 or rate1 <= 0.0:
        return _NEVER
    fraction, least = turning_point(distance0, rate0, distance1, rate1, step)
    return fraction if least <= 0.0 else _NEVER


@kernel
def first_change(
    step: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    constants: Constants,
    contacts: NDArray[np.void],
) -> float:
    """Return the fraction of a step after which a contact begins or ends, or more than 1 if none does.

    Parameters
    ----------
    step : float
        s.
    q, v : ndarray, shape (15,)
        Coordinates at the step's end and their rates, the slider's x from the guide's centre line.
    constants : Constants
    contacts : ndarray, shape (5,)
        At the step's start.
    """
    linkage, law, pin_law = constants.linkage[0], constants.law[0], constants.pin_law[0]
    slider, rates, first = q[SLIDER_X:], v[SLIDER_X:], _NEVER
    for number in range(_COUNT):
        contact = contacts[number]
        gap, rate = 0.0, 0.0
        if number == PIN:
            if linkage.ideal_pin:
                continue
            journal = pin_motion(crank_and_rod2(q, v), pin_law)
            gap, rate = journal.gap, journal.rate
        else:
            if linkage.ideal_slider:
                continue
            corner = corner_motion(number, slider[X], slider[ANGLE], rates[X], rates[Y], rates[ANGLE], law)
            gap, rate = corner.gap, corner.rate
        sign = -1.0 if contact.closed > 0.0 else 1.0
        first = min(
            first, zero_within(sign * contact.gap, sign * contact.rate, sign * gap, sign * rate, step)
        )
    return first
