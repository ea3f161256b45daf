"""Length of each step of five bodies: short in a contact, long in flight, never across a touch.

Lengths are whole numbers of ticks. The tick is the scene's ``solver.exudyn.step``, made to divide the sample
interval: all lengths change with it in proportion, so that the order of convergence means something, and
samples fall on states; dense samples do so only in contacts (``recording``).

- Each zero of a gap is foreseen from gap, rate and acceleration, and so are the kinks of friction (Eq. 13):
  no step covers more than half of the time to it.
- Inside a contact, steps are one tick as long as the normal force oscillates about its mean by all of it, as
  in an impact, and grow as the oscillation decays: to ten ticks at a hundredth of the mean.
- An open contact has no force in a step longer than a tick, wherever a trial state lies. A step in which a
  contact closed nevertheless is found by the gaps' cubic Hermite interpolants, in flight exact to 1e-15 m,
  and taken back. Touches and separations therefore lie in steps of one tick, where ``contact`` locates
  them.

Only where Newton's method fails in a tick is that divided, by halves, so that times remain exact: across a
kink of friction its iterates go round as long as friction can stop the slip several times over in the step.
"""

from exudyn_model.five_bodies.contact import FORESEEN_SHARE
from exudyn_model.five_bodies.settings import Settings
from exudyn_model.five_bodies.system import Model

# Ticks of the longest step. From 32 to 40 the error of x against the tree's over half a cycle changes by less
# than 1 % (150, 300 and 600 rpm): it is that of the contacts
LONGEST = 40
# With constraints at velocity level, where joints drift by the sum of steps in flight
LONGEST_INDEX2 = 8
# Before the first contact there is no other error: with 32 ticks the smallest change of mass or gravity that
# a comparison detects is 18 times as large. First flights are short
LONGEST_BEFORE_CONTACT = 4
# Growth from one step to the next
_GROWTH = 2.0


class StepChoice:
    """Choice of the step from the last accepted state to the next one.

    Parameters
    ----------
    model : Model
        Its ``step`` receives the length of each step, for the contacts.
    settings : Settings

    Attributes
    ----------
    ticks : float
        Length of the step, a whole number of ticks or a fraction of one; 0 before the first step.
    end_tick, time : float
        End of the step, in ticks and in s.
    tick_length : float
        s.
    longest_taken : float
        Length of the longest step so far, in ticks.
    """

    def __init__(self, model: Model, settings: Settings) -> None:
        self.ticks, self.end_tick, self.time, self.longest_taken = 0.0, 0.0, 0.0, 1.0
        self.tick_length, self._per_state = settings.tick, settings.per_state
        self._longest = 1 if settings.fixed else LONGEST_INDEX2 if settings.index2 else LONGEST
        self._step, self._contacts, self._touched = model.step, model.contacts, False

    @property
    def allowed(self) -> float:
        """Largest number of ticks of the next step before the contacts limit it."""
        if not self._touched:
            self._touched = bool(self._contacts["closed"].any())
        longest = self._longest if self._touched else min(self._longest, LONGEST_BEFORE_CONTACT)
        return min(_GROWTH * self.ticks, longest)

    def choose(self, wanted: float) -> None:
        """Choose the step after an accepted one: at most ``wanted`` ticks, at least one."""
        self.longest_taken = max(self.longest_taken, self.ticks)
        if self.end_tick % 1.0:
            self._take(min(2.0 * self.ticks, 1.0 - self.end_tick % 1.0))
        else:
            # Equal parts up to the next required state
            left = self._per_state - self.end_tick % self._per_state
            self._take(-(-left // -(-left // max(wanted // 1.0, 1.0))))

    def shorten(self, fraction: float) -> None:
        """Replace the step by one that covers less than ``fraction`` of it; one of a tick or less by half."""
        self.end_tick -= self.ticks
        covered = FORESEEN_SHARE * fraction * self.ticks // 1.0
        self._take(max(1.0, covered) if self.ticks > 1.0 else 0.5 * self.ticks)

    def _take(self, ticks: float) -> None:
        self.end_tick += ticks
        self.time = self.end_tick * self.tick_length
        if ticks != self.ticks:
            self.ticks = ticks
            self._step["length"] = ticks * self.tick_length
