"""One run of five bodies: choice of its steps, assembly, solution."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from exudyn_model.assembly import assemble
from exudyn_model.energy import mass_diagonal
from exudyn_model.five_bodies import initial_accelerations
from exudyn_model.five_bodies.constraints import Constraints
from exudyn_model.five_bodies.mechanism import build
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.settings import (
    SPECTRAL_RADIUS,
    choose_steps,
    difference,
    fixed_steps,
    jacobian_uses,
    newton_tolerance,
    steps_between_states,
)
from exudyn_model.five_bodies.solver import solve
from exudyn_model.five_bodies.step_choice import LONGEST, LONGEST_INDEX2, StepChoice
from exudyn_model.parameters import Parameters
from exudyn_model.run import Run


def run_five_bodies(parameters: Parameters, progress: Callable[[float], None] | None) -> Run:
    """Run the formulations "full" and "native"; ``progress`` as for ``simulation.simulate``."""
    steps = choose_steps(parameters)
    model = build(parameters, assemble(parameters), steps.size)
    masses = mass_diagonal(parameters.mechanism) if parameters.integration.energy else np.zeros(0)
    method = parameters.integration.method
    longest = LONGEST_INDEX2 if method == "trapezoidal-index2" else LONGEST
    if fixed_steps(parameters):
        longest = 1
    per_state = steps_between_states(parameters, steps)
    choice = StepChoice(model.constants, model.contacts, steps.size, steps.per_sample, longest, per_state)
    period = parameters.drive.period
    recorder = Recorder(model, choice, steps.samples, period, masses, Constraints(parameters))
    tolerance = newton_tolerance(parameters, steps.size)
    uses = jacobian_uses(parameters)
    # Other methods damp what is wrong with the initial accelerations
    correct = partial(initial_accelerations.correct, parameters) if method == "trapezoidal-index2" else None
    apart = difference(parameters)
    outcome = solve(model, steps, choice, method, tolerance, uses, apart, recorder, progress, correct)
    if outcome.status == "newton-failed" and parameters.contact.impact_speed == "current":
        # Over a step the damping of a stiff contact turns by all of it, within the floor of the speed
        remedy = "reduce solver.exudyn.step to 5e-7 s, or use solver.exudyn.formulation = 'tree'"
        outcome = replace(outcome, remedy=remedy)
    settings: dict[str, Any] = {
        "step_used": steps.size,
        "longest_step": choice.longest_taken * steps.size,
        "steps_per_sample": steps.per_sample,
        "newton_tolerance": tolerance,
    }
    if method == "generalized-alpha":
        settings["spectral_radius"] = SPECTRAL_RADIUS
    name = "five bodies"
    if parameters.integration.formulation == "native":
        name += ", native contact"
    return Run(name, settings, recorder, model.contacts, outcome, recorder.drift())
