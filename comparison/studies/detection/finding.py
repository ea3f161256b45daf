"""Tasks worked off in worker processes, each as soon as it can be; what was found is kept.

The study compares thousands of pairs of five runs each: only what was found is kept, not the runs.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from pathlib import Path

from comparison.cache import cache_folder
from comparison.engines import fingerprint
from comparison.files import write_json
from comparison.machine import platform_name
from comparison.run import Progress
from comparison.scene import digest
from comparison.sources import sources
from comparison.studies.detection.tasks import Found, Task, refusal
from comparison.workers import Died, Share, in_turn, work

_JUDGES = (
    "accuracy.py", "accuracy.toml", "align.py", "attribution.py", "channels.py", "channels.toml", "check.py",
    "compare.py", "confirmation.py", "confirmation_causes.py", "confirmation_starts.py",
    "confirmation_text.py", "findings.py",
    "measures/outliers.py", "resample.py", "run.py", "table.py", "thresholds.py", "thresholds.toml",
    "uncertainty.py", "validation.py", "verdict.py", "studies/detection/copies.py",
    "studies/detection/limits.py", "studies/detection/pairs.py", "studies/detection/rounding.py",
    "studies/detection/tables.py", "studies/detection/tasks.py",
)  # fmt: skip
"""What of this package can change what is found."""


def find_all(tasks: Sequence[Task], n_jobs: int, on_progress: Progress | None) -> list[Found]:
    """Work off tasks in worker processes, what was found before is not sought again.

    Tasks of one environment follow one another, each environment in processes of its own.

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
    known = {key: found for key in dict.fromkeys(keys) if (found := _fetch(key)) is not None}
    waiting = {key: task for key, task in zip(keys, tasks, strict=True) if key not in known}
    total = sum(task.cost for task in tasks) or 1.0
    done = total - sum(task.cost for task in waiting.values())

    def report(share: float) -> None:
        if on_progress:
            on_progress(min(share, 1.0))

    report(done / total)
    for environment in dict.fromkeys(task.environment for task in waiting.values()):
        group = {key: task for key, task in waiting.items() if task.environment == environment}
        ordered = [(key, group[key]) for key in in_turn(group)]
        with closing(work(_attempt, ordered, n_jobs, environment=dict(environment))) as events:
            for key, event in events:
                if isinstance(event, Share):
                    continue
                if isinstance(event, Died):
                    known[key] = refusal(event.words)
                else:
                    known[key] = event
                    _keep(key, event)
                done += group[key].cost
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
