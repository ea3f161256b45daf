"""First-order second moments of the slider's errors over random inputs, checked by Monte Carlo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.formatting import quantity
from comparison.scene import Scene, load_scene
from comparison.scene.schema import RandomInput
from comparison.studies.random_inputs import tables
from comparison.studies.random_inputs.draws import RESPONSES, Drawn, Draws, run_draws
from comparison.studies.random_inputs.figures import draw_gradients, draw_precision, draw_probabilities
from comparison.studies.random_inputs.inputs import inputs_of, label
from comparison.studies.random_inputs.second_moment import Plane, fit_plane, paired_change
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array

SCENE = "150rpm-0.2mm"
TOLERANCE = 1e-10
MONTE_CARLO, GRADIENT = 1, 2  # seeds
LIMITS = {
    "displacement": (5.3e-5, 5.5e-5),
    "velocity": (7.8e-3, 8.2e-3),
    "acceleration": (60.0, 80.0),
    "displacement, against the nominal mechanism": (5e-4, 7e-4),
}
"""Two of each, the second exceeded seldom; the scene's own, of ``[reliability]``, come after them."""
COMPARED = ("displacement", "velocity", "acceleration")
"""Responses whose failure probability is compared at several tolerances."""
SLOPES = (("displacement", "clearance.slider"), ("acceleration", "contact.restitution"))
"""Response and input whose gradient is shown over the scale."""


@dataclass(frozen=True)
class Config:
    """How much is run."""

    samples: int
    """A cycle; peaks between them are those that the model has at its own steps."""
    runs: int
    """Of Monte Carlo."""
    plane: int
    """Runs that a plane is fitted to."""
    factors: tuple[float, ...]
    """Scales of the scatter over which a gradient is measured; the last is 1."""
    tolerances: tuple[float, ...]
    """Of the reference, the finest last."""
    common: int
    """Runs with the same inputs at every tolerance."""


@dataclass(frozen=True)
class Results:
    """Monte Carlo runs; planes by factor and response; runs with the same inputs by tolerance.

    With changes of the failure probability against the finest tolerance by response, shape (n - 1, 3): the
    change and its interval.
    """

    config: Config
    inputs: tuple[RandomInput, ...]
    many: Drawn
    planes: dict[float, dict[str, Plane]]
    common: dict[float, Drawn]
    changes: dict[str, Array]


def scene(samples: int, tolerance: float = TOLERANCE) -> Scene:
    """Return two cycles of the scene."""
    values: dict[str, object] = {
        "drive.cycles": 2.0,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": samples,
        "solver.reference.tolerance": tolerance,
    }
    return load_scene(SCENE, values)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all draws and fit the planes."""
    usual = scene(config.samples)
    inputs = inputs_of(usual)
    draws = [Draws(usual, inputs, config.plane, GRADIENT, factor) for factor in config.factors]
    # At the usual tolerance they are the first of the many.
    same = [scene(config.samples, tolerance) for tolerance in config.tolerances]
    draws += [Draws(each, inputs, config.common, MONTE_CARLO) for each in same]
    draws.append(Draws(usual, inputs, config.runs, MONTE_CARLO))
    *drawn, many = run_draws(draws, n_jobs, on_progress)
    planes = {
        factor: {name: fit_plane(of.u, of.responses[name].to_numpy()) for name in RESPONSES}
        for factor, of in zip(config.factors, drawn, strict=False)
    }
    common = dict(zip(config.tolerances, drawn[len(planes) :], strict=True))
    changes = {name: _changes(common, name) for name in COMPARED}
    return Results(config, inputs, many, planes, common, changes)


def _changes(common: dict[float, Drawn], response: str) -> Array:
    *coarse, finest = (of.responses[response] > LIMITS[response][0] for of in common.values())
    pairs = [pd.concat([failed, finest], axis=1, join="inner").to_numpy() for failed in coarse]
    return np.array([paired_change(*both.T) for both in pairs])


def draw(results: Results, folder: Path) -> None:
    """Draw probabilities, gradients over the scale, and changes over the tolerance."""
    draw_probabilities(results.many.responses, results.planes[1.0], folder / "probabilities.svg")
    slopes = {}
    for response, key in SLOPES:
        column = [label(one) for one in results.inputs].index(key)
        at = {factor: planes[response] for factor, planes in results.planes.items()}
        # Per standard deviation of the input, not of the runs.
        found = {factor: (plane.gradient[column], plane.errors[column]) for factor, plane in at.items()}
        slopes[f"{response} by {key}"] = RESPONSES[response], pd.DataFrame(found, ["gradient", "error"]).T
    draw_gradients(slopes, folder / "gradients.svg")
    costs = [f"{tolerance:.0e}\n{1e3 * of.seconds:.1f} ms" for tolerance, of in results.common.items()]
    draw_precision(costs[:-1], results.changes, folder / "precision.svg")


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, many, planes = results.config, results.many, results.planes[1.0]
    count = len(many.responses)
    settings = scene(config.samples).reliability
    limits = {
        name: (*LIMITS[name], float(getattr(settings, name.partition(",")[0]).upper)) for name in RESPONSES
    }
    return {
        "finding": tables.finding(planes, [label(one) for one in results.inputs]),
        "runs": f"{count:,}",
        "failed": len(many.failures),
        "plane_runs": config.plane,
        "common": config.common,
        "seconds": quantity(many.seconds, "s"),
        "total": quantity(many.seconds * (count + len(many.failures)), "s"),
        "inputs": tables.inputs(results.inputs),
        "moments": tables.moments(planes, many.responses),
        "importance": tables.importance(planes, [label(one) for one in results.inputs]),
        "agreement": tables.agreement(planes, many.responses, limits),
        "probabilities": tables.probabilities(planes, many.responses, limits),
        "precision": tables.precision(results.common, results.changes),
        "shifted": tables.shifted(results.common, results.changes),
    }


STUDY = Study(
    "random-inputs",
    small=Config(samples=40, runs=60, plane=30, factors=(0.1, 1.0), tolerances=(1e-7, 1e-10), common=20),
    full=Config(
        samples=500, runs=10_000, plane=400, common=2000, factors=(0.003, 0.03, 0.3, 1.0),
        tolerances=(1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11),
    ),
    measure=measure,
    page=page,
    draw=draw,
)  # fmt: skip
