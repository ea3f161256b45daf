"""Steps, tolerances and Exudyn's settings of five bodies, each with its reason."""

import math
from dataclasses import dataclass
from typing import Any

from exudyn_model.laws import FOUNDATION, HERTZ, IMPACT, SWITCHING
from exudyn_model.parameters import Parameters
from exudyn_model.run import quiet_settings
from exudyn_model.workpiece import load_forces

SPECTRAL_RADIUS = 0.9
TICK_DIVISION = 4096
"""Ratio of a tick to the shortest step, to which halving leads where Newton's method fails: 128 is not
enough for a corner that starts 10 mm inside its wall."""
ROUND_OFF = 4e-15
"""Attainable residual over the load of the joints (`_joint_load`): they bear four times that, and each rounds
by some 1e-16 of it. At 150, 1000 and 3000 rpm 1e-15 is attained and 3e-16 is not."""
_LONG_INTERVAL = 4 * 40
"""Ticks of a sample interval, four longest steps (``step_choice``), from which on samples shorten no step by
much."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run of five bodies."""

    method: str  # "generalized-alpha" or "trapezoidal-index2"
    sample_interval: float  # s
    samples: int  # Number of samples besides the one at t = 0
    period: float  # Crank cycle, by which extrema are kept, s
    energy: bool  # Whether the energies are recorded
    per_sample: int  # Ticks in a sample interval; a tick is the step in a contact
    per_state: int  # Ticks between required states
    fixed: bool  # Whether all steps are one tick: nothing has clearance
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
        """Whether constraints are enforced at velocity level."""
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
    in_a_thousandth = max(1, parameters.integration.samples_per_cycle // 1000)
    return per_sample * math.gcd(in_a_thousandth, parameters.samples)


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


def exudyn_settings(settings: Settings) -> Any:
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
    # Pieces of the crank pin's friction (`journal_contact`): at most four changes; the last one is confirmed
    integration.discontinuous.maxIterations = 6
    integration.discontinuous.ignoreMaxIterations = False
    # The step that `solver` asks for where it takes one back
    integration.discontinuous.useRecommendedStepSize = not settings.fixed
    # In N and m alike. For index 3 the usual 1e-7 is no limit: 1e-8 moves the slider of the paper's case by
    # 2e-11 m, and the step of 2e-6 s leaves 3e-7 m. Much smaller ones are less than the forces' round-off
    integration.newton.absoluteTolerance = settings.tolerance
    return values
