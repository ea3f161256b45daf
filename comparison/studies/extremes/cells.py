"""Cells of the study: what is pushed, who runs it, what became of each run, and why.

A cell is the scene `runs.BASE` with one number pushed to an extreme, or with all drawn at once in a Latin
hypercube (``axes.toml``). Every formulation runs it at its standard accuracy, and is held against the most
accurate runs of either model.
"""

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

from comparison.accuracy.levels import expected, finer, refinement, solver_values
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Levels, uncertainty, window_samples
from comparison.execution.run import FEW_STEPS, MUCH_DRIFT, MUCH_ENERGY, Progress
from comparison.execution.store import Row
from comparison.scene import Scene, SceneError, load_scene
from comparison.studies.extremes.runs import BASE, LIMIT, CellRun, run_tasks
from comparison.studies.shared import scenes as catalogue
from comparison.studies.shared.scenes import Method
from comparison.studies.shared.study import part


def _at(accuracy: str, method: Method, name: str, *groups: str) -> Method:
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
METHODS = {each.name: each for each in (MINIMAL, IMPLICIT, MULTIPLIERS, TREE, FULL, INDEX2)}
COMMON = (MINIMAL, MULTIPLIERS, TREE, FULL)
"""What runs the hypercube, and the laws of a whole side, under which LSODA takes all its time."""
COMPARED = (MINIMAL, TREE, FULL)
"""Whose classes are compared: the smallest formulation of each model, and the full one."""

# What the others are held against; the last one where the reference's strict run does not come to the end.
STRICT = _at("strict", catalogue.MINIMAL, "minimal, strict", "energy")
STRICT_TREE = _at("strict", catalogue.TREE, "tree, strict")
STRICT_IMPLICIT = _at("strict", catalogue.MINIMAL_LSODA, "minimal by LSODA, strict", "energy")
EXACT = (STRICT, STRICT_TREE, STRICT_IMPLICIT)
# From starts beside the cell's: how much the scene magnifies, and whether a hair decides the motion.
PERTURBED = Method("minimal, strict, perturbed", "reference", STRICT.changes)

# ---- what is pushed

LAWS = ("hertz-corners", "foundation", "paper-switching")
LITERAL_LAW = LAWS[2]
IMPACT = "adams-impact"  # of which axes of its own are run, and points of the hypercube
SEED = 1  # of the Latin hypercube
CYCLES, SAMPLES = 1.0, 250
"""An error bound is one over the first cycle; samples of a cycle."""
CYCLES_AXIS, HYPERCUBE, NEWTON, BASE_LABEL = "cycles", "hypercube", "Newton's tolerance", "as shipped"
_DATA: dict[str, list[dict[str, Any]]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("axes.toml").read_text("utf-8")
)
_PARTS, _RANGES = _DATA["part"], _DATA["range"]
AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS if not {"only", "law"} & part.keys()))
"""Those that are run under `LAWS`; the first is the scene as it is."""
OWN_AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS if "law" in part))
"""Those of the law `IMPACT` alone."""
UNITS = {part["axis"]: part["unit"] for part in _PARTS if "unit" in part}
_BASE = load_scene(BASE).data


@dataclass(frozen=True)
class Cell:
    """One scene at an extreme: what is pushed and how far, and the formulations that run it."""

    axis: str
    label: str
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
        """Return the scene as a formulation runs it; exact runs keep their settings and take one cycle."""
        if method not in (*EXACT, PERTURBED):
            return self.scene.with_values({**method.changes, **self.settings})
        scene = self.scene.with_values({**method.changes, "drive.cycles": CYCLES})
        return moved(scene, self.shift) if method == PERTURBED else scene

    def limit(self, method: Method) -> float:
        """Return the units that a run may take; less where most runs would take all they are given."""
        if self.axis == CYCLES_AXIS and method not in (*EXACT, PERTURBED):
            return LONG_LIMIT
        short = self.law == LITERAL_LAW or (self.axis == HYPERCUBE and self.law != LAWS[0])
        return SHORT_LIMIT if short else LIMIT


def moved(scene: Scene, distance: float) -> Scene:
    """Return a scene with the slider's start moved by a distance, m."""
    return scene.with_values({"initial.slider_offset": scene.data["initial"]["slider_offset"] + distance})


def cells(axes: Sequence[str], points: int) -> list[Cell]:
    """Return all cells: every axis under every law, settings and cycles, then the hypercube.

    Under the laws of a whole side the ends of an axis alone: they cost much.
    """
    asked: list[Cell] = []
    for law in LAWS:
        for axis in (axis for axis in axes if axis not in OWN_AXES):
            parts = [part for part in _PARTS if part["axis"] == axis]
            along = [cell for part in parts for cell in _cells(part, law)]
            if law == LAWS[0]:
                asked += along
            elif law != LITERAL_LAW or parts[0].get("literal"):
                asked += dict.fromkeys((along[0], along[-1]))
    asked += [cell for part in _PARTS if "only" in part for cell in _cells(part, LAWS[0])]
    own = [part for part in _PARTS if part["axis"] in axes and "law" in part]
    asked += [cell for part in own for cell in _cells(part, IMPACT)]
    return asked + hypercube(points, SEED)


def _cells(part: Mapping[str, Any], law: str) -> list[Cell]:
    methods: Iterable[Method] = METHODS.values() if law == LAWS[0] else COMMON
    if "only" in part:
        methods = [METHODS[name] for name in part["only"]]
    elif not part.get("audited"):
        methods = [method for method in methods if method != INDEX2]
    cells, keys = [], part["keys"] if "keys" in part else {part["key"]: 1.0}
    for value in part["values"]:
        values = {key: factor * value for key, factor in keys.items()} | part.get("fixed", {})
        both = ({}, values) if part.get("settings") else (values, {})
        cells.append(Cell(part["axis"], part.get("label", "{:g}").format(value), law, tuple(methods), *both))
    return cells


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    The start lies from wall to wall and a tenth of the clearance inside it, tilted up to the wedge; of ten
    points one is under the paper's literal switch, one under ADAMS' law, of the others each second one under
    the foundation; of five one has a workpiece.
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
        if number % 5 != 2:
            del values["load.force"]
        law = {9: LITERAL_LAW, 4: IMPACT}.get(number % 10, LAWS[number % 2])
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
"""Of runs that err more than their bound: reported to the user, or not."""
_BY_STATUS = {"bad input": Class.REFUSED, "crashed": Class.CRASHED, "unusable": Class.NONSENSE}


def judge(row: Row, exact: Iterable[Row], bound: float) -> Row:
    """Judge a run by the most accurate runs of each model, those that finished the first cycle.

    With two of them the run must be close to both, as either may be the one that is wrong. ``bound``: on the
    error of slider_x at its setting over the cycle, m. Returns ``class``; ``error_m``: the largest distance
    from them; ``bound_m``; ``lasted_cycles``, over which the distance stays within the bound.
    """
    judged = {"class": Class.CONVERGED, "error_m": nan, "bound_m": bound, "lasted_cycles": nan}
    if row["status"] != "success":
        # Of what the study cut off nothing is known of the motion.
        other = Class.NOT_TESTED if "share" in row and "x" not in row else Class.STOPPED
        return judged | {"class": _BY_STATUS.get(row["status"], other)}
    x = np.asarray(row["x"], dtype=np.float64)
    finished = [each["x"] for each in exact if each["status"] == "success"]
    if not finished:
        return judged | {"class": Class.UNCONFIRMED}
    distance = np.max([np.abs(x - np.asarray(each)) for each in finished], axis=0)
    outside = np.flatnonzero(~(distance <= bound))  # all, where there is no bound
    if outside.size or _spoiled(row):
        judged["class"] = Class.DEGRADED
    lasted = float(outside[0]) / (x.size - 1) if outside.size else 1.0
    return judged | {"error_m": float(distance.max()), "lasted_cycles": lasted}


def _spoiled(row: Row) -> bool:
    return (row.get("energy_share") or 0.0) > MUCH_ENERGY or (row.get("constraint_m") or 0.0) > MUCH_DRIFT


def warned(row: Row) -> bool:
    """Return whether `sixbar run` would warn of such a run (`comparison.execution.run`)."""
    steps = row.get("steps_per_contact")
    return (steps is not None and steps < FEW_STEPS) or _spoiled(row)


def apart(*rows: Row) -> float:
    """Return how far the finished ones of runs are from one another at most, m; nan with less than two."""
    runs = [np.asarray(row["x"], dtype=np.float64) for row in rows if row["status"] == "success"]
    return float(np.ptp(runs, axis=0).max()) if len(runs) > 1 else nan


# ---- the campaign

LONG_LIMIT, SHORT_LIMIT = 6000.0, 150.0
HAIR = 1e-13
"""m: a thousand times the rounding of x, and less than any setting resolves."""
_SHARES = (0.0, 0.69, 0.81, 0.86, 0.95, 1.0)
"""Of the expected time: where passes, checks and refined reruns begin and end."""
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

Key = tuple[int, Method]
"""Number of the cell, and the formulation that runs it."""
Run = dict[str, Any]
"""What became of a run: `COLUMNS`, and what finds its ``cell``, ``method`` and ``row`` again."""


def run_campaign(cells: Sequence[Cell], n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run cells, check what errs more than its bound, and refine what nothing accounts for.

    Returns a row a run, by cell and formulation, in SI units: columns are `COLUMNS` and ``cell``.
    """
    first, second, third, checks, reruns = (part(on_progress, *ends) for ends in pairwise(_SHARES))
    rows = _run(
        cells, [(n, method) for n, cell in enumerate(cells) for method in cell.methods], n_jobs, first
    )
    # The tree's strict run takes longer than its standard one: not where that did not come to the end, nor
    # under the laws of a whole side.
    usual = [n for n, cell in enumerate(cells) if cell.law == LAWS[0]]
    strict = [
        (n, STRICT_TREE) for n in usual if rows.get((n, TREE), {}).get("status", "success") == "success"
    ]
    rows |= _run(cells, strict + [(n, STRICT) for n in range(len(cells))], n_jobs, second)
    # The perturbed run would take as long as the strict one. Under the laws of a whole side LSODA takes all
    # its time.
    ended = [rows[n, STRICT]["status"] for n in range(len(cells))]
    last = [(n, PERTURBED) for n, status in enumerate(ended) if status == "success"]
    last += [(n, STRICT_IMPLICIT) for n in usual if ended[n] not in ("success", "bad input")]
    rows |= _run(cells, last, n_jobs, third)
    runs = judged(cells, rows)
    check(cells, runs, n_jobs, checks)
    explain(runs)
    rerun(cells, rows, [run for run in runs if Cause.UNEXPLAINED in run["causes"]], n_jobs, reruns)
    explain(runs)
    for run in runs:
        run |= {"class": str(run["class"]), "cause": principal(run["causes"])}
        run["causes"] = "; ".join(run["causes"])
    table = pd.DataFrame(runs, columns=["cell", *COLUMNS]).astype(dict.fromkeys(MEASURED, float))
    return table.assign(**{name: [float(f"{value:.3g}") for value in table[name]] for name in _ROUNDED})


def _run(
    cells: Sequence[Cell], wanted: Iterable[Key], n_jobs: int, on_progress: Progress | None
) -> dict[Key, Row]:
    """Run what can be run, limit by limit."""
    rows: dict[Key, Row] = {}
    tasks: dict[float, dict[Key, CellRun]] = {limit: {} for limit in (SHORT_LIMIT, LIMIT, LONG_LIMIT)}
    for number, method in wanted:
        limit = cells[number].limit(method)
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
        for key, row in ran.items():
            rows[key] |= row
        done += len(some)
    return rows


def judged(cells: Sequence[Cell], rows: Mapping[Key, Row]) -> list[Run]:
    """Judge every run of the cells by their exact runs."""
    runs = []
    for number, cell in enumerate(cells):
        exact = {method: rows[number, method] for method in EXACT if (number, method) in rows}
        magnification = nan
        if (number, PERTURBED) in rows:
            distance = apart(rows[number, STRICT], rows[number, PERTURBED])
            magnification = distance / cell.shift if cell.shift else inf
        known = {
            "cell": number, "axis": cell.axis, "value": cell.label, "law": cell.law, "exact": exact,
            "magnification": magnification, "exact_apart_m": apart(*exact.values()),
            "speed_rpm": cell.changes.get("drive.speed_rpm"),
            "modulus_Pa": cell.changes.get("contact.youngs_modulus"),
            "friction": cell.changes.get("friction.coefficient", _BASE["friction"]["coefficient"]),
            "scene": " ".join(f"{key}={value}" for key, value in cell.changes.items()),
            "estimate_m": nan, "neighbour_m": nan, "finer_error_m": nan, "finer_class": None,
        }  # fmt: skip
        for method in cell.methods:
            row = rows[number, method]
            ran = {"method": method, "model": method.model, "formulation": method.name, "row": row}
            ran |= {"status": row["status"], "message": row.get("message", "")}
            ran |= {"limit_units": row.get("limit", nan)} | {name: row.get(name) for name in MEASURED}
            runs.append(known | ran | judge(row, exact.values(), row.get("bound", nan)))
    return runs


def check(cells: Sequence[Cell], runs: Sequence[Run], n_jobs: int, on_progress: Progress | None) -> None:
    """Estimate the errors of the degraded runs, and call announced what is reported to the user.

    By a warning of the run itself, or by ``sixbar run --check``: its estimate exceeds the bound, or there is
    none. `sixbar run` names that check for every scene on which the bound was not measured.
    """
    degraded = [run for run in runs if run["class"] is Class.DEGRADED]
    scenes = [_one_cycle(cells, run) for run in degraded]
    tasks = {
        (number, level): CellRun(each, run["model"], run["limit_units"])
        for number, (run, scene) in enumerate(zip(degraded, scenes, strict=True))
        for level, each in levels(scene, run["model"]).items()
    }
    rows = run_tasks(tasks, n_jobs, on_progress)
    for number, (run, scene) in enumerate(zip(degraded, scenes, strict=True)):
        family = {level: row for (other, level), row in rows.items() if other == number}
        run["estimate_m"] = estimate(family, scene, run["model"])
        if warned(run["row"]) or not run["estimate_m"] <= run["bound_m"]:
            run["class"] = Class.ANNOUNCED


def _one_cycle(cells: Sequence[Cell], run: Run) -> Scene:
    return cells[run["cell"]].scene_of(run["method"]).with_values({"drive.cycles": CYCLES})


def estimate(family: Mapping[str, Row], scene: Scene, model: str) -> float:
    """Return the largest numerical uncertainty of slider_x over the cycle, m; nan without a finer run.

    ``family``: rows of `runs.run_cell` by the names of `comparison.accuracy.refine.levels`.
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
    cells: Sequence[Cell],
    rows: Mapping[Key, Row],
    wanted: Sequence[Run],
    n_jobs: int,
    on_progress: Progress | None,
) -> None:
    """Ask of some runs what is too dear to ask of all.

    Does what no setting resolves decide the motion? Then two starts a `HAIR` apart end as far apart as the
    run from the exact one. Or is the setting too coarse for this scene? Then a finer one errs less.
    """
    tasks: dict[tuple[int, str], CellRun] = {}
    references: dict[int, Row] = {}
    for run in wanted:
        number = run["cell"]
        for exact in (STRICT, STRICT_IMPLICIT):
            if number not in references and rows.get((number, exact), {}).get("status") == "success":
                references[number] = rows[number, exact]
                beside = moved(cells[number].scene_of(exact), HAIR)
                tasks[number, "beside"] = CellRun(beside, exact.model, LIMIT)
        if (better := finer(run["model"], _one_cycle(cells, run))) is not None:
            tasks[number, run["formulation"]] = CellRun(better, run["model"], LIMIT)
    ran = run_tasks(tasks, n_jobs, on_progress)
    for run in wanted:
        if (number := run["cell"]) in references:
            run["neighbour_m"] = apart(references[number], ran[number, "beside"])
        if (row := ran.get((number, run["formulation"]))) is not None:
            again = judge(row, run["exact"].values(), run["bound_m"])
            run |= {"finer_error_m": again["error_m"], "finer_class": again["class"]}


# ---- why a run did not converge, as far as the runs themselves show

SCATTER = 10.0
"""Errors of single runs scatter by so much about their bound (`studies.tradeoff.study.bounded`)."""
GAIN = 2.0
"""By which a finer setting, of a tenth of the tolerance or half the step, must err less at least."""
SLIGHTLY = 1.25
"""A smaller ratio explains nothing and is not reported."""
TOGETHER = 0.02
"""Cycles within which formulations leave the exact motion at one instant."""
USUAL_NEWTON = 1e-7
"""Newton's tolerance of the five bodies where a scene says nothing."""
_JAMS = _BASE["mechanism"]["slider"]["length"] / _BASE["mechanism"]["slider"]["width"]
"""Friction above which a force N on a corner at (r_x, r_y) from the centre, and c_f N along the wall turn the
slider into its wall, by N (r_y - c_f r_x) / J5. The drive goes on all the same (Painleve's paradox)."""


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


def principal(why: Sequence[Cause]) -> str:
    """Return the cause that stands for a run; empty where nothing is known."""
    return str(min(why, key=list(Cause).index, default=""))


def explain(runs: Sequence[Run]) -> None:
    """Give every run its ``causes``: why it is in its class; nothing for one that converged."""
    unchanged = {(run["law"], run["formulation"]): run for run in runs if run["value"] == BASE_LABEL}
    left: dict[int, list[Run]] = {}
    for run in runs:
        if run["class"] in LARGER:
            left.setdefault(run["cell"], []).append(run)
    for run in runs:
        causes = []
        if run["class"] is Class.REFUSED:
            # Where the same mechanism runs with a finer tolerance, only that was wrong.
            coarse = run["exact"].get(STRICT, run["row"])["status"] != "bad input"
            causes = [Cause.COARSE_TOLERANCE if coarse else Cause.NO_MECHANISM]
        elif run["class"] is Class.UNCONFIRMED:
            causes = [Cause.UNCONFIRMED]
        elif run["class"] in LARGER:
            others = [other["lasted_cycles"] for other in left[run["cell"]] if other is not run]
            causes = _of_the_error(run, others, unchanged)
        elif run["class"] is not Class.CONVERGED and run["friction"] > _JAMS:
            causes = [Cause.JAMMED]
        run["causes"] = causes


def _of_the_error(run: Run, left: Sequence[float], unchanged: Mapping[tuple[str, str], Run]) -> list[Cause]:
    """Return what makes the error larger than its bound, factor by factor, as far as that accounts for it.

    Its numbers are compared with those of the cell that changes nothing: under hertz-corners, on which error
    bounds are measured, and under its own law. ``left``: when others left the exact motion, in cycles.
    """
    steps, error = run["steps_per_contact"], run["error_m"]
    if run["law"] == LITERAL_LAW:
        return [Cause.LITERAL]
    if not isfinite(run["bound_m"]):
        return [Cause.NO_BOUND]
    if run["axis"] == NEWTON and float(run["value"]) > USUAL_NEWTON:
        return [Cause.NEWTON_ERROR]
    if steps is not None and steps < FEW_STEPS:
        return [Cause.FEW_STEPS]
    why, accounted = [], run["bound_m"]
    own = unchanged.get((LAWS[0], run["formulation"]))
    if own is not None and own["error_m"] > own["bound_m"]:
        accounted *= own["error_m"] / own["bound_m"]
        why.append(Cause.AS_IN_BASE)
    usual = next(each["magnification"] for (law, _), each in unchanged.items() if law == LAWS[0])
    laws = {law for law, _ in unchanged}
    same = unchanged.get((run["law"] if run["law"] in laws else LAWS[0], run["formulation"]))
    if (magnified := run["magnification"] / usual) > SLIGHTLY:
        accounted *= magnified
        why.append(Cause.MAGNIFIED)
    if steps is not None and same and (same["steps_per_contact"] or 0.0) > steps * SLIGHTLY:
        accounted *= (same["steps_per_contact"] / steps) ** 2  # of second order in the step
        why.append(Cause.FEW_STEPS)
    if error <= SCATTER * accounted:
        return why or [Cause.SCATTERED]
    tests = {
        Cause.STRICT_APART: run["exact_apart_m"] > run["bound_m"],
        Cause.TOGETHER: any(abs(cycles - run["lasted_cycles"]) <= TOGETHER for cycles in left),
        Cause.UNRESOLVED: run["neighbour_m"] >= error / SCATTER,
        Cause.EDGE: run["finer_class"] in (Class.STOPPED, Class.NOT_TESTED),
        Cause.TOO_COARSE: run["finer_error_m"] <= error / GAIN,
    }
    return [*why, next((cause for cause, holds in tests.items() if holds), Cause.UNEXPLAINED)]
