"""Speed against accuracy of every formulation and integrator; errors and costs of the named settings.

Runs are timed singly (`comparison.accuracy.work_precision.time_run`). Their error is that of slider_x over
one crank cycle against the reference at a tolerance far below all that are measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from math import ceil, floor, log10, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.accuracy.levels import NAMES, START, scene_at, solver_values
from comparison.accuracy.refine import CHANNEL
from comparison.accuracy.uncertainty import SAFETY_FACTOR
from comparison.accuracy.work_precision import Candidate, time_run
from comparison.execution.run import Job, Progress, run_all, run_one, table_of
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.files import write_text
from comparison.formatting import number, quantity
from comparison.models import MODELS, formulations, platform_name
from comparison.report import svg
from comparison.scene import Scene, load_scene, shipped_scenes
from comparison.studies.shared import scenes as catalogue
from comparison.studies.shared.scenes import MINIMAL, MULTIPLIERS, TREE, Method
from comparison.studies.shared.study import Columns, Study, markdown, write_csv
from comparison.tables.channels import Array

TRUTH = 1e-14  # tolerance of the run that counts as exact
CONFIRMATION = 1e-12  # of the other model's most accurate run
SCENES = {"150rpm-0.2mm": "150 rpm, 0.2 mm", "300rpm-0.2mm": "300 rpm, 0.2 mm"}
ERRORS = {quantity(error, "m", 1): error for error in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)}
"""Errors of x at which costs are compared, m, by their headings."""
_STEPS = (4e-5, 2e-5, 8e-6, 4e-6, 2e-6, 1e-6, 5e-7)


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{n}") for n in range(first, last + 1))


SWEEPS: dict[Method, tuple[float, ...]] = {
    MINIMAL: _decades(6, 12),
    catalogue.MINIMAL_SCIPY: _decades(6, 9),
    catalogue.MINIMAL_LSODA: _decades(6, 10),
    catalogue.MINIMAL_RADAU: _decades(6, 8),
    catalogue.MINIMAL_BDF: _decades(6, 9),
    MULTIPLIERS: _decades(6, 12),
    catalogue.MULTIPLIERS_BDF: _decades(6, 8),
    TREE: _decades(4, 11),
    catalogue.TREE_LONG_STEPS: _decades(2, 8),
    catalogue.FULL: _STEPS,
    catalogue.FULL_INDEX2: _STEPS,
}
"""Method -> its tolerances, or step sizes in s, coarsest first."""
RATIOS: tuple[tuple[Method, str, tuple[Method, ...]], ...] = (
    (catalogue.MULTIPLIERS_BDF, "minimal, DOP853", (MINIMAL,)),
    (MULTIPLIERS, "minimal, DOP853", (MINIMAL,)),
    (catalogue.FULL, "the cheaper of the two trees", (TREE, catalogue.TREE_LONG_STEPS)),
    (TREE, "tree, DOPRI5, steps up to 1 ms", (catalogue.TREE_LONG_STEPS,)),
    (TREE, "minimal, DOP853", (MINIMAL,)),
)
"""Method, the words for its bases, and these: the cheapest counts."""
# By formulation, a model's own colour being that of its smallest; by integrator of either model.
_COLOURS = {
    "minimal": svg.FIRST,
    "multipliers": svg.SERIES[0],
    "tree": svg.SECOND,
    "full (five bodies)": svg.SERIES[1],
}
_MARKS = {"DOP853": "o", "scipy's DOP853": "s", "LSODA": "^", "Radau": "v", "BDF": "D"}
_MARKS |= {"DOPRI5": "o", "DOPRI5, steps up to 1 ms": "s"}
_MARKS |= {"generalized alpha": "^", "trapezoidal index 2": "v"}

STARTS = {"minimal": 60, "multiplier": 10, "tree": 20, "full": 2}
"""Starts of each named setting: a cycle takes the reference 10 ms, the five bodies up to 30 s."""
START_STEP = 1e-8
"""m; between starts: far below the accuracy of any press, far above every error that a start could hide."""
ROUND_OFF = 1e-15
"""m; some units in the last place of x, which is about -0.5 m: no error bound is below it."""


class Config(NamedTuple):
    """Amount of the measurements."""

    settings: int  # of each method, from the coarsest, at most
    scenes: int  # of the shipped ones, at most
    starts: int  # of each named setting, at most


class Results(NamedTuple):
    """Rows of the methods and of the named settings: labels, and the row of `measure`."""

    rows: list[Row]  # ``method``, ``model``, ``scene``, ``setting``
    settings: list[Row]  # ``scene``, ``model``, ``formulation``, ``accuracy``, ``cycles``
    distances: list[float]  # between the models' most accurate runs of each of `SCENES`, m of x


@dataclass(frozen=True)
class TimedRun(Task):
    """A run to be timed."""

    name: str  # shipped scene
    start: int  # see `first_cycle`
    model: str
    label: str  # of the formulation, whose first run compiles
    scene: Scene

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, whose run counts as exact."""
        return self.model, MODELS[0]


def measure(task: TimedRun, progress: Progress) -> Row:
    """Run a scene and return its processor time, work, and error of x, m."""
    run = time_run(Candidate(task.scene, task.model, task.label, "", nan), progress)
    if run.x is None:
        return {"status": run.status, "seconds": None, "evaluations": None, "error": None}
    error = float(np.abs(run.x - exact_x(task.name, task.start)).max())
    return {"seconds": run.seconds, "evaluations": run.evaluations, "error": error}


def first_cycle(name: str, start: int = 0) -> Scene:
    """Return the first cycle of a shipped scene from a start: 0, 1, -1, 2, -2 ... times `APART`."""
    scene = load_scene(name)
    metres = (start + 1) // 2 * (1 if start % 2 else -1) * START_STEP
    offset = scene.data["initial"]["slider_offset"] + metres
    cycles = min(1.0, scene.data["drive"]["cycles"])
    return scene.variant({"drive.cycles": cycles, "initial.slider_offset": offset})


@cache
def exact_x(name: str, start: int) -> Array:
    """Return x of the exact run, m, shape (n,)."""
    scene = scene_at(first_cycle(name, start), MODELS[0], "minimal", TRUTH)
    return run_one(scene, MODELS[0]).values(CHANNEL)


def sweep_tasks(config: Config) -> list[tuple[Row, TimedRun]]:
    """Return the labels and runs of the methods over their settings."""
    tasks = []
    for (method, settings), name in product(SWEEPS.items(), SCENES):
        key = "step" if "full" in method.name else "tolerance"
        scene = first_cycle(name).variant({"output.groups": [], **method.changes})
        for setting in settings[: config.settings]:
            labels = {"method": method.name, "model": method.model, "scene": name, "setting": setting}
            variant = scene.variant({f"solver.{method.model}.{key}": setting})
            tasks.append((labels, TimedRun(name, 0, method.model, method.name, variant)))
    return tasks


def setting_tasks(config: Config) -> list[tuple[Row, TimedRun]]:
    """Return the labels and runs of the named settings from some starts, on the shipped scenes."""
    tasks = []
    for name, model in product(shipped_scenes()[: config.scenes], MODELS):
        for formulation in formulations(model, load_scene(name).data):
            for start in range(min(STARTS[formulation], config.starts)):
                scene = first_cycle(name, start).variant({f"solver.{model}.formulation": formulation})
                for accuracy in NAMES:
                    labels = {"scene": name, "formulation": formulation, "accuracy": accuracy}
                    variant = scene.variant(solver_values(model, accuracy, scene))
                    labels |= {"model": model, "cycles": scene.data["drive"]["cycles"]}
                    tasks.append((labels, TimedRun(name, start, model, formulation, variant)))
    return tasks


def measure_study(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Measure in one process, whatever ``n_jobs`` says, since it is timed."""
    sweeps, settings = sweep_tasks(config), setting_tasks(config)
    tasks = sweeps + settings
    results = measure_all(measure, [task for _, task in tasks], on_processes(1), on_progress)
    rows = [row | labels for (labels, _), row in zip(tasks, results, strict=True)]
    return Results(rows[: len(sweeps)], rows[len(sweeps) :], distances(n_jobs))


def distances(n_jobs: int) -> list[float]:
    """Return the distances of the other model's most accurate runs of `SCENES` from the exact ones, m."""
    jobs = [Job(scene_at(first_cycle(name), MODELS[1], "tree", CONFIRMATION), MODELS[1]) for name in SCENES]
    tables = map(table_of, run_all(jobs, n_jobs), jobs)
    pairs = zip(tables, SCENES, strict=True)
    return [float(np.abs(table.values(CHANNEL) - exact_x(name, 0)).max()) for table, name in pairs]


# ---- curves: a row a setting, coarsest first; an error of 0 or nan is no point of one


def curve_of(rows: pd.DataFrame, method: Method, scene: str) -> pd.DataFrame:
    """Return ``error`` and ``seconds`` of a method's settings with a result on a scene."""
    mask = (rows["method"] == method.name) & (rows["scene"] == scene) & (rows["status"] == SUCCESS)
    return rows[mask & (rows["error"] > 0)][["error", "seconds"]].astype(np.float64)


def front(curve: pd.DataFrame) -> pd.DataFrame:
    """Return the points that no other one beats in error and in time, the cheapest first."""
    points = curve.sort_values(["seconds", "error"])
    return points[points["error"] < points["error"].cummin().shift(fill_value=np.inf)]


def cost_at(curve: pd.DataFrame, error: float) -> float:
    """Return the time of a curve at an error, interpolated in logarithms along its front.

    If all settings are more accurate, that of the cheapest; nan if none is: nothing is extrapolated.
    """
    best = front(curve)[::-1]
    if best.empty or error < best["error"].iloc[0]:
        return nan
    return float(10 ** np.interp(log10(error), np.log10(best["error"]), np.log10(best["seconds"])))


def costs(rows: pd.DataFrame, scene: str) -> pd.DataFrame:
    """Return the processor time, s, of each method at each of `ERRORS`; nan where it is not known."""
    curves = {method.title: curve_of(rows, method, scene) for method in SWEEPS}
    costs = {words: [cost_at(curve, error) for curve in curves.values()] for words, error in ERRORS.items()}
    return pd.DataFrame(costs, list(curves)).rename_axis("method")


def ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the cost of some methods over that of others at equal error."""
    lines = []
    for (method, words, bases), scene in product(RATIOS, SCENES):
        cost = costs(rows, scene)
        ratio = cost.T[method.title] / cost.loc[[base.title for base in bases]].min()
        names = {"cost of": method.title, "over that of": words, "scene": SCENES[scene]}
        lines.append(names | ratio.to_dict())
    return pd.DataFrame(lines)


def cheapest(rows: pd.DataFrame) -> list[dict[str, str]]:
    """Return the cheapest method of each scene at the smallest of the equal errors that any reaches."""
    lines = []
    for scene in SCENES:
        table = costs(rows, scene).dropna(axis="columns", how="all")
        if not table.empty:
            error, seconds = table.columns[-1], table.iloc[:, -1]
            time = quantity(seconds.min(), "s")
            lines.append(
                {"scene": SCENES[scene], "method": str(seconds.idxmin()), "error": error, "time": time}
            )
    return lines


# ---- the named settings, as `comparison.accuracy` reads them


def settings_toml(rows: Sequence[Row]) -> str:
    """Return error bound and cost of the named settings as ``measured.toml``."""
    frame, lines = pd.DataFrame(rows), []
    startup = frame["model"].map(START)
    frame["cost"] = (frame["seconds"].astype(float) - startup).clip(lower=1e-6) / frame["cycles"]
    for scene, scene_rows in frame.groupby("scene"):
        lines.append(f'\n["{scene}"]')
        tree_rows = scene_rows[(scene_rows["formulation"] == "tree") & (scene_rows["accuracy"] == NAMES[-1])]
        minimum = float(np.max(tree_rows["error"].to_numpy(np.float64), initial=ROUND_OFF / SAFETY_FACTOR))
        for formulation, group in scene_rows.groupby("formulation", sort=False):
            by_name = group.groupby("accuracy")
            bounds = error_bounds([float(by_name["error"].max()[name]) for name in NAMES], minimum)
            seconds = [float(by_name["cost"].min()[name]) for name in NAMES]
            error, cost = (", ".join(f"{value:.2g}" for value in values) for values in (bounds, seconds))
            lines.append(f"{formulation} = {{ error = [{error}], seconds = [{cost}] }}")
    return "\n".join(lines).lstrip() + "\n"


def error_bounds(errors: Sequence[float], minimum: float) -> list[float]:
    """Return the bounds of errors, coarsest first: with a factor of safety, none below that of a finer one.

    Single runs scatter by a factor of 3, at most 10; the largest of many starts has most of that in it. Of
    3500 runs of the reference from starts halfway between these, 3 were outside, by factors of 6, 6 and 33.
    """
    bounds = [round_up(SAFETY_FACTOR * max(error, minimum)) for error in errors]
    return [float(np.max(bounds[place:])) for place in range(len(bounds))]


def round_up(value: float) -> float:
    """Round up to two digits."""
    digit = floor(log10(value)) - 1
    return float(f"{ceil(value / 10.0**digit * (1 - 1e-12))}e{digit}")


# ---- page and figures


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    rows = pd.DataFrame(results.rows)
    columns: Columns = dict.fromkeys(("cost of", "over that of", "scene"), str)
    return {
        "cheapest": cheapest(rows),
        "titles": SCENES,
        "ratios": markdown(ratios(rows), columns | dict.fromkeys(ERRORS, partial(number, digits=2))),
        "machine": platform_name(),
        "truth": f"{TRUTH:.0e}",
        "distance": " and ".join(quantity(distance, "m", 1) for distance in results.distances),
        "failures": [row for row in results.rows if row["status"] != SUCCESS],
    }


def draw(results: Results, folder: Path) -> None:
    """Write the tables, and draw time over error for each scene, a panel a model."""
    rows = pd.DataFrame(results.rows)
    write_csv({"settings": rows}, folder)
    write_text(settings_toml(results.settings), folder / "measured.toml")
    for scene in SCENES:
        _draw(rows, scene, folder / f"{scene}-seconds.svg")


def _draw(rows: pd.DataFrame, scene: str, path: Path) -> None:
    """Draw a line a method: its colour is that of the formulation, its mark the integrator's."""
    methods = [method for method in SWEEPS if method.name in set(rows["method"])]
    curves = {method: curve_of(rows, method, scene) for method in methods}
    best = front(pd.concat(curves.values()))
    failures = rows[(rows["scene"] == scene) & (rows["status"] != SUCCESS)]["method"].value_counts()
    lines = max(sum(method.model == model for method in methods) for model in MODELS)
    with svg.panels(path, 1, len(MODELS), height=3.3 + 0.19 * lines, sharex=True, sharey=True) as panels:
        for axes, model in zip(panels, MODELS, strict=True):
            axes.set(xscale="log", yscale="log", xlabel="maximum error of x (m)")
            axes.plot(
                best["error"], best["seconds"], color=svg.SHADE, lw=5, label="Pareto front of both models"
            )
            for method in (each for each in methods if each.model == model):
                formulation, _, integrator = method.name.partition(", ")
                label = f"{formulation.removesuffix(' (five bodies)')}, {integrator}"
                label += f" (-{failures[method.name]})" if method.name in failures else ""
                style: Row = {"color": _COLOURS[formulation], "marker": _MARKS[integrator], "ms": 4}
                axes.plot(*curves[method].to_numpy().T, mfc="none", lw=0.9, label=label, **style)
            axes.margins(x=0.05)
            axes.set_title(model, fontsize=9)
            axes.legend(loc="upper left", bbox_to_anchor=(-0.4, 0.0), borderaxespad=5.0)
        panels[0].set_ylabel("processor time (s)")


STUDY = Study(
    "tradeoff",
    small=Config(settings=2, scenes=1, starts=1),
    full=Config(settings=8, scenes=99, starts=60),
    measure=measure_study,
    page=page,
    draw=draw,
)
