"""The tables and words of the study paper."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import isinf, isnan, nan
from typing import Any

import numpy as np

from comparison.formatting import MISSING, NO_BREAK, number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import unit_of
from comparison.studies.paper.claims import Criterion, Evidence, Judged, Verdict
from comparison.studies.paper.figures import WORDS
from comparison.studies.paper.ledger import Entry, Outcome, Size, Use
from comparison.studies.paper.measures import Measured, first_cycle, largest_error, near, scene_of
from comparison.studies.paper.runs import CHANNELS, Runs
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array

Row = Mapping[str, Any]
PEAKS = ("F9-210", "F9-69", "F11-01", "F11-05", "F12-300")
"""Of Figs. 9, 11 and 12: how the ids of printed peaks of different conditions begin."""
SPLIT = {
    Outcome.AGREES: "agrees",
    Outcome.DIFFERS: "differs",
    Outcome.VARIES: "varies",
    Outcome.OPEN: "open",
}
"""Columns of the table of sizes, for sign and instant each."""


def of_ledger(entries: Sequence[Entry]) -> dict[str, object]:
    """Return what the page says of the printed figures, by the names in its template."""
    of = {use: [entry for entry in entries if entry.use is use] for use in Use}
    predicted, calibrated = of[Use.PREDICTION], of[Use.CALIBRATION]
    close = [entry for entry in predicted if entry.size is Size.CLOSE]
    peaks = [entry for entry in predicted if entry.sign is not Outcome.NONE]
    return {
        "rows": sum(len(entry.ids) for entry in entries),
        "entries": len(entries),
        **{use.value: len(found) for use, found in of.items()},
        **{size.name.lower(): sum(e.size is size for e in predicted) for size in Size},
        "close_signs": sum(entry.sign is Outcome.AGREES for entry in close),
        "close_instants": sum(entry.instant is Outcome.AGREES for entry in close),
        "close_both": sum(map(_agrees, close)),
        "peaks": len(peaks),
        "peak_signs": _of_judged([entry.sign for entry in peaks]),
        "peak_instants": _of_judged([entry.instant for entry in peaks]),
        "close_ids": ", ".join(entry.ids[0] for entry in close) or "none",
        "all_ids": ", ".join(entry.ids[0] for entry in close if _agrees(entry)) or "none",
        "calibration_close": sum(entry.size is Size.CLOSE for entry in calibrated),
        "split": rows_table(_split(predicted, size) for size in Size if size is not Size.NONE),
        "predictions": rows_table(map(_prediction, predicted)),
        "calibrations": rows_table(
            {"fitted": entry.fitted} | _cells(entry) | {"size": entry.size.value} for entry in calibrated
        ),
        "silent": rows_table(
            _cells(entry) | {"why not": _why_not(entry)} for entry in of[Use.UNINFORMATIVE] + of[Use.MISPRINT]
        ),
    }


def of_claims(claims: Sequence[Judged], criteria: Mapping[str, Criterion]) -> dict[str, object]:
    """Return what the page says of the statements."""
    counts = Counter(each.verdict for each in claims)
    lines = []
    for each in claims:
        line = {"section": each.claim["section"], "the paper says": each.claim["says"]}
        line["verdict"] = f"**{each.verdict.value}**"
        for model, of in each.evidence.items():
            line[model] = ("" if of.verdict is each.verdict else f"{of.verdict.value}: ") + _evidence(of)
        lines.append(line)
    off = [
        f"- Sec. {each.claim['section']}: {each.claim['says']} ({_evidence(each.evidence[MODELS[0]])})"
        for each in claims
        if each.verdict is Verdict.CONTRADICTED
    ]
    return {
        "claims": rows_table(lines),
        "statements": len(claims),
        **{verdict.value: counts[verdict] for verdict in Verdict},
        "off": "\n".join(off) or "None.",
        "criteria": rows_table(
            {
                "criterion": name,
                "measured": of.measured,
                "supports from": f"{of.supported:g}".replace("-", "−"),
                "contradicts from": f"{of.contradicted:g}".replace("-", "−"),
                "why": of.reason,
            }
            for name, of in criteria.items()
        ),
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


def _agrees(entry: Entry) -> bool:
    return entry.sign is entry.instant is Outcome.AGREES


def _of_judged(outcomes: Sequence[Outcome]) -> str:
    """Return how many agree, of those that the paper does not leave open."""
    judged = [each for each in outcomes if each is not Outcome.OPEN]
    return f"{judged.count(Outcome.AGREES)} of {len(judged)}"


def _split(predicted: Sequence[Entry], size: Size) -> dict[str, str]:
    """Return a line of the predictions of a size: how many, and what their signs and instants are."""
    of = [entry for entry in predicted if entry.size is size]
    peaks = sum(entry.sign is not Outcome.NONE for entry in of)
    line = {"size": size.value, "predictions": f"{len(of)}", "of these peaks": f"{peaks}"}
    for what in ("sign", "instant"):
        counts = Counter(getattr(entry, what) for entry in of)
        line |= {f"{what} {word}": f"{counts[each]}" for each, word in SPLIT.items()}
    return line | {"sign and instant agree": f"{sum(map(_agrees, of))}"}


def _prediction(entry: Entry) -> dict[str, str]:
    cycles = [entry.away[model] for model in MODELS]
    away = "" if isnan(cycles[0]) else ", " + " and ".join(dict.fromkeys(f"{c:+.3f}" for c in cycles))
    return _cells(entry) | {
        "size": f"**{entry.size.value}**",
        "sign": entry.sign.value or MISSING,
        "instant, cycles after the printed one": (entry.instant.value or MISSING) + away.replace("-", "−"),
    }


def _cells(entry: Entry) -> dict[str, str]:
    """Return the columns of every table of printed figures."""
    first = entry.printed[0]
    signs = {printed.value > 0 for printed in entry.printed}
    value = ("±" if len(signs) > 1 else "") + _value(
        abs(first.value) if len(signs) > 1 else first.value, first.unit
    )
    times = [f"{time:.4f}" for time in dict.fromkeys(p.time for p in entry.printed) if not isnan(time)]
    ratios = [number(entry.ratio.get(model, nan)) for model in MODELS]
    return {
        "printed as": ", ".join(entry.ids),
        "scene": f"[{entry.scene}](#runs)",
        "figure": f"[{entry.quantity.replace('_', ' ')}]({_drawing(entry.figure)})",
        "printed": value + (f" at {', '.join(times)} s" if times else ""),
        **{model: _measured(entry.measured[model], first.unit) for model in MODELS},
        "ratio": " and ".join(dict.fromkeys(ratios)),
    }


def _why_not(entry: Entry) -> str:
    if entry.use is Use.MISPRINT:
        return entry.note
    if not entry.fitted:
        return "the cap, which the method gives even without any error"
    limit = quantity(entry.limit, unit_of(entry.quantity.split("_")[1]), 2)
    return f"the one limit that suits all is {limit}, more than the stroke: no limit of an error"


def _drawing(figure: str) -> str:
    """Return the file of a printed figure; what the text alone prints is seen in Fig. 7."""
    return "figure-14-phase.svg" if figure.startswith("14") else f"figure-{figure or 7}.svg"


def _measured(found: Measured, unit: str) -> str:
    cell = _value(found.value, unit)
    if found.error > 5e-4 * abs(found.value):  # four digits are shown
        cell += f" ± {quantity(found.error, unit, 1)}"
    sizes = np.abs([peak.value for peak in found.peaks])
    if max(sizes) > 1.01 * min(sizes):
        cell += f" (of {sizes.size} starts {_value(sizes.min(), unit)} … {_value(sizes.max(), unit)})"
    if abs(found.sampled) < 0.95 * abs(found.value):
        cell += f" (of the samples alone {_value(found.sampled, unit)})"
    return cell if isnan(found.time) else f"{cell} at {found.time:.4f} s"


def _evidence(of: Evidence) -> str:
    numbers = [f"{label} {_range(values, unit)}" for label, (values, unit) in of.numbers.items()]
    return "; ".join([*numbers, *(f"*{name}* {_shown(value, '')}" for name, value in of.values.items())])


def _range(values: Array | Sequence[float], unit: str) -> str:
    if len(values) == 0:
        return MISSING
    ends = dict.fromkeys(_shown(float(end), unit) for end in (np.min(values), np.max(values)))
    return " … ".join(ends)


def _shown(value: float, unit: str) -> str:
    if unit == "%":
        return f"{number(100 * value, 2)}{NO_BREAK}%"
    if unit == "" and value.is_integer():
        return f"{value:.0f}".replace("-", "−")
    return f"{value:.7f}" if unit == "1" else quantity(value, unit)


def _value(value: float, unit: str) -> str:
    if unit == "1":
        return f"{value:.7f}"
    return f"{value:.3f}°" if unit == "deg" else quantity(value, unit, 4)


def _limit(value: float, unit: str) -> str:
    return "∞" if isinf(value) else quantity(value, unit, 2)
