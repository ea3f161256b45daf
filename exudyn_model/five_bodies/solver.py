"""The solution of one run of five bodies by Exudyn's implicit integrators."""

import math
import time
from collections.abc import Callable
from typing import Any

import exudyn as exu

from exudyn_model.bodies import ROD4_ANGLE
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.settings import Steps, settings
from exudyn_model.run import PROGRESS_INTERVAL, Outcome


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
    mbs: Any,
    steps: Steps,
    method: str,
    tolerance: float,
    uses: int,
    recorder: Recorder,
    progress: Callable[[float], None] | None,
) -> Outcome:
    """Integrate ``mbs`` from t = 0 and pass every accepted state to ``recorder``.

    One call of Exudyn's solver for the whole run: a second one would start with new initial accelerations.
    """
    interruption: list[BaseException] = []
    data = mbs.systemData
    last_call = time.monotonic()

    def before_step(*_: Any) -> bool:
        """Record the current state; False to stop."""
        nonlocal last_call
        try:
            if recorder.at_sample:
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
                progress((recorder.accepted - 1) / (steps.samples * steps.per_sample))
        # Also a user's Ctrl-C: Exudyn would make it an error of its own
        except BaseException as exception:
            interruption.append(exception)
            return False
        return True

    mbs.SetPreStepUserFunction(before_step)
    status, remedy = "success", ""
    console = exu.config.printToConsole
    exu.config.printToConsole = False
    try:
        mbs.SolveDynamic(settings(steps, method, tolerance, uses))
        if not interruption:
            before_step()  # the last state, which no further step starts from
    except exu.SolverError:
        status = "newton-failed"
        remedy = (
            "reduce solver.exudyn.step, or raise solver.exudyn.tolerance; where large forces meet slow "
            "sliding, raise friction.transition_speed"
        )
    except exu.ModelError as error:
        # Ctrl-C or a fault inside the contact force arrives as the cause; it is no outcome of the scene
        raise (error.__cause__ or error) from None
    finally:
        exu.config.printToConsole = console
        mbs.SetPreStepUserFunction(0)
    if interruption and not isinstance(interruption[0], _BehindWallError):
        raise interruption[0]
    if interruption:
        status = "out-of-range"
        remedy = "a corner is deeper in its wall than Exudyn's sphere: use solver.exudyn.formulation = 'full'"
    elif status == "success" and _rod4_spun(data):
        status, remedy = "newton-failed", "reduce solver.exudyn.step: it is far longer than a contact"
    if not recorder.is_finite():
        status, remedy = "non-finite", "check the scene's masses and speeds, or reduce solver.exudyn.step"
    if progress is not None and status == "success":
        progress(1.0)
    iterations = mbs.sys["dynamicSolver"].it
    counters = {
        "steps": recorder.accepted - 1,
        "newton_iterations": iterations.newtonStepsCount,
        "jacobians": iterations.newtonJacobiCount,
    }
    return Outcome(status, remedy, counters)
