"""The statements of the paper's text, each decided by both models where it can be.

The values are measured here; ``claims.toml`` says which of them decides, and why.
"""

import tomllib
from collections.abc import Mapping, Sequence
from enum import StrEnum
from importlib.resources import files
from math import inf, nan
from typing import Any

import numpy as np
import pandas as pd

from comparison.models import MODELS
from comparison.reliability.assessment import assess
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.paper.runs import CAP, Runs, lack, measure, numbers
from comparison.tables.channels import Array, channels

Claim = Mapping[str, Any]
Evidence = tuple[dict[str, float], Mapping[str, tuple[Array | Sequence[float], str]]]
"""Values that one model's runs give for a statement: criterion -> value, and the data behind them:
label -> values and their unit."""

NIL = 0.01  # 1/s, of alpha and beta: as good as none, a drift slows down by 3 % or less in two cycles
SCAN = {"displacement": (2e-5, 2.0), "velocity": (1e-3, 10.0), "acceleration": (2.0, 2000.0)}
"""Limits of the permitted error between which `POINTS` are tried, SI."""
POINTS, FLOOR = 40, 0.5  # limits, and the least reliability of those that count: none below 0.97 is printed
SMALL_CHANGE = 0.05  # relative change that is little, in every statement: ``claims.toml``, criterion "peaks"

_DATA = tomllib.loads(files("comparison.studies.paper").joinpath("claims.toml").read_text("utf-8"))
CRITERIA: dict[str, dict[str, Any]] = _DATA["criteria"]
CLAIMS: list[Claim] = [
    {"claim": entry["id"]}
    | entry
    | ({"quantity": name, "channel": QUANTITIES[name]} if name else {})
    | {key: entry[key].format(quantity=name) for key in ("id", "says")}
    for entry in _DATA["claim"]
    for name in entry.get("quantities", [""])
]
"""The statements, one for each of an entry's quantities."""


class Verdict(StrEnum):
    """Judgement of a statement by the runs."""

    SUPPORTED = "supported"
    CONTRADICTED = "contradicted"
    ABSENT = "effect absent"
    UNDECIDED = "undecided"
    UNDECIDABLE = "undecidable"  # by any run: the print leaves out a value that decides


def verdict(evidence: Evidence) -> Verdict:
    """Return the verdict of all criteria; undecided between their bounds, of nan, and if they disagree."""
    if "none" in evidence[0]:
        return Verdict.ABSENT
    answers = set()
    for name, value in evidence[0].items():
        supported, contradicted = CRITERIA[name]["supported"], CRITERIA[name]["contradicted"]
        sign = 1.0 if supported > contradicted else -1.0
        alternative = Verdict.CONTRADICTED if sign * value <= sign * contradicted else Verdict.UNDECIDED
        answers.add(Verdict.SUPPORTED if sign * value >= sign * supported else alternative)
    return answers.pop() if len(answers) == 1 else Verdict.UNDECIDED


def judge_all(runs: Runs) -> pd.DataFrame:
    """Decide every statement by both models.

    A row for each value of a criterion and each number that it follows from, by model; ``verdict`` of
    both models, ``verdict_of_model`` of one. ``reason`` of a statement that cannot be decided, though
    numbers are measured for it. ``claim``: the same of all quantities of one.
    """
    rows = []
    for claim in CLAIMS:
        labels = {key: claim.get(key, "") for key in ("id", "claim", "section", "says", "reason")}
        models = [claim["by"]] if "by" in claim else MODELS
        evidence = {model: TESTS[claim["test"]](runs, model, claim) for model in models if "test" in claim}
        verdicts = dict.fromkeys(evidence, Verdict.UNDECIDABLE)
        if not labels["reason"]:
            verdicts = {model: verdict(each) for model, each in evidence.items()}
        answers = set(verdicts.values()) or {Verdict.UNDECIDABLE}
        labels["verdict"] = answers.pop() if len(answers) == 1 else Verdict.UNDECIDED
        if not evidence:
            rows.append(labels | {"model": "", "what": "", "decides": False})
        for model, (deciding, more) in evidence.items():
            row = labels | {"model": model, "verdict_of_model": verdicts[model]}
            values = {name: ([value], "") for name, value in deciding.items()}
            for name, (sizes, unit) in {**values, **more}.items():
                ends = {"least": min(sizes, default=nan), "most": max(sizes, default=nan)}
                rows.append(row | {"what": name, "unit": unit, "decides": name in deciding} | ends)
    return pd.DataFrame(rows)


# ---- one function a kind of statement


def larger(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Compare two conditions' errors, claimed to differ: of the second cycle, and of every later one."""
    channel, sides = claim["channel"], (claim["more"], claim["less"])
    more, less = (_sizes(runs, scene, model, channel) for scene in sides)
    ratio = np.clip(1.0, _ratio(more.min(), less.max()), _ratio(more.max(), less.min()))
    values, unit, pairs = {"peaks": float(ratio)}, channels()[channel].unit, pair_signs(more, less)
    if all((scene, model) in runs.long for scene in sides):
        later = pair_signs(*(_later_cycles(runs, scene, model, channel) for scene in sides))
        values["cycles"], pairs = float(later.mean()), np.append(pairs, later)
    values = values if pairs.any() else {"none": 0.0}
    return values, {sides[0]: (more, unit), sides[1]: (less, unit)}


def alike(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Compare two conditions' largest errors of the second cycle, claimed to be alike."""
    unit = channels()[claim["channel"]].unit
    numbers = {scene: (_sizes(runs, scene, model, claim["channel"]), unit) for scene in claim["scenes"]}
    a, b = (float(np.median(sizes)) for sizes, _ in numbers.values())
    return {"change": abs(_ratio(b, a) - 1)}, numbers


def contacts(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Compare number or depth of two conditions' contacts a cycle: by column of `_contacts`."""
    word, unit = {"size": ("contacts a cycle", ""), "depth": ("deepest of a cycle", "m")}[claim["counted"]]
    sides = [claim["more"], claim["less"]]
    values = [_contacts(runs, scene, model)[claim["counted"]].to_numpy(np.float64) for scene in sides]
    return {"cycles": float(pair_signs(*values).mean())}, {
        f"{scene}, {word}": (each, unit) for scene, each in zip(sides, values, strict=True)
    }


def less_reliable(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Compare the smallest reliabilities at limits that leave `FLOOR` of both, in all pairs of starts."""
    name, limits, lacks, numbers = claim["quantity"], np.geomspace(*SCAN[claim["quantity"]], POINTS), [], {}
    for scene in (claim["more"], claim["less"]):
        settings, members = load_scene(scene).reliability, range(len(runs.short[scene, model]))
        starts = [assess(runs.two_cycles(scene, model, k), settings)[name] for k in members]
        lacks.append(np.array([[lack(one, each).max() for one in limits] for each in starts]))
        numbers[f"{scene}, at our limit"] = [each.minimum for each in starts], "1"
    more, less = lacks[0][:, None], lacks[1]
    mask, lower = np.maximum(more, less) <= CAP - FLOOR, np.sign(np.round(more - less, 12))
    counts = [f"{(lower[part] > 0).sum()} of {part.sum()}" for part in (mask, ~mask)]
    label = f"lower at {counts[0]} limits and pairs of starts, at {counts[1]} that leave a reliability below"
    scan = {f"{label} {FLOOR:g}; the former": (limits[mask.any(axis=(0, 1))], unit_of(name))}
    return {"reliability": float(lower[mask].mean())}, scan | numbers


def stabilized(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Compare errors of the BDF code, which is neither model, with Baumgarte's stabilization and without."""
    del model, claim
    sizes = {
        name: abs(measure(name, runs, MODELS[0], {}).value)
        for name in dict.fromkeys(runs.solver["id"])
        if name.endswith(("-d", "-v", "-a")) and numbers().loc[name, "use"] != "misprint"
    }
    rows = runs.solver[runs.solver["default"] & runs.solver["id"].isin(sizes)].dropna(subset=["value"])
    errors, mask = (rows["value"].abs() / rows["id"].map(sizes) - 1.0).abs(), rows["gain"] == NIL
    median_without, median_with = float(errors[mask].median()), float(errors[~mask].median())
    kind, letters = rows["id"].str[-1], [name[0] for name in QUANTITIES]
    ratios = (errors[mask].groupby(kind).median() / errors[~mask].groupby(kind).median()).reindex(letters)
    data = {"median relative error without": ([median_without], "1"), "with": ([median_with], "1")}
    data |= {f"ratio, {name}": ([ratios[name[0]]], "1") for name in QUANTITIES}
    return {"stabilized": _ratio(median_without, median_with) if mask.any() else nan}, data


def influence(runs: Runs, model: str, claim: Claim) -> Evidence:
    """Return the spread of y between the cycles of the later half, over the stroke."""
    cycles = runs.by_cycle(claim["scene"], model, claim["channel"])
    y = cycles[len(cycles) // 2 :]
    spread, stroke = float(np.ptp(y, axis=0).max()), float(np.ptp(y))
    return {"influence": spread / stroke}, {"spread": ([spread], "m"), "stroke": ([stroke], "m")}


TESTS = {test.__name__: test for test in (larger, alike, contacts, less_reliable, stabilized, influence)}
"""Functions by the name that a claim's ``test`` gives."""


# ---- their measurements


def pair_signs(a: Array, b: Array) -> Array:
    """Return of all pairs 1 where a is greater by `SMALL_CHANGE`, -1 where it is smaller by that, else 0."""
    difference = np.subtract.outer(a, b)
    margin = SMALL_CHANGE * np.minimum.outer(np.abs(a), np.abs(b))
    return np.asarray(np.sign(difference) * (np.abs(difference) > margin))


def _later_cycles(runs: Runs, scene: str, model: str, channel: str) -> Array:
    """Return the largest error of each cycle from the second on, of the acceleration the largest force.

    A contact is shorter than the interval of the samples of a long run; its peak force, which the
    acceleration's error follows, stands in the table of contacts.
    """
    if channel == "slider_ay":
        return _contacts(runs, scene, model)["max"].to_numpy(np.float64)
    return np.asarray(np.abs(runs.long_errors(scene, model, channel)).max(axis=1)[1:])


def _contacts(runs: Runs, scene: str, model: str) -> pd.DataFrame:
    """Return number (``size``), largest force (``max``, N) and ``depth`` (m) of each later cycle."""
    run = runs.long[scene, model]
    cycles = (run.time.size - 1) // runs.config.long_samples
    events = pd.DataFrame() if run.events is None else run.events
    events = events.reindex(columns=["start", "peak_force", "largest_depth"]).astype(float)
    cycle = (events["start"] / run.time[-1] * cycles).astype(int)
    table = events["peak_force"].groupby(cycle).agg(["size", "max"])
    table["depth"] = events["largest_depth"].groupby(cycle).max()
    return table.reindex(range(1, cycles), fill_value=0)


def _sizes(runs: Runs, scene: str, model: str, channel: str) -> Array:
    """Return the size of the largest error of the second cycle from each start."""
    return np.array([abs(peak.value) for peak in runs.by_member(scene, model, channel)])


def _ratio(a: float, b: float) -> float:
    """Return a / b of sizes; 1 where both are zero."""
    return float(a / b) if b else inf if a else 1.0
