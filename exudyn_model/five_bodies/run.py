"""One run of five bodies: choice of its steps, assembly, solution."""

from collections.abc import Callable
from typing import Any

import numpy as np

from exudyn_model.assembly import assemble
from exudyn_model.energy import mass_diagonal
from exudyn_model.five_bodies.constraints import Constraints
from exudyn_model.five_bodies.mechanism import build
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.settings import (
    SPECTRAL_RADIUS,
    choose_steps,
    jacobian_uses,
    newton_tolerance,
)
from exudyn_model.five_bodies.solver import solve
from exudyn_model.parameters import Parameters
from exudyn_model.run import Run


def run_five_bodies(parameters: Parameters, progress: Callable[[float], None] | None) -> Run:
    """Run the formulations "full" and "native"; ``progress`` as for ``simulation.simulate``."""
    steps = choose_steps(parameters)
    model = build(parameters, assemble(parameters), steps.size)
    masses = mass_diagonal(parameters.mechanism) if parameters.integration.energy else np.zeros(0)
    recorder = Recorder(model, steps.per_sample, steps.samples, masses, Constraints(parameters))
    method = parameters.integration.method
    tolerance = newton_tolerance(parameters, steps.size)
    uses = jacobian_uses(parameters)
    outcome = solve(model.mbs, steps, method, tolerance, uses, recorder, progress)
    settings: dict[str, Any] = {
        "step_used": steps.size,
        "steps_per_sample": steps.per_sample,
        "newton_tolerance": tolerance,
    }
    if method == "generalized-alpha":
        settings["spectral_radius"] = SPECTRAL_RADIUS
    name = "five bodies"
    if parameters.integration.formulation == "native":
        name += ", native contact"
    return Run(name, settings, recorder, model.contacts, outcome, recorder.drift)
