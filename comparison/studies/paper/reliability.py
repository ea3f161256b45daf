"""Reliability of the paper's cases by both models over more cycles, and under a workpiece."""

from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Progress, dense_scene, run_all, table_of
from comparison.formatting import quantity
from comparison.models import MODELS
from comparison.reliability.assessment import MARGIN, Difference, cap, compare_reliability, ideal_scenes
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.report import svg
from comparison.report.figures import against_angle
from comparison.scene import Scene, load_scene
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study, cross_table, write_csv
from comparison.words.reliability import format_reliability

TRANSIENT = 1
"""Cycles at the start of a long run, which still depend on the initial position of the slider."""


class Config(NamedTuple):
    """Scenes, cycles of each long run and samples a cycle of a scene."""

    cases: tuple[str, ...]
    cycles: int
    samples: int


class Results(NamedTuple):
    """Both models' reliabilities over the later cycles of long runs."""

    config: Config
    scenes: dict[str, Scene]
    long: dict[str, dict[str, Difference]]  # by scene and quantity


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the cases and the ideal mechanism by both models; `RunError` if one does not succeed."""
    scenes, plans = {}, {}
    start = load_scene(CASES[0]).data["mechanism"]["crank_angle_deg"]
    for name in config.cases:
        values = {"drive.cycles": float(config.cycles), "output.samples_per_cycle": config.samples}
        values["mechanism.crank_angle_deg"] = start  # the workpiece's own scene begins elsewhere
        scene = scenes[name] = at_tier(load_scene(name, values), "tight")
        for model in MODELS:
            plans[name, model, "actual"] = levels(dense_scene(scene), model)
            plans[name, model, "ideal"] = ideal_scenes(scene, model)
    jobs = [Job(variant, model) for (_, model, _), each in plans.items() for variant in each.values()]
    tables = map(table_of, run_all(jobs, n_jobs, on_progress), jobs)
    each_run = {
        (name, model, motion): Runs(
            refinement=refinement(model, variants["base"]), **dict(zip(variants, tables, strict=False))
        )
        for (name, model, motion), variants in plans.items()
    }
    long = {}
    for name, scene in scenes.items():
        pair = {
            motion: (each_run[name, MODELS[0], motion], each_run[name, MODELS[1], motion])
            for motion in ("actual", "ideal")
        }
        limits, k = scene.reliability, thresholds("tight").k
        long[name] = compare_reliability(
            pair["actual"], pair["ideal"], scene.period, limits, k, TRANSIENT * scene.period
        )
    return Results(config, scenes, long)


# ---- page


def differences(by_scene: dict[str, dict[str, Difference]]) -> pd.DataFrame:
    """Return a row for each scene and quantity: both smallest reliabilities, their difference, its error.

    And of the first model the smallest share of time within the limit, and the largest mean error.
    """
    rows = []
    for scene, by_quantity in by_scene.items():
        for name, each in by_quantity.items():
            row: dict[str, Any] = {"scene": scene, "quantity": name, "unit": unit_of(name)}
            for model, side in zip(MODELS, (each.a, each.b), strict=True):
                row |= {f"{model}_smallest": side.minimum, f"{model}_at_deg": side.angle[side.worst]}
            row |= {"difference": each.minimum, "half_width": each.half_width, "other_cycles": each.sampling}
            row |= {"numerics": each.numerical, "verdict": each.verdict}
            row |= {"smallest_P": each.a.within.min(), "largest_mean": each.a.mean.max()}
            rows.append(row)
    return pd.DataFrame(rows)


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    long, settings = differences(results.long), next(iter(results.scenes.values())).reliability
    verdicts = long.loc[long.filter(regex="_smallest$").max(axis=1).round(5) > 0, "verdict"]
    idle, loads = (long[long["scene"] == name].set_index("quantity") for name in (CASES[0], WORKPIECE))
    limits = (f"{name} {quantity(getattr(settings, name).upper, unit_of(name))}" for name in QUANTITIES)
    return {
        "config": results.config,
        "long": long,
        "verdicts": {name: int((verdicts == name).sum()) for name in ("agree", "undecided", "differ")},
        "settings": settings,
        "limits": ", ".join(limits),
        "cap": f"{cap(settings.displacement):.10f}",
        "margin": f"{MARGIN:g}",
        "smallest": _by_quantity(long),
        "loads": loads.join(idle.add_suffix("_idle")),
        "rounded": format_reliability,
    }


def _by_quantity(rows: pd.DataFrame) -> str:
    """Return both models' smallest reliabilities, once where they round to the same, with the verdicts."""
    cells = []
    for row in rows.to_dict("records"):
        both = dict.fromkeys(format_reliability(row[f"{model}_smallest"]) for model in MODELS)
        verdict = row["verdict"] if row["verdict"] == "agree" else f"**{row['verdict']}**"
        cells.append(f"{' and '.join(both)}, {verdict}")
    return cross_table("scene", list(rows["scene"]), list(rows["quantity"]), cells)


def draw(results: Results, folder: Path) -> None:
    """Draw the central case's reliability over the crank angle; write the tables as CSV."""
    long = differences(results.long)
    write_csv({"differences": long}, folder)
    with svg.style():
        svg.write_svg(against_angle(results.long[CASES[0]], MODELS), folder / "central.svg")


CASES = ("150rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm", "crank-pin")
WORKPIECE = "workpiece"  # the first of them with a workpiece
STUDY = Study(
    "reliability",
    small=Config(("150rpm-0.2mm", WORKPIECE), 3, 100),
    full=Config((*CASES, WORKPIECE), 11, 1000),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
