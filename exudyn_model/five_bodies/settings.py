"""Tolerances and Exudyn's settings of five bodies, each with its reason, and the length of each step.

Steps are short in a contact, long in flight, and never across a touch.

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

import math
from dataclasses import dataclass
from typing import Any

from exudyn_model.five_bodies.contact import FORESEEN_SHARE
from exudyn_model.five_bodies.system import Model
from exudyn_model.laws import FOUNDATION, HERTZ, IMPACT, SWITCHING
from exudyn_model.parameters import Parameters
from exudyn_model.run import quiet_settings
from exudyn_model.workpiece import load_forces

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

SPECTRAL_RADIUS = 0.9
TICK_DIVISION = 4096
"""Ratio of a tick to the shortest step, to which halving leads where Newton's method fails: 128 is not
enough for a corner that starts 10 mm inside its wall."""
ROUND_OFF = 4e-15
"""Attainable residual over the load of the joints (`_joint_load`): they bear four times that, and each rounds
by some 1e-16 of it. At 150, 1000 and 3000 rpm 1e-15 is attained and 3e-16 is not."""
_LONG_INTERVAL = 4 * LONGEST
"""Ticks of a sample interval, four longest steps, from which on samples shorten no step by
much."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run of five bodies."""

    method: str  # "generalized-alpha" or "trapezoidal-index2"
    sample_interval: float  # s
    samples: int  # Number of samples besides the one at t = 0
    period: float  # Crank cycle, by which extrema are kept, s
    energy: bool  # The energies are recorded
    per_sample: int  # Ticks in a sample interval; a tick is the step in a contact
    per_state: int  # Ticks between required states
    fixed: bool  # All steps are one tick: nothing has clearance
    tolerance: float  # Absolute tolerance of the Newton iteration, in N and m alike (index 2: and m/s)
    jacobian_uses: int  # Iterations of a step with an old Jacobian, after which each computes a new one
    # Step of Exudyn's numerical Jacobian, relative to a coordinate of at least 1e-2 m or rad
    differentiation_step: float

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return self.samples * self.sample_interval

    @property
    def tick(self) -> float:
        """The step in a contact, s."""
        return self.sample_interval / self.per_sample

    @property
    def index2(self) -> bool:
        """True if constraints are enforced at velocity level."""
        return self.method == "trapezoidal-index2"


def choose_settings(parameters: Parameters) -> Settings:
    """Choose the settings of a scene; a tick is the scene's step, shortened to divide the sample interval."""
    integration, interval = parameters.integration, parameters.sample_interval
    # An interval that is a whole number of steps must not get one more from round-off
    per_sample = max(1, math.ceil(interval / integration.step * (1 - 1e-12)))
    # Smooth contacts: where three iterations do not suffice, the fourth gets a new Jacobian, which takes as
    # long as ten of them and serves some twenty steps. With a new one sooner, of a step far longer than a
    # contact, the iteration overshoots by revolutions of rod 4 and finds a root there. Stiff contacts with
    # kinks (two corners at once, the pin's friction): a Jacobian from one side of a kink misleads on the
    # other, where an old one from free flight converges, slowly, as the masses over the square of the step
    # outweigh the contact. Then Exudyn's own default
    smooth = parameters.journal is None and _law(parameters) in (None, HERTZ, IMPACT)
    return Settings(
        method=integration.method,
        sample_interval=interval,
        samples=parameters.samples,
        period=parameters.mechanism.period,
        energy=integration.energy,
        per_sample=per_sample,
        per_state=_ticks_between_states(parameters, per_sample),
        fixed=not parameters.contacts,
        tolerance=_newton_tolerance(parameters, interval / per_sample),
        jacobian_uses=2 if smooth else 8,
        # On an elastic foundation a slider rests some 1e-9 m deep: over 1e-7, contact would pass for flight
        differentiation_step=1e-8 if _law(parameters) == FOUNDATION else 1e-7,
    )


def _law(parameters: Parameters) -> float | None:
    return None if parameters.guide is None else parameters.guide.number


def _ticks_between_states(parameters: Parameters, per_sample: int) -> int:
    """Return the number of ticks between required states.

    Each sample requires a state. Where dense samples would shorten the steps in flight, only one in each
    thousandth of a cycle does: there a run takes the steps of one with 1000 samples. Forces of joints and
    energies are not interpolated. A sample at each tick still makes all steps equal.
    """
    if not 1 < per_sample < _LONG_INTERVAL or parameters.integration.method != "generalized-alpha":
        return per_sample
    samples = max(1, parameters.integration.samples_per_cycle // 1000)
    return per_sample * math.gcd(samples, parameters.samples)


def _newton_tolerance(parameters: Parameters, step: float) -> float:
    """Return the absolute tolerance of the Newton iteration, in N, m and m/s, for a ``step`` in s.

    Index 2 has rows in m/s, whose error divided by the step is one of accelerations and so of reactions,
    which nothing damps. The usual tolerance of the scene, 1e-7, means 5e-5 m/s^2 there; a tenth of it is
    missed in some contacts at steps of 4e-6 s. Without contacts, 1e-6 m/s^2 is met easily.
    The tolerance is never less than the round-off of the balances, which grows with the square of the speed.
    """
    tolerance, least = parameters.integration.tolerance, ROUND_OFF * _joint_load(parameters)
    guide = parameters.guide
    if parameters.integration.method == "trapezoidal-index2":
        tolerance *= step / (2e-3 if parameters.contacts else 0.1)
        # Stiffer contacts: the pin's 4e8 N/m times coordinates of 0.2 m, a side's 1e11 N/m times gaps of
        # 2e-4 m round at some 1e-9 N, which the norm of the residual spreads over all rows
        if parameters.journal is not None or _law(parameters) in (SWITCHING, FOUNDATION):
            least = 2e-10
    elif guide is not None and guide.number == FOUNDATION:
        # A joint between coordinates near 0.5 m places the slider to 1e-16 m: half of that, times the
        # stiffness of a whole side
        least = max(least, 5e-17 * guide.side_stiffness)
    return max(tolerance, least)


def _joint_load(parameters: Parameters) -> float:
    """Return a measure of the load of the joints, N.

    This is the weight of all bodies, at gravity plus the acceleration of the crank's tip, plus the largest
    force of a workpiece on an ideal slider.
    """
    mechanism = parameters.mechanism
    bodies = (mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider)
    acceleration = mechanism.crank.length * mechanism.omega**2 + abs(mechanism.gravity)
    weight = acceleration * math.fsum(body.mass for body in bodies)
    return weight + load_forces(parameters, math.inf)[1]


def exudyn_settings(settings: Settings, journals: int) -> Any:
    """Make ``exudyn.SimulationSettings``; each value set here has its reason beside it."""
    values = quiet_settings(settings.duration)
    integration = values.timeIntegration
    integration.numberOfSteps = settings.samples * settings.per_sample
    # A step is tried again only where `solver` asks for it or Newton's method fails, with the length that
    # `solver` sets; never lengthened by Exudyn's own choice
    integration.adaptiveStep = not settings.fixed
    integration.adaptiveStepRecoverySteps = 2**31 - 1
    if not settings.fixed:
        integration.minimumStepSize = settings.tick / TICK_DIVISION * (1.0 + 1e-9)
    integration.automaticStepSize = False
    if settings.index2:
        # Constraints at velocity level: the multipliers are as smooth as the accelerations. A relative
        # tolerance would refer to the residual before the iteration, which drive and gravity make large
        integration.newton.relativeTolerance = 0.0
        integration.generalizedAlpha.useIndex2Constraints = True
        integration.generalizedAlpha.useNewmark = True
    else:
        integration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
        # Constraints at position level (index 3): joints do not drift over many cycles, but the multipliers
        # carry the Newton iteration's error divided by the square of the step
        integration.generalizedAlpha.useIndex2Constraints = False
        integration.generalizedAlpha.useNewmark = False
    # The Jacobian changes little in a hundred steps; a new one in every iteration doubles the cost
    integration.newton.useModifiedNewton = True
    integration.newton.maxModifiedNewtonIterations = settings.jacobian_uses
    integration.newton.numericalDifferentiation.relativeEpsilon = settings.differentiation_step
    # Pieces of a journal's friction (`journal_contact`): at most four changes; the last one is confirmed
    integration.discontinuous.maxIterations = 2 + 4 * max(1, journals)
    integration.discontinuous.ignoreMaxIterations = False
    # The step that `solver` asks for where it takes one back
    integration.discontinuous.useRecommendedStepSize = not settings.fixed
    # In N and m alike. For index 3 the usual 1e-7 is no limit: 1e-8 moves the slider of the paper's case by
    # 2e-11 m, and the step of 2e-6 s leaves 3e-7 m. Much smaller ones are less than the forces' round-off
    integration.newton.absoluteTolerance = settings.tolerance
    return values


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
    def limit(self) -> float:
        """Largest number of ticks of the next step before the contacts limit it."""
        if not self._touched:
            self._touched = bool(self._contacts["closed"].any())
        longest = self._longest if self._touched else min(self._longest, LONGEST_BEFORE_CONTACT)
        return min(_GROWTH * self.ticks, longest)

    def choose(self, ticks: float) -> None:
        """Choose the step after an accepted one: at most so many ``ticks``, at least one."""
        self.longest_taken = max(self.longest_taken, self.ticks)
        if self.end_tick % 1.0:
            self._take(min(2.0 * self.ticks, 1.0 - self.end_tick % 1.0))
        else:
            # Equal parts up to the next required state
            remaining = self._per_state - self.end_tick % self._per_state
            self._take(-(-remaining // -(-remaining // max(ticks // 1.0, 1.0))))

    def shorten(self, fraction: float) -> None:
        """Replace the step by one that covers less than ``fraction`` of it; one of a tick or less by half."""
        self.end_tick -= self.ticks
        span = FORESEEN_SHARE * fraction * self.ticks // 1.0
        self._take(max(1.0, span) if self.ticks > 1.0 else 0.5 * self.ticks)

    def _take(self, ticks: float) -> None:
        self.end_tick += ticks
        self.time = self.end_tick * self.tick_length
        if ticks != self.ticks:
            self.ticks = ticks
            self._step["length"] = ticks * self.tick_length
