"""The solution of one run of five bodies by Exudyn's implicit integrators."""

import math
import time
from collections.abc import Callable
from typing import Any

import exudyn as exu

from exudyn_model.bodies import ROD4_ANGLE
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.settings import Steps, settings
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.model import Model
from exudyn_model.run import PROGRESS_INTERVAL, Outcome

# Ticks of a step in which the linkage hardly moves, and how many iterations of a longer one may use an old
# Jacobian
_SHORT, _USES_IN_LONG = 4, 2


class _BehindWallError(Exception):
    """Stop of a run in which Exudyn's own contact object has let a corner through."""


def _rod4_spun(data: Any) -> bool:
    """Return whether rod 4 is more than half a revolution from its start, as no slider in a guide lets it be.

    In a step far longer than a contact the Newton iteration can overshoot by thousands of revolutions and
    find a root there: the angle counts by its sine alone, and inertia balances whatever the wall exerts. No
    later step brings it back.
    """
    start = data.GetODE2Coordinates(configuration=exu.ConfigurationType.Initial)[ROD4_ANGLE]
    return bool(abs(data.GetODE2Coordinates()[ROD4_ANGLE] - start) > math.pi)


def solve(
    model: Model,
    steps: Steps,
    choice: StepChoice,
    method: str,
    tolerance: float,
    uses: int,
    relative_difference: float,
    recorder: Recorder,
    progress: Callable[[float], None] | None,
    correct: Callable[..., None] | None,
) -> Outcome:
    """Integrate ``model`` from t = 0 and pass every accepted state to ``recorder``.

    ``correct`` changes Exudyn's initial accelerations and multipliers (``initial_accelerations``).

    One call of Exudyn's solver for the whole run: a second one would start with new initial accelerations.
    The length of each step is set before it; a step in which a contact begins or ends is taken back after it
    where it is longer than a tick (``step_choice``).
    """
    interruption: list[BaseException] = []
    mbs, settle = model.mbs, model.after_newton
    data = mbs.systemData
    fixed, index2 = choice.longest == 1, method == "trapezoidal-index2"
    # Whether Newton's method has converged in the present step, so that it is accepted; whether the step is
    # to be iterated once more from its start; fraction of the step up to where a contact begins or ends
    accepted, again, fraction = True, False, 0.0
    rejected = 0
    dynamic: Any = None
    iteration: Any = None
    newton: Any = None
    last_call, duration = time.monotonic(), steps.samples * steps.sample_interval

    def before_step(*_: Any) -> bool:
        """Record the current state; False to stop."""
        nonlocal last_call, accepted, again, rejected, dynamic, iteration, newton
        try:
            if dynamic is None:
                dynamic = mbs.sys["dynamicSolver"]
                iteration, newton = dynamic.it, dynamic.newton
                if correct is not None:
                    correct(
                        data.GetODE2Coordinates(copy=False),
                        data.GetODE2Coordinates_t(copy=False),
                        data.GetODE2Coordinates_tt(copy=False),
                        data.GetAECoordinates(copy=False),
                    )
            if not accepted:
                if fraction == 0.0:
                    # Newton's method has failed, after which Exudyn does not restore the algorithmic
                    # accelerations of its method; to iterate anew does
                    again = not index2
                rejected += 1
                choice.shorten(fraction if fraction > 0.0 else 0.5)
                set_step()
                dynamic.conv.jacobianUpdateRequested = True
                return True
            if choice.at_required_state:
                recorder.follow(
                    data.GetODE2Coordinates(copy=False),
                    data.GetODE2Coordinates_t(copy=False),
                    data.GetAECoordinates(copy=False),
                )
            is_sample = recorder.accept()
            if is_sample and recorder.is_behind_a_wall:
                interruption.append(_BehindWallError())
                return False
            if is_sample and progress is not None and time.monotonic() - last_call > PROGRESS_INTERVAL:
                last_call = time.monotonic()
                progress(choice.time / duration)
            before = choice.ticks
            choice.choose()
            if not fixed:
                accepted = False
                if choice.ticks != before:
                    set_step()
        # Also a user's Ctrl-C: Exudyn would make it an error of its own
        except BaseException as exception:
            interruption.append(exception)
            return False
        return True

    def set_step() -> None:
        """Give Exudyn the step that begins."""
        iteration.currentStepSize = choice.ticks * choice.size
        iteration.currentTime = choice.time
        # In long steps, in which the linkage moves on, two iterations seldom suffice; a third with the old
        # Jacobian takes less time than a new one
        newton.maxModifiedNewtonIterations = uses if choice.ticks <= _SHORT else max(uses, _USES_IN_LONG)
        # Its error in positions, over the step, is one of velocities
        newton.absoluteTolerance = tolerance * min(choice.ticks, 1.0)
        if index2:
            # Rows of the constraints' velocities are scaled with the step
            dynamic.conv.jacobianUpdateRequested = True

    def after_newton(mbs: Any, t: float) -> list[float]:
        """Exudyn's post-Newton function: an error above 1 rejects, with a recommended step or to iterate."""
        nonlocal accepted, again, fraction
        if settle is not None and settle(mbs, t)[0] > 0.0:
            return [2.0, -1.0]
        if again:
            again = False
            return [2.0, -1.0]
        if choice.ticks > 1:
            fraction = choice.first_change(
                data.GetODE2Coordinates(copy=False), data.GetODE2Coordinates_t(copy=False)
            )
            if not fraction > 1.0:
                return [2.0, 0.0]
        accepted, fraction = True, 0.0
        return [0.0, -1.0]

    mbs.SetPreStepUserFunction(before_step)
    if not fixed:
        mbs.SetPostNewtonUserFunction(after_newton)
    elif settle is not None:
        mbs.SetPostNewtonUserFunction(settle)
    status, remedy = "success", ""
    console = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        mbs.SolveDynamic(settings(steps, method, tolerance, uses, fixed, relative_difference))
        if not interruption:
            before_step()  # the last state, which no further step starts from
    except exu.SolverError:
        status = "newton-failed"
        remedy = (
            "raise solver.exudyn.tolerance if below 1e-8, reduce solver.exudyn.step if above 2e-5 s; where "
            "friction.coefficient is above 1, lower it"
        )
    except exu.ModelError as error:
        # Ctrl-C or a fault inside the contact force arrives as the cause; it is no outcome of the scene
        raise (error.__cause__ or error) from None
    finally:
        exu.config.printToConsole = console
        mbs.SetPreStepUserFunction(0)
        mbs.SetPostNewtonUserFunction(0)
    if interruption and not isinstance(interruption[0], _BehindWallError):
        raise interruption[0]
    if interruption:
        status = "out-of-range"
        remedy = "a corner is deeper in its wall than Exudyn's sphere: use solver.exudyn.formulation = 'full'"
    elif status == "success" and _rod4_spun(data):
        status, remedy = "newton-failed", "reduce solver.exudyn.step: it is far longer than a contact"
    if not recorder.is_finite():
        status, remedy = "non-finite", "check the scene's masses and speeds"
    if progress is not None and status == "success":
        progress(1.0)
    iterations = mbs.sys["dynamicSolver"].it
    counters = {
        "steps": recorder.accepted - 1,
        "rejected": rejected,
        "newton_iterations": iterations.newtonStepsCount,
        "jacobians": iterations.newtonJacobiCount,
    }
    return Outcome(status, remedy, counters)
