"""The tables of the study paper."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import exp, isinf, isnan, log, sqrt

from comparison.execution.run import MODELS
from comparison.formatting import MISSING, number, quantity, table
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.paper.claims import Judged
from comparison.studies.paper.decision import CONTRADICTED, SUPPORTED, UNDECIDED
from comparison.studies.paper.figures import WORDS
from comparison.studies.paper.measures import CONDITIONS, REACH, Measured, first_turn, largest_error, near
from comparison.studies.paper.rows import VERDICTS, Row
from comparison.studies.paper.runs import (
    CENTRAL,
    CHANNELS,
    CYCLES,
    FEWER,
    LONG_SAMPLES,
    MEMBERS,
    SAMPLES,
    SCENES,
    Runs,
)
from comparison.studies.paper.tolerances import Implied
from comparison.studies.shared.published import published

_FIGURES = {"14": "figure-14-phase.svg", "S": "figure-7.svg"}
"""Where the figure of a row is not called after its number."""


def of_rows(rows: Sequence[Row]) -> dict[str, str]:
    """Return what the page says of the printed figures, by the names in its template."""
    counts = Counter(row.verdict for row in rows)
    lines = [
        [
            row.identifier,
            f"[{row.scene}](#runs)",
            f"[{row.quantity.replace('_', ' ')}]({_figure(row.identifier)})",
            _printed(row),
            *(_measured(row, row.measured[model]) for model in MODELS),
            *(_ratio(row, model) for model in MODELS),
            f"**{row.verdict}**" + (f": {row.reason}" if row.reason else ""),
        ]
        for row in rows
    ]
    headings = (
        "id",
        "scene",
        "figure",
        "printed",
        *MODELS,
        *(f"ratio, {model}" for model in MODELS),
        "verdict",
    )
    return {
        "count": str(len(rows)),
        "counts": table(
            ("verdict", "printed figures", "which"),
            [
                [word, str(counts[word]), ", ".join(row.identifier for row in rows if row.verdict == word)]
                for word in VERDICTS
            ],
        ),
        "rows": table(headings, lines),
        "comparable": str(len(rows) - counts[VERDICTS[3]]),
        "good": str(counts[VERDICTS[0]]),
        "near": str(counts[VERDICTS[1]]),
        "off": str(counts[VERDICTS[2]]),
    }


def of_claims(claims: Sequence[Judged]) -> dict[str, str]:
    """Return what the page says of the statements."""
    counts = Counter(each.verdict for each in claims)
    lines = [
        [
            each.claim["section"],
            each.claim["says"],
            f"**{each.verdict}**",
            *(
                decision.evidence
                if decision.verdict == each.verdict
                else f"{decision.verdict}: {decision.evidence}"
                for decision in each.decisions.values()
            ),
        ]
        for each in claims
    ]
    told = [f"{counts[word]} {word}" for word in (SUPPORTED, CONTRADICTED, UNDECIDED)]
    return {
        "claims": table(("section", "the paper says", "verdict", *MODELS), lines),
        "claim_counts": f"{len(claims)} statements: {', '.join(told)}",
        "contradicted": "\n".join(
            f"- Sec. {each.claim['section']}: {_whole(each, claims)} ({each.decisions[MODELS[0]].evidence})"
            for each in claims
            if each.verdict == CONTRADICTED
        )
        or "None.",
    }


def of_first_turn(runs: Runs) -> dict[str, str]:
    """Return the peaks of the first turn, the second and near the printed instants over the print's."""
    lines, misfits = [], []
    for prefix in ("F9-210", "F9-69", "F11-01", "F11-05", "F12-300"):
        scene, cells = CONDITIONS[prefix], []
        for channel, letter in zip(CHANNELS, "dva", strict=True):
            printed = published(f"{prefix}-{letter}")
            found = [
                abs(peak.value / printed.value)
                for peak in (
                    first_turn(runs, scene, MODELS[0], channel),
                    largest_error(runs, scene, MODELS[0], channel, 0),
                    near(runs, scene, MODELS[0], channel, printed.time),
                )
            ]
            misfits.append([log(max(each, 1e-300)) ** 2 for each in found])
            cells += [number(each) for each in found]
        lines.append([scene, *cells])
    headings = [f"{word}, {turn}" for word in WORDS.values() for turn in ("first", "second", "near")]
    first, second, close = (exp(sqrt(sum(column) / len(misfits))) for column in zip(*misfits, strict=True))
    return {
        "first_turn": table(("scene", *headings), lines),
        "first_misfit": number(first, 2),
        "second_misfit": number(second, 2),
        "near_misfit": number(close, 2),
        "reach": f"{100 * REACH:g}",
    }


def of_tolerances(found: Sequence[Implied]) -> dict[str, str]:
    """Return what the page says of the limits behind the printed reliabilities."""
    headings = (
        "id",
        "quantity",
        "printed R",
        "at",
        *(f"limit, {model}" for model in MODELS),
        *(f"limit at our worst part, {model}" for model in MODELS),
    )
    lines = [
        [
            each.identifier,
            each.quantity,
            f"{each.printed:g}",
            f"{each.angle:g}°",
            *(_limit(each.limits[model], each.unit) for model in MODELS),
            *(f"{_bound(each.worst[m][1], each.unit)} at {each.worst[m][0]:g}°" for m in MODELS),
        ]
        for each in found
    ]
    return {"tolerances": table(headings, lines)}


def of_runs() -> dict[str, str]:
    """Return what the page says of the scenes, and how to run them."""
    lines = []
    for name in SCENES:
        fixed = f"--set drive.cycles=2 --set output.samples_per_cycle={SAMPLES} --accuracy strict"
        lines.append(
            [
                name,
                load_scene(name).title,
                *(
                    f"`sixbar run {name} --model {model} --out {model}.csv {fixed}"
                    + (" --formulation tree`" if model == "exudyn" else "`")
                    for model in MODELS
                ),
            ]
        )
    return {
        "runs": table(("scene", "", *MODELS), lines),
        "limits": _limits(),
        "members": str(MEMBERS),
        "cycles": str(CYCLES),
        "fewer": str(FEWER),
        "long_samples": f"{LONG_SAMPLES:,}",
        "samples": f"{SAMPLES:,}",
        "central": CENTRAL,
    }


def _limits() -> str:
    settings = load_scene(CENTRAL).reliability
    return ", ".join(quantity(getattr(settings, name).upper, unit_of(name)) for name in QUANTITIES)


def _whole(judged: Judged, claims: Sequence[Judged]) -> str:
    """Return a statement with the words that it continues."""
    says = str(judged.claim["says"])
    if not says.startswith("..."):
        return says
    before = [each.claim["says"] for each in claims[: claims.index(judged)]]
    first = next(text for text in reversed(before) if not text.startswith("..."))
    return f"{first.rstrip('.')} {says}"


def _figure(identifier: str) -> str:
    if identifier.startswith("S"):
        return _FIGURES["S"]
    name = identifier.partition("-")[0].removeprefix("F").rstrip("ace")
    return _FIGURES.get(name, f"figure-{name}.svg")


def _printed(row: Row) -> str:
    told = _value(row, row.printed.value)
    return told if isnan(row.printed.time) else f"{told} at {row.printed.time:.4f} s"


def _measured(row: Row, found: Measured) -> str:
    told = _value(row, found.value)
    if found.others:
        sizes = [abs(each) for each in (found.value, *found.others)]
        if max(sizes) > 1.01 * min(sizes):
            told += f" (of {len(sizes)} starts {_value(row, min(sizes))} … {_value(row, max(sizes))})"
    if abs(found.sampled) < 0.95 * abs(found.value):
        told += f" (of the samples alone {_value(row, found.sampled)})"
    return told if isnan(found.time) else f"{told} at {found.time:.4f} s"


def _value(row: Row, value: float) -> str:
    unit = row.printed.unit
    if unit == "1":
        return f"{value:.7f}"
    return f"{value:.3f}°" if unit == "deg" else quantity(value, unit, 4)


def _ratio(row: Row, model: str) -> str:
    return number(row.ratio[model]) if model in row.ratio else MISSING


def _limit(limits: tuple[float, float, float], unit: str) -> str:
    at, low, high = (_bound(each, unit) for each in limits)
    return f"{at} ({low} … {high})"


def _bound(value: float, unit: str) -> str:
    return "∞" if isinf(value) else quantity(value, unit, 2)
