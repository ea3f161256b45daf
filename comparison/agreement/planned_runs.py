"""Runs that a comparison needs: those of each model's uncertainty, and the ideal mechanism's."""

from __future__ import annotations

from comparison.accuracy.levels import coarser, finer, refinement
from comparison.accuracy.uncertainty import perturbed_scenes
from comparison.agreement.compare import Runs
from comparison.execution.job import Job, Outcome
from comparison.reliability.ideal import ideal_scenes
from comparison.scene import Scene


def family(scene: Scene, model: str) -> list[tuple[str, Job]]:
    """Return the runs that give a model's uncertainty, by their names in `accuracy.uncertainty.Runs`."""
    return [(kind, Job(level, model)) for kind, level in levels(scene, model).items()]


def levels(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the scenes of these runs: base, finer, coarser, perturbed; as available."""
    coarse = coarser(model, scene)
    variants = {"base": scene, "finer": finer(model, scene), "coarser": coarse}
    there = {kind: variant for kind, variant in variants.items() if variant is not None}
    return there if coarse is None else there | perturbed_scenes(coarse)


class Plan:
    """Runs of a comparison, and those of the ideal mechanism for the reliability."""

    def __init__(self, scene: Scene, tier: str, models: tuple[str, str], command: str) -> None:
        self.scene, self.tier, self.models, self.command = scene, tier, models, command
        self.jobs = {(model, kind): job for model in models for kind, job in family(scene, model)}
        self.ideals = {
            (model, kind): Job(ideal, model)
            for model in models
            for kind, ideal in ideal_scenes(scene, model).items()
        }


def sorted_runs(plan: Plan, outcomes: dict[tuple[str, str], Outcome]) -> dict[str, Runs]:
    """Sort the tables of runs that all succeeded by model."""
    return {
        model: Runs(
            refinement=refinement(model, plan.scene),
            **{
                kind: outcome.table
                for (of, kind), outcome in outcomes.items()
                if of == model and outcome.table
            },
        )
        for model in plan.models
    }
