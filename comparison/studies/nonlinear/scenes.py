"""What the study nonlinear runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from comparison.execution.run import Job
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.nonlinear.chains import Chain

Key = tuple[str, str, float]
"""Scene, model, and its tolerance."""

MAIN = "150rpm-0.2mm"
FORGETTING = "150rpm-0.2mm, without memory"
"""Label of the main scene with a damping that refers to the speed of the moment."""
FORGETS = {"contact.impact_speed": "current"}
SPEED, CLEARANCE = "drive.speed_rpm", "clearance.slider"
USUAL = {"reference": 1e-12, "exudyn": 1e-10}
"""Tolerances of the models where only one is run."""
DISTANCES = {"reference": (1e-10, 1e-9, 1e-8, 1e-7, 1e-6), "exudyn": (1e-8, 1e-7)}
"""m, of perturbed runs from their orbit."""
ANGLES = 40
"""Samples a cycle of a long run."""
SWEPT_CYCLES = 60
"""Of a run with another speed or clearance."""


@dataclass(frozen=True)
class Config:
    """What is run."""

    scenes: tuple[str, ...]
    """The first is `MAIN`."""
    tolerances: Mapping[str, tuple[float, ...]]
    """Model -> those of the perturbed runs of the main scene; the reference's in all scenes."""
    cycles: Mapping[str, int]
    """Model -> cycles through which these are followed: Exudyn takes some 4 s a cycle for its five runs of
    each of nine stages."""
    long: Mapping[str, int]
    long_main: Mapping[str, int]
    """Model -> cycles of a run for sections; of the main scene enough for the 0-1 test."""
    swept: Mapping[str, tuple[float, ...]]
    """Key of a scene -> its values in a bifurcation diagram."""
    periods: int
    """Of the systems whose answers are known."""


def of_model(name: str, model: str, tolerance: float, values: Mapping[str, object] | None = None) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates the tree (rod 4 and slider)."""
    fixed: dict[str, object] = {"solver.exudyn.formulation": "tree"} if model == "exudyn" else {}
    if name == FORGETTING:
        name, fixed = MAIN, fixed | FORGETS
    return load_scene(name, fixed | {f"solver.{model}.tolerance": tolerance} | {**(values or {})})


def chains(config: Config) -> dict[Key, Chain]:
    """Return all orbits with perturbed runs."""
    which = [(name, "reference", tol) for name in config.scenes for tol in config.tolerances["reference"]]
    which += [(MAIN, "exudyn", tol) for tol in config.tolerances["exudyn"]]
    which += [(name, "exudyn", USUAL["exudyn"]) for name in config.scenes if name != MAIN]
    which += [(FORGETTING, model, USUAL[model]) for model in MODELS]
    return {
        (name, model, tol): Chain(of_model(name, model, tol), model, config.cycles[model], DISTANCES[model])
        for name, model, tol in which
    }


def long_runs(config: Config) -> dict[tuple[str, str], Job]:
    """Return long runs of each scene by each model."""
    return {
        (name, model): _sparse(
            name, model, USUAL[model], {}, (config.long_main if name == MAIN else config.long)[model]
        )
        for name in (*config.scenes, FORGETTING)
        for model in MODELS
    }


def swept(config: Config) -> dict[tuple[str, float], Job]:
    """Return runs of the main scene with other values of a key."""
    return {
        (key, value): _sparse(MAIN, "reference", 1e-10, {key: value}, SWEPT_CYCLES)
        for key, values in config.swept.items()
        for value in values
    }


def _sparse(name: str, model: str, tolerance: float, values: Mapping[str, object], cycles: int) -> Job:
    fixed = {"drive.cycles": float(cycles), "output.groups": [], "output.samples_per_cycle": ANGLES}
    return Job(of_model(name, model, tolerance, {**values, **fixed}), model)
