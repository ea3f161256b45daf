"""Refined reruns of the runs that err more than anything that was asked of every cell accounts for.

Two more questions, too dear to ask everywhere. Does what no setting resolves decide the motion? Then two
starts a `HAIR` apart end as far apart as the run from the exact one. Or is the setting too coarse for this
scene? Then the same run with a finer one errs less.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

from comparison.accuracy.levels import finer
from comparison.execution.run import Progress
from comparison.studies.extremes.campaign import CellOutcome, perturbed, scene_of
from comparison.studies.extremes.cells import CYCLES
from comparison.studies.extremes.formulations import METHODS, STRICT, STRICT_IMPLICIT
from comparison.studies.extremes.runs import LIMIT, CellRun, run_tasks
from comparison.studies.extremes.verdicts import Refined, apart, judge
from comparison.studies.shared.formulations import Method

HAIR = 1e-13
"""m: a thousand times the rounding of x, and less than any setting resolves."""
_BESIDE = "from a start beside"


def rerun(
    outcomes: Sequence[CellOutcome],
    unexplained: Sequence[tuple[int, str]],
    n_jobs: int,
    on_progress: Progress | None,
) -> None:
    """Run what answers both questions of runs, each by its cell's number and formulation's name; note it."""
    methods = {method.name: method for method in METHODS}
    tasks: dict[tuple[int, str], CellRun] = {}
    for number, name in unexplained:
        of, method = outcomes[number], methods[name]
        if (exact := _exact(of)) is not None:
            tasks[number, _BESIDE] = CellRun(perturbed(scene_of(of.cell, exact), HAIR), exact.model, LIMIT)
        scene = scene_of(of.cell, method).with_values({"drive.cycles": CYCLES})
        if (better := finer(method.model, scene)) is not None:
            tasks[number, name] = CellRun(better, method.model, LIMIT)
    rows = run_tasks(tasks, n_jobs, on_progress)
    for number, name in unexplained:
        of = outcomes[number]
        exact = _exact(of)
        moved = nan if exact is None else apart(of.exact[exact.name], rows[number, _BESIDE])
        if (row := rows.get((number, name))) is None:
            of.refined[name] = Refined(moved, None)
        else:
            verdict = judge(row, of.exact, of.verdicts[name].bound)
            of.refined[name] = Refined(moved, verdict, str(row["status"]))


def _exact(of: CellOutcome) -> Method | None:
    """Return who of the reference counts as exact."""
    ended = {name: row["status"] for name, row in of.exact.items()}
    return next((each for each in (STRICT, STRICT_IMPLICIT) if ended.get(each.name) == "success"), None)
