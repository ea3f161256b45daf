"""Speed against accuracy: the measured rows in tables, drawings and a few sentences."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from math import isnan
from pathlib import Path

import numpy as np

from comparison.accuracy.levels import NAMES, expected, solver_values
from comparison.engines.platform import platform_name
from comparison.execution.ledger import Row
from comparison.execution.run import Progress
from comparison.files import replacing, write_json
from comparison.formatting import MISSING, number, quantity, table
from comparison.studies.tradeoff import growth
from comparison.studies.tradeoff.figures import draw
from comparison.studies.tradeoff.front import Point, asymptotic, cost_at, observed_order
from comparison.studies.tradeoff.measure import BUSY, LONG, QUANTITIES, ROUNDS, TRUTH, confirmation, measured
from comparison.studies.tradeoff.methods import LOOSE, METHODS, PAPERS_WAY, SCENES, WORDS, Method

SMALLEST, WHOLE, TREE, LONG_STEPS, BODIES = (
    "minimal, DOP853",
    "multipliers, DOP853",
    "tree, DOPRI5",
    "tree, DOPRI5, steps up to 1 ms",
    "five bodies, generalized alpha",
)
EQUAL = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
LARGEST = {"slider_x": 2e-6, "crank_torque": 1e-2}
"""Beyond such an error (a hundredth of the clearance, of the range) nothing is asymptotic."""
COSTS = {"seconds": "processor time (s)", "evaluations": "evaluations of the equations of motion"}


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Measure, and write README.md, tradeoff.json and the drawings.

    One process whatever ``n_jobs`` says: timings of runs side by side would be those of a busy machine.
    """
    del n_jobs
    share = (lambda done: on_progress(0.9 * done)) if on_progress else None
    rows = measured(share)
    grown = growth.by_turns(), growth.by_contacts(), growth.by_channels()
    if on_progress:
        on_progress(1.0)
    pictures = []
    for scene in SCENES:
        chief = "slider_x" if scene in LOOSE else "crank_torque"
        words, unit = QUANTITIES[chief]
        for cost, label in COSTS.items():
            name = f"{scene}-{cost}.svg"
            methods = [method for method in METHODS if scene in method.scenes]
            curves = {(m.model, m.name): points(rows, m, scene, chief, cost) for m in methods}
            draw(
                folder / name,
                curves,
                {
                    (m.model, m.name): asymptotic(curves[m.model, m.name], m.order, LARGEST[chief])
                    for m in methods
                },
                error=f"{words}{f' ({unit})' if unit else ''}",
                cost=label,
                failed={(m.model, m.name): failures(rows, m, scene) for m in methods},
            )
            pictures.append(f"![{WORDS[scene]}: {label} over {words}]({name})")
    write_json({"machine": platform_name(), "rows": rows}, folder / "tradeoff.json")
    with replacing(folder / "README.md") as part:
        part.write_text(text(rows, grown, pictures), "utf-8")


Grown = tuple[
    Sequence[tuple[str, float, float, int]], Sequence[tuple[str, float, int]], Sequence[tuple[str, float]]
]


def points(
    rows: Sequence[Row], method: Method, scene: str, error: str = "slider_x", cost: str = "seconds"
) -> list[Point]:
    """Return a method's settings that gave a result, coarsest first."""
    return [
        Point(row["setting"], row["errors"][error], row[cost])
        for row in rows
        if (row["method"], row["scene"], row["status"]) == (method.name, scene, "success")
        and row[cost] is not None
    ]


def failures(rows: Sequence[Row], method: Method, scene: str) -> int:
    """Count the settings without result."""
    return sum(
        (row["method"], row["scene"]) == (method.name, scene) and row["status"] != "success" for row in rows
    )


def text(rows: Sequence[Row], grown: Grown, pictures: Sequence[str]) -> str:
    """Return the study's README."""
    template = files("comparison.studies.tradeoff").joinpath("tradeoff.md").read_text("utf-8")
    turns, contacts, channels = grown
    lost = [
        f"- {row['model']}, {row['method']}, {row['scene']}, {row['setting']:g}: {row['status']}"
        for row in rows
        if row["status"] != "success"
    ]
    return template.format(
        rounds=ROUNDS,
        busy=BUSY,
        long=LONG,
        machine=platform_name(),
        truth=TRUTH,
        confirmed=" and ".join(quantity(confirmation(name), "m", 1) for name in LOOSE),
        short=short(rows) + "\n" + long_runs(turns),
        equal="\n\n".join(f"{WORDS[scene]}:\n\n{equal_table(rows, scene)}" for scene in LOOSE),
        figures="\n\n".join(pictures),
        promises=promises(rows),
        orders=orders(rows),
        turns=table(
            ("turns", "way", "processor time (s)", "a turn (ms)", "contacts a turn"),
            [
                [f"{n:g}", way, number(s), number(1e3 * s / n), number(count / n)]
                for way, n, s, count in turns
            ],
        ),
        contacts=table(
            ("scene, ten turns, reference", "processor time (s)", "contacts", "a contact (µs)"),
            [[name, number(s), str(count), number(1e6 * s / count)] for name, s, count in contacts],
        ),
        channels=table(
            ("channels, ten turns, reference", "processor time (s)"),
            [[words, number(s)] for words, s in channels],
        ),
        failed="\n## Settings without result\n\n" + "\n".join(lost) + "\n" if lost else "",
    )


def ratio_at(rows: Sequence[Row], scene: str, method: str, *bases: str) -> dict[float, float]:
    """Return how many times the cost of the cheapest base a method's is at equal error of x."""
    by_name = {m.name: points(rows, m, scene) for m in METHODS}
    ratios = {
        error: cost_at(by_name[method], error) / np.fmin.reduce([cost_at(by_name[b], error) for b in bases])
        for error in EQUAL
    }
    return {error: float(ratio) for error, ratio in ratios.items() if not isnan(ratio)}


def short(rows: Sequence[Row]) -> str:
    """Return the figures that matter in one list."""
    said = []
    for words, method, *bases in (
        ("the paper's way, multipliers by BDF, against the planned formulation", PAPERS_WAY, SMALLEST),
        ("compiled multipliers against the planned formulation", WHOLE, SMALLEST),
        ("five bodies in Exudyn against its tree, with steps as long as suits it", BODIES, TREE, LONG_STEPS),
        ("Exudyn's tree with its usual longest step, 0.1 ms, against one of 1 ms", TREE, LONG_STEPS),
        ("Exudyn's tree against the reference", TREE, SMALLEST),
    ):
        for scene in LOOSE:
            ratios = ratio_at(rows, scene, method, *bases)
            told = ", ".join(
                f"{number(ratio, 2)} times at {quantity(e, 'm', 1)}" for e, ratio in ratios.items()
            )
            said.append(f"- {WORDS[scene]}: {words}: {told or 'at no error in common'}.")
    return "\n".join(said)


def long_runs(turns: Sequence[tuple[str, float, float, int]]) -> str:
    """Return what is left of a ratio where what a run costs but for its turns no longer counts."""
    ratio, longest = growth.ratio_in_long_runs(turns)
    if isnan(ratio):
        return "- In long runs: not measured."
    return (
        f"- {WORDS['150rpm-0.2mm']}, {longest:g} turns, a hundred samples each, the same tolerance: compiled "
        f"multipliers against the planned formulation: {number(ratio, 2)} times."
    )


def equal_table(rows: Sequence[Row], scene: str) -> str:
    """Return costs and ratios at equal error of x."""
    methods = [method for method in METHODS if scene in method.scenes]
    base = {e: cost_at(points(rows, METHODS[0], scene), e) for e in EQUAL}
    lines = []
    for method in methods:
        costs = {e: cost_at(points(rows, method, scene), e) for e in EQUAL}
        lines.append(
            [
                f"{method.model}: {method.name}",
                *(_beside(costs[e], base[e]) for e in EQUAL),
            ]
        )
    return table(("method", *(quantity(e, "m", 1) for e in EQUAL)), lines)


def _beside(cost: float, base: float) -> str:
    """Return a cost, s, and how many times the base's it is; nothing where it is not known."""
    if isnan(cost):
        return ""
    return number(cost, 2) + ("" if isnan(base) else f" ({number(cost / base, 2)})")


def promises(rows: Sequence[Row]) -> str:
    """Return what the accuracy names give, beside what they promise."""
    lines = []
    for method in (m for m in METHODS if m.name in (SMALLEST, TREE, BODIES)):
        for name in NAMES:
            for scene in LOOSE:
                coarsest = method.scene(scene, method.settings[0])
                chosen = coarsest.with_values(solver_values(method.model, name, coarsest))
                key = method.key.rpartition(".")[2]
                setting = chosen.data["solver"][method.model][key]
                row = next(
                    (
                        row
                        for row in rows
                        if (row["method"], row["scene"], row["setting"]) == (method.name, scene, setting)
                    ),
                    None,
                )
                promised = expected(chosen, method.model).error
                found = {} if row is None else row["errors"]
                lines.append(
                    [
                        name,
                        f"{method.model}, {method.name}",
                        f"{key} = {setting:g}",
                        scene,
                        quantity(promised, "m", 2),
                        *(
                            MISSING if what not in found else quantity(found[what], unit, 2)
                            for what, (_, unit) in QUANTITIES.items()
                            if what != "crank_torque"
                        ),
                        MISSING if row is None or row["seconds"] is None else number(row["seconds"], 2),
                    ]
                )
    headings = ("accuracy", "method", "setting", "scene", "promised of x")
    told = [words for key, (words, _) in QUANTITIES.items() if key != "crank_torque"]
    return table((*headings, *told, "processor time (s)"), lines)


def orders(rows: Sequence[Row]) -> str:
    """Return the observed order of each method on each scene."""
    lines = []
    for method in METHODS:
        cells = []
        for scene in SCENES:
            chief = "slider_x" if scene in LOOSE else "crank_torque"
            found = points(rows, method, scene, chief)
            firm = asymptotic(found, method.order, LARGEST[chief]) if len(found) > 1 else []
            good = [point for point, is_firm in zip(found, firm, strict=False) if is_firm]
            slope = observed_order(good)
            cells.append(MISSING if isnan(slope) else f"{slope:.2f} ({len(good)} of {len(found)})")
        lines.append([f"{method.model}: {method.name}", f"{method.order:g}", *cells])
    return table(("method", "expected", *(f"{scene} (points)" for scene in SCENES)), lines)
