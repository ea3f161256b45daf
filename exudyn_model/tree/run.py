"""One run of a tree: choice of the tree, assembly, solution."""

from collections.abc import Callable

from exudyn_model.assembly import assemble
from exudyn_model.parameters import Parameters
from exudyn_model.run import Run
from exudyn_model.tree import solver
from exudyn_model.tree.recording import TreeRecorder
from exudyn_model.tree.rocker_tree import build_rocker_tree
from exudyn_model.tree.slider_tree import build_slider_tree


def run_tree(parameters: Parameters, progress: Callable[[float], None] | None) -> Run:
    """Run the formulation "tree"; ``progress`` as for ``simulation.simulate``."""
    duration = parameters.samples * parameters.sample_interval
    if parameters.journal is None:
        name, build = "rod 4 and slider tree", build_slider_tree
    else:
        name, build = "rocker, rods and slider tree", build_rocker_tree
    model = build(parameters, assemble(parameters))
    least = solver.least_step(duration)
    recorder = TreeRecorder(
        model, parameters.sample_interval, parameters.samples, parameters.drive.period, least
    )
    cycles = parameters.drive.cycles
    outcome = solver.solve(model.mbs, duration, cycles, parameters.integration, recorder, progress)
    return Run(name, {"least_step": least}, recorder, model.contacts, outcome)
