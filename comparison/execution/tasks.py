"""Tasks of studies, measured in worker processes; each row is stored when its task ends.

The key of a row is everything that can change it: the task's own identity (scenes and settings), the code and
data that the measure depends on, the models' code, the versions of libraries, and the kind of machine.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import fields
from functools import partial
from importlib.metadata import version
from math import inf
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from comparison.execution.pool import Attempt, Death, Share, Timeout, work
from comparison.execution.run import Progress, RunError
from comparison.execution.store import ROWS, Row, cache_folder, drop_unused, fetch_row, keep_row
from comparison.models import code_hash, fingerprint, platform_name, versions
from comparison.scene import Scene, SceneError, digest

SUCCESS, CRASHED, LATE = "success", "crashed", "work-limit"
"""Statuses of a row besides those of a model; the second one after an exception or a process that died."""


class Task(ABC):
    """Task to be measured. Subclasses are frozen dataclasses, for pickling."""

    @property
    def identity(self) -> dict[str, Any]:
        """The fields that distinguish it from other tasks of its measure."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    @property
    @abstractmethod
    def models(self) -> Sequence[str]:
        """The engines that run in it."""

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return 1.0


T = TypeVar("T", bound=Task)
Measure = Callable[[T, Progress], Row]
"""Measures a task; reports a share of 0 when the preparation (compiling) is over."""
Rows = Generator[tuple[str, Row | Death]]
Spread = Callable[[Attempt, Mapping[str, Task]], Rows]
"""Processes tasks, by key, and yields each row on completion."""


def measure_all(
    measure: Measure[T],
    tasks: Sequence[T],
    spread: Spread,
    on_progress: Progress | None = None,
    *,
    folder: Path | None = None,
) -> list[Row]:
    """Measure tasks without a stored row, equal tasks once, the longest first; return rows in their order.

    ``"status"`` of a row is `SUCCESS` if the measure, a function of a module, returned, else the kind of
    failure, with one line in ``"message"``; ``"seconds"``, its processor time, is missing after a time
    limit. Rows are stored in the folder, by default one in `comparison.execution.store.cache_folder`; an
    `OSError` if they cannot be. A task whose process died has no stored row and is tried again.
    """
    if folder is None:
        drop_unused()
        folder = cache_folder() / "-".join([ROWS, *measure.__module__.split(".")[-2:]])
    keys = _keys(measure, tasks)
    by_key = dict(zip(keys, tasks, strict=True))
    rows = {key: entry for key in by_key if (entry := fetch_row(folder, key)) is not None}
    queue = sorted(by_key.keys() - rows.keys(), key=lambda key: (-by_key[key].cost, key))
    total = sum(task.cost for task in by_key.values()) or 1.0
    progress = total - sum(by_key[key].cost for key in queue)
    with closing(spread(partial(_attempt, measure), {key: by_key[key] for key in queue})) as results:
        for key, row in results:
            if isinstance(row, Death):
                rows[key] = {"status": CRASHED, "message": row.words}
            else:
                rows[key] = keep_row(folder, key, row)
            progress += by_key[key].cost
            if on_progress:
                on_progress(min(1.0, progress / total))
    return [rows[key] for key in keys]


def on_processes(n_jobs: int, limit: float = inf) -> Spread:
    """Return a `Spread` over local processes; a task that takes longer than the limit, s, is stopped."""

    def spread(attempt: Attempt, tasks: Mapping[str, Task]) -> Rows:
        with closing(work(attempt, list(tasks.items()), n_jobs, limit)) as events:
            for key, event in events:
                if isinstance(event, Timeout):
                    yield key, {"status": LATE, "message": f"stopped after {limit:g} s", "share": event.share}
                elif not isinstance(event, Share):
                    yield key, event

    return spread


def _keys(measure: Measure[T], tasks: Sequence[T]) -> list[str]:
    hashes = {name: fingerprint(name) for name in sorted({name for task in tasks for name in task.models})}
    common = {"machine": platform_name(), "versions": versions() | {"pandas": version("pandas")}}
    return [
        digest(
            {
                "task": task.identity,
                # The work of a task may be defined in its class.
                "code": code_hash(measure.__module__, type(task).__module__),
                "models": {name: hashes[name] for name in task.models},
            }
            | common,
            default=_json_value,
        )
        for task in tasks
    ]


def _json_value(value: Any) -> Any:
    """Return the JSON equivalent of an object: the fields of a record, the hash of a scene."""
    if isinstance(value, Scene):
        return value.hash
    if isinstance(value, BaseModel):
        return value.model_dump()
    return {field.name: getattr(value, field.name) for field in fields(value)}


def _attempt(measure: Measure[T], task: T, progress: Progress) -> Row:
    """Measure; any failure becomes the row's status and message (in the worker)."""
    start = time.process_time()
    try:
        row = {"status": SUCCESS, "message": ""} | measure(task, progress)
    except RunError as error:
        row = {"status": error.outcome.status, "message": error.outcome.message}
    except SceneError as error:
        row = {"status": "bad input", "message": str(error)}
    except Exception as error:
        row = {"status": CRASHED, "message": " ".join(f"{type(error).__name__}: {error}".split())}
    return {"seconds": time.process_time() - start} | row
