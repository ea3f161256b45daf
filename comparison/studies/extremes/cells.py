"""Cells of the study: what is pushed, who runs it, what became of each run, and why.

A cell is the scene `runs.BASE` with one number pushed to an extreme, or with all drawn at once in a Latin
hypercube (``axes.toml``). Every formulation runs it at its standard accuracy, and is held against the most
accurate runs of either model. All is data: `frame` has a row for each run.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from importlib.resources import files
from itertools import pairwise
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc

from comparison.accuracy.levels import finer, refinement, solver_values
from comparison.accuracy.measured import expected
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Levels, uncertainty, window_samples
from comparison.execution.quality import FEW_STEPS, MUCH_DRIFT, MUCH_ENERGY
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.scene import Scene, SceneError, load_scene
from comparison.studies.extremes.runs import BASE, LIMIT, CellRun, out_of_time, run_tasks
from comparison.studies.shared import formulations as catalogue
from comparison.studies.shared.formulations import Method
from comparison.studies.shared.study import part

# ---- who runs a cell


def _at(accuracy: str, method: Method, name: str, *groups: str) -> Method:
    """Return a method of the catalogue at an accuracy, its table with groups of channels."""
    values = solver_values(method.model, accuracy, load_scene(BASE, dict(method.changes)))
    output = {"output.groups": list(groups)} if groups else {}
    return Method(name, method.model, {**method.changes, **values, **output})


# Energies need no further coordinates in the reference and at index 2; elsewhere they cost some.
MINIMAL = _at("standard", catalogue.MINIMAL, "minimal", "energy")
IMPLICIT = _at("standard", catalogue.MINIMAL_LSODA, "minimal, LSODA", "energy")
MULTIPLIERS = _at("standard", catalogue.MULTIPLIERS, "multipliers", "energy")
TREE = _at("standard", catalogue.TREE, "tree")
FULL = _at("standard", catalogue.FULL, "full (five bodies)")
INDEX2 = _at("standard", catalogue.FULL_INDEX2, "full (five bodies), index 2", "energy")
METHODS = (MINIMAL, IMPLICIT, MULTIPLIERS, TREE, FULL, INDEX2)
COMMON = (MINIMAL, MULTIPLIERS, TREE, FULL)
"""What runs the hypercube, and the laws of a whole side, under which LSODA takes all its time."""
COMPARED = (MINIMAL, TREE, FULL)
"""Whose classes are compared: the smallest formulation of each model, and the full one."""

STRICT = _at("strict", catalogue.MINIMAL, "minimal, strict", "energy")
STRICT_TREE = _at("strict", catalogue.TREE, "tree, strict")
STRICT_IMPLICIT = _at("strict", catalogue.MINIMAL_LSODA, "minimal by LSODA, strict", "energy")
"""Instead of the reference's strict run, where that does not come to the end."""
EXACT = (STRICT, STRICT_TREE, STRICT_IMPLICIT)
"""What the others are held against."""
PERTURBED = Method("minimal, strict, perturbed", "reference", STRICT.changes)
"""From a start beside the cell's: how much the scene magnifies."""

# ---- what is pushed

LAWS = ("hertz-corners", "foundation", "paper-switching")
LITERAL_LAW = LAWS[2]
SEED = 1  # of the Latin hypercube
CYCLES, SAMPLES = 1.0, 250
"""An error bound is one over the first cycle; samples of a cycle."""
CYCLES_AXIS, HYPERCUBE, NEWTON, BASE_LABEL = "cycles", "hypercube", "Newton's tolerance", "as shipped"
_DATA: dict[str, list[dict[str, Any]]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("axes.toml").read_text("utf-8")
)
_PARTS, _RANGES = _DATA["part"], _DATA["range"]
AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS if "only" not in part))
"""Those that are run under all laws; the first is the scene as it is."""
UNITS = {part["axis"]: part["unit"] for part in _PARTS if "unit" in part}


@dataclass(frozen=True)
class Cell:
    """One scene at an extreme, and the formulations that run it."""

    axis: str
    """What is pushed."""
    label: str
    """How far."""
    law: str
    methods: tuple[Method, ...]
    changes: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Dotted keys that differ from the scene `BASE`."""
    settings: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Of a solver, dotted keys: they replace those of the formulation that runs it."""

    @cached_property
    def scene(self) -> Scene:
        """The scene, without the solver of a formulation; raises `SceneError` where it is refused."""
        usual: dict[str, object] = {"drive.cycles": CYCLES, "contact.law": self.law}
        sampled = {"output.groups": [], "output.samples_per_cycle": SAMPLES}
        return load_scene(BASE, usual | sampled | dict(self.changes))

    @property
    def shift(self) -> float:
        """By how much the perturbed start is moved, m: a thousandth of the clearance, at most 1 nm."""
        return min(1e-3 * float(self.scene.data["clearance"]["slider"]), 1e-9)

    def scene_of(self, method: Method) -> Scene:
        """Return the scene as a formulation runs it; exact runs keep their settings and take one cycle.

        Raises
        ------
        SceneError
            If there is no such scene.
        """
        if method not in (*EXACT, PERTURBED):
            return self.scene.with_values({**method.changes, **self.settings})
        scene = self.scene.with_values({**method.changes, "drive.cycles": CYCLES})
        return moved(scene, self.shift) if method == PERTURBED else scene


def moved(scene: Scene, distance: float) -> Scene:
    """Return a scene with the slider's start moved by a distance, m."""
    return scene.with_values({"initial.slider_offset": scene.data["initial"]["slider_offset"] + distance})


def cells(axes: Sequence[str], points: int) -> list[Cell]:
    """Return all cells: every axis under every law, settings and cycles, then the hypercube."""
    usual = [cell for law in LAWS for axis in axes for cell in along(axis, law)]
    special = [cell for part in _PARTS if "only" in part for cell in _cells(part, LAWS[0])]
    return [*usual, *special, *hypercube(points, SEED)]


def along(axis: str, law: str) -> list[Cell]:
    """Return the cells of an axis under a law: of the laws of a whole side the ends alone; they cost much."""
    parts = [part for part in _PARTS if part["axis"] == axis]
    all_of_it = [cell for part in parts for cell in _cells(part, law)]
    if law == LAWS[0]:
        return all_of_it
    if law == LITERAL_LAW and not parts[0].get("literal"):
        return []
    return list(dict.fromkeys((all_of_it[0], all_of_it[-1])))


def _cells(part: Mapping[str, Any], law: str) -> list[Cell]:
    methods: Sequence[Method] = METHODS if law == LAWS[0] else COMMON
    if "only" in part:
        methods = [method for method in METHODS if method.name in part["only"]]
    elif not part.get("audited"):
        methods = [method for method in methods if method != INDEX2]
    cells = []
    for value in part["values"]:
        values = {key: factor * value for key, factor in part["keys"].items()} | part.get("fixed", {})
        both = ({}, values) if part.get("settings") else (values, {})
        cells.append(Cell(part["axis"], part.get("label", "{:g}").format(value), law, tuple(methods), *both))
    return cells


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    The start lies from wall to wall and a tenth of the clearance inside it, tilted up to the wedge; of ten
    points one is under the paper's literal switch, of the others each second one under the foundation.
    """
    cells = []
    for number, u in enumerate(qmc.LatinHypercube(len(_RANGES) + 2, rng=seed).random(count).tolist()):
        values: dict[str, Any] = {}
        for span, share in zip(_RANGES, u, strict=False):
            low, high = span.get("logarithmic") or span["linear"]
            at = low + share * (high - low)
            values[span["key"]] = float(f"{10**at:.6g}") if "logarithmic" in span else round(at, 4)
        clearance, (offset, angle) = values["clearance.slider"], (2.0 * share - 1.0 for share in u[-2:])
        values["mechanism.reference_offset"] = 0.0
        values["initial.slider_offset"] = 1.1 * offset * clearance
        # Corners of a diagonal touch at about 2 clearances / length.
        values["initial.slider_angle"] = angle * clearance / 0.035
        law = LITERAL_LAW if number % 10 == 9 else LAWS[number % 2]
        cells.append(Cell(HYPERCUBE, f"{number + 1}", law, COMMON, values))
    return cells


# ---- what became of a run


class Class(StrEnum):
    """The classes, best first, as the page explains them; of the last three there must be none."""

    CONVERGED = "converged"
    ANNOUNCED = "announced"
    UNCONFIRMED = "unconfirmed"
    STOPPED = "stopped"
    REFUSED = "refused"
    NOT_TESTED = "not tested"
    DEGRADED = "degraded"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


LARGER = (Class.ANNOUNCED, Class.DEGRADED)
"""Of runs that err more than their bound: the user is told, or is not."""
_BY_STATUS = {"bad input": Class.REFUSED, "crashed": Class.CRASHED, "unusable": Class.NONSENSE}


@dataclass
class Judged:
    """A run of a cell (`runs.measure`) and what became of it."""

    row: Row
    kind: Class
    error: float = nan
    """Largest distance of slider_x from the exact runs over the first cycle, m; nan without any."""
    bound: float = nan
    """On the error at its setting, m; nan where none is on record."""
    lasted: float = nan
    """Share of the first cycle over which the distance stays within the bound."""
    estimate: float = nan
    """A posteriori, of an error above the bound, m; nan where there is none."""
    neighbour: float = nan
    """Of an error that nothing else accounts for: where a start `HAIR` beside ends, m."""
    finer: Judged | None = None
    """Of such an error: the same run at the next finer setting."""


def judge(row: Row, exact: Mapping[str, Row], bound: float) -> Judged:
    """Judge a run by those that count as exact, the most accurate runs of each model.

    Those that finished the first cycle are used: with two of them the run must be close to both, as either
    may be the one that is wrong. ``bound``: on the error of slider_x at its setting over the cycle, m.
    """
    if row["status"] != "success":
        other = Class.NOT_TESTED if out_of_time(row) else Class.STOPPED
        return Judged(row, _BY_STATUS.get(row["status"], other), bound=bound)
    x = np.asarray(row["x"], dtype=np.float64)
    finished = [each["x"] for each in exact.values() if each["status"] == "success"]
    if not finished:
        return Judged(row, Class.UNCONFIRMED, bound=bound)
    distance = np.max([np.abs(x - np.asarray(each)) for each in finished], axis=0)
    outside = np.flatnonzero(~(distance <= bound))  # all, where there is no bound
    lasted = float(outside[0]) / (x.size - 1) if outside.size else 1.0
    sound = not _above(row, MUCH_ENERGY, MUCH_DRIFT)
    kind = Class.CONVERGED if sound and not outside.size else Class.DEGRADED
    return Judged(row, kind, float(distance.max()), bound, lasted)


def _above(row: Row, energy: float, drift: float) -> bool:
    return (row.get("energy_share") or 0.0) > energy or (row.get("constraint_m") or 0.0) > drift


def warned(row: Row) -> bool:
    """Return whether `sixbar run` warns of a run by itself (`comparison.execution.quality`)."""
    steps = row.get("steps_per_contact")
    return (steps is not None and steps < FEW_STEPS) or _above(row, MUCH_ENERGY, MUCH_DRIFT)


def apart(*rows: Row) -> float:
    """Return how far the finished ones of runs are from one another at most, m; nan with less than two."""
    runs = [np.asarray(row["x"], dtype=np.float64) for row in rows if row["status"] == "success"]
    return float(np.ptp(runs, axis=0).max()) if len(runs) > 1 else nan


# ---- the campaign

LONG_LIMIT, SHORT_LIMIT = 6000.0, 150.0
"""Units for a run of many cycles; and where most runs would take all they are given: in the hypercube under
the law of a whole side, and under the literal switch."""
HAIR = 1e-13
"""m: a thousand times the rounding of x, and less than any setting resolves."""
_BESIDE = "beside"
_SHARES = (0.0, 0.69, 0.81, 0.86, 0.95, 1.0)
"""Of the expected time: where passes, checks and refined reruns begin and end."""

Run = tuple[int, Method]
"""Number of the cell, and the formulation that runs it."""


@dataclass
class Outcome:
    """What became of a cell."""

    cell: Cell
    runs: dict[str, Judged] = field(default_factory=dict)
    """By name of the formulation."""
    exact: dict[str, Row] = field(default_factory=dict)
    """Rows of the runs that these are held against, by the names of their formulations."""
    magnification: float = nan
    """By how much two starts move apart at most in the first cycle; nan where unknown."""

    @property
    def exact_method(self) -> Method | None:
        """Which run of the reference counts as exact."""
        ended = {name: row["status"] for name, row in self.exact.items()}
        return next((each for each in (STRICT, STRICT_IMPLICIT) if ended.get(each.name) == "success"), None)


def run_campaign(cells: Sequence[Cell], n_jobs: int, on_progress: Progress | None) -> list[Outcome]:
    """Run cells, check what errs more than its bound, and refine what nothing accounts for."""
    first, second, third, checks, reruns = (part(on_progress, *ends) for ends in pairwise(_SHARES))
    wanted = [(number, method) for number, cell in enumerate(cells) for method in cell.methods]
    rows = _run(cells, wanted, n_jobs, first)
    # The tree's strict run takes longer than its standard one: not where that did not come to the end, nor
    # under the laws of a whole side.
    usual = [number for number, cell in enumerate(cells) if cell.law == LAWS[0]]
    failed = {run for run, row in rows.items() if row["status"] != "success"}
    strict = [(number, STRICT_TREE) for number in usual if (number, TREE) not in failed]
    strict += [(number, STRICT) for number in range(len(cells))]
    rows |= _run(cells, strict, n_jobs, second)
    # The perturbed run would take as long as the strict one. Under the laws of a whole side LSODA takes all
    # its time.
    ended = [rows[number, STRICT]["status"] for number in range(len(cells))]
    last = [(number, PERTURBED) for number, status in enumerate(ended) if status == "success"]
    last += [(number, STRICT_IMPLICIT) for number in usual if ended[number] not in ("success", "bad input")]
    rows |= _run(cells, last, n_jobs, third)
    outcomes = [_outcome(number, cell, rows) for number, cell in enumerate(cells)]
    check(outcomes, n_jobs, checks)
    rerun(outcomes, unexplained(outcomes), n_jobs, reruns)
    return outcomes


def _outcome(number: int, cell: Cell, rows: Mapping[Run, Row]) -> Outcome:
    exact = {method.name: rows[number, method] for method in EXACT if (number, method) in rows}
    each = {method.name: rows[number, method] for method in cell.methods}
    runs = {name: judge(row, exact, row.get("bound", nan)) for name, row in each.items()}
    outcome = Outcome(cell, runs, exact)
    if (number, PERTURBED) in rows:
        distance = apart(rows[number, STRICT], rows[number, PERTURBED])
        outcome.magnification = distance / cell.shift if cell.shift else inf
    return outcome


def _run(
    cells: Sequence[Cell], wanted: Iterable[Run], n_jobs: int, on_progress: Progress | None
) -> dict[Run, Row]:
    """Run what can be run, limit by limit."""
    rows: dict[Run, Row] = {}
    tasks: dict[float, dict[Run, CellRun]] = {limit: {} for limit in (SHORT_LIMIT, LIMIT, LONG_LIMIT)}
    for number, method in wanted:
        limit = _limit(cells[number], method)
        try:
            scene = cells[number].scene_of(method)
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


def check(outcomes: Sequence[Outcome], n_jobs: int, on_progress: Progress | None) -> None:
    """Estimate the errors of the degraded runs, and call announced what a user is told of.

    By a warning of the run itself, or by ``sixbar run --check``: its estimate exceeds the bound, or there is
    none. `sixbar run` names that check for every scene on which the bound was not measured.
    """
    scenes = {
        (number, method): outcome.cell.scene_of(method).with_values({"drive.cycles": CYCLES})
        for number, outcome in enumerate(outcomes)
        for method in outcome.cell.methods
        if outcome.runs[method.name].kind is Class.DEGRADED
    }
    tasks: dict[tuple[Run, str], CellRun] = {
        (run, level): CellRun(each, run[1].model, outcomes[run[0]].runs[run[1].name].row["limit"])
        for run, scene in scenes.items()
        for level, each in levels(scene, run[1].model).items()
    }
    rows = run_tasks(tasks, n_jobs, on_progress)
    for run, scene in scenes.items():
        family = {level: row for (other, level), row in rows.items() if other == run}
        judged = outcomes[run[0]].runs[run[1].name]
        judged.estimate = estimate(family, scene, run[1].model)
        if warned(judged.row) or not judged.estimate <= judged.bound:
            judged.kind = Class.ANNOUNCED


def estimate(family: Mapping[str, Row], scene: Scene, model: str) -> float:
    """Return the largest numerical uncertainty of slider_x over the cycle, m; nan without a finer run.

    Parameters
    ----------
    family
        Rows of `runs.run_cell` by the names of `comparison.accuracy.refine.levels`.
    scene, model
        Of the run itself.
    """
    x = {kind: np.asarray(row["x"]) for kind, row in family.items() if row["status"] == "success"}
    if not {"base", "finer"} <= set(x):
        return nan
    # Perturbed runs are beside the coarser one, where that is there
    beside = "coarser" in x or "coarser" not in family
    perturbed = tuple(values for kind, values in x.items() if beside and kind.endswith("perturbed"))
    runs = Levels(x["base"], x["finer"], x.get("coarser"), perturbed, *refinement(model, scene))
    half_width = window_samples(scene.period, scene.period / scene.data["output"]["samples_per_cycle"])
    return float(uncertainty(runs, half_width, 0.0).max())


def rerun(
    outcomes: Sequence[Outcome], wanted: Sequence[tuple[int, str]], n_jobs: int, on_progress: Progress | None
) -> None:
    """Ask of some runs, by cell's number and formulation's name, what is too dear to ask of all.

    Does what no setting resolves decide the motion? Then two starts a `HAIR` apart end as far apart as the
    run from the exact one. Or is the setting too coarse for this scene? Then a finer one errs less.
    """
    methods = {method.name: method for method in METHODS}
    tasks: dict[tuple[int, str], CellRun] = {}
    for number, name in wanted:
        outcome, method = outcomes[number], methods[name]
        if (exact := outcome.exact_method) is not None:
            beside = moved(outcome.cell.scene_of(exact), HAIR)
            tasks[number, _BESIDE] = CellRun(beside, exact.model, LIMIT)
        scene = outcome.cell.scene_of(method).with_values({"drive.cycles": CYCLES})
        if (better := finer(method.model, scene)) is not None:
            tasks[number, name] = CellRun(better, method.model, LIMIT)
    rows = run_tasks(tasks, n_jobs, on_progress)
    for number, name in wanted:
        outcome = outcomes[number]
        judged = outcome.runs[name]
        if (exact := outcome.exact_method) is not None:
            judged.neighbour = apart(outcome.exact[exact.name], rows[number, _BESIDE])
        if (row := rows.get((number, name))) is not None:
            judged.finer = judge(row, outcome.exact, judged.bound)


# ---- why a run did not converge, as far as the runs themselves show

SCATTER = 10.0
"""Errors of single runs scatter by so much about their bound (`benchmarks/error_bounds.py`)."""
GAIN = 2.0
"""By which a finer setting, of a tenth of the tolerance or half the step, must err less at least."""
SLIGHTLY = 1.25
"""A smaller ratio explains nothing and is not reported."""
TOGETHER = 0.02
"""Cycles within which formulations leave the exact motion at one instant."""
USUAL_NEWTON = 1e-7
"""Newton's tolerance of the five bodies where a scene says nothing."""


class Cause(StrEnum):
    """Causes, as the page explains them. The first of several of a run stands for it (`principal`)."""

    UNEXPLAINED = "not explained"
    UNRESOLVED = "below any setting's resolution"
    TOO_COARSE = "setting too coarse"
    EDGE = "at the edge of stopping"
    LITERAL = "literal switch"
    FEW_STEPS = "few steps a contact"
    MAGNIFIED = "scene magnifies"
    TOGETHER = "leaves with others"
    STRICT_APART = "exact runs differ"
    SCATTERED = "scatter"
    NO_BOUND = "no bound on record"
    NEWTON_ERROR = "Newton's tolerance"
    AS_IN_BASE = "as in the base scene"
    UNCONFIRMED = "no exact run"
    COARSE_TOLERANCE = "tolerance refused"
    NO_MECHANISM = "no such mechanism"
    JAMMED = "friction may jam it"


@dataclass(frozen=True)
class Base:
    """What a cell's numbers are compared with."""

    bounded: Outcome
    """The cell that changes nothing under hertz-corners: the scene that error bounds are measured on."""
    law: Outcome
    """The same under the cell's own law."""


def bases(outcomes: Sequence[Outcome]) -> dict[str, Base]:
    """Return what the cells of each law are compared with."""
    unchanged = {each.cell.law: each for each in outcomes if each.cell.label == BASE_LABEL}
    bounded = unchanged[LAWS[0]]
    return {law: Base(bounded, unchanged.get(law, bounded)) for law in LAWS}


def unexplained(outcomes: Sequence[Outcome]) -> list[tuple[int, str]]:
    """Return the number of the cell and the formulation of each run whose error nothing explains."""
    by_law = bases(outcomes)
    return [
        (number, name)
        for number, outcome in enumerate(outcomes)
        for name in outcome.runs
        if Cause.UNEXPLAINED in causes(outcome, name, by_law[outcome.cell.law])
    ]


def principal(why: Sequence[Cause]) -> str:
    """Return the cause that stands for a run; empty where nothing is known."""
    return min(why, key=list(Cause).index, default="")


def causes(outcome: Outcome, name: str, base: Base) -> list[Cause]:
    """Return why a run is in its class; nothing for one that converged."""
    judged = outcome.runs[name]
    match judged.kind:
        case Class.CONVERGED:
            return []
        case Class.REFUSED:
            # Where the same mechanism runs with a finer tolerance, only that was wrong.
            coarse = outcome.exact.get(STRICT.name, judged.row)["status"] != "bad input"
            return [Cause.COARSE_TOLERANCE if coarse else Cause.NO_MECHANISM]
        case Class.UNCONFIRMED:
            return [Cause.UNCONFIRMED]
        case Class.ANNOUNCED | Class.DEGRADED:
            return _of_the_error(outcome, name, base)
        case _:
            return [Cause.JAMMED] if may_jam(outcome.cell.scene) else []


def may_jam(scene: Scene) -> bool:
    """Return whether friction can rotate a corner into its wall more than the wall rotates it out.

    A force N on a corner at (r_x, r_y) from the centre, with friction c_f N along the wall, rotates the
    slider by N (r_y - c_f r_x) / J5: inwards where c_f > r_y / r_x, length over width. What rod 4 lets the
    centre yield counts little beside it. The drive goes on all the same (Painleve's paradox).
    """
    slider = scene.data["mechanism"]["slider"]
    return bool(scene.data["friction"]["coefficient"] > slider["length"] / slider["width"])


def _of_the_error(outcome: Outcome, name: str, base: Base) -> list[Cause]:
    """Return what makes the error larger than its bound, factor by factor, as far as that accounts for it."""
    judged, cell = outcome.runs[name], outcome.cell
    if cell.law == LITERAL_LAW:
        return [Cause.LITERAL]
    if not isfinite(judged.bound):
        return [Cause.NO_BOUND]
    if cell.axis == NEWTON and float(cell.label) > USUAL_NEWTON:
        return [Cause.NEWTON_ERROR]
    steps = judged.row.get("steps_per_contact")
    if steps is not None and steps < FEW_STEPS:
        return [Cause.FEW_STEPS]
    why, accounted = [], judged.bound
    own = base.bounded.runs.get(name)
    if own is not None and own.error > own.bound:
        accounted *= own.error / own.bound
        why.append(Cause.AS_IN_BASE)
    magnified = outcome.magnification / base.bounded.magnification
    if magnified > SLIGHTLY:
        accounted *= magnified
        why.append(Cause.MAGNIFIED)
    same = base.law.runs.get(name)
    usual = same.row.get("steps_per_contact") if same else None
    if steps is not None and usual is not None and steps * SLIGHTLY < usual:
        accounted *= (usual / steps) ** 2  # of second order in the step over the contact's duration
        why.append(Cause.FEW_STEPS)
    if judged.error <= SCATTER * accounted:
        return why or [Cause.SCATTERED]
    return [*why, _last_resort(outcome, name)]


def _last_resort(outcome: Outcome, name: str) -> Cause:
    """Return the cause of an error that no factor accounts for."""
    judged = outcome.runs[name]
    if apart(*outcome.exact.values()) > judged.bound:
        return Cause.STRICT_APART
    for other, run in outcome.runs.items():
        if other != name and run.kind in LARGER and abs(run.lasted - judged.lasted) <= TOGETHER:
            return Cause.TOGETHER
    if judged.neighbour >= judged.error / SCATTER:
        return Cause.UNRESOLVED
    if judged.finer is not None:
        if judged.finer.kind in (Class.STOPPED, Class.NOT_TESTED):
            return Cause.EDGE
        if judged.finer.error <= judged.error / GAIN:
            return Cause.TOO_COARSE
    return Cause.UNEXPLAINED


# ---- all runs as a table

MEASURED = (
    "energy_share", "constraint_m", "steps_per_contact", "contacts", "largest_force_N", "steps", "work",
)  # fmt: skip
"""Of a row of `runs.measure`."""
COLUMNS = (
    "axis", "value", "law", "model", "formulation", "class", "error_m", "bound_m", "estimate_m",
    "lasted_cycles", "magnification", "exact_apart_m", "neighbour_m", "finer_error_m", *MEASURED, "status",
    "limit_units", "message", "cause", "causes", "speed_rpm", "modulus_Pa", "scene",
)  # fmt: skip
"""Of ``cells.csv``."""
_ROUNDED = (
    "error_m", "estimate_m", "magnification", "exact_apart_m", "neighbour_m", "finer_error_m", "energy_share",
    "constraint_m", "steps_per_contact", "largest_force_N",
)  # fmt: skip
"""To three digits: what the machine's last bits do not change."""


def frame(outcomes: Sequence[Outcome]) -> pd.DataFrame:
    """Return every run as a row, by cell and formulation, in SI units; columns are `COLUMNS` and ``cell``."""
    by_law, rows = bases(outcomes), []
    for number, outcome in enumerate(outcomes):
        cell = outcome.cell
        asked = {
            "cell": number,
            "axis": cell.axis,
            "value": cell.label,
            "law": cell.law,
            "magnification": outcome.magnification,
            "speed_rpm": cell.changes.get("drive.speed_rpm"),
            "modulus_Pa": cell.changes.get("contact.youngs_modulus"),
            "exact_apart_m": apart(*outcome.exact.values()),
            "scene": " ".join(f"{key}={value}" for key, value in cell.changes.items()),
        }
        for method in cell.methods:
            judged = outcome.runs[method.name]
            why = causes(outcome, method.name, by_law[cell.law])
            ran = {
                "model": method.model,
                "formulation": method.name,
                "class": judged.kind.value,
                "error_m": judged.error,
                "bound_m": judged.bound,
                "estimate_m": judged.estimate,
                "lasted_cycles": judged.lasted,
                "neighbour_m": judged.neighbour,
                "finer_error_m": judged.finer.error if judged.finer else nan,
                "status": judged.row["status"],
                "limit_units": judged.row.get("limit", nan),
                "message": judged.row.get("message", ""),
                "cause": str(principal(why)),
                "causes": "; ".join(why),
            }
            rows.append(asked | ran | {name: judged.row.get(name) for name in MEASURED})
    runs = pd.DataFrame(rows).astype(dict.fromkeys(MEASURED, float))
    rounded = {name: [float(f"{value:.3g}") for value in runs[name]] for name in _ROUNDED}
    return runs.assign(**rounded)[["cell", *COLUMNS]]
