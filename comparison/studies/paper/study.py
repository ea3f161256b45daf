"""The paper against both models: every printed number, every figure, every statement."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from comparison.execution.run import Progress
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.nonlinear.study import STUDY as CHAOS
from comparison.studies.paper import figures
from comparison.studies.paper.claims import CRITERIA, judge_all
from comparison.studies.paper.ledger import Outcome, Size, Use, implied, ledger
from comparison.studies.paper.runs import CENTRAL, REACH, Config, Runs, scene_of, simulate
from comparison.studies.shared.frames import markdown, rows_table, write_csv
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study

FIRST_CYCLE = ("F9-210", "F9-69", "F11-01", "F11-05", "F12-300")
"""Of Figs. 9, 11 and 12: how the ids of printed peaks of different conditions begin."""
OUTCOMES = (Outcome.AGREES, Outcome.DIFFERS, Outcome.VARIES, Outcome.OPEN)


class Results(NamedTuple):
    """What was run, and what follows from it: `ledger`, `implied`, `first_cycle`, `judge_all`."""

    runs: Runs
    entries: pd.DataFrame
    limits: pd.DataFrame
    first_cycle: pd.DataFrame
    statements: pd.DataFrame


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run everything and judge it."""
    runs = simulate(config, n_jobs, on_progress)
    return Results(runs, ledger(runs), implied(runs), first_cycle(runs), judge_all(runs))


def first_cycle(runs: Runs) -> pd.DataFrame:
    """Return sizes over the printed ones: of the first and second cycle, and near the printed instant."""
    rows = []
    for prefix in FIRST_CYCLE:
        scene = scene_of(f"{prefix}-d")
        errors = runs.two_cycles(scene, MODELS[0])
        for word, channel in QUANTITIES.items():
            printed = published(f"{prefix}-{word[0]}")
            at = printed.time / errors.period
            spans = {"first": (0, 1), "second": (1, 2), "near": (at - REACH, at + REACH)}
            row: dict[str, object] = {"scene": scene, "quantity": word}
            for name, (start, end) in spans.items():
                peak = errors.peak(channel, start * errors.period, end * errors.period)
                row[name] = abs(peak.value / printed.value)
            rows.append(row)
    return pd.DataFrame(rows)


def page(results: Results) -> Mapping[str, object]:
    """Return what the template asks."""
    entries, settings = results.entries, load_scene(CENTRAL).reliability
    near = results.first_cycle.query("scene == @CENTRAL")["near"]
    predicted = entries[entries["use"] == Use.PREDICTION]
    fitted = entries.drop_duplicates("limit").set_index("quantity")["limit"]
    shown = results.statements.query("model == @MODELS[0] and not decides")
    limits = {name: fitted[f"min_{name}_reliability"] for name in QUANTITIES}
    return {
        "entries": entries,
        "uses": {str(use): int((entries["use"] == use).sum()) for use in Use},
        "sizes": {str(size): predicted[predicted["size"] == size] for size in Size},
        "split": rows_table(_split(predicted, size) for size in Size if size is not Size.NONE),
        "table": markdown(_written(entries)),
        "statements": results.statements.drop_duplicates("id"),
        "evidence": {name: rows.to_dict("records") for name, rows in shown.groupby("id")},
        "limits": ", ".join(quantity(getattr(settings, name).upper, unit_of(name)) for name in QUANTITIES),
        "one_limit": ", ".join(quantity(limit, unit_of(name), 2) for name, limit in limits.items()),
        "near": ", ".join(map(number, near)),
        "reach": f"{100 * REACH:g}",
        "config": results.runs.config,
        "central": CENTRAL,
    }


def agree(rows: pd.DataFrame) -> pd.Series:
    """Return where sign and instant are the printed ones."""
    return (rows["sign"] == Outcome.AGREES) & (rows["instant"] == Outcome.AGREES)


def _split(predicted: pd.DataFrame, size: Size) -> dict[str, str]:
    """Return a line of the predictions of a size: how many, and what their signs and instants are."""
    rows = predicted[predicted["size"] == size]
    peaks = (rows["sign"] != Outcome.NONE).sum()
    line = {"size": f"**{size}**", "predictions": f"{len(rows)}", "peaks": f"{peaks}"}
    for what in ("sign", "instant"):
        counts = (f"{(rows[what] == each).sum()}" for each in OUTCOMES)
        line[f"{what}: {' / '.join(OUTCOMES)}"] = " / ".join(counts)
    return line | {"sign and instant agree": f"{agree(rows).sum()}"}


def _written(entries: pd.DataFrame) -> pd.DataFrame:
    """Return the ledger as the page shows it: ratios of both models once where they are the same."""
    each = [entries[f"{model}_ratio"].map(number) for model in MODELS]
    fitted = entries["fitted"].where(entries["fitted"] == "", ": " + entries["fitted"])
    return pd.DataFrame(
        {
            "printed as": entries["ids"],
            "what": entries["scene"] + ", " + entries["quantity"].str.replace("_", " "),
            "printed": [
                f"{value:.7f}" if unit == "1" else quantity(value, unit, 4)
                for value, unit in zip(entries["printed"], entries["unit"], strict=True)
            ],
            "use": entries["use"] + fitted,
            "ours / printed": [" and ".join(dict.fromkeys(both)) for both in zip(*each, strict=True)],
            "size": entries["size"],
            "sign": entries["sign"],
            "instant": entries["instant"],
        }
    )


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and the long tables as CSV."""
    figures.draw(results.runs, results.entries, folder)
    times = results.entries["times"].map(lambda t: " ".join(map(str, t)))
    frames = {
        "printed": results.entries.assign(times=times),
        "statements": results.statements,
        "criteria": pd.DataFrame([{"criterion": name} | each for name, each in CRITERIA.items()]),
        "limits": results.limits,
        "first-cycle": results.first_cycle,
    }
    write_csv(frames, folder)


STUDY = Study(
    "paper",
    small=Config(
        samples=100, long_samples=50, cycles=4, fewer=3, members=2,
        chaos=CHAOS.small._replace(scenes=(CENTRAL,), swept={}),
    ),
    full=Config(
        samples=10_000, long_samples=1000, cycles=100, fewer=30, members=4,
        chaos=CHAOS.full._replace(scenes=(CENTRAL,), swept={}),
    ),
    measure=measure,
    page=page,
    draw=draw,
    one_file=True,
)  # fmt: skip
