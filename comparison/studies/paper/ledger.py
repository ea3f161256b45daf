"""The ledger: every printed number against both models, by what it was used for, size, sign and instant.

A number to which the geometry, the reference line or a limit of the reliability was fitted is no prediction,
however well it is met. A number that the paper prints again is one entry. Sizes are judged after ASME V&V 20:
the difference of simulation and print against the uncertainties of numerics, inputs and print, but around the
median of the draws, on each side separately. Size, sign and instant are judged separately: the largest error
of a cycle has the printed size by chance more easily than all three.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from math import exp, hypot, isnan, nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize_scalar

from comparison.execution.run import Progress
from comparison.models import MODELS
from comparison.reliability.assessment import implied_limit
from comparison.reliability.errors import unit_of
from comparison.scene import load_scene
from comparison.studies.paper.runs import (
    CAP,
    CENTRAL,
    DATA,
    GROUPS,
    IDEAL,
    MISSED,
    PEAKS,
    REACH,
    VARIANTS,
    Config,
    Draw,
    Ensemble,
    Runs,
    lacking,
    measure,
    numbers,
    run_draws,
    scene_of,
)
from comparison.studies.shared.published import Published, printed_rows, published
from comparison.studies.shared.study import part
from comparison.tables.channels import Array

Entry = Mapping[Any, Any]  # a row of the ledger

LEVEL: float = DATA["level"]
WIDE: float = DATA["wide"]


class Use(StrEnum):
    """What a printed number can say of the models."""

    PREDICTION = "prediction"
    CALIBRATION = "calibration"
    UNINFORMATIVE = "uninformative"
    MISPRINT = "misprint"


USES = {"prediction": Use.PREDICTION, "misprint": Use.MISPRINT, "cap": Use.UNINFORMATIVE}
"""Of the table of printed numbers; all other words in it say what was fitted."""


class Size(StrEnum):
    """Whether the printed size lies in the interval of ours."""

    REPRODUCED = "reproduced"
    WIDE = "not excluded"  # in an interval so wide that it says little
    OUTSIDE = "not reproduced"
    NONE = "not compared"


class Outcome(StrEnum):
    """Whether a sign or an instant is the printed one, in all but a few draws."""

    AGREES = "agrees"
    DIFFERS = "differs"
    VARIES = "varies"  # from draw to draw
    OPEN = "open"  # printed in more than one way
    NONE = ""  # nothing to compare


class Interval(NamedTuple):
    """The interval of a size."""

    low: float
    high: float
    u_input: float  # half of the interval of the draws alone

    def size(self, printed: float) -> Size:
        """Judge a printed size."""
        if not self.low <= printed <= self.high:
            return Size.OUTSIDE
        return Size.REPRODUCED if self.low > 0 and self.high <= WIDE * self.low else Size.WIDE


def interval(sizes: Array, u_num: float, u_print: float) -> Interval:
    """Return the interval of sizes drawn, with the half-widths of numerics and print added in squares.

    To each side of the median: what the inputs leave open is not symmetric. Of n draws Weibull's rule leaves
    the share of further ones between two quantiles what it is to be; the linear one 0.91 for 0.95 of 50.
    """
    if not sizes.size:
        return Interval(nan, nan, nan)
    shares = [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2]
    low, middle, high = np.quantile(sizes, shares, method="weibull").tolist()
    rest = hypot(u_num, u_print)
    return Interval(middle - hypot(middle - low, rest), middle + hypot(high - middle, rest), (high - low) / 2)


def outcome(ways: int, share: float) -> Outcome:
    """Judge what is printed in so many ways by the share of the draws that agree with it."""
    if isnan(share):
        return Outcome.NONE
    if ways > 1:
        return Outcome.OPEN
    if share >= LEVEL:
        return Outcome.AGREES
    return Outcome.DIFFERS if share <= 1 - LEVEL else Outcome.VARIES


def size_of(quantity: str, value: Any) -> Any:
    """Return the size of values of a quantity: of a reliability what is missing to the cap."""
    return CAP - value if quantity.startswith("min_") else abs(value)


def ledger(runs: Runs, drawn: Mapping[str, pd.DataFrame], limits: Mapping[str, float]) -> pd.DataFrame:
    """Return a row for each printed number, in the order of the paper.

    ``drawn``: by the first id of each number, what `Ensemble` has of it.

    ``printed``, ``printed_at`` (s) as first printed, ``times``, ``signs`` as printed anywhere; ``limit`` of
    the permitted error, of a reliability. By model: its value, ``_at`` (s), and ``_ratio``: its size over the
    printed one (`size_of`). ``printed_size``, ``u_num``, ``u_print``, ``u_input``, ``low`` and ``high``,
    95 %, are of that size. ``sign_share``, ``instant_share``, ``both_share``: of the draws.
    """
    rows = numbers().to_dict("index")
    return pd.DataFrame([_entry(row, runs, drawn[str(name)], limits) for name, row in rows.items()])


def _entry(row: Entry, runs: Runs, drawn: pd.DataFrame, limits: Mapping[str, float]) -> dict[str, Any]:
    """Judge one of the `numbers`."""
    ids, scene, quantity, word = row["ids"].split(", "), row["scene"], row["quantity"], row["use"]
    prints = [published(name) for name in ids]
    first = prints[0]
    use, limit = USES.get(word, Use.CALIBRATION), nan
    if quantity.startswith("min_"):
        limit = limits[quantity.split("_")[1]]
        if "displacement" in quantity and limit > abs(published("S4.2-stroke").value):
            use = Use.UNINFORMATIVE
    judged = use in (Use.PREDICTION, Use.CALIBRATION)
    shown = {model: measure(ids[0], runs, model, limits) for model in MODELS}
    sizes = {model: float(size_of(quantity, each.value)) for model, each in shown.items()}
    size = float(size_of(quantity, first.value))
    others = [sizes[model] for model in MODELS[1:]]
    if quantity in PEAKS:
        usual = {(scene, MODELS[0]): [runs.standard[scene, MODELS[0]]]}
        others.append(abs(measure(ids[0], replace(runs, short=usual), MODELS[0], limits).value))
    missed = MISSED * sizes[MODELS[0]] if quantity in PEAKS else 0.0
    u_num = max(abs(other - sizes[MODELS[0]]) for other in others) + missed
    times, signs = list(dict.fromkeys(p.time for p in prints)), {p.value > 0 for p in prints}
    same_sign = drawn["value"] * first.value > 0
    near = (drawn["time"] - first.time).abs() <= REACH * load_scene(scene).period
    peak = judged and quantity in PEAKS
    sign, instant, both = (
        float(each.mean()) if peak else nan for each in (same_sign, near, same_sign & near)
    )
    within = interval(size_of(quantity, drawn["value"]).to_numpy(np.float64), u_num, first.rounding)
    entry: dict[str, Any] = {
        "ids": row["ids"],
        "scene": scene,
        "figure": row["figure"],
        "quantity": quantity,
        "unit": first.unit,
        "printed": first.value,
        "printed_at": first.time,
        "times": [time for time in times if not isnan(time)],
        "signs": len(signs),
        "use": use,
        "fitted": "" if word in USES else word,
        "limit": limit,
        "note": "; ".join(filter(None, printed_rows().loc[ids, "note"])),
    }
    for model, each in shown.items():
        ratio = sizes[model] / size if judged else nan
        entry |= {model: each.value, f"{model}_at": each.time, f"{model}_ratio": ratio}
    return entry | {
        "printed_size": size,
        "u_num": u_num,
        "u_print": first.rounding,
        **within._asdict(),
        "draws": len(drawn),
        "size": within.size(size) if judged else Size.NONE,
        "sign_share": sign,
        "instant_share": instant,
        "both_share": both,
        "sign": outcome(len(signs), sign),
        "instant": outcome(len(times), instant),
    }


# ---- the limits that the paper must have used for its reliabilities, from our errors


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


# ---- what is drawn, and what is tried for the predictions that are not reproduced

FIRST_CYCLE = "first cycle"  # the variant that needs no run of its own
PROBED = 2  # draws that must succeed before more are run: a law may be refused, or take minutes to fail
COLUMNS = [
    "ids", "scene", "quantity", "unit", "printed", "variant", "low", "high", "draws", "size", "why",
]  # fmt: skip


def drawn_together(ids: Iterable[str]) -> dict[tuple[str, bool], tuple[str, ...]]:
    """Return numbers by the scene in which they are drawn, and whether they are ranges of many cycles."""
    rows = numbers().loc[list(ids)]
    scene = rows["scene"].replace(IDEAL, CENTRAL)  # the ideal mechanism is that of the central case
    many = rows["quantity"].str.startswith("range_")
    groups = rows.groupby([scene, many], sort=False)
    return {(str(name), bool(long)): tuple(own.index) for (name, long), own in groups}


def peaks_of(scene: str) -> tuple[str, ...]:
    """Return the first id of each largest error that is printed of a scene."""
    own = numbers()
    return tuple(own.index[(own["scene"] == scene) & own["quantity"].isin(PEAKS)])


def draw_all(
    config: Config, limits: Mapping[str, float], n_jobs: int, on_progress: Progress | None
) -> tuple[dict[str, pd.DataFrame], pd.DataFrame]:
    """Draw all inputs for every printed number, and each group alone for the central largest errors.

    Returns what `Ensemble` shows by id, and `shares` of the inputs.
    """
    small = config._replace(samples=2 * config.long_samples)
    asked = [
        (Draw(scene, ids, small, limits, many), config.long_draws if many else config.draws)
        for (scene, many), ids in drawn_together(numbers().index).items()
    ]
    count, central = len(asked), peaks_of(CENTRAL)
    asked += [(Draw(CENTRAL, central, small, {}, only=group), config.draws) for group in GROUPS]
    ensembles = run_draws(asked, n_jobs, on_progress)
    for (one, _), each in zip(asked, ensembles, strict=True):
        if each.shown.empty:
            raise ValueError(f"no draw of {one.name} succeeded: {each.failures[0]}")
    drawn = {
        name: pd.DataFrame(each.shown[name])
        for (one, _), each in zip(asked[:count], ensembles, strict=False)
        for name in one.ids
    }
    counted = [name for name in central if numbers().loc[name, "use"] != "misprint"]
    return drawn, shares(dict(zip(GROUPS, ensembles[count:], strict=True)), counted)


def shares(alone: Mapping[str, Ensemble], ids: Sequence[str]) -> pd.DataFrame:
    """Return ``u_input`` of largest errors by each group of inputs alone, and its share of the squares."""
    rows = [
        (name, group, interval(each.shown[name]["value"].abs().to_numpy(), 0.0, 0.0).u_input)
        for name in ids
        for group, each in alone.items()
    ]
    frame = pd.DataFrame(rows, columns=["id", "group", "u_input"])
    squares = frame["u_input"] ** 2
    return frame.assign(share=(squares / squares.groupby(frame["id"]).transform("sum")).fillna(0.0))


def missed(entries: pd.DataFrame) -> pd.DataFrame:
    """Return the predictions that are not reproduced."""
    return entries[(entries["use"] == Use.PREDICTION) & (entries["size"] == Size.OUTSIDE)]


def try_variants(
    entries: pd.DataFrame,
    drawn: Mapping[str, pd.DataFrame],
    config: Config,
    n_jobs: int,
    on_progress: Progress | None,
) -> pd.DataFrame:
    """Return a row of `COLUMNS` for each largest error or range and each variant tried for it.

    Tried for the predictions that are not reproduced, the materials for all of their largest errors. A
    variant of which one of `PROBED` draws of two cycles fails under a condition is left out, and ``why`` has
    the status of its run. Ranges are those of fewer cycles.
    """
    by_id = {entry["ids"].split(", ")[0]: entry for entry in entries.to_dict("records")}
    open_ids = [ids.split(", ")[0] for ids in missed(entries)["ids"]]
    peaks = [name for name in open_ids if by_id[name]["quantity"] in PEAKS]
    wanted = drawn_together(
        [name for name in open_ids if by_id[name]["quantity"].startswith(("peak_", "range_"))]
    )
    small = config._replace(samples=2 * config.long_samples, cycles=config.fewer)
    asked = [
        (one["name"], Draw(scene, ids, small, {}, many, changes=one["values"]))
        for one in VARIANTS
        if "values" in one
        for (scene, many), ids in (
            {(one["scene"], False): peaks_of(one["scene"])} if "scene" in one else wanted
        ).items()
    ]
    probed = [(variant, draw) for variant, draw in asked if not draw.many]
    probes = run_draws([(draw, PROBED) for _, draw in probed], n_jobs, part(on_progress, 0.0, 0.1))
    why: dict[str, str] = {}
    for (variant, _), probe in zip(probed, probes, strict=True):
        for text in probe.failures:
            why.setdefault(variant, text)
    runs = [(draw, config.long_draws) for variant, draw in asked if variant not in why]
    rest = iter(run_draws(runs, n_jobs, part(on_progress, 0.1, 1.0)))
    rows = [_row(by_id[name], FIRST_CYCLE, drawn[name]["first"]) for name in peaks]
    for variant, draw in asked:
        shown = None if variant in why else next(rest).shown
        for name in draw.ids:
            values = pd.Series(dtype=float) if shown is None else shown[name]["value"]
            rows.append(_row(by_id[name], variant, values, why.get(variant, "")))
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(entry: Entry, variant: str, values: pd.Series, why: str = "") -> dict[str, Any]:
    """Judge a printed number by the interval of a variant's draws; numerics and print are the entry's."""
    sizes = size_of(entry["quantity"], values).to_numpy(np.float64)
    within = interval(sizes, entry["u_num"], entry["u_print"])
    size = Size.NONE if why else within.size(abs(entry["printed"]))
    judged = (variant, within.low, within.high, len(values), size, why)
    return {name: entry[name] for name in COLUMNS[:5]} | dict(zip(COLUMNS[5:], judged, strict=True))


def causes(entries: pd.DataFrame, tried: pd.DataFrame, numerics: pd.DataFrame) -> pd.DataFrame:
    """Return what reaches each prediction that is not reproduced, a row each by the index of ``entries``.

    ``reached_by``: the names of variants; ``variants``: how many were tried; ``settings``: at how many the
    paper's own formulation and solver gives the printed size, ``chance`` of that: those of ``numerics``, as
    `comparison.studies.as_published.study.judge` returns it; nan where it was not tried.
    """
    by_id = numerics.set_index("id").reindex(columns=["settings", "chance"])
    rows = {}
    for key, ids in missed(entries)["ids"].items():
        mine = tried[(tried["ids"] == ids) & (tried["size"] != Size.NONE)]
        name = next((each for each in ids.split(", ") if each in by_id.index), None)
        rows[key] = {
            "reached_by": list(mine["variant"][mine["size"] != Size.OUTSIDE]),
            "variants": len(mine),
            **(by_id.loc[name].to_dict() if name else dict.fromkeys(by_id, nan)),
        }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["reached_by", "variants", *by_id])
