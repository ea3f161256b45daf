"""Length of each step of five bodies: short in a contact, long in flight, never across a touch.

Lengths are whole numbers of ticks. The tick is the scene's ``solver.exudyn.step``, made to divide the sample
interval: all lengths change with it in proportion, so that the order of convergence means something, and
samples fall on states; of dense ones those in contacts alone (``recording``).

- Each zero of a gap is foreseen from gap, rate and acceleration, and so are the kinks of friction (Eq. 13):
  no step covers more than half of the time to it.
- Inside a contact, steps are one tick as long as the normal force oscillates about its mean by all of it, as
  in an impact, and grow as the oscillation decays: to ten ticks at a hundredth of the mean.
- An open contact has no force in a step longer than a tick, wherever a trial state lies. A step in which a
  contact closed nevertheless is found by the gaps' cubic Hermite interpolants, in flight exact to 1e-15 m,
  and taken back. Touches and separations therefore lie in steps of one tick, where ``observation`` locates
  them.

Only where Newton's method fails in a tick is that divided, by halves, so that times remain exact: across a
kink of friction its iterates go round as long as friction can stop the slip several times over in the step.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import (
    ACROSS_X,
    ACROSS_Y,
    CLOSED,
    DIRECTION,
    EXPONENT,
    GAP,
    LAW,
    MASS,
    NORMAL,
    RATE,
    SIDE_STIFFNESS,
    SLIP,
    STATIC_SPEED,
    TRANSITION_SPEED,
)
from exudyn_model.corners import CORNER_COUNT, corner_motion
from exudyn_model.five_bodies.contact_forces import (
    LENGTH,
    STAYS_OPEN,
    crossing,
    journal_in_bearing,
    triple,
)
from exudyn_model.five_bodies.system import ANGLE, PER_BODY, Constants, Model, X, Y
from exudyn_model.kernels import entry, kernel, machine_code
from exudyn_model.laws import FOUNDATION
from exudyn_model.tables import turning_point

Array = NDArray[np.float64]

# Ticks of the longest step: at 300 rpm its error in flight is a hundredth of that of contacts, at 50 ticks
# a twentieth
LONGEST = 32
# With constraints at velocity level, where joints drift by what steps in flight add up to
LONGEST_INDEX2 = 8
# Before the first contact there is no other error: with 32 ticks the smallest change of mass or gravity that
# a comparison detects is 18 times as large. First flights are short
LONGEST_BEFORE_CONTACT = 4

# Part of the time to a foreseen zero that a step may cover; growth from one step to the next
PART, _GROWTH = 0.5, 2.0
# The oscillation of a normal force, relative to its mean, at which steps in a contact begin to grow
RIPPLE = 1.0
# Decay of the observed second derivative of a normal force, over the phase of its oscillation (rad): that
# passes through zero twice a period
_DECAY = 0.25
_NEVER = 2.0

# Of each contact in the last state: rate of its gap, slip, normal force and its rate, second derivative of
# the normal force, its largest one (decaying), and the length of the step that led there
(_RATE, _SLIP, _NORMAL, _NORMAL_RATE, _CHANGE, _LARGEST_CHANGE, _STEP) = range(7)
BEFORE_COLUMNS = 7


@kernel
def time_to_zero(distance: float, rate: float, acceleration: float) -> float:
    """Return when (s) a positive distance vanishes, at the latest acceleration if that is towards zero."""
    towards = min(acceleration, 0.0)
    root: float = np.sqrt(rate * rate - 2.0 * towards * distance)
    if rate < 0.0:
        return 2.0 * distance / (root - rate)
    return -(root + rate) / towards if towards < 0.0 else np.inf


@kernel
def time_to_kink(slip: float, slip_rate: float, law: Array) -> float:
    """Return when (s) the slip reaches a speed at which the friction of Eq. 13 has a kink."""
    speed, change = abs(slip), slip_rate if slip >= 0.0 else -slip_rate
    found = np.inf
    for kink in (law[STATIC_SPEED], law[TRANSITION_SPEED]):
        if (kink - speed) * change > 0.0:
            found = min(found, (kink - speed) / change)
    return min(found, -speed / change) if change < 0.0 else found


@kernel
def resolved_ticks(contact: Array, last: Array, law: Array) -> float:
    """Return the ticks that resolve the oscillation of a closed contact's normal force.

    An oscillation by ``RIPPLE`` times N has N'' = ripple omega^2 N, with the frequency omega of the mass on
    the contact; the error of a step is that of N'' times the square of its length.
    """
    depth, normal = -contact[GAP], contact[NORMAL]
    if normal <= 0.0:
        return 1.0
    squared_frequency = law[EXPONENT] * normal / (depth * law[MASS])
    if law[LAW] == FOUNDATION:  # that of a whole side inside: the stiffest
        squared_frequency = law[SIDE_STIFFNESS] / law[MASS]
    decay = np.exp(-_DECAY * np.sqrt(squared_frequency) * last[_STEP])
    last[_LARGEST_CHANGE] = max(last[_CHANGE], decay * last[_LARGEST_CHANGE])
    if not last[_LARGEST_CHANGE] > 0.0:
        return np.inf
    ticks: float = np.sqrt(RIPPLE * squared_frequency * normal / last[_LARGEST_CHANGE])
    return ticks


@kernel
def foreseen_ticks(
    time: float, step: float, tick: float, longest: float, system: Constants, contacts: Array, before: Array
) -> int:
    """Return the length of the next step, in ticks, from the contacts in the accepted state.

    Parameters
    ----------
    time, step, tick : float
        Of the state; of the step that led there; shortest step, s.
    longest : float
        Ticks.
    system : Constants
    contacts : ndarray, shape (n, columns)
    before : ndarray, shape (n, 7)
        Changed in place.
    """
    allowed, span = min(_GROWTH * step / tick, longest), np.inf
    corners = CORNER_COUNT * len(system.sliders)
    for row in range(len(contacts)):
        contact, last = contacts[row], before[row]
        acceleration, slip_rate = 0.0, 0.0
        if time > 0.0:
            acceleration, slip_rate = (contact[RATE] - last[_RATE]) / step, (contact[SLIP] - last[_SLIP]) / step
            normal_rate = (contact[NORMAL] - last[_NORMAL]) / step
            if last[_STEP] > 0.0:
                last[_CHANGE] = 2.0 * abs(normal_rate - last[_NORMAL_RATE]) / (step + last[_STEP])
            last[_NORMAL_RATE], last[_STEP] = normal_rate, step
        last[_RATE], last[_SLIP], last[_NORMAL] = contact[RATE], contact[SLIP], contact[NORMAL]
        if time == 0.0:
            continue
        sign = 1.0
        if contact[CLOSED] == 0.0:
            last[_LARGEST_CHANGE] = 0.0
        else:
            sign = -1.0
            if row >= corners:
                allowed = 1.0  # a journal's friction reverses within a step: see `contact_forces`
            else:
                law = system.sliders[row // CORNER_COUNT]
                allowed = min(allowed, resolved_ticks(contact, last, law))
                span = min(span, time_to_kink(contact[SLIP], slip_rate, law))
        span = min(span, time_to_zero(abs(contact[GAP]), sign * contact[RATE], sign * acceleration))
    if time == 0.0:
        return 1
    return max(int(min(allowed, PART * span / tick) + 1e-9), 1)  # lengths are rounded


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


@entry
def first_change(q: Array, v: Array, step: Array, system: Constants, contacts: Array) -> float:
    """Return the fraction of a step after which a contact begins or ends, or more than 1 if none does.

    Parameters
    ----------
    q, v : ndarray, shape (3 n,)
        Coordinates at the step's end and their rates.
    step : ndarray, shape (2,)
    system : Constants
    contacts : ndarray, shape (n, columns)
        At the step's start.
    """
    first, corners = _NEVER, CORNER_COUNT * len(system.sliders)
    for row in range(len(contacts)):
        contact = contacts[row]
        if row >= corners:
            ends = system.journal_ends[row - corners]
            journal = journal_in_bearing(
                triple(q, ends[0]),
                triple(v, ends[0]),
                triple(q, ends[3]),
                triple(v, ends[3]),
                ends,
                system.journals[row - corners],
            )
            gap, rate = journal.gap, journal.rate
        else:
            number = row // CORNER_COUNT
            law, body = system.sliders[number], PER_BODY * int(system.slider_bodies[number])
            cx, cy = law[ACROSS_X], law[ACROSS_Y]
            corner = corner_motion(
                row % CORNER_COUNT,
                cx * q[body + X] + cy * q[body + Y],
                q[body + ANGLE] - law[DIRECTION],
                cx * v[body + X] + cy * v[body + Y],
                0.0,
                v[body + ANGLE],
                law,
            )
            gap, rate = corner.gap, corner.rate
        sign = -1.0 if contact[CLOSED] > 0.0 else 1.0
        zero = zero_within(sign * contact[GAP], sign * contact[RATE], sign * gap, sign * rate, step[LENGTH])
        first = min(first, zero)
    return first


class StepChoice:
    """Step from the state accepted last to the next one.

    Parameters
    ----------
    model : Model
        The length of each step is entered there for the contacts.
    size : float
        The tick, s.
    per_sample, per_state : int
        Ticks in a sample interval; between states that there have to be, a multiple of it.
    longest : int
        Ticks of the longest step; 1: fixed steps.

    Attributes
    ----------
    ticks : float
        Of the step, a whole number of them or a part of one; 0 before the first one.
    time : float
        Of the step's end, s.
    at_sample, at_required_state : bool
        Whether the step ends at a sample; where there has to be a state.
    longest_taken : float
        Ticks of the longest step so far.
    before : ndarray, shape (contacts, 7)
        What :func:`foreseen_ticks` keeps.
    """

    def __init__(self, model: Model, size: float, per_sample: int, per_state: int, longest: int) -> None:
        self.ticks, self.longest_taken = 0.0, 1.0
        self.time, self.at_sample, self.at_required_state = 0.0, True, True
        self.size, self.per_sample, self.longest = size, per_sample, longest
        self.before = np.zeros((len(model.contacts), BEFORE_COLUMNS))
        self._tick, self._per_state = 0.0, per_state
        self._step, self._contacts = model.step, model.contacts
        self._touched = False
        if longest > 1:
            self._known = model.step, model.constants, model.contacts
            self._first_change = machine_code(first_change, np.zeros(1), np.zeros(1), *self._known)

    @property
    def allowed(self) -> int:
        """Ticks that the next step may take at most."""
        self._touched = self._touched or bool(self._contacts[:, CLOSED].any())
        return self.longest if self._touched else min(self.longest, LONGEST_BEFORE_CONTACT)

    def samples_inside(self) -> Sequence[int]:
        """Return the ticks of the samples inside the step, without those at its ends."""
        if self.ticks <= 1.0 or self._per_state == self.per_sample:
            return ()  # a step of one tick has no inside, and none goes beyond the next required state
        first = int((self._tick - self.ticks) // self.per_sample) + 1
        return range(first * self.per_sample, math.ceil(self._tick), self.per_sample)

    def choose(self, wanted: int) -> None:
        """Choose the step after the one that has been accepted; ``wanted`` ticks at most."""
        self.longest_taken = max(self.longest_taken, self.ticks)
        if self._tick % 1.0:
            ticks = min(2.0 * self.ticks, 1.0 - self._tick % 1.0)
        else:
            # Equal parts up to the next state that there has to be
            left = self._per_state - self._tick % self._per_state
            ticks = -(-left // -(-left // wanted))
        self._take(ticks)

    def shorten(self, fraction: float) -> None:
        """Replace the step by one that covers less than ``fraction`` of it; one of a tick or less by half."""
        self._tick -= self.ticks
        if self.ticks > 1.0:
            self._take(max(1.0, PART * fraction * self.ticks // 1.0))
        else:
            self._take(0.5 * self.ticks)

    def _take(self, ticks: float) -> None:
        self._tick = tick = self._tick + ticks
        self.time = tick * self.size
        self.at_sample = tick % self.per_sample == 0
        self.at_required_state = tick % self._per_state == 0
        if ticks != self.ticks:
            self.ticks = ticks
            self._step[LENGTH], self._step[STAYS_OPEN] = ticks * self.size, float(ticks > 1)

    def first_change(self, q: Array, v: Array) -> float:
        """Return :func:`first_change` for the step, from the coordinates at its end and their rates."""
        return self._first_change(q, v, *self._known)
