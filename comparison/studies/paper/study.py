"""The paper against both models: every printed number, every figure, every statement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.formatting import MISSING, NO_BREAK, number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.nonlinear.study import STUDY as CHAOS
from comparison.studies.paper import figures
from comparison.studies.paper.claims import Judged, Verdict, criteria, judge_all
from comparison.studies.paper.ledger import Outcome, Size, Use, implied, ledger
from comparison.studies.paper.runs import CENTRAL, REACH, Config, Runs, scene_of, simulate
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array

FIRST_CYCLE = ("F9-210", "F9-69", "F11-01", "F11-05", "F12-300")
"""Of Figs. 9, 11 and 12: how the ids of printed peaks of different conditions begin."""
SHORT = {Size.CLOSE: "5 %", Size.FACTOR: "factor 2", Size.FAR: "farther"}
OUTCOMES = (Outcome.AGREES, Outcome.DIFFERS, Outcome.VARIES, Outcome.OPEN)


@dataclass(frozen=True)
class Results:
    """What was run, and what follows from it."""

    runs: Runs
    entries: pd.DataFrame
    limits: pd.DataFrame
    """Of `ledger` and `implied`."""
    first_cycle: pd.DataFrame
    """Scene, quantity, and sizes of peaks over the printed ones: ``first`` cycle, ``second``, and ``near``
    the printed instant; of the first model."""
    judged: list[Judged]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run everything and judge it."""
    return evaluate(simulate(config, n_jobs, on_progress))


def evaluate(runs: Runs) -> Results:
    """Judge the printed numbers and statements by runs."""
    rows = []
    for prefix, (word, channel) in product(FIRST_CYCLE, QUANTITIES.items()):
        scene, printed = scene_of(f"{prefix}-d"), published(f"{prefix}-{word[0]}")
        peaks = {
            "first": runs.peak(scene, MODELS[0], channel, (0, 1)),
            "second": runs.peak(scene, MODELS[0], channel, (1, 2)),
            "near": runs.near(scene, MODELS[0], channel, printed.time),
        }
        ratios = {name: abs(peak.value / printed.value) for name, peak in peaks.items()}
        rows.append({"scene": scene, "quantity": word} | ratios)
    return Results(runs, ledger(runs), implied(runs), pd.DataFrame(rows), judge_all(runs))


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, limits = results.runs.config, load_scene(CENTRAL).reliability
    return {
        **of_ledger(results.entries),
        **of_claims(results.judged),
        **of_limits(results.limits, results.entries),
        **of_first_cycle(results.first_cycle),
        "limits": ", ".join(quantity(getattr(limits, name).upper, unit_of(name)) for name in QUANTITIES),
        "reach": f"{100 * REACH:g}",
        "members": config.members,
        "cycles": config.cycles,
        "fewer": config.fewer,
        "long_samples": f"{config.long_samples:,}",
        "samples": f"{config.samples:,}",
        "samples_value": config.samples,
        "central": CENTRAL,
    }


def of_ledger(entries: pd.DataFrame) -> dict[str, object]:
    """Return what the page says of the printed numbers."""
    sections = {use: entries[entries["use"] == use] for use in Use}
    predicted, calibrated = sections[Use.PREDICTION], sections[Use.CALIBRATION]
    close = predicted[predicted["size"] == Size.CLOSE]
    peaks = predicted[predicted["sign"] != Outcome.NONE]
    silent = pd.concat([sections[Use.UNINFORMATIVE], sections[Use.MISPRINT]])
    return {
        "rows": int(entries["ids"].str.count(",").sum()) + len(entries),
        "entries": len(entries),
        **{use.value: len(section) for use, section in sections.items()},
        **{size.name.lower(): int((predicted["size"] == size).sum()) for size in Size},
        "close_signs": int((close["sign"] == Outcome.AGREES).sum()),
        "close_instants": int((close["instant"] == Outcome.AGREES).sum()),
        "close_both": len(close[_agree(close)]),
        "peaks": len(peaks),
        "peak_signs": _of_judged(peaks["sign"]),
        "peak_instants": _of_judged(peaks["instant"]),
        "close_ids": ", ".join(close["ids"].map(_first)) or "none",
        "all_ids": ", ".join(close["ids"][_agree(close)].map(_first)) or "none",
        "calibration_close": int((calibrated["size"] == Size.CLOSE).sum()),
        "split": rows_table(_split(predicted, size) for size in Size if size is not Size.NONE),
        "predictions": rows_table(
            _cells(row) | {"size, sign, instant": f"{SHORT[row['size']]}{_sign_and_instant(row)}"}
            for row in _rows(predicted)
        ),
        "calibrations": rows_table(
            _cells(row) | {"size; fitted": f"{SHORT[row['size']]}; {row['fitted']}"}
            for row in _rows(calibrated)
        ),
        "silent": rows_table(_cells(row, MODELS[0]) | {"why not": _why_not(row)} for row in _rows(silent)),
    }


def of_claims(judged: Sequence[Judged]) -> dict[str, object]:
    """Return what the page says of the statements."""
    verdicts = [each.verdict for each in judged]
    off = [
        f"- Sec. {each.claim['section']}: {each.claim['says']} ({_evidence(each)})"
        for each in judged
        if each.verdict is Verdict.CONTRADICTED
    ]
    return {
        "statements": len(judged),
        **{verdict.value: verdicts.count(verdict) for verdict in Verdict},
        "off": "\n".join(off) or "None.",
        "claims": rows_table(
            {
                "the paper says": f"{each.claim['says']} ({each.claim['section']})",
                "verdict, by": f"**{each.verdict}**, "
                + "; ".join(
                    f"{name} "
                    + _different(_shown(model.deciding[name], "") for model in each.evidence.values())
                    for name in each.evidence[MODELS[0]].deciding
                ),
            }
            for each in judged
        ),
    }


def of_limits(limits: pd.DataFrame, entries: pd.DataFrame) -> dict[str, object]:
    """Return what the page says of the limits behind the printed reliabilities, by the first model."""
    lines, one = [], entries.drop_duplicates("limit").set_index("quantity")["limit"]
    for name, rows in limits.groupby("quantity", sort=False):
        unit = unit_of(str(name))
        bounds = [quantity(value, unit, 2) for value in (rows[MODELS[0]].min(), rows[MODELS[0]].max())]
        fitted = quantity(one[f"min_{name}_reliability"], unit, 2)
        lines.append(
            {"quantity": str(name), "limits that suit one": " … ".join(bounds), "that suits all": fitted}
        )
    return {"implied": rows_table(lines), "one_limit": ", ".join(line["that suits all"] for line in lines)}


def of_first_cycle(ratios: pd.DataFrame) -> dict[str, str]:
    """Return the typical factors by which peaks are missed, and what is near the central case's."""
    logs = np.log(np.maximum(ratios[["first", "second", "near"]], 1e-300))
    misfits = np.exp(np.sqrt((logs**2).mean()))
    central = ratios[ratios["scene"] == CENTRAL]["near"]
    return {f"{name}_misfit": number(float(value), 2) for name, value in misfits.items()} | {
        "near_central": ", ".join(map(number, central))
    }


def _rows(frame: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(key): value for key, value in row.items()} for row in frame.to_dict("records")]


def _first(ids: str) -> str:
    return ids.partition(",")[0]


def _agree(rows: pd.DataFrame) -> pd.Series[bool]:
    return (rows["sign"] == Outcome.AGREES) & (rows["instant"] == Outcome.AGREES)


def _of_judged(outcomes: pd.Series[Any]) -> str:
    """Return how many agree, of those that the paper does not leave open."""
    return f"{(outcomes == Outcome.AGREES).sum()} of {(outcomes != Outcome.OPEN).sum()}"


def _split(predicted: pd.DataFrame, size: Size) -> dict[str, str]:
    """Return a line of the predictions of a size: how many, and what their signs and instants are."""
    rows = predicted[predicted["size"] == size]
    line = {
        "size": f"**{size}**",
        "predictions": f"{len(rows)}",
        "peaks": f"{(rows['sign'] != Outcome.NONE).sum()}",
    }
    for what in ("sign", "instant"):
        counts = (f"{(rows[what] == each).sum()}" for each in OUTCOMES)
        line[f"{what}: {' / '.join(OUTCOMES)}"] = " / ".join(counts)
    return line | {"sign and instant agree": f"{_agree(rows).sum()}"}


def _cells(row: Mapping[str, Any], model: str = "") -> dict[str, str]:
    """Return the columns of every table of printed numbers: ours as ratio, or a model's own."""
    sign = "±" if row["signs"] > 1 else ""
    printed = sign + _value(abs(row["printed"]) if sign else row["printed"], row["unit"])
    times = ", ".join(f"{time:.4f}" for time in row["times"])
    again = row["ids"].count(",")
    return {
        "printed as": _first(row["ids"]) + (f" and {again} more" if again else ""),
        "what": f"{row['scene']}, {row['quantity'].replace('_', ' ')}",
        "printed": printed + (f" at {times} s" if times else ""),
    } | (
        {"ours": _value(row[model], row["unit"])}
        if model
        else {"ours / printed": _different(number(row[f"{name}_ratio"]) for name in MODELS)}
    )


def _sign_and_instant(row: Mapping[str, Any]) -> str:
    if row["sign"] == Outcome.NONE:
        return ""
    away = _different(f"{row[f'{name}_away']:+.3f}".replace("-", "−") for name in MODELS)
    return f"; {row['sign']}; {row['instant']}, {away}"


def _why_not(row: Mapping[str, Any]) -> str:
    if row["use"] == Use.MISPRINT:
        return str(row["note"])
    if not row["fitted"]:
        return "the cap, which the method gives even without any error"
    limit = quantity(row["limit"], unit_of(row["quantity"].split("_")[1]), 2)
    return f"the one limit that suits all is {limit}, more than the stroke"


def _different(texts: Iterable[str]) -> str:
    """Return what both models give, once where it is the same."""
    return " and ".join(dict.fromkeys(texts))


def _evidence(judged: Judged) -> str:
    """Return the numbers that the first model's runs show of a statement."""
    return "; ".join(
        f"{label} " + " … ".join(dict.fromkeys(_shown(float(end), unit) for end in _range(values)))
        for label, (values, unit) in judged.evidence[MODELS[0]].numbers.items()
    )


def _range(values: Sequence[float] | Array) -> tuple[float, float]:
    """Return the least and the largest; nan without any, as of exponents where none could be measured."""
    return (min(values), max(values)) if len(values) else (nan, nan)


def _shown(value: float, unit: str) -> str:
    if isnan(value):
        return MISSING
    if unit == "%":
        return f"{number(100 * value, 2)}{NO_BREAK}%"
    if unit == "" and value.is_integer():
        return f"{value:.0f}".replace("-", "−")
    return f"{value:.7f}" if unit == "1" else quantity(value, unit)


def _value(value: float, unit: str) -> str:
    if unit == "1":
        return f"{value:.7f}"
    return f"{value:.3f}°" if unit == "deg" else quantity(value, unit, 4)


# ---- figures and tables beside the page


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and the long tables as CSV."""
    figures.draw(results.runs, results.entries, folder)
    frames = {
        "printed": results.entries.assign(
            times=results.entries["times"].map(lambda t: " ".join(map(str, t)))
        ),
        "statements": statements(results.judged),
        "criteria": pd.DataFrame([{"criterion": name} | asdict(each) for name, each in criteria().items()]),
        "limits": results.limits,
        "first-cycle": results.first_cycle,
    }
    for name, frame in frames.items():
        with replacing(folder / f"{name}.csv") as part:
            frame.to_csv(part, index=False)


def statements(judged: Sequence[Judged]) -> pd.DataFrame:
    """Return a row for each value of a criterion and each number that it follows from, by model."""
    rows = []
    for each, model in product(judged, MODELS):
        evidence = each.evidence[model]
        known = {key: each.claim[key] for key in ("id", "section", "says")} | {"verdict": each.verdict}
        known |= {"model": model, "verdict_of_model": evidence.verdict}
        deciding = {name: ([value], "") for name, value in evidence.deciding.items()}
        for name, (values, unit) in {**deciding, **evidence.numbers}.items():
            ends = {"least": min(values, default=np.nan), "most": max(values, default=np.nan)}
            about = {"what": name, "unit": unit.replace("%", "1"), "decides": name in deciding}
            rows.append(known | about | ends)
    return pd.DataFrame(rows)


STUDY = Study(
    "paper",
    small=Config(
        samples=100,
        long_samples=50,
        cycles=4,
        fewer=3,
        members=2,
        chaos=replace(CHAOS.small, scenes=(CENTRAL,), swept={}),
    ),
    full=Config(
        samples=10_000,
        long_samples=1000,
        cycles=100,
        fewer=30,
        members=4,
        chaos=replace(CHAOS.full, scenes=(CENTRAL,), swept={}),
    ),
    measure=measure,
    page=page,
    draw=draw,
    one_file=True,
)
