"""The tables of the study paper."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import isinf, isnan, nan
from typing import Any

import numpy as np

from comparison.execution.job import MODELS
from comparison.formatting import number, quantity
from comparison.reliability.errors import unit_of
from comparison.studies.paper.claims import Judged
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED
from comparison.studies.paper.figures import WORDS
from comparison.studies.paper.measures import Measured, first_cycle, largest_error, near, scene_of
from comparison.studies.paper.rows import VERDICTS
from comparison.studies.paper.runs import CHANNELS, Runs
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.published import Published, published

Row = Mapping[str, Any]
PEAKS = ("F9-210", "F9-69", "F11-01", "F11-05", "F12-300")
"""Of Figs. 9, 11 and 12: how the ids of printed peaks of different conditions begin."""


def of_rows(rows: Sequence[Row]) -> dict[str, object]:
    """Return what the page says of the printed figures, by the names in its template."""
    which = {word: [row["id"] for row in rows if row["verdict"] == word] for word in VERDICTS}
    counts = {word: len(ids) for word, ids in which.items()}
    lines = [
        {
            "id": row["id"],
            "scene": f"[{row['scene']}](#runs)",
            "figure": f"[{row['quantity'].replace('_', ' ')}]({_drawing(row['figure'])})",
            "printed": _at(_value(row["printed"].value, row["printed"].unit), row["printed"].time),
            **{model: _measured(row["printed"], row["measured"][model]) for model in MODELS},
            **{f"ratio, {model}": number(row["ratio"].get(model, nan)) for model in MODELS},
            "verdict": f"**{row['verdict']}**" + _reason(row),
        }
        for row in rows
    ]
    return {
        "count": len(rows),
        "counts": rows_table(
            {"verdict": word, "printed figures": f"{counts[word]}", "which": ", ".join(which[word])}
            for word in VERDICTS
        ),
        "rows": rows_table(lines),
        "comparable": len(rows) - counts[VERDICTS[3]],
        "good": counts[VERDICTS[0]],
        "near": counts[VERDICTS[1]],
        "off": counts[VERDICTS[2]],
    }


def of_claims(claims: Sequence[Judged]) -> dict[str, str]:
    """Return what the page says of the statements."""
    counts = Counter(each.verdict for each in claims)
    lines = []
    for each in claims:
        line = {"section": each.claim["section"], "the paper says": each.claim["says"]}
        line["verdict"] = f"**{each.verdict}**"
        for model, of in each.decisions.items():
            line[model] = ("" if of.verdict == each.verdict else f"{of.verdict}: ") + of.evidence
        lines.append(line)
    verdicts = ", ".join(f"{counts[word]} {word}" for word in (SUPPORTED, CONTRADICTED, UNDECIDED))
    off = [
        f"- Sec. {each.claim['section']}: {each.claim['says']} ({each.decisions[MODELS[0]].evidence})"
        for each in claims
        if each.verdict == CONTRADICTED
    ]
    return {
        "claims": rows_table(lines),
        "claim_counts": f"{len(claims)} statements: {verdicts}",
        "contradicted": "\n".join(off) or "None.",
    }


def of_first_cycle(runs: Runs) -> dict[str, str]:
    """Return the peaks of the first cycle, the second and near the printed instants over the print's."""
    lines, ratios = [], []
    for prefix in PEAKS:
        scene = scene_of(f"{prefix}-d")
        line = {"scene": scene}
        for channel, letter in zip(CHANNELS, "dva", strict=True):
            printed = published(f"{prefix}-{letter}")
            found = {
                "first": first_cycle(runs, scene, MODELS[0], channel),
                "second": largest_error(runs, scene, MODELS[0], channel),
                "near": near(runs, scene, MODELS[0], channel, printed.time),
            }
            ratios.append([abs(peak.value / printed.value) for peak in found.values()])
            line |= {f"{WORDS[channel]}, {of}": number(r) for of, r in zip(found, ratios[-1], strict=True)}
        lines.append(line)
    logs = np.log(np.maximum(ratios, 1e-300))
    misfits = [number(float(of), 2) for of in np.exp(np.sqrt(np.mean(logs**2, axis=0)))]
    names = ("first_misfit", "second_misfit", "near_misfit")
    return {"first_cycle": rows_table(lines)} | dict(zip(names, misfits, strict=True))


def of_tolerances(found: Sequence[Row]) -> str:
    """Return the limits behind the printed reliabilities."""
    lines = []
    for row in found:
        line = {"id": row["id"], "quantity": row["quantity"]}
        line |= {"printed R": f"{row['printed'].value:g}", "at": f"{row['printed'].angle:g}°"}
        for model in MODELS:
            at, low, high = (_limit(each, row["unit"]) for each in row["limits"][model])
            line[f"limit, {model}"] = f"{at} ({low} … {high})"
        for model, (angle, limit) in row["worst"].items():
            line[f"limit at our worst part, {model}"] = f"{_limit(limit, row['unit'])} at {angle:g}°"
        lines.append(line)
    return rows_table(lines)


def _reason(row: Row) -> str:
    limit = quantity(row["limit"], unit_of(row["quantity"].split("_")[1]), 2) if row["limit"] > 0 else ""
    return str(row["reason"].value).format(note=row["note"], limit=limit)


def _drawing(figure: str) -> str:
    """Return the file of a printed figure; what the text alone prints is seen in Fig. 7."""
    return "figure-14-phase.svg" if figure.startswith("14") else f"figure-{figure or 7}.svg"


def _measured(printed: Published, found: Measured) -> str:
    cell, unit = _value(found.value, printed.unit), printed.unit
    if found.error > 5e-4 * abs(found.value):  # four digits are shown
        cell += f" ± {quantity(found.error, unit, 1)}"
    sizes = np.abs([found.value, *found.others])
    if max(sizes) > 1.01 * min(sizes):
        cell += f" (of {sizes.size} starts {_value(sizes.min(), unit)} … {_value(sizes.max(), unit)})"
    if abs(found.sampled) < 0.95 * abs(found.value):
        cell += f" (of the samples alone {_value(found.sampled, unit)})"
    return _at(cell, found.time)


def _at(cell: str, time: float) -> str:
    return cell if isnan(time) else f"{cell} at {time:.4f} s"


def _value(value: float, unit: str) -> str:
    if unit == "1":
        return f"{value:.7f}"
    return f"{value:.3f}°" if unit == "deg" else quantity(value, unit, 4)


def _limit(value: float, unit: str) -> str:
    return "∞" if isinf(value) else quantity(value, unit, 2)
