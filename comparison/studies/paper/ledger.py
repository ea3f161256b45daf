"""The ledger: every printed number against both models, by what it was used for, size, sign and instant.

A number to which the geometry, the reference line or a limit of the reliability was fitted is no prediction,
however well it is met. A number that the paper prints again is one entry. Size, sign and instant are judged
apart: the largest error of a cycle has the printed size by chance more easily than all three.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from math import exp, isnan, nan
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar

from comparison.models import MODELS
from comparison.reliability.assessment import Assessment, cap, implied_limit, reliability
from comparison.reliability.errors import QUANTITIES, Peak, unit_of
from comparison.scene import load_scene
from comparison.scene.schema import Limits
from comparison.studies.paper.runs import PEAKS, REACH, Runs, measure, scene_of
from comparison.studies.shared.published import CONDITION, Published, printed_rows, published

CLOSE = 0.05
"""What the paper calls insignificant moves its peaks by 0.3 % at most (Fig. 10), what it calls larger by 33 %
at least (Fig. 9): within 5 % is the condition's own number."""
FACTOR = 2.0
"""The paper prints neither its tolerances nor the radius of the corners, which is known to a factor of four
and moves accelerations by a third; and from starts 1 um apart our own peaks differ by up to 1.7 (300 rpm)."""
CAP = cap(Limits(upper=1.0))  # reliability without any error, whatever the limit


class Use(StrEnum):
    """What a printed number can say of the models."""

    PREDICTION = "prediction"
    CALIBRATION = "calibration"
    UNINFORMATIVE = "uninformative"
    MISPRINT = "misprint"


USES = {"prediction": Use.PREDICTION, "misprint": Use.MISPRINT, "cap": Use.UNINFORMATIVE}
"""Of the table of printed numbers; all other words in it say what was fitted."""


class Size(StrEnum):
    """How far the sizes are apart, of both models and all starts the farthest."""

    CLOSE = "within 5 %"
    FACTOR = "within a factor of 2"
    FAR = "farther apart"
    NONE = "not compared"


class Outcome(StrEnum):
    """Whether a sign or an instant is the printed one."""

    AGREES = "agrees"
    DIFFERS = "differs"
    VARIES = "varies"  # between models or starts
    OPEN = "open"  # printed in more than one way
    NONE = ""  # nothing to compare


def ledger(runs: Runs) -> pd.DataFrame:
    """Return a row for each printed number, in the order of the paper.

    A figure is printed again where condition, quantity and size are the same; sign and instant may differ:
    then the paper contradicts itself. ``printed``, ``printed_at`` (s) as first printed, ``times``, ``signs``
    as printed anywhere; ``limit`` of the permitted error, of a reliability. By model: ``_at`` (s);
    ``_least`` and ``_most`` of all starts' sizes; ``_ratio``: its size over the printed one, of reliabilities
    of what is missing to the cap, nan where nothing is judged; ``_away``: its instant after the printed one,
    cycles.
    """
    limits = {quantity: one_limit(runs, quantity) for quantity in QUANTITIES}
    rows = printed_rows().assign(size=lambda rows: rows["value"].astype(float).abs())
    events = rows.groupby([*CONDITION, "quantity", "size"], sort=False)
    return pd.DataFrame([_entry(same, runs, limits) for _, same in events])


def _size(ratios: Sequence[float]) -> Size:
    """Judge ratios of sizes, ours over the printed one."""
    if all(abs(ratio - 1) <= CLOSE for ratio in ratios):
        return Size.CLOSE
    return Size.FACTOR if all(1 / FACTOR <= ratio <= FACTOR for ratio in ratios) else Size.FAR


def _outcome(ways: int, agree: Sequence[bool]) -> Outcome:
    """Judge what is printed in so many ways by whether each of our runs agrees with it."""
    if not agree:
        return Outcome.NONE
    if ways > 1:
        return Outcome.OPEN
    if len(set(agree)) > 1:
        return Outcome.VARIES
    return Outcome.AGREES if agree[0] else Outcome.DIFFERS


def _entry(printed: pd.DataFrame, runs: Runs, limits: Mapping[str, float]) -> dict[str, Any]:
    """Judge one number by the rows that print it."""
    ids = [str(name) for name in printed.index]
    prints, row, scene = [published(name) for name in ids], printed.iloc[0], scene_of(ids[0])
    first, quantity, word = prints[0], str(row["quantity"]), str(row["use"])
    use, limit = USES.get(word, Use.CALIBRATION), nan
    if quantity.startswith("min_"):
        name = quantity.split("_")[1]
        limit, lack = limits[name], CAP - first.value
        missing = {model: lacking(limit, runs.reliabilities[scene, model][name]) for model in MODELS}
        measured = {model: [Peak(CAP - each, nan)] for model, each in missing.items()}
        ratio = {model: each / lack for model, each in missing.items()}
        same = all(abs(each - lack) <= first.rounding for each in missing.values())
        size = Size.CLOSE if same else _size(list(ratio.values()))
        if name == "displacement" and limit > abs(published("S4.2-stroke").value):
            use = Use.UNINFORMATIVE
    else:
        measured = {model: measure(ids[0], runs, model) for model in MODELS}
        ratio = {model: abs(each[0].value / first.value) for model, each in measured.items()}
        size = _size([abs(p.value / first.value) for each in measured.values() for p in each])
    judged = use in (Use.PREDICTION, Use.CALIBRATION)
    peaks = [p for each in measured.values() for p in each] if judged and quantity in PEAKS else []
    times, signs = list(dict.fromkeys(p.time for p in prints)), {p.value > 0 for p in prints}
    period = load_scene(scene).period
    entry: dict[str, Any] = {
        "ids": ", ".join(ids),
        "scene": scene,
        "figure": str(row["figure"]),
        "quantity": quantity,
        "unit": first.unit,
        "printed": first.value,
        "printed_at": first.time,
        "times": [time for time in times if not isnan(time)],
        "signs": len(signs),
        "use": use,
        "fitted": "" if word in USES else word,
        "limit": limit,
        "note": "; ".join(filter(None, printed["note"])),
    }
    for model, each in measured.items():
        sizes = [abs(peak.value) for peak in each]
        entry |= {
            model: each[0].value,
            f"{model}_at": each[0].time,
            f"{model}_least": min(sizes),
            f"{model}_most": max(sizes),
            f"{model}_ratio": ratio[model] if judged else nan,
            f"{model}_away": (each[0].time - first.time) / period,
        }
    return entry | {
        "size": size if judged else Size.NONE,
        "sign": _outcome(len(signs), [p.value * first.value > 0 for p in peaks]),
        "instant": _outcome(len(times), [abs(p.time - first.time) <= REACH * period for p in peaks]),
    }


# ---- the limits that the paper must have used for its reliabilities, from our errors


def lacking(limit: float, assessed: Assessment) -> float:
    """Return what the smallest reliability would miss to the cap with another upper limit, the lower zero."""
    return CAP - float(reliability(Limits(upper=limit), assessed.mean, assessed.deviation).min())


def printed_reliabilities() -> list[tuple[str, str, Published]]:
    """Return id, quantity and number of each smallest reliability that the paper prints."""
    quantities = printed_rows()["quantity"].str.extract(r"^min_(\w+)_reliability$", expand=False).dropna()
    return [(str(identifier), name, published(str(identifier))) for identifier, name in quantities.items()]


def one_limit(runs: Runs, quantity: str) -> float:
    """Return the upper limit that meets all printed reliabilities of a quantity best, in its unit.

    Least squares of the logarithms of what is missing to the cap; a reliability printed at the cap does not
    count. The errors are those of the first model: both have the same.
    """
    known = [
        (CAP - printed.value, runs.reliabilities[scene_of(identifier), MODELS[0]][quantity])
        for identifier, name, printed in printed_reliabilities()
        if name == quantity and CAP - printed.value > printed.rounding
    ]

    def squares(log_limit: float) -> float:
        ours = [max(lacking(exp(log_limit), assessed), 1e-300) for _, assessed in known]
        return float(np.sum(np.log(np.array(ours) / [wanted for wanted, _ in known]) ** 2))

    # The sum has several minima where a limit is too narrow for any reliability; a scan finds the widest.
    scan = np.log(np.geomspace(1e-6, 1e6, 241))
    start = int(np.argmin([squares(value) for value in scan]))
    around = scan[max(start - 1, 0)], scan[min(start + 1, scan.size - 1)]
    return exp(minimize_scalar(squares, bounds=around, method="bounded").x)


def implied(runs: Runs) -> pd.DataFrame:
    """Solve every printed reliability for its upper limit (the lower one is zero), in its part of the cycle.

    Behind a model's name ``_least`` and ``_most`` within the rounding of the print; ``_worst_at`` (deg): the
    part in which the model's reliability is smallest, and ``_worst``: the limit that gives the print there.
    """
    rows = []
    for identifier, quantity, printed in printed_reliabilities():
        row: dict[str, Any] = {"id": identifier, "quantity": quantity, "unit": unit_of(quantity)}
        row |= {"printed": printed.value, "at": printed.angle}
        for model in MODELS:
            assessed = runs.reliabilities[scene_of(identifier), model][quantity]
            there, worst = int(np.argmin(np.abs(assessed.angle - printed.angle))), assessed.worst
            moments = {k: (float(assessed.mean[k]), float(assessed.deviation[k])) for k in (there, worst)}
            # A higher reliability needs a wider limit.
            for end, by in (("", 0.0), ("_least", -printed.rounding), ("_most", printed.rounding)):
                row[f"{model}{end}"] = implied_limit(printed.value + by, *moments[there])
            row[f"{model}_worst_at"] = float(assessed.angle[worst])
            row[f"{model}_worst"] = implied_limit(printed.value, *moments[worst])
        rows.append(row)
    return pd.DataFrame(rows)
