"""Runs that a comparison needs: those of each model's uncertainty, and those of the reliability."""

from __future__ import annotations

from comparison.accuracy.levels import coarser, finer, refinement
from comparison.accuracy.uncertainty import perturbed_scenes
from comparison.execution.job import VIOLATED, Job, Outcome
from comparison.reliability.ideal import ideal_scenes
from comparison.scene import Scene
from comparison.tables.table import Table
from comparison.verdict.compare import Runs


def family(scene: Scene, model: str) -> list[tuple[str, Job]]:
    """Return the runs that give a model's uncertainty, by their names in `accuracy.uncertainty.Runs`."""
    return [(kind, Job(level, model)) for kind, level in levels(scene, model).items()]


def levels(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the scenes of these runs: base, finer, coarser, perturbed; as available."""
    coarse = coarser(model, scene)
    variants = {"base": scene, "finer": finer(model, scene), "coarser": coarse}
    there = {kind: variant for kind, variant in variants.items() if variant is not None}
    return there if coarse is None else there | perturbed_scenes(coarse)


def table_of_family(kind: str, outcome: Outcome) -> Table | None:
    """Return the table of a run by its name in a family; None if there is none to use.

    A run at the coarser setting may violate an invariant of its model (measured: the rate of a constraint in
    one impact at 4e-6 s, not at the scene's own 2e-6 s): what it gets wrong widens the uncertainty of the
    base run, which is the one that must hold them.
    """
    coarse = kind not in ("base", "finer")
    return outcome.partial if coarse and outcome.status == VIOLATED else outcome.table


def families(scene: Scene, models: tuple[str, str]) -> dict[tuple[str, str], Job]:
    """Return the runs of both models by model and name."""
    return {(model, kind): job for model in models for kind, job in family(scene, model)}


def ideal_runs(scene: Scene, models: tuple[str, str]) -> dict[tuple[str, str], Job]:
    """Return those of the ideal mechanism, by which the reliability is judged, in the same way.

    The reliability itself is that of the `families` of `comparison.reliability.ideal.dense_scene`.
    """
    return {
        (model, kind): Job(ideal, model)
        for model in models
        for kind, ideal in ideal_scenes(scene, model).items()
    }


def sorted_runs(
    scene: Scene, models: tuple[str, str], outcomes: dict[tuple[str, str], Outcome]
) -> dict[str, Runs]:
    """Sort the tables of families by model."""
    tables: dict[str, dict[str, Table]] = {model: {} for model in models}
    for (model, kind), outcome in outcomes.items():
        table = table_of_family(kind, outcome)
        if table is not None:
            tables[model][kind] = table
    return {model: Runs(refinement=refinement(model, scene), **tables[model]) for model in models}
