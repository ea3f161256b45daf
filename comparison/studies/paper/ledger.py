"""The ledger: every printed figure against both models, by what it was used for, size, sign and instant.

A figure to which the geometry, the reference line or a limit of the reliability was fitted is no prediction,
however well it is met. A figure that the paper prints again is one entry. Size, sign and instant are judged
apart: the largest error of a cycle has the printed size by chance more easily than all three.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from comparison.models import MODELS
from comparison.reliability.assessment import cap
from comparison.reliability.errors import QUANTITIES
from comparison.scene import load_scene
from comparison.scene.schema import Limits
from comparison.studies.paper.measures import PEAKS, REACH, Measured, measure, reliabilities, scene_of
from comparison.studies.paper.runs import Runs
from comparison.studies.paper.tolerances import missing, one_limit
from comparison.studies.shared.published import Published, printed_events, printed_rows, published

CLOSE = 0.05
"""What the paper calls insignificant moves its peaks by 0.3 % at most (Fig. 10), what it calls larger by 33 %
at least (Fig. 9): within 5 % is the condition's own figure."""
FACTOR = 2.0
"""The paper prints neither its tolerances nor the radius of the corners, which is known to a factor of four
and moves accelerations by a third; and from starts 1 um apart our own peaks differ by up to 1.7 (300 rpm)."""


class Use(Enum):
    """What a printed figure can say of the models."""

    PREDICTION = "prediction"
    CALIBRATION = "calibration"
    UNINFORMATIVE = "uninformative"
    MISPRINT = "misprint"


USES = {"prediction": Use.PREDICTION, "misprint": Use.MISPRINT, "cap": Use.UNINFORMATIVE}
"""Of the table of printed figures; all others say what was fitted."""


class Size(Enum):
    """How far the sizes are apart, of both models and all starts the farthest."""

    CLOSE = "within 5 %"
    FACTOR = "within a factor of 2"
    FAR = "farther apart"
    NONE = "not compared"


class Outcome(Enum):
    """Whether a sign or an instant is the printed one."""

    AGREES = "agrees"
    DIFFERS = "differs"
    VARIES = "varies between models or starts"
    OPEN = "open: printed in more than one way"
    NONE = ""
    """Nothing to compare."""


@dataclass(frozen=True)
class Entry:
    """A printed figure with all rows that print it."""

    ids: tuple[str, ...]
    figure: str
    """Of the paper, where it is first printed; "" in the text alone."""
    scene: str
    quantity: str
    note: str
    use: Use
    fitted: str
    """What was fitted to it; "" if nothing was."""
    printed: tuple[Published, ...]
    """By each row."""
    measured: Mapping[str, Measured]
    """Model -> what stands in its place."""
    ratio: Mapping[str, float]
    """Model -> our size over the printed one, of the first start; of reliabilities what is missing to the
    cap. Empty where nothing is judged."""
    away: Mapping[str, float]
    """Model -> our instant after the printed one, cycles; nan where the figure has no instant."""
    size: Size
    sign: Outcome
    instant: Outcome
    limit: float
    """Of the permitted error, fitted to the reliabilities of one quantity; nan of other figures."""


def ledger(runs: Runs) -> list[Entry]:
    """Return an entry for each printed figure, in the order of the paper."""
    limits = {quantity: one_limit(runs, quantity) for quantity in QUANTITIES}
    return [_entry(tuple(ids), runs, limits) for ids in printed_events()]


def size_of(ratios: Sequence[float]) -> Size:
    """Judge ratios of sizes, ours over the printed one."""
    if all(abs(ratio - 1) <= CLOSE for ratio in ratios):
        return Size.CLOSE
    return Size.FACTOR if all(1 / FACTOR <= ratio <= FACTOR for ratio in ratios) else Size.FAR


def outcome(ways: int, agree: Sequence[bool]) -> Outcome:
    """Judge what is printed in so many ways by whether each of our runs agrees with it."""
    if not agree:
        return Outcome.NONE
    if ways > 1:
        return Outcome.OPEN
    if len(set(agree)) > 1:
        return Outcome.VARIES
    return Outcome.AGREES if agree[0] else Outcome.DIFFERS


def _entry(ids: tuple[str, ...], runs: Runs, limits: Mapping[str, float]) -> Entry:
    row, printed = printed_rows().loc[ids[0]], tuple(map(published, ids))
    quantity, use, scene = str(row["quantity"]), str(row["use"]), scene_of(ids[0])
    role, limit = USES.get(use, Use.CALIBRATION), float("nan")
    if quantity.startswith("min_"):
        of = quantity.split("_")[1]
        limit = limits[of]
        measured, ratio, size = _reliability(printed[0], of, scene, runs, limit)
        if of == "displacement" and limit > abs(published("S4.2-stroke").value):
            role = Use.UNINFORMATIVE
    else:
        measured = {model: measure(ids[0], quantity, runs, model) for model in MODELS}
        ratio = {model: abs(found.value / printed[0].value) for model, found in measured.items()}
        size = size_of([abs(p.value / printed[0].value) for found in measured.values() for p in found.peaks])
    judged = role in (Use.PREDICTION, Use.CALIBRATION)
    peaks = [p for found in measured.values() for p in found.peaks] if judged and quantity in PEAKS else []
    first, period = printed[0], load_scene(scene).period
    return Entry(
        ids=ids,
        figure=str(row["figure"]),
        scene=scene,
        quantity=quantity,
        note="; ".join(filter(None, printed_rows().loc[list(ids), "note"])),
        use=role,
        fitted="" if use in USES else use,
        printed=printed,
        measured=measured,
        ratio=ratio if judged else {},
        away={model: (found.time - first.time) / period for model, found in measured.items()},
        size=size if judged else Size.NONE,
        sign=outcome(len({p.value > 0 for p in printed}), [p.value * first.value > 0 for p in peaks]),
        instant=outcome(
            len({p.time for p in printed}), [abs(p.time - first.time) <= REACH * period for p in peaks]
        ),
        limit=limit,
    )


def _reliability(
    printed: Published, quantity: str, scene: str, runs: Runs, limit: float
) -> tuple[dict[str, Measured], dict[str, float], Size]:
    """Compare a smallest reliability by what is missing to the cap, with a limit of the permitted error."""
    top = cap(Limits(upper=1.0))
    lacking = {model: missing(limit, reliabilities(runs, scene, model)[quantity]) for model in MODELS}
    wanted = top - printed.value
    ratio = {model: lack / wanted for model, lack in lacking.items()}
    same = all(abs(lack - wanted) <= printed.rounding for lack in lacking.values())
    return (
        {model: Measured(top - lack) for model, lack in lacking.items()},
        ratio,
        Size.CLOSE if same else size_of(list(ratio.values())),
    )
