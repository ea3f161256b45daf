"""A setting with the runs that estimate its error: itself, a finer, a coarser and two perturbed runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from comparison.accuracy.levels import refinement
from comparison.accuracy.uncertainty import Runs, perturbed_scenes
from comparison.agreement.planned_runs import levels
from comparison.agreement.refinement.estimate import Estimate, estimate
from comparison.execution.run import Outcome
from comparison.scene import Scene
from comparison.tables.table import Table

Run = Callable[[Sequence[Scene]], list[Outcome]]
"""Runs scenes by a model."""


@dataclass(frozen=True)
class Level:
    """A setting that was tried.

    Attributes
    ----------
    scene
        With the setting.
    outcomes
        Of its family, by the names in `comparison.accuracy.uncertainty.Runs`.
    estimate
        Of the error of the run at this setting; None where too many of the runs did not succeed.
    """

    scene: Scene
    outcomes: dict[str, Outcome]
    estimate: Estimate | None

    def table(self, kind: str = "base") -> Table | None:
        """Return the table of one of its runs; None where that did not succeed, or there is none."""
        outcome = self.outcomes.get(kind)
        return None if outcome is None else outcome.table

    @property
    def failed(self) -> Outcome | None:
        """The most telling of its runs that did not succeed: the run itself, else the finer one."""
        ended = [self.outcomes[kind] for kind in ("base", "finer") if kind in self.outcomes]
        return next((outcome for outcome in ended if outcome.table is None), None)


class Families:
    """Levels of one model, which share their runs.

    Parameters
    ----------
    model
        Which runs.
    run
        Runs its scenes.
    """

    def __init__(self, model: str, run: Run) -> None:
        self._model, self._run = model, run
        self._ran: dict[str, Outcome] = {}

    @property
    def count(self) -> int:
        """Number of runs so far."""
        return len(self._ran)

    def level(self, scene: Scene) -> Level:
        """Run the family of a setting.

        The perturbed runs are those of the coarser setting; where that has no result, of this one.
        """
        outcomes = self._outcomes(levels(scene, self._model))
        if outcomes["base"].table is not None and _lost(outcomes, "coarser"):
            outcomes = {kind: outcomes[kind] for kind in ("base", "finer") if kind in outcomes}
            outcomes |= self._outcomes(perturbed_scenes(scene))
        return Level(scene, outcomes, self._estimate(scene, outcomes))

    def _outcomes(self, family: dict[str, Scene]) -> dict[str, Outcome]:
        new = {scene.hash: scene for scene in family.values() if scene.hash not in self._ran}
        self._ran |= dict(zip(new, self._run(list(new.values())), strict=True))
        return {kind: self._ran[scene.hash] for kind, scene in family.items()}

    def _estimate(self, scene: Scene, outcomes: dict[str, Outcome]) -> Estimate | None:
        tables = {kind: outcome.table for kind, outcome in outcomes.items() if outcome.table is not None}
        perturbed = [kind for kind in outcomes if kind.endswith("perturbed")]
        if not {"base", "finer"} <= set(tables) or (perturbed and not set(perturbed) & set(tables)):
            return None
        return estimate(Runs(refinement=refinement(self._model, scene), **tables), scene.period)


def _lost(outcomes: dict[str, Outcome], kind: str) -> bool:
    return kind in outcomes and outcomes[kind].table is None
