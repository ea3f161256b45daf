"""Length of each step of five bodies: short in a contact, long in flight, never across a touch.

Lengths are whole numbers of ticks. The tick is the scene's ``solver.exudyn.step``, made to divide the sample
interval: all lengths change with it in proportion, so that the order of convergence means something, and
samples fall on states.

- An open contact has no force in a step longer than a tick, wherever a trial state lies. After the step the
  gaps' cubic Hermite interpolants tell whether one closed in it; then the step is taken back. In flight these
  are exact to 1e-15 m.
- So that this is rare, each zero of a gap is foreseen from gap, rate and acceleration: no step covers more
  than half of the time to it. Touches and separations therefore lie in steps of one tick, where
  ``contact.memory`` locates them. The same holds for the kinks of friction (Eq. 13).
- Inside a contact, steps are one tick as long as the normal force oscillates about its mean by all of it, as
  in an impact, and grow as the oscillation decays: to ten ticks at a hundredth of the mean.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, SLIDER_X, X, Y
from exudyn_model.compiled import direct, kernel
from exudyn_model.constants import Constants
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.impact_speed import crossing, turning_point
from exudyn_model.contact.journal import crank_and_rod2, pin_motion
from exudyn_model.contact.states import CONTACTS, PIN

# Ticks of the longest step: at 300 rpm its error in flight is a hundredth of that of contacts, at 50 ticks
# a twentieth
LONGEST = 32
# With constraints at velocity level, where joints drift by what steps in flight add up to
LONGEST_INDEX2 = 8
# Part of the time to a foreseen zero that a step may cover
_PART = 0.5
# Growth from one step to the next
_GROWTH = 2
# The oscillation of a normal force, relative to its mean, at which steps in a contact begin to grow
_RIPPLE = 1.0
# Decay of the observed second derivative of a normal force, over the phase of its oscillation (rad): that
# passes through zero twice a period
_DECAY = 0.25
_NEVER = 2.0
_COUNT = len(CONTACTS)

_BEFORE = np.dtype(
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
    squared_frequency = law.exponent * normal / (depth * law.mass)
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
    ticks: int,
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
    ticks : int
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
    allowed, span = float(min(_GROWTH * ticks, longest)), np.inf
    for number in range(_COUNT):
        if linkage.ideal_pin if number == PIN else linkage.ideal_slider:
            continue
        contact, last = contacts[number], before[number]
        if ticks == 0:
            last.rate, last.slip, last.normal = contact.rate, contact.slip, contact.normal
            continue
        acceleration, slip_rate = follow(contact, last, ticks * tick)
        closed = contact.impact_speed > 0.0
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
    return max(int(min(allowed, _PART * span / tick)), 1)


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
        sign = -1.0 if contact.impact_speed > 0.0 else 1.0
        first = min(
            first, zero_within(sign * contact.gap, sign * contact.rate, sign * gap, sign * rate, step)
        )
    return first


class StepChoice:
    """Step from the state accepted last to the next one.

    Parameters
    ----------
    constants : Constants
        The lengths of the steps are entered here for the contacts.
    contacts : ndarray, shape (5,)
    size : float
        The tick, s.
    per_sample : int
        Ticks in a sample interval.
    longest : int
        Ticks of the longest step; 1: fixed steps.

    Attributes
    ----------
    ticks : int
        Of the step; 0 before the first one.
    longest_taken : int
        Ticks of the longest step so far.
    """

    def __init__(
        self, constants: Constants, contacts: NDArray[np.void], size: float, per_sample: int, longest: int
    ) -> None:
        self.ticks, self.longest_taken = 0, 1
        self.size, self.per_sample, self.longest = size, per_sample, longest
        self._tick = 0
        self._constants, self._contacts = constants, contacts
        self._laws = constants.law[0], constants.pin_law[0]
        self._before = np.zeros(_COUNT, _BEFORE)
        known = constants, contacts
        vector = np.zeros(1)
        if longest > 1:
            self._foresee = direct(foreseen_ticks, 0, size, longest, _RIPPLE, *known, self._before)
            self._first_change = direct(first_change, size, vector, vector, *known)

    @property
    def time(self) -> float:
        """Time of the step's end, s."""
        return self._tick * self.size

    @property
    def at_sample(self) -> bool:
        """Whether the step ends at a sample."""
        return self._tick % self.per_sample == 0

    def choose(self) -> None:
        """Choose the step after the one that has been accepted."""
        self.longest_taken = max(self.longest_taken, self.ticks)
        ticks = 1
        if self.longest > 1:
            known = self._constants, self._contacts, self._before
            wanted = self._foresee(self.ticks, self.size, self.longest, _RIPPLE, *known)
            # Equal parts up to the next sample
            left = self.per_sample - self._tick % self.per_sample
            ticks = -(-left // -(-left // wanted))
        self._take(ticks)

    def shorten(self, fraction: float) -> None:
        """Replace the step by one that covers less than ``fraction`` of it."""
        self._tick -= self.ticks
        self._take(max(1, int(_PART * fraction * self.ticks)))

    def _take(self, ticks: int) -> None:
        self._tick += ticks
        if ticks != self.ticks:
            self.ticks = ticks
            for law in self._laws:
                law["step"], law["stays_open"] = ticks * self.size, float(ticks > 1)

    def first_change(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> float:
        """Return :func:`first_change` for the step, from the coordinates at its end and their rates."""
        return self._first_change(self.ticks * self.size, q, v, self._constants, self._contacts)
