"""All runs of the grid: every cell by every formulation, and what they are held against."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import inf, nan

from comparison.accuracy.measured import expected
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.scene import Scene, SceneError
from comparison.studies.extremes.cells import CYCLES, CYCLES_AXIS, HYPERCUBE, LAWS, LITERAL_LAW, Cell
from comparison.studies.extremes.formulations import (
    EXACT,
    PERTURBED,
    STRICT,
    STRICT_IMPLICIT,
    STRICT_TREE,
    TREE,
)
from comparison.studies.extremes.runs import LIMIT, CellRun, run_tasks
from comparison.studies.extremes.verdicts import Refined, Verdict, apart, judge
from comparison.studies.shared.formulations import Method
from comparison.studies.shared.study import part

LONG_LIMIT, SHORT_LIMIT = 6000.0, 150.0
"""Units for a run of many cycles; and where most runs would take all they are given: in the hypercube under
the law of a whole side, and under the literal switch."""
MOVED, MOST_MOVED = 1e-3, 1e-9
"""The perturbed run's start is moved by this share of the clearance, at most so far, m."""
SHARES = (0.0, 0.8, 0.95, 1.0)
"""Of the expected time: where each of the three passes begins and ends."""

Run = tuple[int, Method]
"""Number of the cell, and the formulation that runs it."""


@dataclass
class CellOutcome:
    """What became of a cell."""

    cell: Cell
    rows: dict[str, Row] = field(default_factory=dict)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    """Of each formulation's run, by its name. A row has its ``limit``, units, and the error ``bound`` of its
    setting, m."""
    estimates: dict[str, float] = field(default_factory=dict)
    """A posteriori, of the error of runs that err more than their bound, m, by name of the formulation; nan
    where there is none."""
    exact: dict[str, Row] = field(default_factory=dict)
    """Rows of the runs that it is held against, by the names of their formulations."""
    magnification: float = nan
    """By how much two starts move apart at most in the first cycle; nan where unknown."""
    refined: dict[str, Refined] = field(default_factory=dict)
    """What refined reruns found of errors that nothing else accounts for, by name of the formulation."""


def run_campaign(cells: Sequence[Cell], n_jobs: int, on_progress: Progress | None) -> list[CellOutcome]:
    """Run cells in three passes; what ran before is not run again."""
    wanted = [(number, method) for number, cell in enumerate(cells) for method in cell.methods]
    rows = _run(cells, wanted, n_jobs, part(on_progress, *SHARES[:2]))
    # The tree's strict run takes longer than its standard one: not where that did not come to the end, nor
    # under the laws of a whole side.
    usual = [number for number, cell in enumerate(cells) if cell.law == LAWS[0]]
    failed = {
        number for (number, method), row in rows.items() if method == TREE and row["status"] != "success"
    }
    strict = [(number, STRICT_TREE) for number in usual if number not in failed]
    strict += [(number, STRICT) for number in range(len(cells))]
    rows |= _run(cells, strict, n_jobs, part(on_progress, *SHARES[1:3]))
    # The perturbed run would take as long as the strict one. Under the laws of a whole side LSODA takes all
    # its time.
    ended = [rows[number, STRICT]["status"] for number in range(len(cells))]
    last = [(number, PERTURBED) for number, status in enumerate(ended) if status == "success"]
    last += [(number, STRICT_IMPLICIT) for number in usual if ended[number] not in ("success", "bad input")]
    rows |= _run(cells, last, n_jobs, part(on_progress, *SHARES[2:]))
    return [_outcome(number, cell, rows) for number, cell in enumerate(cells)]


def scene_of(cell: Cell, method: Method) -> Scene:
    """Return a cell's scene as a formulation runs it; exact runs keep their settings and take one cycle.

    Raises
    ------
    SceneError
        If there is no such scene.
    """
    if method not in (*EXACT, PERTURBED):
        return cell.scene.with_values({**method.changes, **cell.settings})
    scene = cell.scene.with_values({**method.changes, "drive.cycles": CYCLES})
    return perturbed(scene, _move(cell)) if method == PERTURBED else scene


def perturbed(scene: Scene, distance: float) -> Scene:
    """Return a scene with the slider's start moved by a distance, m."""
    return scene.with_values({"initial.slider_offset": scene.data["initial"]["slider_offset"] + distance})


def _outcome(number: int, cell: Cell, rows: dict[Run, Row]) -> CellOutcome:
    of = CellOutcome(cell)
    of.exact = {method.name: rows[number, method] for method in EXACT if (number, method) in rows}
    for method in cell.methods:
        of.rows[method.name] = row = rows[number, method]
        of.verdicts[method.name] = judge(row, of.exact, row.get("bound", nan))
    if (number, PERTURBED) in rows:
        moved = _move(cell)
        of.magnification = apart(rows[number, STRICT], rows[number, PERTURBED]) / moved if moved else inf
    return of


def _run(
    cells: Sequence[Cell], wanted: Iterable[Run], n_jobs: int, on_progress: Progress | None
) -> dict[Run, Row]:
    """Run what can be run, limit by limit."""
    rows: dict[Run, Row] = {}
    tasks: dict[float, dict[Run, CellRun]] = {limit: {} for limit in (SHORT_LIMIT, LIMIT, LONG_LIMIT)}
    for number, method in wanted:
        limit = _limit(cells[number], method)
        try:
            scene = scene_of(cells[number], method)
        except SceneError as error:
            rows[number, method] = {"status": "bad input", "message": str(error)}
            continue
        rows[number, method] = {"limit": limit, "bound": expected(scene, method.model).error}
        tasks[limit][number, method] = CellRun(scene, method.model, limit)
    total, done = sum(map(len, tasks.values())) or 1, 0
    for some in tasks.values():
        ran = run_tasks(some, n_jobs, part(on_progress, done / total, (done + len(some)) / total))
        for run, row in ran.items():
            rows[run] |= row
        done += len(some)
    return rows


def _limit(cell: Cell, method: Method) -> float:
    if cell.axis == CYCLES_AXIS and method not in (*EXACT, PERTURBED):
        return LONG_LIMIT
    short = cell.law == LITERAL_LAW or (cell.axis == HYPERCUBE and cell.law != LAWS[0])
    return SHORT_LIMIT if short else LIMIT


def _move(cell: Cell) -> float:
    """Return by how much the perturbed start is moved, m."""
    return min(MOVED * float(cell.scene.data["clearance"]["slider"]), MOST_MOVED)
