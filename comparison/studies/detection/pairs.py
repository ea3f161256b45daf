"""Two sides compared as the results of one scene, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from comparison.execution.run import RunError, run_one
from comparison.files import plain
from comparison.scene import Scene, SceneError
from comparison.studies.detection.copies import load_copy
from comparison.studies.detection.tables import SPOILS
from comparison.studies.detection.tasks import Comparison, Found, Side, cached_runs, refusal
from comparison.studies.shared.scenes import leaves
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare
from comparison.verdict.refinement import settle, without_violation
from comparison.verdict.results import SceneComparison
from comparison.words.differences import confirmation
from comparison.words.verdicts import scene_reason

_MOVED = ("initial.slider_offset", "initial.slider_angle", "mechanism.crank_angle_deg")
"""Where an ensemble's starts lie apart."""
_CONFIRMATION = ("outcome", "members", "factor", "suspicious")
"""What is kept of a confirmation."""


@dataclass(frozen=True)
class Pair(Comparison):
    """Two sides judged as results of one scene; found is `summary`, or why they cannot be compared."""

    scene: Scene
    a: Side
    b: Side
    tier: str
    spoil: str = ""
    """Of `SPOILS`: what happens to the tables of ``b``, or of both."""
    environment: tuple[tuple[str, str], ...] = ()
    """Variables of the process in which it is found, see `comparison.studies.detection.rounding`."""

    @property
    def sides(self) -> tuple[Side, ...]:
        """Both sides."""
        return self.a, self.b

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.b.cost + 0.1 * self.a.cost

    def find(self) -> Found:
        """Run what has not run yet in this process, judge, and have a difference confirmed."""
        try:
            found = summary(self.judged(*self.valid_runs()))
        except (RunError, SceneError, TableError) as error:
            found = refusal(str(error))
        return found | {"scene": self.scene.name}

    def valid_runs(self) -> tuple[tuple[Runs, Runs], Scene, int]:
        """Return the runs of both sides, one level finer where five bodies violate an invariant."""
        try:
            return self.spoiled(cached_runs(self.a), cached_runs(self.b)), self.scene, 0
        except RunError as error:
            side = self.a if error.job.model == self.a.runs_by else self.b
            models = self.a.model, self.b.model
            again = without_violation(self.scene, [(side.model, error.outcome)], models, self.families)
            if again is None:
                raise
            return again[1], again[0], 1

    def judged(self, runs: tuple[Runs, Runs], scene: Scene | None = None, level: int = 0) -> SceneComparison:
        """Compare the runs of both sides; a difference is confirmed by ensembles before it is one."""
        a, b = models = (self.a.model, self.b.model)
        labels = models if a != b else (a, f"{b} again")
        scene = scene or self.scene
        result = compare(*runs, scene=scene, labels=labels, tier=self.tier)
        return settle(
            result,
            runs,
            scene=scene,
            models=models,
            run=self.ensemble,
            run_families=self.families,
            level=level,
        ).comparison

    def spoiled(self, a: Runs, b: Runs) -> tuple[Runs, Runs]:
        """Return the runs of both sides with what happens to their tables."""
        return SPOILS[self.spoil](a, b) if self.spoil else (a, b)

    def families(self, scene: Scene) -> tuple[Runs, Runs] | None:
        """Run both sides at the settings of a scene; None if a run does not succeed."""
        sides = [replace(side, scene=_change(self.scene, side.scene)(scene)) for side in self.sides]
        try:
            return self.spoiled(cached_runs(sides[0]), cached_runs(sides[1]))
        except (RunError, SceneError, TableError):
            return None

    def ensemble(self, scenes: Sequence[Scene], model: str) -> list[Table]:
        """Run an ensemble of a model as its side of this pair runs it; those that succeed.

        Where both sides are of one model this is the first one, as they differ by their numerics alone.
        """
        first = model == self.a.model
        side = self.a if first else self.b
        if side.engine:
            load_copy(side.engine)
        given = _change(self.scene, side.scene)
        tables = []
        for scene in scenes:
            try:
                table = run_one(given(scene), side.runs_by)
                spoiled = self.spoiled(Runs(table), Runs(table))[0 if first else 1].base
            except (RunError, SceneError, TableError):
                continue
            tables.append(spoiled)
        return tables


def _change(scene: Scene, given: Scene) -> Callable[[Scene], Scene]:
    """Return what makes of a scene what a side is given, as it was given ``given`` for ``scene``.

    Numbers that an ensemble moves are moved from there, all others are what the side was given.
    """
    before, after = leaves(scene.data), leaves(given.data)
    changed = {key: value for key, value in after.items() if before.get(key) != value}

    def change(other: Scene) -> Scene:
        if not changed:
            return other
        theirs = leaves(other.data)
        return other.with_values(
            {
                key: theirs[key] + value - before[key] if key in _MOVED else value
                for key, value in changed.items()
            }
        )

    return change


def summary(result: SceneComparison) -> Found:
    """Return what the study needs of a comparison, as JSON holds it.

    ``first`` is the earliest sample that says "differ": of the channels with that verdict, the earliest
    predictable sample outside its threshold; of several at that time the one that is the most outside.
    """
    first: dict[str, Any] | None = None
    made = result.confirmation
    best = (np.inf, 0.0)
    for name, channel in result.channels.items():
        if channel.verdict != "differ" or channel.u is None:
            continue
        judged = channel.judged
        threshold = channel.limits.k * channel.u
        outside = np.flatnonzero(judged & (np.abs(channel.difference) > threshold))
        if not outside.size:
            # Separated by the largest uncertainty of all times, though no sample is predictable.
            threshold = np.full(threshold.shape, channel.worst_threshold)
            outside = np.flatnonzero(np.abs(channel.difference) > threshold)
        at = int(outside[0])
        excess = float(abs(channel.difference[at]) / threshold[at])
        if (result.time[at], -excess) < best:
            best = (float(result.time[at]), -excess)
            first = {
                "channel": name,
                "unit": channel.unit,
                "time": float(result.time[at]),
                "difference": float(abs(channel.difference[at])),
                "threshold": float(threshold[at]),
            }
    return {
        "verdict": result.verdict,
        "reason": scene_reason(result),
        "channels": {name: [c.verdict, c.coverage] for name, c in result.channels.items()},
        "first": first,
        "refined": result.refined,
        "confirmation": made
        and plain({name: getattr(made, name) for name in _CONFIRMATION} | {"sentence": confirmation(result)}),
    }
