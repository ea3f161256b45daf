"""Solution of one run of five bodies by Exudyn's implicit integrators."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.balance import constraints, correct_start
from exudyn_model.five_bodies.journal_contact import JournalElement
from exudyn_model.five_bodies.recording import BodiesRecorder
from exudyn_model.five_bodies.settings import (
    SPECTRAL_RADIUS,
    Settings,
    StepChoice,
    choose_settings,
    exudyn_settings,
)
from exudyn_model.five_bodies.system import Model, System, build, press_system
from exudyn_model.linkage import assemble
from exudyn_model.parameters import Parameters
from exudyn_model.run import Outcome, Progress, Report, Run, solve, state_vectors

Array = NDArray[np.float64]


def run_five_bodies(parameters: Parameters, progress: Report | None) -> Run:
    """Run the formulation "full"; ``progress`` as for ``simulation.simulate``."""
    settings = choose_settings(parameters)
    system = press_system(parameters, assemble(parameters))
    recorder, choice, outcome = run_system(system, settings, progress)
    step_settings: dict[str, Any] = {
        "step_used": settings.tick,
        "longest_step": choice.longest_taken * settings.tick,
        "steps_per_sample": settings.per_sample,
        "newton_tolerance": settings.tolerance,
    }
    if not settings.index2:
        step_settings["spectral_radius"] = SPECTRAL_RADIUS
    return Run("five bodies", step_settings, recorder, outcome, recorder.drift)


def run_system(
    system: System, settings: Settings, report: Report | None = None
) -> tuple[BodiesRecorder, StepChoice, Outcome]:
    """Run a linkage that is given as lists; its initial positions and velocities must fit its joints.

    Raises
    ------
    AssertionError
        If they do not fit: Exudyn would accept them silently.
    """
    model = build(system, settings.tick)
    choice = StepChoice(model, settings)
    recorder = BodiesRecorder(model, choice, settings)
    progress = Progress(report, settings.duration)
    return recorder, choice, Solution(model, settings, choice, recorder, progress).run()


@dataclass
class Solution:
    """A run by a single call of Exudyn's solver: a second call would start with new initial accelerations.

    The length of each step is set before it; a step in which a contact begins or ends is taken back after it
    where it is longer than a tick (``settings``). Every accepted state goes to the recorder.
    """

    model: Model
    settings: Settings
    choice: StepChoice
    recorder: BodiesRecorder
    progress: Progress
    accepted: bool = True  # Newton's method has converged in the present step
    iterate_again: bool = False  # Newton's method has to start the step once more
    fraction: float = 0.0  # Of the step, after which a contact begins or ends; 0: Newton's method failed
    rejected: int = 0
    dynamic: Any = None  # Exudyn's solver
    vectors: list[Array] = field(default_factory=list)

    @cached_property
    def journals(self) -> list[JournalElement]:
        """Contacts whose friction changes piece by piece."""
        return [element for element in self.model.elements if isinstance(element, JournalElement)]

    def run(self) -> Outcome:
        """Integrate from t = 0."""
        mbs, recorder, remedy = self.model.mbs, self.recorder, ""
        after_newton = None if self.settings.fixed else self._after_newton
        status = solve(
            mbs, exudyn_settings(self.settings, len(self.journals)), self._before_step, after_newton
        )
        if status == "success" and not recorder.ending:
            self._before_step()  # record the last state, from which no step starts
        else:
            status = "newton-failed"
            remedy = (
                "raise solver.exudyn.tolerance if below 1e-8, reduce solver.exudyn.step if above 2e-5 s; "
                "where friction.coefficient is above 1, lower it"
            )
            recorder.explain_failure()
        if [one.ctypes.data for one in self.vectors] != [one.ctypes.data for one in state_vectors(mbs)]:
            raise AssertionError("Exudyn has moved its coordinates")
        recorder.observe()
        if not recorder.is_finite():
            status, remedy = "non-finite", "check the scene's masses and speeds"
        if recorder.ending:
            status, remedy = recorder.ending
        if status == "success":
            self.progress.finish()
        iterations = self.dynamic.it
        counters = {
            "steps": recorder.state_count - 1,
            "rejected": self.rejected,
            "newton_iterations": iterations.newtonStepsCount,
            "jacobians": iterations.newtonJacobiCount,
        }
        return Outcome(status, remedy, counters)

    def _before_step(self, *_: Any) -> bool:
        """Exudyn's pre-step function, called again after a rejected step: record where a step starts."""
        if not self.accepted:
            self._try_again()
            return True
        if self.dynamic is None:
            self._begin()
        choice = self.choice
        ticks = choice.ticks
        choice.choose(self.recorder.accept())
        self.progress(choice.time)
        if not self.settings.fixed:
            self.accepted = False
            if choice.ticks != ticks:
                self._set_step()
        return True

    def _begin(self) -> None:
        """Record the initial state, whose accelerations Exudyn has computed by now.

        Raises
        ------
        AssertionError
            If positions or velocities do not fit the joints.
        """
        mbs, system = self.model.mbs, self.model.system
        self.dynamic, self.vectors = mbs.sys["dynamicSolver"], state_vectors(mbs)
        q, v, multipliers = [*self.vectors, np.zeros(0)][:3]  # without constraints there are no multipliers
        with np.errstate(over="ignore"):
            start = constraints(system, np.zeros(1), q[:, None], v[:, None])
        # Round-off of a few operations is some 1e-16 of the lengths, which are near 1 m or longer
        size = max(1.0, *(float(np.abs(body.position[:2]).max()) for body in system.bodies))
        gap, rate = (np.abs(one).max(initial=0.0) for one in (start.gaps, start.rates))
        if not (gap <= 1e-13 * size and rate <= 1e-12 * (1 + np.max(np.abs(v)))):
            raise AssertionError("initial positions or velocities do not fit the joints")
        if self.settings.index2:  # other methods damp an error of the initial accelerations
            correct_start(system, q, v, mbs.systemData.GetODE2Coordinates_tt(copy=False), multipliers)
        self.recorder.begin(q, v, multipliers)

    def _try_again(self) -> None:
        """Shorten the step that was not accepted."""
        if self.fraction == 0.0:
            # After a failure of Newton's method Exudyn does not restore the algorithmic accelerations; a
            # second iteration from the start of the step does
            self.iterate_again = not self.settings.index2
        self.rejected += 1
        self.choice.shorten(self.fraction if self.fraction > 0.0 else 0.5)
        self._set_step()
        self.dynamic.conv.jacobianUpdateRequested = True

    def _set_step(self) -> None:
        """Set length and end of the next step in Exudyn."""
        dynamic, settings, ticks = self.dynamic, self.settings, self.choice.ticks
        dynamic.it.currentStepSize = ticks * settings.tick
        dynamic.it.currentTime = self.choice.time
        # Newton's error in positions, divided by the step, is one of velocities
        dynamic.newton.absoluteTolerance = settings.tolerance * min(ticks, 1.0)
        if settings.index2:
            # Rows of the constraints' velocities are scaled with the step
            dynamic.conv.jacobianUpdateRequested = True

    def _after_newton(self, mbs: Any, t: float) -> list[float]:
        """Exudyn's post-Newton function: return [error, step]; an error above 1 rejects."""
        del mbs, t
        fits = [element.settled() for element in self.journals]  # each takes its next piece
        if not all(fits):
            return [2.0, -1.0]
        if self.iterate_again:
            self.iterate_again = False
            return [2.0, -1.0]
        if self.choice.ticks > 1:
            self.fraction = min(element.change() for element in self.model.elements)
            if not self.fraction > 1.0:
                return [2.0, 0.0]
        self.accepted, self.fraction = True, 0.0
        return [0.0, -1.0]
