"""Error and processor time of the settings of both models on one scene, within a stated time.

The most accurate runs of the two models are held against each other, and against the reference's from two
neighbouring starts: two runs alone may be close by chance where the motion magnifies errors. Three times
their distance from the most accurate one, the largest in a window (`comparison.accuracy.uncertainty.spread`),
is how well the motion is known. The error of a setting is its distance from the most accurate run and that of
these, where the motion is known well enough.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from math import nan

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.tiers import TIERS
from comparison.accuracy.uncertainty import perturbed_scenes, spread, window_samples
from comparison.agreement.refinement.candidates import Candidate, Timed, attempt, candidates
from comparison.agreement.refinement.estimate import CHANNEL, FLOOR
from comparison.execution.pool import Died, Share, work
from comparison.metrics.pareto import pareto
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

DECADES = tuple(10.0**-n for n in range(5, 13))
"""Errors for which the cheapest setting is looked for, m."""
LATE, WAITING = "time limit", "not begun"


@dataclass(frozen=True)
class WorkPrecision:
    """Settings of both models on a scene.

    Attributes
    ----------
    scene
        As it was given.
    rows
        A run a setting, in the order of `candidates`.
    exact, confirming
        Most accurate run of the reference, and of Exudyn; of one model alone its two most accurate runs. None
        without any.
    known
        How well the motion is known, m, shape (n,); empty where there are no two runs.
    neighbours
        Number of the runs from neighbouring starts that count in it.
    interrupted
        Whether it was stopped before its time.
    """

    scene: Scene
    rows: tuple[Timed, ...]
    exact: Timed | None
    confirming: Timed | None
    known: Array
    neighbours: int = 0
    interrupted: bool = False

    def coverage(self, error: float) -> float:
        """Return the share of the samples at which the motion is known to an error, m."""
        return float(np.mean(self.known <= error)) if self.known.size else 0.0

    @property
    def resolution(self) -> float:
        """How well the motion must be known where errors of settings are compared, m.

        As the predictable part of the tightest tier asks that covers enough; of none, what covers enough.
        """
        scale = channels()[CHANNEL].scale_value(self.scene.data, nan)
        wanted = [thresholds(tier).alpha * scale for tier in reversed(TIERS)]
        enough = [error for error in wanted if self.coverage(error) >= FLOOR]
        return enough[0] if enough else float(np.quantile(self.known, FLOOR, method="higher"))

    def error(self, row: Timed, known: float | None = None) -> float:
        """Return the largest error of a run where the motion is known so well, m; nan without a result.

        Parameters
        ----------
        row
            One of `rows`.
        known
            How well the motion must be known, m; default: `resolution`.
        """
        if row.x is None or self.exact is None or self.exact.x is None or not self.known.size:
            return nan
        limit = self.resolution if known is None else known
        distance = np.abs(row.x - self.exact.x)
        return float(np.max((distance + self.known / 3.0)[self.known <= limit], initial=0.0))

    @property
    def confirmed(self) -> bool:
        """Whether the most accurate run is held against the other model's."""
        return (
            self.exact is not None
            and self.confirming is not None
            and self.exact.candidate.model != self.confirming.candidate.model
        )

    @property
    def front(self) -> tuple[Timed, ...]:
        """Settings that no other one beats in error and processor time, the cheapest first."""
        rows = sorted((row for row in self.rows if self.error(row) >= 0.0), key=lambda row: row.seconds)
        best = pareto(np.array([self.error(row) for row in rows]), np.array([row.seconds for row in rows]))
        return tuple(row for row, kept in zip(rows, best, strict=True) if kept)

    def cheapest(self, error: float) -> Timed | None:
        """Return the setting with the least processor time that keeps an error, m, where it can be seen.

        None if there is none, or the motion is known to that error on less than `FLOOR` of the samples.
        """
        if self.coverage(error) < FLOOR:
            return None
        good = [row for row in self.rows if row.x is not None and self.error(row, error) <= error]
        return min(good, key=lambda row: row.seconds, default=None)


def work_precision(
    scene: Scene,
    seconds: float,
    *,
    n_jobs: int = 1,
    on_finished: Callable[[float, Timed], None] | None = None,
) -> WorkPrecision:
    """Run the settings of both models that could matter, as many as the time allows.

    Parameters
    ----------
    scene
        Whose settings; those of its solvers do not count.
    seconds
        Wall time after which nothing runs any more, s.
    n_jobs
        Worker processes.
    on_finished
        Called with the share of the time, 0 to 1, and each finished run.

    Notes
    -----
    An interrupt (Ctrl-C) ends the runs; the result has those that were finished. Uses worker processes: a
    script that calls this needs ``if __name__ == "__main__":``.
    """
    begun = time.monotonic()
    asked = candidates(scene)
    affordable = {str(n): each for n, each in enumerate(asked) if n < 2 or each.cost <= seconds * n_jobs}
    moved = perturbed_scenes(asked[0].scene)
    first = {name: affordable.pop(name) for name in ("0", "1")}
    affordable = first | {name: replace(asked[0], scene=of) for name, of in moved.items()} | affordable
    rows = {str(n): Timed(each, WAITING, nan) for n, each in enumerate(asked)}
    interrupted = False
    try:
        tasks = list(affordable.items())
        with closing(work(attempt, tasks, n_jobs, until=begun + seconds)) as events:
            for name, event in events:
                if isinstance(event, Share):
                    continue
                rows[name] = _row(affordable[name], event)
                if on_finished and name not in moved:
                    on_finished(min(1.0, (time.monotonic() - begun) / seconds), rows[name])
    except KeyboardInterrupt:
        interrupted = True
    neighbours = [rows.pop(name) for name in moved if name in rows]
    return held_against_each_other(scene, tuple(rows.values()), neighbours, interrupted=interrupted)


def held_against_each_other(
    scene: Scene, rows: Sequence[Timed], neighbours: Sequence[Timed] = (), *, interrupted: bool = False
) -> WorkPrecision:
    """Choose the most accurate of finished runs, and find out how well they know the motion.

    ``neighbours``: runs from neighbouring starts at the setting of the first row; they count if that is the
    most accurate.
    """
    reference, exudyn = (_most_accurate(rows, model) for model in MODELS)
    pair = [reference[0], exudyn[0]] if reference and exudyn else (reference or exudyn)[:2]
    exact, confirming = [*pair, None, None][:2]
    known = np.empty(0)
    beside = [row.x for row in neighbours if row.x is not None] if exact is rows[0] else []
    if exact is not None and confirming is not None and exact.x is not None and confirming.x is not None:
        half_width = window_samples(scene.period, scene.duration / (exact.x.size - 1))
        known = spread(exact.x, [confirming.x, *beside], half_width)
    return WorkPrecision(scene, tuple(rows), exact, confirming, known, len(beside), interrupted)


def _row(candidate: Candidate, event: object) -> Timed:
    if isinstance(event, Timed):
        return event
    status = event.words if isinstance(event, Died) else LATE
    return Timed(candidate, status, nan)


def _most_accurate(rows: Sequence[Timed], model: str) -> list[Timed]:
    """Return the finished runs of a model, the most accurate first: of its smallest formulation."""
    order = ("minimal", "multiplier", "tree", "full")
    good = [row for row in rows if row.x is not None and row.candidate.model == model]
    return sorted(good, key=lambda row: (order.index(row.candidate.formulation), row.candidate.setting))
