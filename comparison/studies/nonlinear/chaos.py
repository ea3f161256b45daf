"""What the study nonlinear runs and measures, and its verdict: whether a scene is chaotic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.execution.tasks import measure_all, on_processes
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.nonlinear import press
from comparison.studies.nonlinear.methods import Exponent
from comparison.studies.nonlinear.press import TRANSIENT
from comparison.studies.shared.study import part
from comparison.tables.arrays import Array
from comparison.tables.table import Table

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
NEAR = 0.01
"""Of the largest scatter over the angles: perturbed runs that start farther away are no neighbours."""
ANGLES = 40
"""Samples a cycle of a long run."""
SWEPT_CYCLES, SHOWN_CYCLES = 60, 40
"""Of a run with another speed or clearance, and of these the last that are drawn."""


@dataclass(frozen=True)
class Config:
    """What is run."""

    scenes: tuple[str, ...]  # the first is `MAIN`
    tolerances: Mapping[str, tuple[float, ...]]
    """Model -> those of the perturbed runs of the main scene; the reference's in all scenes."""
    cycles: Mapping[str, int]  # model -> cycles through which these are followed
    long: Mapping[str, int]
    long_main: Mapping[str, int]
    """Model -> cycles of a run for sections; of the main scene enough for the 0-1 test."""
    swept: Mapping[str, tuple[float, ...]]  # key of a scene -> its values in a bifurcation diagram


class Chaos(Enum):
    """What the exponents say of a scene."""

    CHAOTIC = "chaotic"
    REGULAR = "not chaotic"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Results:
    """What was run, and what follows from it at once."""

    config: Config
    exponents: dict[Key, list[Exponent]]  # one a distance; none where they cannot be followed
    best: dict[Key, Exponent]  # of these the ones to believe
    sections: dict[tuple[str, str], Array]
    """(scene, model) -> states by cycle and angle, shape (cycles, angles, 4), without the first cycles."""
    scatter: dict[str, Array]
    """Scene -> how far its states scatter at each angle of the reference's long run, m, shape (angles,)."""
    swept: dict[str, dict[float, Array]]
    """Key -> value -> x over the clearance by cycle and angle, shape (cycles, angles); of successful runs."""


# ---- runs


def scene_of(name: str, model: str, tolerance: float, values: Mapping[str, object]) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates the tree (rod 4 and slider)."""
    fixed: dict[str, object] = {f"solver.{model}.tolerance": tolerance, **values}
    if model == "exudyn":
        fixed["solver.exudyn.formulation"] = "tree"
    return load_scene(MAIN, FORGETS | fixed) if name == FORGETTING else load_scene(name, fixed)


def sparse(name: str, model: str, tolerance: float, cycles: int, values: Mapping[str, object]) -> Job:
    """Return a run for sections."""
    fixed = {"drive.cycles": float(cycles), "output.groups": [], "output.samples_per_cycle": ANGLES}
    return Job(scene_of(name, model, tolerance, {**values, **fixed}), model)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Follow perturbed runs, and run the rest; every long run must succeed."""
    followed = [(name, "reference", tol) for name in config.scenes for tol in config.tolerances["reference"]]
    followed += [(MAIN, "exudyn", tol) for tol in config.tolerances["exudyn"]]
    followed += [(name, "exudyn", USUAL["exudyn"]) for name in config.scenes if name != MAIN]
    followed += [(FORGETTING, model, USUAL[model]) for model in MODELS]
    chains = [
        press.Chain(scene_of(*key, {}), key[1], config.cycles[key[1]], DISTANCES[key[1]]) for key in followed
    ]
    halves = part(on_progress, 0.0, 0.5), part(on_progress, 0.5, 1.0)
    rows = measure_all(press.measure, chains, on_processes(n_jobs), halves[0])
    measured = {
        key: [Exponent(*each) for each in row.get("exponents", [])]
        for key, row in zip(followed, rows, strict=True)
    }
    which = [(name, model) for name in (*config.scenes, FORGETTING) for model in MODELS]
    long = [
        sparse(name, model, USUAL[model], (config.long_main if name == MAIN else config.long)[model], {})
        for name, model in which
    ]
    varied = [(key, value) for key, values in config.swept.items() for value in values]
    swept = [sparse(MAIN, "reference", 1e-10, SWEPT_CYCLES, {key: value}) for key, value in varied]
    outcomes = run_all([*long, *swept], n_jobs, halves[1])
    tables = dict(zip(which, map(successful, outcomes, long), strict=True))
    scenes = {pair: job.scene for pair, job in zip(which, long, strict=True)}
    sections = {pair: cycles_of(table, scenes[pair])[TRANSIENT:] for pair, table in tables.items()}
    scatter = {
        name: press.spread(states, scenes[name, model])
        for (name, model), states in sections.items()
        if model == MODELS[0]
    }
    diagrams: dict[str, dict[float, Array]] = {key: {} for key in config.swept}
    for (key, value), job, outcome in zip(varied, swept, outcomes[len(long) :], strict=True):
        if outcome.table is not None:
            x = cycles_of(outcome.table, job.scene)[-SHOWN_CYCLES:, :, 0]
            diagrams[key][value] = x / job.scene.data["clearance"]["slider"]
    return Results(
        config,
        measured,
        believed(measured, {name: float(sizes.max()) for name, sizes in scatter.items()}),
        sections,
        scatter,
        diagrams,
    )


def cycles_of(table: Table, scene: Scene) -> Array:
    """Return the states of a run by cycle and angle, shape (cycles, angles, 4)."""
    return press.by_cycle(press.states(table, scene), scene)


# ---- verdict


def believed(measured: Mapping[Key, Sequence[Exponent]], scatter: Mapping[str, float]) -> dict[Key, Exponent]:
    """Return the exponent to believe of each orbit that could be followed.

    Of the distances (each has one exponent) at which perturbed runs are neighbours, by the largest scatter of
    a scene's states (m), the smallest at which it is measured; where it is nowhere, the lowest bound.
    """
    best = {}
    for (name, model, tolerance), of in measured.items():
        near = [e for e, d in zip(of, DISTANCES[model], strict=False) if d <= NEAR * scatter[name]] or of[:1]
        if near:
            lowest = min(near, key=lambda e: e.value)
            best[name, model, tolerance] = next((e for e in near if e.measured), lowest)
    return best


def verdict(best: Mapping[Key, Exponent], name: str) -> Chaos:
    """Return whether a scene is chaotic, by the exponents to believe of its runs.

    Chaotic: positive in every run that measures it, in both models. Not chaotic: it, or its upper bound,
    negative in every run.
    """
    runs = {key: e for key, e in best.items() if key[0] == name}
    measured = {key: e for key, e in runs.items() if e.measured}
    if {e.sign for e in measured.values()} == {1} and {model for _, model, _ in measured} == set(MODELS):
        return Chaos.CHAOTIC
    return Chaos.REGULAR if runs and {e.sign for e in runs.values()} == {-1} else Chaos.UNDECIDED
