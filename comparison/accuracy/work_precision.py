"""Error and processor time of the settings of both models on one scene, within a stated time.

The uncertainty of the motion is three times the largest distance, in a window, of the most accurate run from
that of the other model and from its own of two neighbouring starts, since two runs alone may be close by
chance. The error of a setting is its distance from the most accurate run plus a third of this uncertainty,
at the samples where this is small enough.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, nan

import numpy as np

from comparison.accuracy.levels import TIERS, scene_at, thresholds
from comparison.accuracy.refine import CHANNEL, FLOOR
from comparison.accuracy.uncertainty import (
    SAFETY_FACTOR,
    error_on,
    perturbed_scenes,
    share_within,
    spread,
    window_samples,
)
from comparison.execution.pool import Death, Share, work
from comparison.execution.run import RunError, run_one
from comparison.models import MODELS, declared_formulations, formulations, smallest
from comparison.scene import Scene, SceneError
from comparison.tables.channels import Array, channels

_TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
SETTINGS = {
    "minimal": _TOLERANCES,
    "multiplier": _TOLERANCES,
    "tree": _TOLERANCES[:-1],
    "full": (8e-6, 4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7),
}
"""Formulation -> its tolerances, or steps in s, coarsest first; a model's smallest formulation first."""
EXACT = {"minimal": 1e-13, "tree": 1e-11, "full": 5e-7}
"""Formulation -> its most accurate setting that a minute allows; the others are compared with its run."""
DECADES = tuple(10.0**-n for n in range(5, 13))  # m, for which the cheapest setting is looked for
WARM = 0.02  # cycles of a first run that compiles code; its time does not count
SHORT = 0.1  # s of processor time within which a run is repeated up to twice: the least counts
TIME_LIMIT, WAITING = "time limit", "not begun"
_warm: set[str] = set()


@dataclass(frozen=True)
class Candidate:
    """A scene at a setting of a formulation."""

    scene: Scene
    model: str
    formulation: str
    key: str  # of the setting: "tolerance" or "step"
    setting: float


@dataclass(frozen=True, eq=False)
class TimedRun:
    """One run of a candidate: processor time, s, and if it has a result slider_x, m, shape (n,), and work."""

    candidate: Candidate
    status: str  # "success", a status of the model, or the reason why it did not run
    seconds: float = nan
    x: Array | None = None
    evaluations: int | None = None  # of the equations of motion


@dataclass(frozen=True)
class WorkPrecision:
    """Settings of both models on a scene."""

    scene: Scene
    rows: tuple[TimedRun, ...]  # a run for each setting, in the order of `candidates`
    exact: TimedRun | None  # most accurate run: of the reference where it has one
    confirming: TimedRun | None  # that of the other model, or the second one of the same where that has none
    u: Array  # uncertainty of the motion itself, m, shape (n,); empty without two runs
    neighbours: int  # runs from neighbouring starts that count in it
    interrupted: bool

    @property
    def confirmed(self) -> bool:
        """True if the most accurate run is compared with the other model's."""
        pair = self.exact, self.confirming
        return len({row.candidate.model for row in pair if row is not None}) == 2

    def coverage(self, error: float) -> float:
        """Return the share of the samples at which u is at most an error, m."""
        return share_within(self.u, error)

    @cached_property
    def resolution(self) -> float:
        """Largest u at which errors are compared, m: the least that enough samples keep."""
        scale = channels()[CHANNEL].scale_value(self.scene.data, nan)
        limits = [thresholds(tier).largest(scale) for tier in reversed(TIERS)]
        errors = [error for error in limits if self.coverage(error) >= FLOOR]
        return errors[0] if errors else error_on(self.u, FLOOR)

    def error(self, row: TimedRun, largest_u: float | None = None, *, doubt: float = 1.0) -> float:
        """Return the largest error of a run, m, where u is at most ``largest_u``, by default `resolution`.

        The error of the most accurate run is added to the distance from it; ``doubt`` -1 subtracts it.
        """
        if row.x is None or self.exact is None or self.exact.x is None or not self.u.size:
            return nan
        counts = self.u <= (self.resolution if largest_u is None else largest_u)
        distance = np.abs(row.x - self.exact.x) + doubt * self.u / SAFETY_FACTOR
        return float(np.max(distance[counts], initial=0.0))

    @cached_property
    def front(self) -> tuple[TimedRun, ...]:
        """Settings whose error is certainly below that of each cheaper one here, the cheapest first."""
        front, least = list[TimedRun](), inf
        rows = [row for row in self.rows if self.error(row) >= 0.0]
        for row in sorted(rows, key=lambda row: (row.seconds, self.error(row))):
            if self.error(row) < least:
                front.append(row)
                least = self.error(row, doubt=-1.0)
        return tuple(front)

    def cheapest(self, error: float) -> TimedRun | None:
        """Return the setting with the least processor time that keeps an error, m, if it can be seen."""
        if self.coverage(error) < FLOOR:
            return None
        rows = [row for row in self.rows if self.error(row, error) <= error]
        return min(rows, key=lambda row: row.seconds, default=None)


def candidates(scene: Scene) -> list[Candidate]:
    """Return the settings that can run a scene: each model's most accurate, then all from coarse to fine.

    Exudyn's tree is left out where a scene asks for forces that only its five bodies have; multipliers,
    which take as many steps of more work, where the scene does not name them.
    """
    exudyn_formulation = smallest("exudyn", scene.data)
    names = {"minimal", exudyn_formulation, "full", scene.data["solver"]["reference"]["formulation"]}
    models = {name: model for model in MODELS for name in formulations(model, scene.data) if name in names}

    def candidate(name: str, setting: float) -> Candidate:
        model = models[name]
        key = declared_formulations(model)[name]["setting"]
        return Candidate(scene_at(scene, model, name, setting), model, name, key, setting)

    exact = {(name, EXACT[name]): None for name in ("minimal", exudyn_formulation)}
    rest = [(place, name, each) for name in models for place, each in enumerate(SETTINGS[name])]
    others = {(name, setting): None for _, name, setting in sorted(rest, key=lambda each: each[0])}
    return [candidate(*each) for each in exact | others]


def time_run(candidate: Candidate, progress: Callable[[float], None]) -> TimedRun:
    """Run a candidate and measure its time, after a short run that compiles."""
    del progress
    try:
        if candidate.formulation not in _warm:
            per_cycle = candidate.scene.data["output"]["samples_per_cycle"]
            cycles = max(1, round(WARM * per_cycle)) / per_cycle
            run_one(candidate.scene.variant({"drive.cycles": cycles}), candidate.model)
            _warm.add(candidate.formulation)
        times: list[float] = []
        while not times or (len(times) < 3 and sum(times) < SHORT):
            start = time.process_time()
            table = run_one(candidate.scene, candidate.model)
            times.append(time.process_time() - start)
    except RunError as error:
        return TimedRun(candidate, error.outcome.status)
    except SceneError as error:
        return TimedRun(candidate, " ".join(str(error).split()))
    counters = table.provenance["counters"]
    evaluations = counters.get("rhs", counters.get("newton_iterations"))
    return TimedRun(candidate, "success", min(times), table.values(CHANNEL), evaluations)


def work_precision(
    scene: Scene,
    seconds: float,
    *,
    n_jobs: int = 1,
    on_finished: Callable[[float, TimedRun], None] | None = None,
) -> WorkPrecision:
    """Run the settings of both models that could matter, as many as the time allows, or until Ctrl-C.

    Parameters
    ----------
    seconds
        Wall time after which nothing runs any more, s.
    n_jobs
        Worker processes: a script that calls this needs ``if __name__ == "__main__":``.
    on_finished
        Called with the share of the time, 0 to 1, and each finished run.
    """
    start_time = time.monotonic()
    planned = {str(number): candidate for number, candidate in enumerate(candidates(scene))}
    rows = {name: TimedRun(candidate, WAITING) for name, candidate in planned.items()}
    first = planned["0"]
    neighbours = {name: replace(first, scene=start) for name, start in perturbed_scenes(first.scene).items()}
    tasks = {name: planned[name] for name in ("0", "1")} | neighbours | planned
    interrupted = False
    try:
        with closing(work(time_run, list(tasks.items()), n_jobs, until=start_time + seconds)) as events:
            for name, event in events:
                if isinstance(event, Share):
                    continue
                status = event.words if isinstance(event, Death) else TIME_LIMIT
                rows[name] = event if isinstance(event, TimedRun) else TimedRun(tasks[name], status)
                if on_finished and name not in neighbours:
                    on_finished(min(1.0, (time.monotonic() - start_time) / seconds), rows[name])
    except KeyboardInterrupt:
        interrupted = True
    neighbour_runs = [rows.pop(name) for name in neighbours if name in rows]
    return evaluate_runs(scene, tuple(rows.values()), neighbour_runs, interrupted=interrupted)


def evaluate_runs(
    scene: Scene, rows: Sequence[TimedRun], neighbours: Sequence[TimedRun] = (), *, interrupted: bool = False
) -> WorkPrecision:
    """Choose the most accurate runs; they and the neighbouring ones give the motion's uncertainty."""
    order = list(SETTINGS)  # of each model the smallest first
    results = sorted(
        (row for row in rows if row.x is not None),
        key=lambda row: (order.index(row.candidate.formulation), row.candidate.setting),
    )
    reference, exudyn = ([row for row in results if row.candidate.model == model] for model in MODELS)
    pair = [reference[0], exudyn[0]] if reference and exudyn else (reference or exudyn)[:2]
    exact, confirming = [*pair, None, None][:2]
    neighbour_x = [row.x for row in neighbours if row.x is not None] if exact is rows[0] else []
    u = np.empty(0)
    if len(pair) == 2:
        x, other = (row.x for row in pair if row.x is not None)
        half_width = window_samples(scene.period, scene.duration / (x.size - 1))
        u = spread(x, [other, *neighbour_x], half_width)
    return WorkPrecision(scene, tuple(rows), exact, confirming, u, len(neighbour_x), interrupted)
