"""Pairs of models judged in worker processes, each as soon as it has run; what was judged is kept.

The study compares thousands of pairs of five runs each: only what was found is kept, not the runs.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from comparison.accuracy import refinement
from comparison.cache import cache_folder
from comparison.compare import Runs, compare
from comparison.engines import fingerprint
from comparison.files import write_json
from comparison.findings import SceneComparison
from comparison.machine import platform_name
from comparison.run import Progress, RunError, kernels, run_one
from comparison.scene import Scene, SceneError, digest
from comparison.sources import sources
from comparison.studies.detection.copies import load_copy
from comparison.studies.detection.tables import SPOILS
from comparison.table import TableError
from comparison.validation import levels
from comparison.workers import Died, Kernels, Share, in_turn, work

Found = dict[str, Any]

_JUDGES = (
    "accuracy.py", "accuracy.toml", "align.py", "channels.py", "channels.toml", "check.py", "compare.py",
    "findings.py", "resample.py", "run.py", "table.py", "thresholds.py", "thresholds.toml", "uncertainty.py",
    "validation.py", "verdict.py", "studies/detection/tasks.py", "studies/detection/tables.py",
)  # fmt: skip
"""What of this package can change what is found."""


@dataclass(frozen=True)
class Side:
    """One of the two that are compared: a scene as this model is given it."""

    scene: Scene
    model: str
    engine: str = ""
    """Who runs it, where that is not the model itself but a copy of it with a fault."""

    @property
    def runs_by(self) -> str:
        """Name of the engine."""
        return self.engine or self.model

    @property
    def identity(self) -> dict[str, str]:
        """What tells it from others."""
        return {"scene": self.scene.hash, "model": self.model, "engine": self.runs_by}

    @property
    def kernels(self) -> Kernels:
        """Which code is compiled for it."""
        return kernels(self.scene, self.model, self.engine)

    @property
    def cost(self) -> float:
        """Expected time of its five runs, s, roughly."""
        solver = self.scene.data["solver"]["exudyn"]
        if self.model == "reference":
            time = 0.2
        elif solver["formulation"] == "tree":
            time = 3.0 * self.scene.data["drive"]["cycles"]
        else:
            time = 6e-5 * self.scene.duration / solver["step"]
        return time + (40.0 if self.engine else 0.0)  # a copy must be compiled


class Task(Protocol):
    """Something to find by running models."""

    @property
    def sides(self) -> tuple[Side, ...]:
        """Whom it runs."""

    @property
    def identity(self) -> dict[str, Any]:
        """What tells it from other tasks, as JSON holds it."""

    @property
    def cost(self) -> float:
        """Expected time, s."""

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code is compiled for it."""

    def find(self) -> Found:
        """Run and judge."""


@dataclass(frozen=True)
class Pair:
    """Two sides judged as results of one scene; found is `summary`, or why they cannot be compared."""

    scene: Scene
    a: Side
    b: Side
    tier: str
    spoil: str = ""
    """Of `SPOILS`: what happens to the tables of ``b``, or of both."""

    @property
    def sides(self) -> tuple[Side, ...]:
        """Both."""
        return self.a, self.b

    @property
    def identity(self) -> dict[str, Any]:
        """What tells it from others."""
        return {
            "scene": self.scene.hash,
            "sides": [side.identity for side in self.sides],
            "tier": self.tier,
            "spoil": self.spoil,
        }

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.b.cost + 0.1 * self.a.cost

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code is compiled for it."""
        return frozenset(side.kernels for side in self.sides)

    def find(self) -> Found:
        """Run what has not run yet in this process, and judge."""
        try:
            a, b = kept_runs(self.a), kept_runs(self.b)
            if self.spoil:
                a, b = SPOILS[self.spoil](a, b)
            return summary(compare(a, b, scene=self.scene, tier=self.tier))
        except (RunError, SceneError, TableError) as error:
            return refusal(str(error))


def refusal(reason: str) -> Found:
    """Return what is found where there is nothing to compare."""
    return {"verdict": "cannot compare", "reason": reason, "channels": {}, "first": None}


def runs(side: Side) -> Runs:
    """Run one side at all its levels, in this process."""
    if side.engine:
        load_copy(side.engine)
    tables = {kind: run_one(scene, side.runs_by) for kind, scene in levels(side.scene, side.model).items()}
    return Runs(refinement=refinement(side.model, side.scene), **tables)


def kept_runs(side: Side) -> Runs:
    """Return the runs of a side that many are compared with: this process keeps the last few."""
    key = (side.scene.hash, side.runs_by)
    if key not in _RUNS:
        while len(_RUNS) >= _MOST_RUNS:
            del _RUNS[next(iter(_RUNS))]
        _RUNS[key] = runs(side)
    return _RUNS[key]


_RUNS: dict[tuple[str, str], Runs] = {}
_MOST_RUNS = 8


def summary(result: SceneComparison) -> Found:
    """Return what the study needs of a comparison, as JSON holds it.

    ``first`` is the earliest sample that says "differ": of the channels with that verdict, the earliest
    predictable sample beyond its threshold; of several at that time the one that is the most beyond.
    """
    first: dict[str, Any] | None = None
    best = (np.inf, 0.0)
    for name, channel in result.channels.items():
        if channel.verdict != "differ" or channel.u is None:
            continue
        judged = channel.predictable & ((channel.a != 0) | (channel.b != 0))
        threshold = channel.limits.k * channel.u
        beyond = np.flatnonzero(judged & (np.abs(channel.difference) > threshold))
        if not beyond.size:
            # Told apart by the largest uncertainty of all times, though no sample is predictable.
            threshold = np.full(threshold.shape, channel.worst_threshold)
            beyond = np.flatnonzero(np.abs(channel.difference) > threshold)
        at = int(beyond[0])
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
        "reason": result.reason,
        "channels": {name: [c.verdict, c.coverage] for name, c in result.channels.items()},
        "first": first,
    }


def find_all(tasks: Sequence[Task], n_jobs: int, on_progress: Progress | None) -> list[Found]:
    """Work off tasks in worker processes, what was found before is not sought again.

    Returns
    -------
    found
        In the order of the tasks.
    """
    prints = {name: fingerprint(name) for name in {side.runs_by for task in tasks for side in task.sides}}
    judges = sources(*_JUDGES)
    keys = [
        digest(
            {
                "task": task.identity,
                "models": {side.runs_by: prints[side.runs_by] for side in task.sides},
                "sources": judges,
                "machine": platform_name(),
            }
        )
        for task in tasks
    ]
    known = {key: found for key in keys if (found := _fetch(key)) is not None}
    waiting = {key: task for key, task in zip(keys, tasks, strict=True) if key not in known}
    total = sum(task.cost for task in tasks) or 1.0
    done = total - sum(task.cost for task in waiting.values())

    def report(share: float) -> None:
        if on_progress:
            on_progress(min(share, 1.0))

    report(done / total)
    ordered = [(key, waiting[key]) for key in in_turn(waiting)]
    with closing(work(_attempt, ordered, n_jobs)) as events:
        for key, event in events:
            if isinstance(event, Share):
                continue
            if isinstance(event, Died):
                known[key] = refusal(event.words)
            else:
                known[key] = event
                _keep(key, event)
            done += waiting[key].cost
            report(done / total)
    return [known[key] for key in keys]


def _attempt(task: Task, progress: Callable[[float], None]) -> Found:
    """Find; whatever else goes wrong is found as well, since a copy with a fault may raise anything."""
    del progress
    before = time.process_time()
    try:
        found = task.find()
    except Exception as error:
        found = refusal(" ".join(f"{type(error).__name__}: {error}".split()))
    return found | {"seconds": time.process_time() - before}


def _fetch(key: str) -> Found | None:
    path = _path(key)
    try:
        found: Found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None
    with suppress(OSError):
        path.touch()  # `comparison.cache` drops what nobody asked for in a month
    return found


def _keep(key: str, found: Found) -> None:
    with suppress(OSError):
        cache_folder().mkdir(parents=True, exist_ok=True)
        write_json(found, _path(key))


def _path(key: str) -> Path:
    return cache_folder() / f"detection-{key}.json"
