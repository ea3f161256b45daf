"""Every printed figure against both models, with a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any

from comparison.execution.job import MODELS
from comparison.reliability.errors import QUANTITIES
from comparison.reliability.interference import cap
from comparison.scene.criteria import Limits
from comparison.studies.paper.measures import Measured, measure, reliabilities, scene_of
from comparison.studies.paper.runs import Runs
from comparison.studies.paper.tolerances import missing, one_limit
from comparison.studies.shared.published import printed_rows, published

REPRODUCED, CLOSE = 0.05, 2.0
"""Five per cent; a factor. The paper states neither its tolerances nor the radius of the corners."""
VERDICTS = ("reproduced", "within a factor 2", "contradicted", "not comparable")
MISPRINTED = ("F7-T-d", "F14c-y")
"""Figures that cannot be what the authors computed: they say nothing of a model."""


class Reason(Enum):
    """Why a figure is not comparable, or what was assumed, as the page puts it."""

    NONE = ""
    MISPRINT = ": {note}"
    AT_CAP = ": at the cap that the method sets even without any error"
    ONE_LIMIT = ": with the one limit of {limit}, not printed, that suits all"
    ABOVE_STROKE = f"{ONE_LIMIT}: more than the stroke, so no limit of an error"


def all_rows(runs: Runs) -> list[dict[str, Any]]:
    """Return every published row, in the order of the file.

    Returns
    -------
    rows
        ``id``, ``figure``, ``quantity``, ``scene``, ``note``; ``printed``: the figure; ``measured``: model ->
        what stands in its place; ``ratio``: model -> ours over the printed one, sizes, of reliabilities of
        what is missing to the cap; ``verdict``: the worse of the two models' `VERDICTS`; its ``reason``; the
        ``limit`` assumed.
    """
    limits = {quantity: one_limit(runs, quantity) for quantity in QUANTITIES}
    rows = []
    for identifier, texts in printed_rows().iterrows():
        name, quantity = str(identifier), str(texts["quantity"])
        row = {"id": name, "scene": scene_of(name), "printed": published(name), "limit": float("nan")}
        row |= {key: str(texts[key]) for key in ("figure", "quantity", "note")}
        judged = _reliability if quantity.startswith("min_") else _figure
        rows.append(row | judged(name, quantity, runs, limits))
    return rows


def judge(ratio: float) -> str:
    """Say what a ratio of sizes, ours over the printed one, means."""
    if abs(ratio - 1) <= REPRODUCED:
        return VERDICTS[0]
    return VERDICTS[1] if 1 / CLOSE <= ratio <= CLOSE else VERDICTS[2]


def _figure(name: str, quantity: str, runs: Runs, _limits: Mapping[str, float]) -> dict[str, Any]:
    measured = {model: measure(name, quantity, runs, model) for model in MODELS}
    if name in MISPRINTED:
        return _judged(measured, {}, VERDICTS[3:], Reason.MISPRINT)
    ratio = {model: abs(found.value / published(name).value) for model, found in measured.items()}
    return _judged(measured, ratio, map(judge, ratio.values()))


def _reliability(name: str, quantity: str, runs: Runs, limits: Mapping[str, float]) -> dict[str, Any]:
    """Judge a smallest reliability by what it misses to the cap, with the limit that suits the paper best."""
    of, printed, top = quantity.split("_")[1], published(name), cap(Limits(upper=1.0))
    lacking = {model: missing(limits[of], reliabilities(runs, scene_of(name), model)[of]) for model in MODELS}
    measured = {model: Measured(top - lack) for model, lack in lacking.items()}
    wanted = top - printed.value
    if wanted <= printed.rounding:
        return _judged(measured, {}, VERDICTS[3:], Reason.AT_CAP)
    ratio = {model: lack / wanted for model, lack in lacking.items()}
    if of == "displacement" and limits[of] > abs(published("S4.2-stroke").value):
        return _judged(measured, ratio, VERDICTS[3:], Reason.ABOVE_STROKE, limits[of])
    same = {model: abs(found.value - printed.value) <= printed.rounding for model, found in measured.items()}
    verdicts = [VERDICTS[0] if same[model] else judge(ratio[model]) for model in MODELS]
    return _judged(measured, ratio, verdicts, Reason.ONE_LIMIT, limits[of])


def _judged(
    measured: Mapping[str, Measured],
    ratio: Mapping[str, float],
    verdicts: Iterable[str],
    reason: Reason = Reason.NONE,
    limit: float = float("nan"),
) -> dict[str, Any]:
    worst = max(verdicts, key=VERDICTS.index)
    return {"measured": measured, "ratio": ratio, "verdict": worst, "reason": reason, "limit": limit}
