"""The solution of one run of five bodies by Exudyn's implicit integrators."""

import math
import time
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from exudyn_model.five_bodies.balance import constraints, correct_start
from exudyn_model.five_bodies.contact_forces import ANGLE, PER_BODY
from exudyn_model.five_bodies.parts import JournalPart
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.settings import (
    SPECTRAL_RADIUS,
    Settings,
    choose_settings,
    exudyn_settings,
)
from exudyn_model.five_bodies.step_choice import LONGEST, LONGEST_INDEX2, StepChoice
from exudyn_model.five_bodies.system import Model, System, build, press
from exudyn_model.linkage import assemble
from exudyn_model.parameters import Parameters
from exudyn_model.run import PROGRESS_INTERVAL, Outcome, Run

Array = NDArray[np.float64]
Progress = Callable[[float], None]


def run_five_bodies(parameters: Parameters, progress: Progress | None) -> Run:
    """Run the formulation "full"; ``progress`` as for ``simulation.simulate``."""
    settings = choose_settings(parameters)
    recorder, choice, outcome = run_system(
        press(parameters, assemble(parameters)),
        settings,
        parameters.mechanism.period,
        parameters.integration.energy,
        progress,
    )
    if outcome.status == "newton-failed" and any(
        one.impact_speed == "current" for one in parameters.contacts
    ):
        # Over a step the damping of a stiff contact turns by all of it, within the floor of the speed
        remedy = "reduce solver.exudyn.step to 5e-7 s, or use solver.exudyn.formulation = 'tree'"
        outcome = Outcome(outcome.status, remedy, outcome.counters)
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
    system: System, settings: Settings, period: float, energy: bool, progress: Progress | None = None
) -> tuple[Recorder, StepChoice, Outcome]:
    """Run a linkage of lists.

    Parameters
    ----------
    system : System
        At positions and with velocities that fit its joints.
    settings : Settings
    period : float
        Of the cycles by which extrema are kept, s.
    energy : bool
        Whether the energies are recorded.
    progress : callable, optional

    Raises
    ------
    AssertionError
        If positions or velocities do not fit the joints: Exudyn would accept them without a word.
    """
    model = build(system, settings.tick)
    longest = 1 if settings.fixed else LONGEST_INDEX2 if settings.index2 else LONGEST
    choice = StepChoice(model, settings.tick, settings.per_sample, settings.per_state, longest)
    duration = settings.samples * settings.sample_interval
    recorder = Recorder(model, choice, settings.samples, period, duration, energy)
    return recorder, choice, Solution(model, settings, choice, recorder, progress).run()


class Solution:
    """One call of Exudyn's solver for the whole run: a second one would start with new initial accelerations.

    The length of each step is set before it; a step in which a contact begins or ends is taken back after it
    where it is longer than a tick (``step_choice``). Every accepted state goes to the recorder.

    Parameters
    ----------
    model : Model
    settings : Settings
    choice : StepChoice
    recorder : Recorder
    progress : callable or None
    """

    def __init__(
        self,
        model: Model,
        settings: Settings,
        choice: StepChoice,
        recorder: Recorder,
        progress: Progress | None,
    ) -> None:
        self._model, self._settings, self._choice = model, settings, choice
        self._recorder, self._progress = recorder, progress
        self._data = model.mbs.systemData
        self._settling = [part for part in model.parts if isinstance(part, JournalPart)]
        self._interruption: BaseException | None = None
        # Whether Newton's method has converged in the present step, so that it is accepted; whether the step
        # is to be iterated once more from its start; fraction of the step to where a contact begins or ends
        self._accepted, self._again, self._fraction = True, False, 0.0
        self._rejected, self._last_call = 0, time.monotonic()
        self._duration = settings.samples * settings.sample_interval
        self._dynamic: Any = None
        self._views: list[Array] = []

    def run(self) -> Outcome:
        """Integrate from t = 0."""
        mbs, status, remedy = self._model.mbs, "success", ""
        mbs.SetPreStepUserFunction(self._before_step)
        if not self._settings.fixed:
            mbs.SetPostNewtonUserFunction(self._after_newton)
        console = exu.config.printToConsole
        exu.config.printToConsole = False
        try:
            mbs.SolveDynamic(exudyn_settings(self._settings))
            if self._interruption is None:
                self._before_step()  # the last state, which no further step starts from
        except exu.SolverError:
            status = "newton-failed"
            remedy = (
                "raise solver.exudyn.tolerance if below 1e-8, reduce solver.exudyn.step if above 2e-5 s; "
                "where friction.coefficient is above 1, lower it"
            )
        except exu.ModelError as error:
            # Ctrl-C or a fault inside the contact force arrives as the cause; it is no outcome of the scene
            raise (error.__cause__ or error) from None
        finally:
            exu.config.printToConsole = console
            mbs.SetPreStepUserFunction(0)
            mbs.SetPostNewtonUserFunction(0)
        if self._interruption is not None:
            raise self._interruption
        if [view.ctypes.data for view in self._views] != [view.ctypes.data for view in self._vectors()]:
            raise AssertionError("Exudyn has moved its coordinates")
        self._recorder.observe()
        if status == "success" and self._has_spun():
            status, remedy = "newton-failed", "reduce solver.exudyn.step: it is far longer than a contact"
        if not self._recorder.is_finite():
            status, remedy = "non-finite", "check the scene's masses and speeds"
        if self._progress is not None and status == "success":
            self._progress(1.0)
        iterations = mbs.sys["dynamicSolver"].it
        counters = {
            "steps": self._recorder.accepted - 1,
            "rejected": self._rejected,
            "newton_iterations": iterations.newtonStepsCount,
            "jacobians": iterations.newtonJacobiCount,
        }
        return Outcome(status, remedy, counters)

    def _before_step(self, *_: Any) -> bool:
        """Exudyn's pre-step function: record the current state; False to stop."""
        try:
            if self._dynamic is None:
                self._begin()
            if self._accepted:
                self._accept()
            else:
                self._try_again()
        # Also a user's Ctrl-C: Exudyn would make it an error of its own
        except BaseException as exception:
            self._interruption = exception
            return False
        return True

    def _vectors(self) -> list[Array]:
        """Return Exudyn's own memory of coordinates, their rates and the multipliers."""
        data = self._data
        vectors = data.GetODE2Coordinates, data.GetODE2Coordinates_t, data.GetAECoordinates
        return [vector(copy=False) for vector in vectors]

    def _begin(self) -> None:
        self._dynamic, self._views = self._model.mbs.sys["dynamicSolver"], self._vectors()
        q, v, multipliers = self._views
        self._require_consistent_start(q, v)
        if self._settings.index2:  # other methods damp what is wrong with the initial accelerations
            acceleration = self._data.GetODE2Coordinates_tt(copy=False)
            correct_start(self._model.system, q, v, acceleration, multipliers)
        self._recorder.begin(q, v, multipliers)

    def _accept(self) -> None:
        choice = self._choice
        before = choice.ticks
        choice.choose(self._recorder.accept())
        if self._progress is not None and time.monotonic() - self._last_call > PROGRESS_INTERVAL:
            self._last_call = time.monotonic()
            self._progress(choice.time / self._duration)
        if not self._settings.fixed:
            self._accepted = False
            if choice.ticks != before:
                self._set_step()

    def _require_consistent_start(self, q: Array, v: Array) -> None:
        with np.errstate(over="ignore"):
            found = constraints(self._model.system, np.zeros(1), q[:, None], v[:, None])
        # Lengths are near 1 m: round-off of a few operations is some 1e-16
        if not (found.position[0] <= 1e-13 and found.velocity[0] <= 1e-12 * (1 + np.max(np.abs(v)))):
            raise AssertionError("initial positions or velocities do not fit the joints")

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

    def _has_spun(self) -> bool:
        """Return whether a slider, or what it is pinned to, is over half a revolution from its start.

        No guide lets it be. In a step far longer than a contact the Newton iteration can overshoot by
        thousands of revolutions and find a root there: an angle counts by its sine alone, and inertia
        balances whatever the wall exerts. No later step brings it back.
        """
        system, start = self._model.system, exu.ConfigurationType.Initial
        sliders = {one.body for one in system.sliders} | {one.body for one in system.guides}
        held = sliders | {pin.first for pin in system.pins if pin.second in sliders}
        turned = self._data.GetODE2Coordinates() - self._data.GetODE2Coordinates(configuration=start)
        return any(abs(turned[PER_BODY * body + ANGLE]) > math.pi for body in held)
