"""A sweep: which runs, who does them, and the table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from comparison.execution.run import Progress
from comparison.execution.tasks import Spread, measure_all
from comparison.files import replacing
from comparison.models import find
from comparison.scene import Scene
from comparison.studies.sweep.outputs import check_names
from comparison.studies.sweep.points import Point, check_keys
from comparison.studies.sweep.runs import SweepRun, result_table, run_point

LEDGER, TABLE = "runs.jsonl", "sweep.csv"


def sweep(
    base: Scene,
    points: Sequence[Point],
    models: Sequence[str],
    asked: Sequence[str],
    folder: Path,
    spread: Spread,
    on_progress: Progress | None = None,
) -> tuple[Path, int]:
    """Run all points by all models and write the table.

    Each run's row is kept in the folder as soon as it ends: a sweep that was broken off goes on where it
    was. The table does not depend on who ran what when. The folder is made once all that is asked for is
    known; the quantities are those of `comparison.studies.sweep.outputs.names`.

    Returns
    -------
    table, failed
        The path of the table, and how many runs did not succeed: these are rows too, with their reason.

    Raises
    ------
    SweepError
        If a point names what is not a key of a scene, or a quantity is not one.
    LedgerError
        If a row cannot be kept.
    """
    check_names(asked)
    check_keys(base, list(dict.fromkeys(key for point in points for key in point)))
    for model in models:
        find(model)
    folder.mkdir(parents=True, exist_ok=True)
    tasks = [SweepRun(base, point, model, tuple(asked)) for point in points for model in models]
    rows = measure_all(run_point, tasks, spread, on_progress, ledger=folder / LEDGER)
    frame = result_table(tasks, rows)
    path = folder / TABLE
    with replacing(path) as part:
        frame.to_csv(part, index=False)
    return path, int((frame["status"] != "success").sum())
