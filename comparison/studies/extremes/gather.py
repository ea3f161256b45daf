"""All runs of the study: every cell by every way, and what they are held against."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import isfinite, nan

from comparison.accuracy.levels import expected
from comparison.execution.ledger import Row
from comparison.execution.run import Progress
from comparison.execution.task_store import LATE
from comparison.scene import Scene, SceneError
from comparison.studies.extremes.cells import HYPERCUBE, LAWS, LITERAL_LAW, TURNS, TURNS_AXIS, Cell, cells
from comparison.studies.extremes.outcomes import Closer, Verdict, judge, magnification
from comparison.studies.extremes.runs import LIMIT, CellRun, run_tasks
from comparison.studies.extremes.ways import STIFF, TIGHT, TREE, TWIN, Way, exact_of, ways_of
from comparison.studies.shared.progress import part

LONG_LIMIT, SHORT_LIMIT = 120.0, 3.0
"""s for a run of many turns; and where most runs would take all they are given, in the hypercube and under
the literal switch, so that a cell with its seven runs has some 20 s in all."""
HOPELESS = 1.25
"""A run that is expected to take so many times its limit is not started: by so much estimates err."""
MOVED, MOST_MOVED = 1e-3, 1e-9
"""The start of a cell's twin is moved by this share of the clearance, at most so far, m."""
SHARES = (0.0, 0.8, 0.95, 1.0)
"""Of the expected time: where each of the three passes begins and ends."""

Run = tuple[int, Way]
"""Number of the cell, and who runs it."""


@dataclass
class Found:
    """What became of a cell.

    Attributes
    ----------
    cell
        Which.
    rows
        Of each way's run, by its name.
    verdicts
        By the same names.
    tight
        Rows of the runs that count as exact, by the names of their ways.
    magnification
        By how much two starts move apart at most in the first turn; nan where unknown.
    closer
        What a closer look found at runs whose error nothing else accounts for, by the names of their ways.
    """

    cell: Cell
    rows: dict[str, Row] = field(default_factory=dict)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    tight: dict[str, Row] = field(default_factory=dict)
    magnification: float = nan
    closer: dict[str, Closer] = field(default_factory=dict)


def gather(n_jobs: int, on_progress: Progress | None, chosen: list[Cell] | None = None) -> list[Found]:
    """Run the cells, all if none are chosen; what ran before is not run again."""
    found = [Found(cell) for cell in (cells() if chosen is None else chosen)]
    numbers = range(len(found))
    usual = [(number, way) for number in numbers for way in ways_of(found[number].cell)]
    rows = _run(found, usual, n_jobs, part(on_progress, *SHARES[:2]))
    strict, tree = TIGHT
    # The tree's strict run takes longer than its standard one: not where that did not come to the end.
    exact = [
        (number, tree)
        for number in numbers
        if tree in exact_of(found[number].cell)
        and rows.get((number, TREE), {"status": "success"})["status"] == "success"
    ]
    exact += [(number, strict) for number in numbers]
    rows |= _run(found, exact, n_jobs, part(on_progress, *SHARES[1:3]))
    # Its twin would take as long as the strict run. Under the laws of a whole side LSODA takes all its time.
    last = [(number, TWIN) for number in numbers if rows[number, strict]["status"] == "success"]
    last += [
        (number, STIFF)
        for number in numbers
        if rows[number, strict]["status"] not in ("success", "bad input")
        and found[number].cell.law == LAWS[0]
    ]
    rows |= _run(found, last, n_jobs, part(on_progress, *SHARES[2:]))
    for number, of in enumerate(found):
        of.tight = {way.name: rows[number, way] for way in (*TIGHT, STIFF) if (number, way) in rows}
        for way in ways_of(of.cell):
            of.rows[way.name] = rows[number, way]
            of.verdicts[way.name] = judge(rows[number, way], of.tight, _promise(of.cell, way))
        if (number, TWIN) in rows:
            of.magnification = magnification(rows[number, strict], rows[number, TWIN], _move(of.cell))
    return found


def _run(
    found: list[Found], wanted: Iterable[Run], n_jobs: int, on_progress: Progress | None
) -> dict[Run, Row]:
    """Run what can be run, limit by limit."""
    rows: dict[Run, Row] = {}
    tasks: dict[float, dict[Run, CellRun]] = {limit: {} for limit in (SHORT_LIMIT, LIMIT, LONG_LIMIT)}
    for number, way in wanted:
        limit = _limit(found[number].cell, way)
        try:
            scene = _scene(found[number].cell, way)
        except SceneError as error:
            rows[number, way] = {"status": "bad input", "message": str(error)}
            continue
        if hopeless := _hopeless(scene, way, limit):
            rows[number, way] = hopeless
        else:
            tasks[limit][number, way] = CellRun(scene, way.model, limit)
    total, done = sum(map(len, tasks.values())) or 1, 0
    for some in tasks.values():
        share = part(on_progress, done / total, (done + len(some)) / total)
        rows |= run_tasks(some, n_jobs, share)
        done += len(some)
    return rows


def _scene(cell: Cell, way: Way) -> Scene:
    """Return what a way runs of a cell: of what counts as exact the first turn alone."""
    scene = way.scene(cell)
    if way in (*TIGHT, STIFF, TWIN):
        scene = scene.with_values({"drive.cycles": TURNS})
    if way == TWIN:
        offset = scene.data["initial"]["slider_offset"] + _move(cell)
        scene = scene.with_values({"initial.slider_offset": offset})
    return scene


def _limit(cell: Cell, way: Way) -> float:
    if cell.axis == TURNS_AXIS and way not in (*TIGHT, STIFF, TWIN):
        return LONG_LIMIT
    return SHORT_LIMIT if cell.axis == HYPERCUBE or cell.law == LITERAL_LAW else LIMIT


def _hopeless(scene: Scene, way: Way, limit: float) -> Row | None:
    """Return the row of a run that is not started, as it would take too long by far."""
    seconds = expected(scene, way.model).seconds
    if not isfinite(seconds) or seconds <= HOPELESS * limit:
        return None
    message = f"not started: some {seconds:.2g} s are expected, {limit:g} s are allowed"
    return {"status": LATE, "message": message}


def _promise(cell: Cell, way: Way) -> float:
    """Return what is promised of a run's x over the first turn, m; nan where nothing is."""
    try:
        return expected(way.scene(cell), way.model).error
    except SceneError:
        return nan


def _move(cell: Cell) -> float:
    """Return by how much the twin's start is moved, m; of a cell without a scene nothing is asked."""
    try:
        return min(MOVED * float(cell.scene.data["clearance"]["slider"]), MOST_MOVED)
    except SceneError:
        return nan
