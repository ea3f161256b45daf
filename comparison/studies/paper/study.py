"""The paper against both models: every printed number, instant, figure and statement."""

from collections.abc import Mapping
from dataclasses import replace
from math import isnan, nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.formatting import MISSING, number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import QUANTITIES, unit_of
from comparison.scene import load_scene
from comparison.studies.paper import figures, ledger, numerics, runs
from comparison.studies.paper.claims import CRITERIA, NIL, Verdict, judge_all
from comparison.studies.paper.ledger import Entry, Joint, Size, Use
from comparison.studies.paper.runs import CENTRAL, DATA, HYPOTHESES, INPUTS, REACH, VARIANTS, Runs
from comparison.studies.shared.published import published
from comparison.studies.shared.study import Study, cross_table, markdown, part, share, write_csv

FACTORS = (1.5, ledger.FACTOR, 3.0)  # of random sizes
REACHES = (0.01, REACH, 0.05)  # of a cycle
SHARES = ("share", "shifted", "sized", "random", "random_shifted", "top")
POISSON_PAIR = ("F9-210-d", "F10-33-d")  # the displacement's error at both Poisson's ratios
BRINK = 0.01  # of a size: a range that misses it by less may hold it in other draws
PRINTED_DIGITS = 1.5e-4  # relative: both are printed as 3.687e-5 m


class Config(NamedTuple):
    """Settings of the runs: here, and by the paper's own solver."""

    runs: runs.Config
    solver: numerics.Config


class Results(NamedTuple):
    """Runs, and the judgements that follow from them."""

    runs: Runs
    entries: pd.DataFrame  # `ledger.ledger`
    verdicts: pd.DataFrame  # `ledger.judge`
    instants: pd.DataFrame  # `ledger.instants`
    joints: dict[str, Joint]
    forms: pd.DataFrame  # `ledger.forms`
    limits: dict[str, float]  # of the permitted error, by quantity
    statements: pd.DataFrame  # `judge_all`


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run everything and judge it."""
    defaults = [pair for pair in config.solver.tolerances if pair in numerics.DEFAULTS]
    base = config.solver._replace(tolerances=defaults, gains=(NIL,), draws=1)
    solver = [numerics.measure(each, n_jobs, part(on_progress, 0.35, 0.6)) for each in (config.solver, base)]
    models = replace(
        runs.simulate(config.runs, n_jobs, part(on_progress, 0.0, 0.35)),
        solver=pd.concat(solver, ignore_index=True),
    )
    limits = {name: ledger.one_limit(models, name) for name in QUANTITIES}
    draws = ledger.draw_all(config.runs, limits, n_jobs, part(on_progress, 0.6, 1.0))
    entries = ledger.ledger(models, draws, limits)
    verdicts, joints = ledger.judge(entries, draws), ledger.joints(entries, draws)
    instants = [ledger.instants(entries, draws, each).assign(reach=each) for each in REACHES]
    times = pd.concat(instants, ignore_index=True)
    return Results(models, entries, verdicts, times, joints, draws.forms, limits, judge_all(models))


def page(results: Results) -> Mapping[str, object]:
    """Return the variables of the template."""
    entries, instants = results.entries, results.instants
    predictions = entries[entries["use"] == Use.PREDICTION]
    verdicts = results.verdicts[results.verdicts["id"].isin(predictions.index)]
    early = verdicts["later"] < verdicts["id"].map(predictions["printed_size"])  # by the first cycle alone
    apart = ~(early | verdicts["id"].map(predictions["scene"] == ledger.POISSON))
    by_hypothesis = [(name, verdicts[verdicts["hypothesis"] == name]) for name in HYPOTHESES]
    statements = results.statements.drop_duplicates("id")
    evidence = results.statements.query("model not in ('', @MODELS[1]) and not decides")
    answers = statements["verdict"] + (": " + statements["reason"]).where(statements["reason"] != "", "")
    support = (statements["verdict"] == Verdict.SUPPORTED).groupby(statements["claim"]).mean()
    times = instants[(instants["unit"] == "s") & (instants["at"] > 0)]  # the start is no result
    peaks = times[times["sized"].notna()].assign(sign=np.sign(times["printed"]))  # no stroke, no misprint
    places = ["hypothesis", "reach", "scene", "quantity"]
    ways = peaks.groupby(places)[["at", "sign"]].transform("nunique")
    peaks = peaks[(ways == 1).all(axis=1)].drop_duplicates(places)  # printed in two ways counts for neither
    bands = {f"within {100 * each:g} % of a cycle": peaks["reach"] == each for each in REACHES}
    pin, fast = peaks["scene"] == runs.PIN, peaks["quantity"] != "peak_displacement_error"
    masks = {"": pin.notna(), "velocities and accelerations, ": fast}
    masks["velocities and accelerations, less those with clearance at the crank pin, "] = fast & ~pin
    masks["less poisson-0.33, a near copy, "] = peaks["scene"] != ledger.POISSON
    counts = {part + name: _agreement(peaks[a & b]) for part, a in masks.items() for name, b in bands.items()}
    inside = verdicts[verdicts["without"]].merge(peaks[peaks["reach"] == REACH], on=["id", "hypothesis"])
    fits = entries.index[(entries["use"] == Use.CALIBRATION) & entries["quantity"].str.startswith("min_")]
    misses = results.verdicts[results.verdicts["id"].isin(fits) & (results.verdicts["size"] == Size.OUTSIDE)]
    angles = instants[instants["id"].isin(fits)].drop_duplicates("id").set_index("id")["at"]
    ours = {model: entries.loc[angles.index, f"{model}_at"] for model in MODELS}
    units = {name: unit_of(name) for name in QUANTITIES}
    by_chance = {model: ledger.matches_by_chance(list(angles), list(ours[model])) for model in MODELS}
    ratio = predictions[MODELS[0]].abs() / predictions["printed_size"]
    by_default = results.runs.solver.groupby("default")
    return {
        "entries": entries,
        "uses": {str(use): int((entries["use"] == use).sum()) for use in Use},
        "hypotheses": {name: _counts(rows, entries) for name, rows in by_hypothesis},
        "apart": {name: _counts(rows[apart[rows.index]], entries) for name, rows in by_hypothesis},
        "fits": len(fits),
        "misses": {name: int((misses["hypothesis"] == name).sum()) for name in HYPOTHESES},
        "factors": FACTORS,
        "close": int(((ratio - 1.0).abs() <= ledger.CLOSE).sum()),
        "near": _hits(ratio),
        "joints": results.joints,
        "proportion": _proportion(predictions),
        "sizes": tuple(Size),
        "predictions": markdown(_entry_table(predictions, results.verdicts)),
        "pin": _pin(results.runs),
        "others": markdown(_entry_table(entries[entries["use"] == Use.CALIBRATION], results.verdicts)),
        "instants": markdown(_instant_table(times[times["reach"] == REACH])),
        "dates": times["id"].nunique(),
        "agreement": counts,
        "inside": _agreement(inside),
        "angles": len(angles),
        "angles_met": {model: int((each == angles).sum()) for model, each in ours.items()},
        "angles_chance": {model: number(each[0], 2) for model, each in by_chance.items()},
        "angles_likely": {model: share(each[1]) for model, each in by_chance.items()},
        "settings": {default: _by_setting(predictions, verdicts, group) for default, group in by_default},
        "equal": _equal_pairs(results.runs.solver),
        "ours": " and ".join(quantity(x, "m", 4) for x in predictions[MODELS[0]].abs()[list(POISSON_PAIR)]),
        "solver": _solver(results.runs.solver),
        "forms": _forms(results.forms),
        "omissions": results.forms[results.forms["why"] != ""].drop_duplicates(["variant", "why"]),
        "quantities": QUANTITIES,
        "units": units,
        "laws_and_codes": results.runs.laws_and_codes,
        "data": DATA,
        "likely": next(one for one in INPUTS if "likely" in one),
        "statements": statements,
        "statements_table": markdown(statements.assign(verdict=answers)[["section", "says", "verdict"]]),
        "supported": {"full": int((support == 1).sum()), "part": int((support % 1 > 0).sum())},
        "verdicts": {str(each): int((statements["verdict"] == each).sum()) for each in Verdict},
        "evidence": {name: rows.to_dict("records") for name, rows in evidence.groupby("id")},
        "one_limit": ", ".join(quantity(limit, units[name], 2) for name, limit in results.limits.items()),
        "reach": f"{100 * REACH:g}",
        "factor": f"{ledger.FACTOR:g}",
        "brink": f"{100 * BRINK:g}",
        "wide": f"{ledger.WIDE:g}",
        "config": results.runs.config,
        "central": CENTRAL,
        "bare": f"{NIL:g}",
    }


def _proportion(entries: pd.DataFrame) -> dict[str, int]:
    """Return the counts of peaks of conditions other than the central case's near ours, and near a rule's.

    The rule has the printed sizes of the central case in proportion to the clearance, to that times the speed
    (velocities) and to that times its square (accelerations).
    """
    scenes, quantities, peaks = entries["scene"].map(load_scene), entries["quantity"], list(runs.PEAKS)
    power = quantities.map({name: peaks.index(name) for name in peaks})
    scale = scenes.map(lambda each: each.clearance("slider")) / scenes.map(lambda each: each.period) ** power
    targets, central = entries["printed_size"], entries["scene"] == CENTRAL
    rule = quantities.map((targets / scale)[central].groupby(quantities).first()) * scale
    others = entries["scene"].isin({*runs.SLIDER} - {CENTRAL, ledger.POISSON})
    sizes = {"ours": entries[MODELS[0]].abs(), "rule": rule}
    return {"of": int(others.sum())} | {name: _hits((targets / size)[others]) for name, size in sizes.items()}


def _hits(ratios: pd.Series) -> int:
    """Return the number of ratios within `ledger.FACTOR`."""
    return int(ratios.between(1 / ledger.FACTOR, ledger.FACTOR).sum())


def _pin(models: Runs) -> dict[str, str]:
    """Return the pin's printed displacement beside the bound of rigid bodies and the depth in its bearing."""
    clearance = load_scene(runs.PIN).data["clearance"]["crank_pin"]
    value, bound = abs(published("F7-R-d").value), numerics.bound(runs.PIN)
    depths = [run.events["largest_depth"].max() for run in models.pin.values() if run.events is not None]
    # To first order the bound goes with the radius of the pin's circle.
    sizes = {"bound": bound, "needed": clearance * (value / bound - 1), "depth": max(depths, default=nan)}
    return {"printed": quantity(value, "m", 4)} | {
        name: quantity(size, "m", 4 if name == "bound" else 2) for name, size in sizes.items()
    }


def _agreement(peaks: pd.DataFrame) -> dict[str, dict[str, str]]:
    """Return by hypothesis the number of instants, and the numbers that agree in the mean of all draws."""
    return {
        name: {"of": str(len(rows))} | {key: number(rows[key].sum(), 2) for key in SHARES}
        for name, rows in ((each, peaks[peaks["hypothesis"] == each]) for each in HYPOTHESES)
    }


def _by_setting(predictions: pd.DataFrame, rows: pd.DataFrame, solver: pd.DataFrame) -> dict[Any, Any]:
    """Return the least and most predictions inside with u_D of one tolerance and gain, and by chance."""
    exact, targets = predictions[MODELS[0]].abs(), rows["id"].map(predictions["printed_size"])
    runs = solver[solver["gain"] > NIL].dropna(subset=["value"])
    counts = []
    for _, group in runs.assign(default=True).groupby(["relative", "absolute", "gain"]):
        relative = numerics.u_d(group, {str(name): size for name, size in exact.items()})
        half, middle = (rows["id"].map(relative) * rows["id"].map(exact)).fillna(0.0), rows["middle"]
        low = middle - np.hypot(middle - rows["low_without"], half)
        high = middle + np.hypot(rows["high_without"] - middle, half)
        chance = [ledger.Interval(*each, nan).chance() for each in zip(low, middle, high, strict=True)]
        row = pd.DataFrame({"inside": targets.between(low, high), "chance": chance})
        counts.append(row.groupby(rows["hypothesis"]).sum())
    by = pd.concat(counts).round().astype(int).groupby(level=0)
    return (by.min().astype(str) + " to " + by.max().astype(str)).to_dict()


def _counts(rows: pd.DataFrame, entries: pd.DataFrame) -> dict[str, Any]:
    """Return the counts of predictions by `Size`, of those inside, and of those inside by chance."""
    events = rows["id"].map(ledger.events(entries))
    inside, counts = rows["size"].isin([Size.INSIDE, Size.WIDE]), {"of": len(rows)}
    counts |= {str(size): int((rows["size"] == size).sum()) for size in Size}
    counts |= {"hits": int(inside.sum())} | {key: int(rows[key].sum()) for key in ("without", "likely")}
    signs = rows["id"].map(entries["printed"].astype(float) * entries[MODELS[0]])
    other_sign = list(rows["id"][rows["without"] & (signs < 0)])
    counts |= {"certain": int((inside & (rows["chance"] == 1.0)).sum())}
    ends = rows[["low_without", "high_without"]].div(rows["id"].map(entries["printed_size"]), axis=0)
    brink = list(rows["id"][((ends - 1.0).abs().min(axis=1) < BRINK) & ~rows["without"]])
    random, counts["near"] = dict[str, dict[float, str]](), counts["without"] + len(brink)
    for key, end in (("hits", ""), ("without", "_without"), ("near", "_without")):
        limits = rows[[f"low{end}", "middle", f"high{end}", "u_input"]].to_numpy(np.float64)
        intervals = [ledger.Interval(*each) for each in limits if each[1] > 0]
        ids = events[rows["middle"] > 0]
        for factor in FACTORS:
            spans = pd.Series([each.powers(factor) for each in intervals], ids.index).groupby(ids).agg(list)
            random.setdefault(key, {})[factor] = number(sum(each.chance(factor) for each in intervals), 2)
            random.setdefault(f"{key}_likely", {})[factor] = share(ledger.at_least(counts[key], spans))
    means = {f"{key}_expected": number(rows[f"{key}_chance"].sum(), 2) for key in ("form", "likely")}
    return {**counts, "random": random, "brink": brink, "other_sign": other_sign, **means}


def _size(value: float, entry: Entry, digits: int = 3) -> str:
    """Write a value, or an uncertainty of one, in the unit of an entry: of a reliability as it is."""
    digits += 2 * (entry["unit"] == "deg")
    return f"{value:.{digits + 4}f}" if entry["unit"] == "1" else quantity(value, entry["unit"], digits)


def _interval(entry: Entry, verdict: Entry) -> str:
    """Write the interval of the sizes, of a reliability that of the reliability, and its verdict."""
    ends = [max(verdict[end], 0.0) for end in ("low", "high")]
    if entry["unit"] == "1":
        ends = [runs.CAP - end for end in reversed(ends)]
    size = {Size.INSIDE: "**inside**", Size.OUTSIDE: "outside", Size.FORM: "inside with the form"}
    words = size.get(verdict["size"], verdict["size"]) + "†" * verdict["without"]
    chance = MISSING if isnan(verdict["chance"]) else share(verdict["chance"])
    return f"{' … '.join(_size(end, entry) for end in ends)}: {words} ({chance})"


def _entry_table(entries: pd.DataFrame, verdicts: pd.DataFrame) -> pd.DataFrame:
    """Return entries as the page prints them: a column a hypothesis."""
    by = {(row["id"], row["hypothesis"]): row for row in verdicts.to_dict("records")}
    rows = []
    for name, entry in entries.to_dict("index").items():
        ours = dict.fromkeys(_size(entry[model], entry) for model in MODELS)
        row = {
            "printed as": entry["ids"],
            "what": f"{entry['scene']}, {entry['quantity'].replace('_', ' ')}",
            "printed": _size(entry["printed"], entry, 4 if entry["unit"] != "1" else 3),
            "ours": " and ".join(ours),
        }
        for key in ("u_num", "u_print", "u_D", "u_model"):
            ratio = entry[key] / entry["printed_size"]
            row[key] = "" if isnan(ratio) else number(ratio, 2)
        row |= {each: _interval(entry, by[name, each]) for each in HYPOTHESES}
        rows.append(row | {"remarks": "; ".join(_remarks(entry, [by[name, each] for each in HYPOTHESES]))})
    return pd.DataFrame(rows)


def _remarks(entry: Entry, verdicts: list[Entry]) -> list[str]:
    """Return remarks on an entry: number fitted, geometry's bound, first cycle, samples."""
    notes = [f"{of}: {entry[key]}" for of, key in (("fitted", "fitted"), ("in sight", "sight")) if entry[key]]
    bound = quantity(entry["bound"], "m", 4)
    if entry["printed_size"] > entry["bound"]:
        notes.append(f"geometry without penetration permits {bound}")
    elif abs(entry[MODELS[0]]) > 0.97 * entry["bound"]:  # penetrations add a per cent
        notes.append(f"ours is geometry's bound of {bound}")
    for each in verdicts:
        if each["transient"] > 1 - ledger.LEVEL:
            words = f"in {share(each['transient'])} of the draws, later at most {_size(each['later'], entry)}"
            notes.append(f"{each['hypothesis']}: the first cycle's alone {words}")
    if entry["missed"] > 1e-3 * entry["printed_size"]:
        notes.append(f"samples miss about {share(entry['missed'] / entry['printed_size'])}")
    return notes


def _instant_table(instants: pd.DataFrame) -> pd.DataFrame:
    """Return the printed instants, a column a hypothesis: shares as printed, and a period earlier."""
    rows: dict[str, dict[str, str]] = {}
    for each in instants.to_dict("records"):
        row = rows.setdefault(each["id"], {"printed as": each["id"], "what": each["scene"]})
        row |= {"printed": f"{each['at']:.4f} s", "ours": f"{each['ours']:.4f} s"}
        cells = [share(each[key]) if not isnan(each[key]) else "" for key in ("share", "shifted", "sized")]
        row[each["hypothesis"]] = " / ".join(cells)
    return pd.DataFrame(list(rows.values()))


def _solver(solver: pd.DataFrame) -> str:
    """Return extreme sizes of the runs by the paper's solver with stabilization, a column a tolerance."""
    rows = solver[(solver["gain"] > NIL) & solver["value"].notna()].assign(size=lambda f: f["value"].abs())
    ends = rows.groupby(["id", "relative", "absolute"], sort=False)["size"].agg(["min", "max"]).reset_index()
    cells = [
        " … ".join(quantity(row[end], runs.numbers().loc[row["id"], "unit"]) for end in ("min", "max"))
        for row in ends.to_dict("records")
    ]
    columns = [f"{row.relative:.2g} / {row.absolute:.2g}" for row in ends.itertuples()]
    return cross_table("printed as", list(ends["id"]), columns, cells)


def _equal_pairs(solver: pd.DataFrame) -> dict[str, int]:
    """Count pairs of runs under two Poisson's ratios, and those whose displacements agree as in print."""
    rows = solver[solver["default"] & (solver["gain"] > NIL)]
    keys = ["relative", "absolute", "gain", "inside", "draw"]
    one, other = (rows[rows["id"] == name].set_index(keys)["value"].abs() for name in POISSON_PAIR)
    ratio = (one / other).dropna()
    return {"pairs": len(ratio), "equal": int(((ratio - 1.0).abs() <= PRINTED_DIGITS).sum())}


def _forms(forms: pd.DataFrame) -> str:
    """Return the median sizes of the forms of the model over those of the shipped one."""
    rows = forms[(forms["why"] == "") & (forms["variant"] != VARIANTS[0]["name"])]
    ratios = rows["median"] / (rows["median"] - rows["change"])
    cells = [number(ratio, 3) if np.isfinite(ratio) else MISSING for ratio in ratios]
    return cross_table("printed as", list(rows["id"]), list(rows["variant"]), cells)


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and the long tables as CSV."""
    figures.draw(results.runs, results.entries, results.verdicts, folder)
    frames = {
        "printed": results.entries,
        "judged": results.verdicts,
        "instants": results.instants,
        "forms": results.forms,
        "solver": results.runs.solver,
        "statements": results.statements,
        "criteria": pd.DataFrame([{"criterion": name} | each for name, each in CRITERIA.items()]),
    }
    write_csv(frames, folder)


STUDY = Study(
    "paper",
    small=Config(
        runs.Config(samples=200, long_samples=50, cycles=4, fewer=3, members=2, draws=3, long_draws=2),
        numerics.Config((CENTRAL,), numerics.DEFAULTS[1:], gains=(50.0,), draws=1, samples=500),
    ),
    full=Config(
        runs.Config(10_000, 1000, cycles=100, fewer=30, members=4, draws=200, long_draws=50),
        numerics.Config(
            runs.SLIDER, numerics.DEFAULTS + numerics.OTHERS, (5.0, 10.0, 50.0, 100.0), 3, 10_000
        ),
    ),
    measure=measure,
    page=page,
    draw=draw,
)
