"""The solution of one run of five bodies by Exudyn's implicit integrators."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.balance import constraints, correct_start
from exudyn_model.five_bodies.journal_contact import JournalPart
from exudyn_model.five_bodies.recording import BodiesRecorder
from exudyn_model.five_bodies.settings import (
    SPECTRAL_RADIUS,
    Settings,
    choose_settings,
    exudyn_settings,
)
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.five_bodies.system import Model, System, build, press
from exudyn_model.linkage import assemble
from exudyn_model.parameters import Parameters
from exudyn_model.run import Outcome, Progress, Report, Run, solve, state_vectors

Array = NDArray[np.float64]


def run_five_bodies(parameters: Parameters, progress: Report | None) -> Run:
    """Run the formulation "full"; ``progress`` as for ``simulation.simulate``."""
    settings = choose_settings(parameters)
    system = press(parameters, assemble(parameters))
    recorder, choice, outcome = run_system(system, settings, progress)
    used: dict[str, Any] = {
        "step_used": settings.tick,
        "longest_step": choice.longest_taken * settings.tick,
        "steps_per_sample": settings.per_sample,
        "newton_tolerance": settings.tolerance,
    }
    if not settings.index2:
        used["spectral_radius"] = SPECTRAL_RADIUS
    return Run("five bodies", used, recorder, outcome, recorder.drift)


def run_system(
    system: System, settings: Settings, report: Report | None = None
) -> tuple[BodiesRecorder, StepChoice, Outcome]:
    """Run a linkage of lists, at positions and with velocities that fit its joints.

    Raises
    ------
    AssertionError
        If they do not: Exudyn would accept them silently.
    """
    model = build(system, settings.tick)
    choice = StepChoice(model, settings)
    recorder = BodiesRecorder(model, choice, settings)
    return recorder, choice, Solution(model, settings, choice, recorder, report).run()


class Solution:
    """One call of Exudyn's solver for the whole run: a second one would start with new initial accelerations.

    The length of each step is set before it; a step in which a contact begins or ends is taken back after it
    where it is longer than a tick (``step_choice``). Every accepted state goes to the recorder.

    Parameters
    ----------
    model : Model
    settings : Settings
    choice : StepChoice
    recorder : BodiesRecorder
    report : callable or None
    """

    def __init__(
        self,
        model: Model,
        settings: Settings,
        choice: StepChoice,
        recorder: BodiesRecorder,
        report: Report | None,
    ) -> None:
        self._model, self._settings, self._choice, self._recorder = model, settings, choice, recorder
        self._progress = Progress(report, settings.duration)
        self._settling = [part for part in model.parts if isinstance(part, JournalPart)]
        # Whether Newton's method has converged in the present step, so that it is accepted; whether the step
        # is to be iterated once more from its start; fraction of the step to where a contact begins or ends
        self._accepted, self._again, self._fraction = True, False, 0.0
        self._rejected = 0
        self._dynamic: Any = None
        self._vectors: list[Array] = []

    def run(self) -> Outcome:
        """Integrate from t = 0."""
        mbs, recorder, remedy = self._model.mbs, self._recorder, ""
        after_newton = None if self._settings.fixed else self._after_newton
        status = solve(mbs, exudyn_settings(self._settings), self._before_step, after_newton)
        if status == "success":
            self._before_step()  # the last state, which no further step starts from
        else:
            status = "newton-failed"
            remedy = (
                "raise solver.exudyn.tolerance if below 1e-8, reduce solver.exudyn.step if above 2e-5 s; "
                "where friction.coefficient is above 1, lower it"
            )
        if [one.ctypes.data for one in self._vectors] != [one.ctypes.data for one in state_vectors(mbs)]:
            raise AssertionError("Exudyn has moved its coordinates")
        recorder.observe()
        if not recorder.is_finite():
            status, remedy = "non-finite", "check the scene's masses and speeds"
        if status == "success":
            self._progress.finish()
        iterations = self._dynamic.it
        counters = {
            "steps": recorder.accepted - 1,
            "rejected": self._rejected,
            "newton_iterations": iterations.newtonStepsCount,
            "jacobians": iterations.newtonJacobiCount,
        }
        return Outcome(status, remedy, counters)

    def _before_step(self, *_: Any) -> bool:
        """Exudyn's pre-step function, called again after a rejected step: record where a step starts."""
        if not self._accepted:
            self._try_again()
            return True
        if self._dynamic is None:
            self._begin()
        choice = self._choice
        before = choice.ticks
        choice.choose(self._recorder.accept())
        self._progress(choice.time)
        if not self._settings.fixed:
            self._accepted = False
            if choice.ticks != before:
                self._set_step()
        return True

    def _begin(self) -> None:
        """Take the start, whose accelerations Exudyn has found by now.

        Raises
        ------
        AssertionError
            If positions or velocities do not fit the joints.
        """
        mbs, system = self._model.mbs, self._model.system
        self._dynamic, self._vectors = mbs.sys["dynamicSolver"], state_vectors(mbs)
        q, v, multipliers = self._vectors
        with np.errstate(over="ignore"):
            start = constraints(system, np.zeros(1), q[:, None], v[:, None])
        # Round-off of a few operations is some 1e-16 of the lengths, which are near 1 m or longer
        size = max(1.0, *(float(np.abs(body.position[:2]).max()) for body in system.bodies))
        if not (start.position[0] <= 1e-13 * size and start.velocity[0] <= 1e-12 * (1 + np.max(np.abs(v)))):
            raise AssertionError("initial positions or velocities do not fit the joints")
        if self._settings.index2:  # other methods damp what is wrong with the initial accelerations
            correct_start(system, q, v, mbs.systemData.GetODE2Coordinates_tt(copy=False), multipliers)
        self._recorder.begin(q, v, multipliers)

    def _try_again(self) -> None:
        """Shorten the step that was not accepted."""
        if self._fraction == 0.0:
            # Newton's method has failed, after which Exudyn does not restore the algorithmic accelerations of
            # its method; to iterate anew does
            self._again = not self._settings.index2
        self._rejected += 1
        self._choice.shorten(self._fraction if self._fraction > 0.0 else 0.5)
        self._set_step()
        self._dynamic.conv.jacobianUpdateRequested = True

    def _set_step(self) -> None:
        """Give Exudyn the step that begins."""
        dynamic, settings, ticks = self._dynamic, self._settings, self._choice.ticks
        dynamic.it.currentStepSize = ticks * settings.tick
        dynamic.it.currentTime = self._choice.time
        # Its error in positions, over the step, is one of velocities
        dynamic.newton.absoluteTolerance = settings.tolerance * min(ticks, 1.0)
        if settings.index2:
            # Rows of the constraints' velocities are scaled with the step
            dynamic.conv.jacobianUpdateRequested = True

    def _after_newton(self, mbs: Any, t: float) -> list[float]:
        """Exudyn's post-Newton function: an error above 1 rejects, with a recommended step or to iterate."""
        del mbs, t
        for part in self._settling:
            if not part.settled():
                return [2.0, -1.0]
        if self._again:
            self._again = False
            return [2.0, -1.0]
        if self._choice.ticks > 1:
            self._fraction = min(part.change() for part in self._model.parts)
            if not self._fraction > 1.0:
                return [2.0, 0.0]
        self._accepted, self._fraction = True, 0.0
        return [0.0, -1.0]
