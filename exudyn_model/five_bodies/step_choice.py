"""Length of each step of five bodies: short in a contact, long in flight, never across a touch.

Lengths are whole numbers of ticks. The tick is the scene's ``solver.exudyn.step``, made to divide the sample
interval: all lengths change with it in proportion, so that the order of convergence means something, and
samples fall on states; of dense ones those in contacts alone (``samples_between``).

An open contact has no force in a step longer than a tick, wherever a trial state lies. A step in which a
contact closed is taken back; that this is rare, and how long steps in contacts may be, ``foresight`` sees to.
Touches and separations therefore lie in steps of one tick, where ``contact.memory`` locates them.

Only where Newton's method fails in a tick is that divided, by halves, so that times remain exact: across a
kink of friction its iterates go round as long as friction can stop the slip several times over in the step.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import direct
from exudyn_model.constants import Constants
from exudyn_model.five_bodies.foresight import BEFORE, PART, RIPPLE, first_change, foreseen_ticks

# Ticks of the longest step: at 300 rpm its error in flight is a hundredth of that of contacts, at 50 ticks
# a twentieth
LONGEST = 32
# With constraints at velocity level, where joints drift by what steps in flight add up to
LONGEST_INDEX2 = 8
# Before the first contact there is no other error: with 32 ticks the smallest change of mass or gravity that
# a comparison detects is 18 times as large. First flights are short
LONGEST_BEFORE_CONTACT = 4


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
    per_state : int, optional
        Ticks between states that there have to be, a multiple of ``per_sample``, which is the default.

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
    """

    def __init__(
        self,
        constants: Constants,
        contacts: NDArray[np.void],
        size: float,
        per_sample: int,
        longest: int,
        per_state: int = 0,
    ) -> None:
        self.ticks, self.longest_taken = 0.0, 1.0
        self.time, self.at_sample, self.at_required_state = 0.0, True, True
        self.size, self.per_sample, self.longest = size, per_sample, longest
        self._tick, self._per_state = 0.0, per_state or per_sample
        self._constants, self._contacts = constants, contacts
        self._laws = constants.law[0], constants.pin_law[0]
        self._before = np.zeros(contacts.size, BEFORE)
        self._touched = False
        known = constants, contacts
        vector = np.zeros(1)
        if longest > 1:
            self._foresee = direct(foreseen_ticks, 0.0, size, longest, RIPPLE, *known, self._before)
            self._first_change = direct(first_change, size, vector, vector, *known)

    def samples_inside(self) -> Sequence[int]:
        """Return the ticks of the samples inside the step, without those at its ends."""
        if self.ticks <= 1.0 or self._per_state == self.per_sample:
            return ()  # a step of one tick has no inside, and none goes beyond the next required state
        first = int((self._tick - self.ticks) // self.per_sample) + 1
        return range(first * self.per_sample, math.ceil(self._tick), self.per_sample)

    def choose(self) -> None:
        """Choose the step after the one that has been accepted."""
        self.longest_taken = max(self.longest_taken, self.ticks)
        ticks = 1.0
        if self.longest > 1:
            known = self._constants, self._contacts, self._before
            self._touched = self._touched or bool(self._contacts["closed"].any())
            longest = self.longest if self._touched else min(self.longest, LONGEST_BEFORE_CONTACT)
            wanted = self._foresee(self.ticks, self.size, longest, RIPPLE, *known)
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
            for law in self._laws:
                law["step"], law["stays_open"] = ticks * self.size, float(ticks > 1)

    def first_change(self, q: NDArray[np.float64], v: NDArray[np.float64]) -> float:
        """Return :func:`first_change` for the step, from the coordinates at its end and their rates."""
        return self._first_change(self.ticks * self.size, q, v, self._constants, self._contacts)
