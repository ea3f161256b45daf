"""All runs of the study: every cell by every way, and what they are held against."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

from comparison.accuracy import expected
from comparison.ledger import Row
from comparison.run import Progress
from comparison.scene import Scene, SceneError
from comparison.studies.extremes.cells import HYPERCUBE, LITERAL_LAW, TURNS, TURNS_AXIS, Cell, cells
from comparison.studies.extremes.outcomes import Verdict, judge, magnification
from comparison.studies.extremes.runs import LIMIT, Task, run_tasks
from comparison.studies.extremes.ways import STIFF, TIGHT, Way, ways_of

LONG_LIMIT, SHORT_LIMIT = 120.0, 3.0
"""s for a run of many turns; and where most runs would take all they are given, in the hypercube and under
the literal switch, so that a cell with its seven runs has some 20 s in all."""
HOPELESS = 2.0
"""A run that is expected to take so many times its limit is not started."""
MOVED, MOST_MOVED = 1e-3, 1e-9
"""The start of a cell's twin is moved by this share of the clearance, at most so far, m."""


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
    """

    cell: Cell
    rows: dict[str, Row] = field(default_factory=dict)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    tight: dict[str, Row] = field(default_factory=dict)
    magnification: float = float("nan")


def gather(n_jobs: int, on_progress: Progress | None, chosen: list[Cell] | None = None) -> list[Found]:
    """Run the cells, all if none are chosen; what ran before is not run again."""
    found = [Found(cell) for cell in (cells() if chosen is None else chosen)]
    tasks: dict[float, dict[str, Task]] = {limit: {} for limit in (SHORT_LIMIT, LIMIT, LONG_LIMIT)}
    rows: dict[str, Row] = {}
    promises: dict[str, float] = {}
    for number, of in enumerate(found):
        limit = _limit(of.cell)
        for way in (*ways_of(of.cell), *TIGHT):
            key = f"{number} {way.name}"
            try:
                scene = way.scene(of.cell)
            except SceneError as error:
                rows[key] = {"status": "bad input", "message": str(error)}
                continue
            if way in TIGHT:
                scene = scene.with_values({"drive.cycles": TURNS})
            promises[key] = expected(scene, way.model).error
            if hopeless := _hopeless(scene, way, limit):
                rows[key] = hopeless
            else:
                tasks[limit][key] = Task(scene, way.model)
        twin = _twin(of.cell)
        if twin is not None:
            tasks[limit][f"{number} twin"] = Task(twin, TIGHT[0].model)
    total, done = sum(map(len, tasks.values())) or 1, 0
    for limit, some in tasks.items():
        part = None if on_progress is None else _part(on_progress, done / total, len(some) / total)
        rows |= run_tasks(some, n_jobs, part, limit)
        done += len(some)
    rows |= _instead(found, rows, n_jobs)
    for number, of in enumerate(found):
        of.tight = {way.name: rows[key] for way in (*TIGHT, STIFF) if (key := f"{number} {way.name}") in rows}
        for way in ways_of(of.cell):
            key = f"{number} {way.name}"
            of.rows[way.name] = rows[key]
            of.verdicts[way.name] = judge(rows[key], of.tight, promises.get(key, float("nan")))
        exact, twin_row = of.tight[TIGHT[0].name], rows.get(f"{number} twin")
        if twin_row is not None:
            of.magnification = magnification(exact, twin_row, _move(of.cell.scene))
    return found


def _limit(cell: Cell) -> float:
    if cell.axis == TURNS_AXIS:
        return LONG_LIMIT
    return SHORT_LIMIT if cell.axis == HYPERCUBE or cell.law == LITERAL_LAW else LIMIT


def _part(on_progress: Progress, start: float, share: float) -> Progress:
    return lambda done: on_progress(start + share * done)


def _instead(found: list[Found], rows: dict[str, Row], n_jobs: int) -> dict[str, Row]:
    """Run the cells by `STIFF` of which the reference's own strict run did not come to the end."""
    tasks = {}
    for number, of in enumerate(found):
        if rows[f"{number} {TIGHT[0].name}"]["status"] not in ("success", "bad input"):
            scene = STIFF.scene(of.cell).with_values({"drive.cycles": TURNS})
            tasks[f"{number} {STIFF.name}"] = Task(scene, STIFF.model)
    return run_tasks(tasks, n_jobs, None, SHORT_LIMIT)


def _hopeless(scene: Scene, way: Way, limit: float) -> Row | None:
    """Return the row of a run that is not started, as it would take too long by far."""
    seconds = expected(scene, way.model).seconds
    if not isfinite(seconds) or seconds <= HOPELESS * limit:
        return None
    message = f"not started: some {seconds:.2g} s are expected, {limit:g} s are allowed"
    return {"status": "work-limit", "message": message}


def _move(scene: Scene) -> float:
    return min(MOVED * float(scene.data["clearance"]["slider"]), MOST_MOVED)


def _twin(cell: Cell) -> Scene | None:
    """Return the strict scene with its start moved; None where there is no scene."""
    try:
        scene = TIGHT[0].scene(cell).with_values({"drive.cycles": TURNS})
    except SceneError:
        return None
    offset = scene.data["initial"]["slider_offset"] + _move(scene)
    return scene.with_values({"initial.slider_offset": offset})
