"""Every printed figure against both models, with a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from comparison.execution.run import MODELS
from comparison.formatting import quantity as quantity_words
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.reliability.interference import cap
from comparison.scene.criteria import Limits
from comparison.studies.paper.measures import Measured, measure, reliabilities, scene_of
from comparison.studies.paper.runs import Runs
from comparison.studies.paper.tolerances import missing, one_limit
from comparison.studies.shared.published import Published, printed_rows, published

REPRODUCED, CLOSE = 0.05, 2.0
"""Five per cent; a factor. The paper states neither its tolerances nor the radius of the corners."""
VERDICTS = ("reproduced", "within a factor 2", "contradicted", "not comparable")


@dataclass(frozen=True)
class Row:
    """One printed figure.

    Attributes
    ----------
    identifier, quantity, scene
        Of the row.
    printed
        The figure.
    note
        What is odd about it.
    measured
        Model -> what stands in its place; empty where nothing can.
    ratio
        Model -> ours over the printed one, sizes; of reliabilities what is missing to the cap.
    verdict
        One of `VERDICTS`: the worse of the two models'.
    reason
        Why it is not comparable, or what was assumed.
    """

    identifier: str
    quantity: str
    scene: str
    printed: Published
    note: str
    measured: Mapping[str, Measured]
    ratio: Mapping[str, float]
    verdict: str
    reason: str = ""


def all_rows(runs: Runs) -> list[Row]:
    """Return every published row, in the order of the file."""
    limits = {quantity: one_limit(runs, quantity) for quantity in QUANTITIES}
    return [
        _row(str(identifier), str(texts["quantity"]), str(texts["note"]), runs, limits)
        for identifier, texts in printed_rows().iterrows()
    ]


def judge(ratio: float) -> str:
    """Say what a ratio of sizes, ours over the printed one, means."""
    if abs(ratio - 1) <= REPRODUCED:
        return VERDICTS[0]
    return VERDICTS[1] if 1 / CLOSE <= ratio <= CLOSE else VERDICTS[2]


def _row(identifier: str, quantity: str, note: str, runs: Runs, limits: Mapping[str, float]) -> Row:
    printed = published(identifier)
    if quantity.startswith("min_"):
        return _reliability(identifier, quantity, note, runs, limits)
    measured = {model: measure(identifier, quantity, runs, model) for model in MODELS}
    parts = identifier, quantity, scene_of(identifier), printed, note, measured
    # A figure that cannot be what the authors computed says nothing of a model.
    if note.startswith(("misprint", "impossible")):
        return Row(*parts, ratio={}, verdict=VERDICTS[3], reason=note)
    ratio = {model: abs(found.value / printed.value) for model, found in measured.items()}
    return Row(*parts, ratio, _worse(judge(each) for each in ratio.values()))


def _reliability(identifier: str, quantity: str, note: str, runs: Runs, limits: Mapping[str, float]) -> Row:
    """Judge a smallest reliability by what it misses to the cap, with the limit that suits the paper best."""
    name, scene, printed = quantity.split("_")[1], scene_of(identifier), published(identifier)
    top, limit = cap(Limits(upper=1.0)), limits[name]
    lacking = {model: missing(limit, reliabilities(runs, scene, model)[name]) for model in MODELS}
    measured = {model: Measured(top - lack) for model, lack in lacking.items()}
    parts = identifier, quantity, scene, printed, note, measured
    wanted = top - printed.value
    if wanted <= printed.rounding:
        return Row(*parts, {}, VERDICTS[3], "at the cap that the method sets even without any error")
    told = f"with the one limit of {quantity_words(limit, unit_of(name), 2)}, not printed, that suits all"
    ratio = {model: lack / wanted for model, lack in lacking.items()}
    stroke = abs(published("S4.2-stroke").value)
    if name == "displacement" and limit > stroke:
        return Row(*parts, ratio, VERDICTS[3], f"{told}: more than the stroke, so no limit of an error")
    verdicts = [
        VERDICTS[0] if abs(measured[model].value - printed.value) <= printed.rounding else judge(ratio[model])
        for model in MODELS
    ]
    return Row(*parts, ratio, _worse(verdicts), told)


def _worse(verdicts: Iterable[str]) -> str:
    return max(verdicts, key=VERDICTS.index)
