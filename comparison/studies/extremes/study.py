"""The study extremes: its cells, the class of each comparison, page, figures, and the table beside the page.

A cell is the scene `runs.BASE` with one parameter pushed to an extreme, or all drawn at once. The axes and
the ranges of the Latin hypercube are data, ``axes.toml``.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from importlib.resources import files
from math import log10
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from scipy.stats import qmc

from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import CRASHED, SUCCESS
from comparison.formatting import decade
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import Scene, SceneError, load_scene
from comparison.studies.extremes.runs import BASE, CUT_OFF, LIMIT, PairRun, no_run, run_pairs, verdict_of
from comparison.studies.shared.scenes import FULL, MINIMAL, MULTIPLIERS, TREE
from comparison.studies.shared.study import Study, markdown, part, write_csv
from comparison.verdict.validate import validate

PAIRS: dict[str, dict[str, object]] = {
    "smallest": {**MINIMAL.changes, **TREE.changes},
    "largest": {**MULTIPLIERS.changes, **FULL.changes},
}
"""Pair of formulations -> keys that select it; settings are those of the scene (accuracy ``standard``)."""
LAWS = ("hertz-corners", "foundation", "paper-switching", "adams-impact")
"""Contact laws; the first three are run along the axes that name none of their own."""
HERTZ, FOUNDATION, SWITCHING, IMPACT = LAWS
DAMPING_MODELS = ("lankarani-nikravesh", "hunt-crossley", "flores", "gonthier")
SEED = 1
"""Of the Latin hypercube."""
CYCLES, SAMPLES = 1.0, 250
"""Crank cycles of a cell, where its axis does not push them; samples per cycle."""
CYCLES_AXIS, HYPERCUBE = "cycles", "hypercube"
LONG_LIMIT, SHORT_LIMIT = 120.0, 3.0
"""Limits of cells of many cycles, and of those whose runs mostly take all the time that they are given."""
_DATA: dict[str, list[dict[str, Any]]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("axes.toml").read_text("utf-8")
)
_PARTS, _RANGES = _DATA["part"], _DATA["range"]
AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS))
"""All axes; the first is the base scene as it is shipped."""
UNITS = {part["axis"]: part["unit"] for part in _PARTS if "unit" in part}


@dataclass(frozen=True)
class Cell:
    """A scene at an extreme, and the pairs of formulations that run it."""

    axis: str
    label: str
    law: str
    changes: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Dotted keys that differ from the scene `BASE`."""
    pairs: tuple[str, ...] = tuple(PAIRS)

    @cached_property
    def scene(self) -> Scene:
        """The scene, without formulations; raises `SceneError` where the values of a scene exclude it."""
        settings: dict[str, object] = {"drive.cycles": CYCLES, "contact.law": self.law}
        sampling = {"output.groups": [], "output.samples_per_cycle": SAMPLES}
        return load_scene(BASE, settings | sampling | dict(self.changes))

    @property
    def limit(self) -> float:
        """Processor time that a run may take, s."""
        if self.axis == CYCLES_AXIS:
            return LONG_LIMIT
        short = self.law == SWITCHING or (self.axis == HYPERCUBE and self.law != HERTZ)
        return SHORT_LIMIT if short else LIMIT


def cells(axes: Sequence[str], points: int) -> list[Cell]:
    """Return the cells along axes, by law, and so many points of the hypercube.

    Under the laws of a whole side, whose runs are expensive, only the two ends of an axis.
    """
    grid: list[Cell] = []
    for law in LAWS:
        for axis in axes:
            parts = [part for part in _PARTS if part["axis"] == axis]
            law_name, literal = parts[0].get("law"), parts[0].get("literal", False)
            series = [cell for part in parts for cell in _cells_along(part, law)]
            if law == (law_name or HERTZ):
                grid += series
            elif law_name is None and (law == FOUNDATION or (law == SWITCHING and literal)):
                grid += dict.fromkeys((series[0], series[-1]))
    return grid + hypercube(points, SEED)


def _cells_along(part: Mapping[str, Any], law: str) -> list[Cell]:
    pairs = (part["pair"],) if "pair" in part else tuple(PAIRS)
    keys, cells = part["keys"] if "keys" in part else {part["key"]: 1.0}, []
    for value in part["values"]:
        changes = {key: factor * value for key, factor in keys.items()} | part.get("fixed", {})
        cells.append(Cell(part["axis"], part.get("label", "{:g}").format(value), law, changes, pairs))
    return cells


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    The start lies from wall to wall and a tenth of the clearance inside it, tilted up to the wedge. Of ten
    points one is under the paper's literal switch, one under ADAMS' law, of the others each second one under
    the foundation; these take the damping models in turn. Of five points one has a workpiece.
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
        law = {9: SWITCHING, 4: IMPACT}.get(number % 10, LAWS[number % 2])
        if law in (HERTZ, FOUNDATION):
            values["contact.damping_model"] = DAMPING_MODELS[number // 2 % len(DAMPING_MODELS)]
        cells.append(Cell(HYPERCUBE, f"{number + 1}", law, values))
    return cells


# ---- comparisons of the cells, their class, the page


class Class(StrEnum):
    """Classes of a comparison, as the page explains them; of the last two there must be none."""

    AGREE = "agree"
    INDETERMINATE = "indeterminate"
    DIFFER = "differ"
    REFERENCE_STOPS = "reference stops"
    EXUDYN_STOPS = "Exudyn stops"
    BOTH_STOP = "both stop"
    REFUSED = "refused"
    NOT_TESTED = "not tested"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


FORMULATIONS = {
    ("smallest", "reference"): "reference, minimal",
    ("smallest", "exudyn"): "Exudyn, tree",
    ("largest", "reference"): "reference, multipliers",
    ("largest", "exudyn"): "Exudyn, five bodies",
}
"""Formulations that run in a pair."""
_SIDE = ("status", "message", "steps", "contacts", "steps_per_contact", "constraint_m")
COLUMNS = (
    *("axis", "value", "law", "pair", "class", "tight", "coverage", "apart_m", "reason"),
    *(f"{model}_{name}" for model in MODELS for name in _SIDE),
    *("speed_rpm", "modulus_Pa", "scene"),
)
"""Of ``cells.csv``."""
_COLOURS = {
    Class.AGREE: svg.SERIES[0],
    Class.INDETERMINATE: svg.SERIES[2],
    Class.DIFFER: svg.SECOND,
    Class.REFERENCE_STOPS: svg.SERIES[1],
    Class.EXUDYN_STOPS: svg.SERIES[3],
    Class.BOTH_STOP: svg.OUTSIDE,
    Class.REFUSED: svg.SERIES[5],
    Class.NOT_TESTED: svg.LIMIT,
    Class.CRASHED: svg.INK,
    Class.NONSENSE: svg.INK,
}
_MARKS = dict(zip(Class, "os^><x_.**", strict=True))
_STRIPS = {"smallest": "minimal, tree", "largest": "multipliers, five bodies"}


class Config(NamedTuple):
    """Axes along which one parameter is pushed, and points of the Latin hypercube."""

    axes: Sequence[str]
    points: int


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run all cells by their pairs; a row for each comparison, with `COLUMNS` (SI units)."""
    runs = [(cell, pair) for cell in cells(config.axes, config.points) for pair in cell.pairs]
    rows: dict[int, Row] = {}
    tasks: dict[int, PairRun] = {}
    for number, (cell, pair) in enumerate(runs):
        try:
            tasks[number] = PairRun(cell.scene.with_values(PAIRS[pair]), cell.limit)
        except SceneError as error:
            rows[number] = no_run("bad input", str(error))
    for limit in sorted({task.limit for task in tasks.values()}):  # a process that hangs is ended by it
        group = {number: task for number, task in tasks.items() if task.limit == limit}
        ends = len(rows), len(rows) + len(group)
        share = part(on_progress, *(count / len(runs) for count in ends))
        rows |= zip(group, run_pairs(list(group.values()), n_jobs, share), strict=True)
    for number in [number for number in tasks if classify(rows[number]) is Class.DIFFER]:
        rows[number] |= _refined_verdicts(tasks[number].scene, n_jobs)
    table = [_columns(cell, pair, rows[number]) for number, (cell, pair) in enumerate(runs)]
    return pd.DataFrame(table, columns=list(COLUMNS))


def _refined_verdicts(scene: Scene, n_jobs: int) -> Row:
    """Return the verdicts of `validate` on models that differ without refinement; empty where runs fail."""
    (validation,) = validate(scene, n_jobs=n_jobs)
    result = validation.comparison
    if result.verdict == "cannot compare" or result.tight is None:
        return {}
    return verdict_of(result) | {"tight": result.tight.verdict}


def _columns(cell: Cell, pair: str, row: Row) -> dict[str, Any]:
    sides = {f"{model}_{name}": row[model].get(name) for model in MODELS for name in _SIDE}
    return {
        "axis": cell.axis,
        "value": cell.label,
        "law": cell.law,
        "pair": pair,
        "class": str(classify(row)),
        "tight": row.get("tight", ""),
        **{name: row[name] for name in ("coverage", "apart_m", "reason")},
        **sides,
        "speed_rpm": cell.changes.get("drive.speed_rpm"),
        "modulus_Pa": cell.changes.get("contact.youngs_modulus"),
        "scene": " ".join(f"{key}={value}" for key, value in cell.changes.items()),
    }


def classify(row: Row) -> Class:
    """Return the class of a row of `runs.run_pairs`: the worst of both runs, or the verdict on them."""
    statuses = [row[model]["status"] for model in MODELS]
    classes = {CRASHED: Class.CRASHED, "unusable": Class.NONSENSE, "bad input": Class.REFUSED}
    for status, worst in classes.items():
        if status in statuses:
            return worst
    first, second = (status not in (SUCCESS, CUT_OFF) for status in statuses)
    if first and second:
        return Class.BOTH_STOP
    if first or second:
        return Class.REFERENCE_STOPS if first else Class.EXUDYN_STOPS
    return Class.NOT_TESTED if CUT_OFF in statuses else Class(row["verdict"])


def page(runs: pd.DataFrame) -> Mapping[str, object]:
    """Return the values of the template."""
    columns, frames = ["axis", "value", "law"], []
    for (pair, model), name in FORMULATIONS.items():
        rows = runs[runs["pair"] == pair].rename(columns={f"{model}_status": "status"})
        failures = rows[~rows["status"].isin([SUCCESS, CUT_OFF, "bad input"])]
        frames.append(failures[[*columns, "status"]].assign(formulation=name))
    stops = pd.concat(frames)
    axis_stops = stops[(stops["law"] == HERTZ) & (stops["axis"] != HYPERCUBE)]
    classes = [kind for kind in Class if kind in set(runs["class"])]
    return {
        "runs": runs,
        "count": {kind: int((runs["class"] == kind).sum()) for kind in Class},
        "numerical": int(((runs["class"] == Class.DIFFER) & (runs["tight"] == "agree")).sum()),
        "law": HERTZ,
        "stopped": "; ".join(
            f"{name} ({where(axis_stops[axis_stops['formulation'] == name]) or 'nowhere'})"
            for name in FORMULATIONS.values()
        ),
        "points": runs.loc[runs["axis"] == HYPERCUBE, "value"].nunique(),
        "limits": [f"{limit:g}" for limit in (LIMIT, SHORT_LIMIT, LONG_LIMIT)],
        "classes": count_table(runs, ["pair", "law"], "class", classes),
        "stops": count_table(stops, ["formulation"], "status") if len(stops) else "None did.",
        "differ": "; ".join(
            f"{pair}, {law}: {where(group)} (at the tight tier: {', '.join(dict.fromkeys(group['tight']))})"
            for (pair, law), group in runs[runs["class"] == Class.DIFFER].groupby(["pair", "law"])
        ),
    }


def where(runs: pd.DataFrame) -> str:
    """Return the cells of runs, the values of each axis together."""
    groups = runs.drop_duplicates(["axis", "value"]).groupby("axis", sort=False)["value"]
    return "; ".join(f"{axis} {', '.join(values)}" for axis, values in groups)


def count_table(runs: pd.DataFrame, by: list[str], over: str, columns: Sequence[str] = ()) -> str:
    """Return a table of the counts of rows by the values of a column, in an order, and of all rows."""
    total = pd.crosstab([runs[name] for name in by], runs[over])
    rows = list(dict.fromkeys(zip(*(runs[name] for name in by), strict=True)))
    total = total.loc[rows if len(by) > 1 else [row for (row,) in rows]]
    if columns:
        total = total[list(columns)]
    return markdown(total.assign(all=total.sum(axis=1)).reset_index())


# ---- figures and the table beside the page


def draw(runs: pd.DataFrame, folder: Path) -> None:
    """Write both figures, and every comparison as a row of ``cells.csv``."""
    _draw_axes(runs, folder / "axes.svg")
    _draw_hypercube(runs, folder / "hypercube.svg")
    write_csv({"cells": runs}, folder, "%.6g")


def _draw_axes(runs: pd.DataFrame, path: Path) -> None:
    """Draw the classes along each parameter that is a number, a strip a pair of formulations."""
    points = runs[(runs["law"] == HERTZ) & (runs["axis"] != HYPERCUBE)]
    points = points.assign(at=pd.to_numeric(points["value"], errors="coerce")).dropna(subset="at")
    groups = points.groupby("axis", sort=False)
    rows = -(-len(groups) // 2)
    with svg.panels(path, rows, 2, height=0.75 + 0.65 * rows, sharey=True) as panels:
        for axes in panels[len(groups) :]:
            axes.set_visible(False)
        for axes, (axis, group) in zip(panels, groups, strict=False):
            values = sorted(set(group["at"]))
            for run in group.to_dict("records"):
                x, y = values.index(run["at"]), list(_STRIPS).index(run["pair"])
                axes.barh(y, 0.94, 0.88, x - 0.47, color=_COLOURS[run["class"]], alpha=0.75)
            axes.set_xticks(range(len(values)), map(_short_number, values), size=6)
            axes.set_yticks(range(len(_STRIPS)), list(_STRIPS.values()), size=7)
            axes.set_title(f"{axis} ({UNITS.get(str(axis), '1')})", size=8, loc="left", pad=3)
            axes.set(xlim=(-0.5, 7.5), ylim=(1.5, -0.5))
            axes.tick_params(length=0)
            axes.spines[:].set_visible(False)
            axes.grid(visible=False)
        for kind in [kind for kind in Class if kind in set(points["class"])]:
            panels[0].scatter([], [], marker="s", s=50, color=_COLOURS[kind], alpha=0.75, label=str(kind))
        svg.legend_above(panels[0], 4)


def _short_number(value: float) -> str:
    """Return a value in few characters: as a power of ten where it is one outside 0.1 to 1000."""
    tenth = log10(value) if value > 0 else 0.5
    if tenth == round(tenth) and not -1 <= tenth <= 3:
        return decade(value)
    head, _, exponent = f"{value:g}".replace("-", "−").partition("e")
    return f"{head}·{decade(10.0 ** int(exponent.replace('−', '-')))}" if exponent else head


def _draw_hypercube(runs: pd.DataFrame, path: Path) -> None:
    """Draw the class of each point, modulus over speed, a panel a pair of formulations."""
    points = runs[runs["axis"] == HYPERCUBE]
    looks: dict[Class, dict[str, Any]] = {
        kind: {"color": _COLOURS[kind], "marker": _MARKS[kind], "ms": 3.5, "mfc": "none", "ls": ""}
        for kind in Class
        if kind in set(points["class"])
    }
    with svg.panels(path, 1, 2, height=3.0, sharey=True) as panels:
        for axes, (pair, title) in zip(panels, _STRIPS.items(), strict=True):
            panel_points = points[points["pair"] == pair]
            for kind, look in looks.items():
                group = panel_points[panel_points["class"] == kind]
                axes.plot(group["speed_rpm"], group["modulus_Pa"], label=str(kind), **look)
            axes.set(xscale="log", yscale="log", xlabel="speed (rpm)")
            axes.margins(0.05)
            axes.set_title(title, size=8, loc="left")
        panels[0].set_ylabel("Young's modulus (Pa)")
        svg.legend_above(panels[0], 4)


STUDY = Study(
    "extremes",
    small=Config(axes=("base", "restitution"), points=5),
    full=Config(axes=AXES, points=200),
    measure=measure,
    page=page,
    draw=draw,
)
