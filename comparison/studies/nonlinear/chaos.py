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
from comparison.studies.nonlinear.methods import Exponent, PerturbedOrbits, closest_measured, exponents
from comparison.studies.nonlinear.press import SAMPLES, TRANSIENT, Memory
from comparison.studies.shared.study import part
from comparison.tables.arrays import Array

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


class Chaos(Enum):
    """What the exponents say of a scene."""

    CHAOTIC = "chaotic"
    REGULAR = "not chaotic"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Results:
    """What was run, and what follows from it at once."""

    config: Config
    perturbed: dict[Key, PerturbedOrbits | None]
    """Perturbed runs; None where they cannot be followed."""
    exponents: dict[Key, list[Exponent]]
    """One a distance; none where they cannot be followed."""
    best: dict[Key, Exponent]
    """Of these the ones to believe."""
    sections: dict[tuple[str, str], Array]
    """(scene, model) -> states by cycle and angle, shape (cycles, angles, 4), without the first cycles."""
    scatter: dict[str, Array]
    """Scene -> how far its states scatter at each angle of the reference's long run, m, shape (angles,)."""
    memories: list[Memory]
    """What the main scene's states after a rest have of the frozen impact speeds, by the reference."""
    swept: dict[str, dict[float, Array]]
    """Key -> value -> x over the clearance by cycle and angle, shape (cycles, angles); of successful runs."""


# ---- runs


def scene_of(name: str, model: str, tolerance: float, values: Mapping[str, object] | None = None) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates the tree (rod 4 and slider)."""
    fixed: dict[str, object] = {f"solver.{model}.tolerance": tolerance, **(values or {})}
    if model == "exudyn":
        fixed["solver.exudyn.formulation"] = "tree"
    return load_scene(MAIN, FORGETS | fixed) if name == FORGETTING else load_scene(name, fixed)


def chains(config: Config) -> dict[Key, press.Chain]:
    """Return all orbits with perturbed runs."""
    which = [(name, "reference", tol) for name in config.scenes for tol in config.tolerances["reference"]]
    which += [(MAIN, "exudyn", tol) for tol in config.tolerances["exudyn"]]
    which += [(name, "exudyn", USUAL["exudyn"]) for name in config.scenes if name != MAIN]
    which += [(FORGETTING, model, USUAL[model]) for model in MODELS]
    return {
        (name, model, tol): press.Chain(
            scene_of(name, model, tol), model, config.cycles[model], DISTANCES[model]
        )
        for name, model, tol in which
    }


def sparse(name: str, model: str, tolerance: float, cycles: int, values: Mapping[str, object]) -> Job:
    """Return a run for sections."""
    fixed = {"drive.cycles": float(cycles), "output.groups": [], "output.samples_per_cycle": ANGLES}
    return Job(scene_of(name, model, tolerance, {**values, **fixed}), model)


def long_runs(config: Config) -> dict[tuple[str, str], Job]:
    """Return long runs of each scene by each model."""
    return {
        (name, model): sparse(
            name, model, USUAL[model], (config.long_main if name == MAIN else config.long)[model], {}
        )
        for name in (*config.scenes, FORGETTING)
        for model in MODELS
    }


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Follow perturbed runs, and run the rest.

    Raises
    ------
    RunError
        If a long run does not succeed.
    """
    asked = chains(config)
    halves = part(on_progress, 0.0, 0.5), part(on_progress, 0.5, 1.0)
    rows = measure_all(press.measure, list(asked.values()), on_processes(n_jobs), halves[0])
    perturbed = {key: press.orbits_of(row) for key, row in zip(asked, rows, strict=True)}
    long = long_runs(config)
    swept = {
        (key, value): sparse(MAIN, "reference", 1e-10, SWEPT_CYCLES, {key: value})
        for key, values in config.swept.items()
        for value in values
    }
    outcomes = dict(
        zip([*long, *swept], run_all([*long.values(), *swept.values()], n_jobs, halves[1]), strict=True)
    )
    tables = {which: successful(outcomes[which], job) for which, job in long.items()}
    sections = {
        which: press.by_cycle(press.states(table, long[which].scene), long[which].scene)[TRANSIENT:]
        for which, table in tables.items()
    }
    scatter = {
        name: press.spread(states, long[name, model].scene)
        for (name, model), states in sections.items()
        if model == MODELS[0]
    }
    measured = {
        key: [] if orbits is None else exponents(orbits, SAMPLES, skip=1) for key, orbits in perturbed.items()
    }
    diagrams: dict[str, dict[float, Array]] = {key: {} for key in config.swept}
    for (key, value), job in swept.items():
        if (table := outcomes[key, value].table) is not None:
            x = press.by_cycle(press.states(table, job.scene), job.scene)[-SHOWN_CYCLES:, :, 0]
            diagrams[key][value] = x / job.scene.data["clearance"]["slider"]
    return Results(
        config,
        perturbed,
        measured,
        believed(measured, {name: float(sizes.max()) for name, sizes in scatter.items()}),
        sections,
        scatter,
        press.remembered(tables[MAIN, "reference"], long[MAIN, "reference"].scene, TRANSIENT),
        diagrams,
    )


# ---- verdict


def believed(measured: Mapping[Key, Sequence[Exponent]], scatter: Mapping[str, float]) -> dict[Key, Exponent]:
    """Return the exponent to believe of each orbit, of those whose perturbed runs are neighbours.

    Parameters
    ----------
    measured
        Exponents, one a distance; none where the runs could not be followed.
    scatter
        Of each scene the largest scatter of its states over the angles, m.
    """
    best = {}
    for key, candidates in measured.items():
        if candidates:
            name, model, _ = key
            near = [e for e, d in zip(candidates, DISTANCES[model], strict=True) if d <= NEAR * scatter[name]]
            best[key] = closest_measured(near or candidates[:1])
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
