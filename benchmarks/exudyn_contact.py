"""Cost of the slider's contact in Exudyn, by kind of contact: python benchmarks/exudyn_contact.py.

The paper's case, five bodies, steps of 5 us, recording excluded; of the user function's contact the memory of
impact speeds is included. Runs of all kinds alternate, and the least time of each counts: ratios hold where
times depend on what else the machine does.
"""

import time
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import exudyn as exu
import numpy as np
from plain_contact import corners_user_function

from comparison.scene import load_scene
from exudyn_model.assembly import assemble
from exudyn_model.bodies import SLIDER_X
from exudyn_model.contact.memory import EVENT, update_corners
from exudyn_model.five_bodies import mechanism
from exudyn_model.five_bodies.mechanism import build
from exudyn_model.five_bodies.settings import choose_steps, jacobian_uses, newton_tolerance, settings
from exudyn_model.model import Model
from exudyn_model.reading import read_scene

ROUNDS = 7
STEP = 5e-6
# 0.08 s: in flight and in contact
CYCLES = 0.2


def model(kind: str) -> tuple[Model, Any]:
    """Build the mechanism with one kind of contact; also Exudyn's settings."""
    values = {"drive.cycles": CYCLES, "solver.exudyn.step": STEP, "solver.exudyn.formulation": "full"}
    parameters = read_scene(load_scene("paper", values).data)
    steps = choose_steps(parameters)
    replaced: dict[str, Any] = {}
    if kind == "bare mechanism":
        replaced["_add_contact"] = lambda *_: None
    if kind == "user function, plain Python":
        replaced["force_user_function"] = lambda _, contacts: corners_user_function(
            parameters.contact, parameters.mechanism.slider, steps.size, contacts
        )
    with patch.multiple(mechanism, **replaced) if replaced else patch.dict({}):
        built = build(parameters, assemble(parameters), steps.size)
    tolerance = newton_tolerance(parameters, steps.size)
    uses = jacobian_uses(parameters)
    return built, settings(steps, parameters.integration.method, tolerance, uses)


def update_memory(built: Model) -> Callable[[Any, float], bool]:
    """Make the function before each step that the user function's contact needs."""
    events, done, data = np.zeros(4000, EVENT), 0, built.mbs.systemData
    step = float(built.constants.law[0]["step"])

    def before_step(*_: Any) -> bool:
        nonlocal done
        q, v = data.GetODE2Coordinates(copy=False), data.GetODE2Coordinates_t(copy=False)
        update_corners(
            done * step, q[SLIDER_X:], v[SLIDER_X:], built.constants.law, built.contacts, events, 0
        )
        done += 1
        return True

    return before_step


def microseconds(kind: str) -> float:
    """Time of one step."""
    built, values = model(kind)
    if kind.startswith("user"):
        built.mbs.SetPreStepUserFunction(update_memory(built))
    started = time.perf_counter()
    built.mbs.SolveDynamic(values)
    return (time.perf_counter() - started) / float(values.timeIntegration.numberOfSteps) * 1e6


def main() -> None:
    """Measure and print a Markdown table."""
    exu.config.printToConsole = False
    kinds = ["bare mechanism", "user function, numba", "user function, plain Python"]
    measured: dict[str, list[float]] = {kind: [] for kind in kinds}
    for kind in kinds:
        microseconds(kind)  # compiles
    for _ in range(ROUNDS):
        for kind, times in measured.items():
            times.append(microseconds(kind))
    least = {kind: min(times) for kind, times in measured.items()}
    print("| contact | us a step | ratio |\n|---|---|---|")
    for kind, value in least.items():
        print(f"| {kind} | {value:.1f} | {value / least[kinds[0]]:.2f} |")


if __name__ == "__main__":
    main()
