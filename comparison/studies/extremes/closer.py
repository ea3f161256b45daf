"""A closer look at the runs that err more than anything that was asked of every cell accounts for.

Two more questions, too dear to ask everywhere. Does what no setting resolves decide the motion? Then two
starts a `HAIR` apart end as far apart as the run from what counts as exact. Or is the setting too coarse for
this scene? Then the same run with a finer one errs less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from comparison.accuracy.levels import finer
from comparison.execution.ledger import Row
from comparison.execution.run import Progress
from comparison.scene import Scene
from comparison.studies.extremes.cells import TURNS
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Closer, judge
from comparison.studies.extremes.runs import LIMIT, CellRun, run_tasks
from comparison.studies.extremes.ways import STIFF, TIGHT, WAYS, Way

HAIR = 1e-13
"""m: a thousand times the rounding of x, and less than any setting resolves."""
_BESIDE = "from a start beside"
Unexplained = tuple[int, str]
"""Number of the cell, and the way that ran it."""


def look(
    found: Sequence[Found], unexplained: Sequence[Unexplained], n_jobs: int, on_progress: Progress | None
) -> None:
    """Run what answers both questions, and note it in `found`."""
    ways = {way.name: way for way in WAYS}
    tasks: dict[tuple[int, str], CellRun] = {}
    for number, name in unexplained:
        of, way = found[number], ways[name]
        if (exact := _exact(of)) is not None:
            tasks[number, _BESIDE] = CellRun(_beside(exact.scene(of.cell)), exact.model, LIMIT)
        scene = way.scene(of.cell).with_values({"drive.cycles": TURNS})
        if (better := finer(way.model, scene)) is not None:
            tasks[number, name] = CellRun(better, way.model, LIMIT)
    rows = run_tasks(tasks, n_jobs, on_progress)
    for number, name in unexplained:
        of = found[number]
        row = rows.get((number, name))
        of.closer[name] = Closer(
            _apart(of, rows.get((number, _BESIDE))),
            None if row is None else judge(row, of.tight, of.verdicts[name].promise),
            "" if row is None else str(row["status"]),
        )


def _exact(of: Found) -> Way | None:
    """Return who of the reference counts as exact."""
    for way in (TIGHT[0], STIFF):
        if of.tight.get(way.name, {"status": ""})["status"] == "success":
            return way
    return None


def _beside(scene: Scene) -> Scene:
    offset = scene.data["initial"]["slider_offset"] + HAIR
    return scene.with_values({"drive.cycles": TURNS, "initial.slider_offset": offset})


def _apart(of: Found, row: Row | None) -> float:
    exact = _exact(of)
    if exact is None or row is None or row["status"] != "success":
        return float("nan")
    return float(np.abs(np.asarray(row["x"]) - np.asarray(of.tight[exact.name]["x"])).max())
