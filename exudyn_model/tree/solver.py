"""Explicit integration of a tree with error control, in steps that end where a contact begins or ends."""

import math
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from exudyn_model.linkage import assemble
from exudyn_model.parameters import Parameters
from exudyn_model.run import Outcome, Progress, Report, Run, StopError, quiet_settings, solve, state_vectors
from exudyn_model.tree.building import build_tree
from exudyn_model.tree.recording import TreeRecorder

Array = NDArray[np.float64]

# Evaluations of the force in one trial of a step
_STAGES = 7

# Exudyn's post-Newton function returns this to go on
_GO_ON = [0.0, -1.0]

# Trials of one step, each shorter than the one before, after which a run is stopped. At its shortest step
# Exudyn repeats the trial without end
_TRIALS = 200

# Steps in a crank cycle after which a run is stopped; the paper's scene needs 1.3e4 at 1e-10, a slider
# pressed to its wall over a cycle of 20 s 1.2e6. A run takes some 40 s to it; a jammed slider never ends
STEPS_PER_CYCLE_LIMIT = 2_000_000

# Remedy of each failure, if one was seen to help
_REMEDIES = {
    "success": "",
    "step-too-small": "raise solver.exudyn.tolerance if below 1e-15 or where load.table jumps, lower "
    "solver.exudyn.step if far above 1e-4 s, or check the scene's masses and speeds",
    "non-finite": "lower solver.exudyn.step if far above 1e-4 s, or check the scene's masses and speeds",
    "work-limit": "shorten drive.cycles to less than was reached, or raise solver.exudyn.tolerance",
}


def least_step(duration: float) -> float:
    """Return the shortest step (s) that ends at a touch: well above the round-off of ``duration`` (s)."""
    return max(1e-12, 64 * math.ulp(duration))


def shortest_step(time: float, least: float) -> float:
    """Return the shortest step (s) taken at ``time`` (s): half of ``least``, but far less at the start.

    A corner that starts millimetres inside its wall is pushed by some 1e7 N, until 1e-11 to 1e-13 s later the
    damping has taken that force away; such starts were seen to need steps of 2e-14 s. Still shorter steps, or
    more of them, would let a run with a tolerance below round-off go on without end.
    """
    return (1e-3 if time < 100.0 * least else 0.5) * least


def settings(duration: float, tolerance: float, largest_step: float) -> Any:
    """Make ``exudyn.SimulationSettings``; each value set here has its reason beside it."""
    values = quiet_settings(duration)
    integration = values.timeIntegration
    integration.automaticStepSize = True
    # The number of steps is Exudyn's way to give the largest one
    integration.numberOfSteps = math.ceil(duration / largest_step * (1 - 1e-12))
    # Below the shortest step of `_Steps`, which stops the run before Exudyn repeats a step without end
    integration.minimumStepSize = 0.5 * shortest_step(0.0, least_step(duration))
    integration.initialStepSize = min(1e-6, largest_step)
    # Absolute, in rad and rad/s: Exudyn multiplies its relative tolerance by the coordinate with its sign,
    # which lets the scale of an angle near -1 rad vanish
    integration.absoluteTolerance = tolerance
    integration.relativeTolerance = 0.0
    # A step after a touch is far shorter than one in flight, and grows back in fewer steps than with 2
    integration.stepSizeMaxIncrease = 5.0
    # All coordinates are angles about one direction: no Lie group to stay on
    integration.explicit.useLieGroupIntegration = False
    # Accelerations are found by balance of forces in the recorder: saves an evaluation a step
    integration.explicit.computeEndOfStepAccelerations = False
    return values


@dataclass
class _Steps:
    """Functions that Exudyn calls before and after a trial of a step; ``q`` and ``v`` are its own vectors."""

    recorder: TreeRecorder
    q: Array
    v: Array
    parameters: Parameters
    least: float  # See `least_step`
    progress: Progress
    located: int = 0
    trials: int = 0

    def before_trial(self, mbs: Any, t: float) -> bool:
        """Exudyn's pre-step function; after a trial whose error is too large there is no other call."""
        del mbs, t
        self.trials += 1
        if self.trials > _TRIALS:
            raise StopError("step-too-small")
        return True

    def after_step(self, mbs: Any, t: float) -> list[float]:
        """Exudyn's post-Newton function: [error above 1, wanted step], or [0, -1] to go on."""
        del mbs
        self.trials = 0
        recorder, duration = self.recorder, self.parameters.duration
        step = t - recorder.time
        if step < shortest_step(t, self.least) and t < duration - 1e-10:  # Exudyn's own rule of the end
            raise StopError("step-too-small")
        fraction = recorder.judge_step(t, self.q, self.v)
        if recorder.steps + self.located >= STEPS_PER_CYCLE_LIMIT * max(1.0, self.parameters.cycles):
            raise StopError("work-limit")
        if fraction >= 1.0:
            self.progress(t)
            return _GO_ON
        if math.isnan(fraction):
            raise StopError("non-finite")
        self.located += 1
        # Exudyn shortens a step to three quarters at most; it would ignore a longer wish
        return [2.0, min(fraction, 0.75) * step]


def run_tree(parameters: Parameters, report: Report | None) -> Run:
    """Run the formulation "tree" by Dormand and Prince's method of order 5(4).

    Exudyn calls back after each step that its error control accepts. The recorder then looks for a contact
    that begins or ends inside the step; if it finds one, the step is taken back and tried again with the
    length up to there. A step that is taken back leaves one trace: a contact that began at its very start
    (``steps.accepted_fraction``). ``report`` is ``progress`` of ``simulation.simulate``.
    """
    duration, integration = parameters.duration, parameters.integration
    tree, least = build_tree(parameters, assemble(parameters)), least_step(duration)
    mbs = tree.mbs
    recorder = TreeRecorder(tree, parameters, least)
    q, v = vectors = state_vectors(mbs)
    recorder.begin(q, v)
    steps = _Steps(recorder, q, v, parameters, least, Progress(report, duration))
    exudyn_settings = settings(duration, integration.tolerance, integration.step)
    method = exu.DynamicSolverType.DOPRI5
    status = solve(mbs, exudyn_settings, steps.before_trial, steps.after_step, solverType=method)
    if status == "solver-error":
        status = "step-too-small"
    if [one.ctypes.data for one in vectors] != [one.ctypes.data for one in state_vectors(mbs)]:
        raise AssertionError("Exudyn has moved its coordinates")
    recorder.observe(last=True)
    if status == "success":
        steps.progress.finish()
    rejected = mbs.sys["dynamicSolver"].it.rejectedAutomaticStepSizeSteps
    counters = {
        "steps": recorder.steps,
        "rejected": rejected,
        "located": steps.located,
        "rhs": _STAGES * (recorder.steps + rejected + steps.located),
    }
    outcome = Outcome(status, _REMEDIES[status], counters)
    return Run(tree_name(parameters), {"least_step": least}, recorder, outcome)


def tree_name(parameters: Parameters) -> str:
    """Return the name of a scene's tree in the provenance."""
    return "rod 4 and slider tree" if parameters.journal is None else "rocker, rods and slider tree"
