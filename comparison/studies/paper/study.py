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
    judged: pd.DataFrame  # `ledger.judge`
    instants: pd.DataFrame  # `ledger.instants`
    joints: dict[str, Joint]
    tried: pd.DataFrame  # `ledger.forms`
    limits: dict[str, float]  # of the permitted error, by quantity
    statements: pd.DataFrame  # `judge_all`


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run everything and judge it."""
    usual = [pair for pair in config.solver.tolerances if pair in numerics.DEFAULTS]
    bare = config.solver._replace(tolerances=usual, gains=(NIL,), draws=1)
    solver = [numerics.measure(each, n_jobs, part(on_progress, 0.35, 0.6)) for each in (config.solver, bare)]
    models = replace(
        runs.simulate(config.runs, n_jobs, part(on_progress, 0.0, 0.35)),
        solver=pd.concat(solver, ignore_index=True),
    )
    limits = {name: ledger.one_limit(models, name) for name in QUANTITIES}
    drawn = ledger.draw_all(config.runs, limits, n_jobs, part(on_progress, 0.6, 1.0))
    entries = ledger.ledger(models, drawn, limits)
    judged, joints = ledger.judge(entries, drawn), ledger.joints(entries, drawn)
    instants = [ledger.instants(entries, drawn, each).assign(reach=each) for each in REACHES]
    times = pd.concat(instants, ignore_index=True)
    return Results(models, entries, judged, times, joints, drawn.tried, limits, judge_all(models))


def page(results: Results) -> Mapping[str, object]:
    """Return what the template asks."""
    entries, instants = results.entries, results.instants
    predicted = entries[entries["use"] == Use.PREDICTION]
    judged = results.judged[results.judged["id"].isin(predicted.index)]
    early = judged["later"] < judged["id"].map(predicted["printed_size"])  # by the first cycle alone
    apart = ~(early | judged["id"].map(predicted["scene"] == ledger.POISSON))
    by_hypothesis = [(name, judged[judged["hypothesis"] == name]) for name in HYPOTHESES]
    statements = results.statements.drop_duplicates("id")
    shown = results.statements.query("model not in ('', @MODELS[1]) and not decides")
    said = statements["verdict"] + (": " + statements["reason"]).where(statements["reason"] != "", "")
    supported = (statements["verdict"] == Verdict.SUPPORTED).groupby(statements["claim"]).mean()
    times = instants[(instants["unit"] == "s") & (instants["at"] > 0)]  # the start is no result
    peaks = times[times["sized"].notna()].assign(sign=np.sign(times["printed"]))  # no stroke, no misprint
    places = ["hypothesis", "reach", "scene", "quantity"]
    ways = peaks.groupby(places)[["at", "sign"]].transform("nunique")
    peaks = peaks[(ways == 1).all(axis=1)].drop_duplicates(places)  # printed in two ways counts for neither
    near = {f"within {100 * each:g} % of a cycle": peaks["reach"] == each for each in REACHES}
    pin, fast = peaks["scene"] == runs.PIN, peaks["quantity"] != "peak_displacement_error"
    some = {"": pin.notna(), "velocities and accelerations, ": fast}
    some["velocities and accelerations, less those with clearance at the crank pin, "] = fast & ~pin
    some["less poisson-0.33, a near copy, "] = peaks["scene"] != ledger.POISSON
    timed = {part + name: _agreement(peaks[a & b]) for part, a in some.items() for name, b in near.items()}
    inside = judged[judged["without"]].merge(peaks[peaks["reach"] == REACH], on=["id", "hypothesis"])
    fitted = entries.index[(entries["use"] == Use.CALIBRATION) & entries["quantity"].str.startswith("min_")]
    missed = results.judged[results.judged["id"].isin(fitted) & (results.judged["size"] == Size.OUTSIDE)]
    angles = instants[instants["id"].isin(fitted)].drop_duplicates("id").set_index("id")["at"]
    ours = {model: entries.loc[angles.index, f"{model}_at"] for model in MODELS}
    units = {name: unit_of(name) for name in QUANTITIES}
    by_chance = {model: ledger.matches_by_chance(list(angles), list(ours[model])) for model in MODELS}
    ratio = predicted[MODELS[0]].abs() / predicted["printed_size"]
    by_default = results.runs.solver.groupby("default")
    return {
        "entries": entries,
        "uses": {str(use): int((entries["use"] == use).sum()) for use in Use},
        "hypotheses": {name: _counts(rows, entries) for name, rows in by_hypothesis},
        "apart": {name: _counts(rows[apart[rows.index]], entries) for name, rows in by_hypothesis},
        "fitted": len(fitted),
        "missed": {name: int((missed["hypothesis"] == name).sum()) for name in HYPOTHESES},
        "factors": FACTORS,
        "close": int(((ratio - 1.0).abs() <= ledger.CLOSE).sum()),
        "near": _hits(ratio),
        "joints": results.joints,
        "proportion": _proportion(predicted),
        "sizes": tuple(Size),
        "predictions": markdown(_entry_table(predicted, results.judged)),
        "pin": _pin(results.runs),
        "others": markdown(_entry_table(entries[entries["use"] == Use.CALIBRATION], results.judged)),
        "instants": markdown(_instant_table(times[times["reach"] == REACH])),
        "dated": times["id"].nunique(),
        "agreeing": timed,
        "inside": _agreement(inside),
        "angles": len(angles),
        "angles_met": {model: int((each == angles).sum()) for model, each in ours.items()},
        "angles_chance": {model: number(each[0], 2) for model, each in by_chance.items()},
        "angles_likely": {model: share(each[1]) for model, each in by_chance.items()},
        "settings": {default: _by_setting(predicted, judged, own) for default, own in by_default},
        "equal": _equal_pairs(results.runs.solver),
        "ours": " and ".join(quantity(x, "m", 4) for x in predicted[MODELS[0]].abs()[list(POISSON_PAIR)]),
        "solver": _solver(results.runs.solver),
        "forms": _forms(results.tried),
        "left_out": results.tried[results.tried["why"] != ""].drop_duplicates(["variant", "why"]),
        "quantities": QUANTITIES,
        "units": units,
        "laws_and_codes": results.runs.laws_and_codes,
        "data": DATA,
        "likely": next(one for one in INPUTS if "likely" in one),
        "statements": statements,
        "statements_table": markdown(statements.assign(verdict=said)[["section", "says", "verdict"]]),
        "supported": {"full": int((supported == 1).sum()), "part": int((supported % 1 > 0).sum())},
        "verdicts": {str(each): int((statements["verdict"] == each).sum()) for each in Verdict},
        "evidence": {name: rows.to_dict("records") for name, rows in shown.groupby("id")},
        "one_limit": ", ".join(quantity(limit, units[name], 2) for name, limit in results.limits.items()),
        "reach": f"{100 * REACH:g}",
        "factor": f"{ledger.FACTOR:g}",
        "brink": f"{100 * BRINK:g}",
        "wide": f"{ledger.WIDE:g}",
        "config": results.runs.config,
        "central": CENTRAL,
        "bare": f"{NIL:g}",
    }


def _proportion(predicted: pd.DataFrame) -> dict[str, int]:
    """Return how many peaks of conditions other than the central case's are near ours, and near a rule's.

    It has the printed sizes of the central case in proportion to the clearance, to that times the speed
    (velocities) and to that times its square (accelerations).
    """
    scenes, quantities, kinds = predicted["scene"].map(load_scene), predicted["quantity"], list(runs.PEAKS)
    power = quantities.map({name: kinds.index(name) for name in kinds})
    scale = scenes.map(lambda own: own.clearance("slider")) / scenes.map(lambda own: own.period) ** power
    printed, central = predicted["printed_size"], predicted["scene"] == CENTRAL
    rule = quantities.map((printed / scale)[central].groupby(quantities).first()) * scale
    others = predicted["scene"].isin({*runs.SLIDER} - {CENTRAL, ledger.POISSON})
    sizes = {"ours": predicted[MODELS[0]].abs(), "rule": rule}
    return {"of": int(others.sum())} | {name: _hits((printed / own)[others]) for name, own in sizes.items()}


def _hits(ratios: pd.Series) -> int:
    """Return how many ratios are within `ledger.FACTOR`."""
    return int(ratios.between(1 / ledger.FACTOR, ledger.FACTOR).sum())


def _pin(models: Runs) -> dict[str, str]:
    """Return what rigid bodies and the pin's depth leave of its printed displacement."""
    clearance = load_scene(runs.PIN).data["clearance"]["crank_pin"]
    printed, bound = abs(published("F7-R-d").value), numerics.bound(runs.PIN)
    depths = [run.events["largest_depth"].max() for run in models.pin.values() if run.events is not None]
    # To first order the bound goes with the radius of the pin's circle.
    sizes = {"bound": bound, "needed": clearance * (printed / bound - 1), "depth": max(depths, default=nan)}
    return {"printed": quantity(printed, "m", 4)} | {
        name: quantity(size, "m", 4 if name == "bound" else 2) for name, size in sizes.items()
    }


def _agreement(peaks: pd.DataFrame) -> dict[str, dict[str, str]]:
    """Return by hypothesis how many instants there are, and how many agree in the mean of all draws."""
    return {
        name: {"of": str(len(rows))} | {key: number(rows[key].sum(), 2) for key in SHARES}
        for name, rows in ((each, peaks[peaks["hypothesis"] == each]) for each in HYPOTHESES)
    }


def _by_setting(predicted: pd.DataFrame, judged: pd.DataFrame, solver: pd.DataFrame) -> dict[Any, Any]:
    """Return the least and most predictions inside with u_D of one tolerance and gain, and by chance."""
    exact, printed = predicted[MODELS[0]].abs(), judged["id"].map(predicted["printed_size"])
    runs = solver[solver["gain"] > NIL].dropna(subset=["value"])
    counts = []
    for _, own in runs.assign(default=True).groupby(["relative", "absolute", "gain"]):
        known = numerics.u_d(own, {str(name): size for name, size in exact.items()})
        off, middle = (judged["id"].map(known) * judged["id"].map(exact)).fillna(0.0), judged["middle"]
        low = middle - np.hypot(middle - judged["low_without"], off)
        high = middle + np.hypot(judged["high_without"] - middle, off)
        chance = [ledger.Interval(*each, nan).chance() for each in zip(low, middle, high, strict=True)]
        row = pd.DataFrame({"inside": printed.between(low, high), "chance": chance})
        counts.append(row.groupby(judged["hypothesis"]).sum())
    by = pd.concat(counts).round().astype(int).groupby(level=0)
    return (by.min().astype(str) + " to " + by.max().astype(str)).to_dict()


def _counts(judged: pd.DataFrame, entries: pd.DataFrame) -> dict[str, Any]:
    """Return how many predictions have each `Size`, how many are inside, and what chance gives of it."""
    events = judged["id"].map(ledger.events(entries))
    inside, counts = judged["size"].isin([Size.INSIDE, Size.WIDE]), {"of": len(judged)}
    counts |= {str(size): int((judged["size"] == size).sum()) for size in Size}
    counts |= {"held": int(inside.sum())} | {key: int(judged[key].sum()) for key in ("without", "likely")}
    signs = judged["id"].map(entries["printed"].astype(float) * entries[MODELS[0]])
    other_sign = list(judged["id"][judged["without"] & (signs < 0)])
    counts |= {"certain": int((inside & (judged["chance"] == 1.0)).sum())}
    ends = judged[["low_without", "high_without"]].div(judged["id"].map(entries["printed_size"]), axis=0)
    brink = list(judged["id"][((ends - 1.0).abs().min(axis=1) < BRINK) & ~judged["without"]])
    random, counts["near"] = dict[str, dict[float, str]](), counts["without"] + len(brink)
    for key, end in (("held", ""), ("without", "_without"), ("near", "_without")):
        rows = judged[[f"low{end}", "middle", f"high{end}", "u_input"]].to_numpy(np.float64)
        known = [ledger.Interval(*each) for each in rows if each[1] > 0]
        of = events[judged["middle"] > 0]
        for factor in FACTORS:
            spans = pd.Series([each.powers(factor) for each in known], of.index).groupby(of).agg(list)
            random.setdefault(key, {})[factor] = number(sum(each.chance(factor) for each in known), 2)
            random.setdefault(f"{key}_likely", {})[factor] = share(ledger.at_least(counts[key], spans))
    expected = {f"{key}_expected": number(judged[f"{key}_chance"].sum(), 2) for key in ("form", "likely")}
    return {**counts, "random": random, "brink": brink, "other_sign": other_sign, **expected}


def _size(value: float, entry: Entry, digits: int = 3) -> str:
    """Write a value, or an uncertainty of one, in the unit of an entry: of a reliability as it is."""
    digits += 2 * (entry["unit"] == "deg")
    return f"{value:.{digits + 4}f}" if entry["unit"] == "1" else quantity(value, entry["unit"], digits)


def _interval(entry: Entry, judged: Entry) -> str:
    """Write the interval of the sizes, of a reliability that of the reliability, and its verdict."""
    ends = [max(judged[end], 0.0) for end in ("low", "high")]
    if entry["unit"] == "1":
        ends = [runs.CAP - end for end in reversed(ends)]
    size = {Size.INSIDE: "**inside**", Size.OUTSIDE: "outside", Size.FORM: "inside with the form"}
    said = size.get(judged["size"], judged["size"]) + "†" * judged["without"]
    chance = MISSING if isnan(judged["chance"]) else share(judged["chance"])
    return f"{' … '.join(_size(end, entry) for end in ends)}: {said} ({chance})"


def _entry_table(entries: pd.DataFrame, judged: pd.DataFrame) -> pd.DataFrame:
    """Return entries as the page shows them: a column a hypothesis."""
    by = {(row["id"], row["hypothesis"]): row for row in judged.to_dict("records")}
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
            over = entry[key] / entry["printed_size"]
            row[key] = "" if isnan(over) else number(over, 2)
        row |= {each: _interval(entry, by[name, each]) for each in HYPOTHESES}
        rows.append(row | {"remarks": "; ".join(_remarks(entry, [by[name, each] for each in HYPOTHESES]))})
    return pd.DataFrame(rows)


def _remarks(entry: Entry, judged: list[Entry]) -> list[str]:
    """Return what is to be known of an entry: what was fitted, geometry's bound, first cycle, samples."""
    said = [f"{of}: {entry[key]}" for of, key in (("fitted", "fitted"), ("in sight", "sight")) if entry[key]]
    bound = quantity(entry["bound"], "m", 4)
    if entry["printed_size"] > entry["bound"]:
        said.append(f"geometry without penetration permits {bound}")
    elif abs(entry[MODELS[0]]) > 0.97 * entry["bound"]:  # penetrations add a per cent
        said.append(f"ours is geometry's bound of {bound}")
    for each in judged:
        if each["transient"] > 1 - ledger.LEVEL:
            of = f"in {share(each['transient'])} of the draws, later at most {_size(each['later'], entry)}"
            said.append(f"{each['hypothesis']}: the first cycle's alone {of}")
    if entry["missed"] > 1e-3 * entry["printed_size"]:
        said.append(f"samples miss about {share(entry['missed'] / entry['printed_size'])}")
    return said


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
    own = solver[(solver["gain"] > NIL) & solver["value"].notna()].assign(size=lambda f: f["value"].abs())
    ends = own.groupby(["id", "relative", "absolute"], sort=False)["size"].agg(["min", "max"]).reset_index()
    cells = [
        " … ".join(quantity(row[end], runs.numbers().loc[row["id"], "unit"]) for end in ("min", "max"))
        for row in ends.to_dict("records")
    ]
    columns = [f"{row.relative:.2g} / {row.absolute:.2g}" for row in ends.itertuples()]
    return cross_table("printed as", list(ends["id"]), columns, cells)


def _equal_pairs(solver: pd.DataFrame) -> dict[str, int]:
    """Return of how many pairs of runs under two Poisson's ratios the displacements agree as in print."""
    own = solver[solver["default"] & (solver["gain"] > NIL)]
    keys = ["relative", "absolute", "gain", "inside", "draw"]
    one, other = (own[own["id"] == name].set_index(keys)["value"].abs() for name in POISSON_PAIR)
    ratio = (one / other).dropna()
    return {"pairs": len(ratio), "equal": int(((ratio - 1.0).abs() <= PRINTED_DIGITS).sum())}


def _forms(tried: pd.DataFrame) -> str:
    """Return the median sizes of the forms of the model over those of the shipped one."""
    own = tried[(tried["why"] == "") & (tried["variant"] != VARIANTS[0]["name"])]
    ratios = own["median"] / (own["median"] - own["change"])
    cells = [number(ratio, 3) if np.isfinite(ratio) else MISSING for ratio in ratios]
    return cross_table("printed as", list(own["id"]), list(own["variant"]), cells)


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and the long tables as CSV."""
    figures.draw(results.runs, results.entries, results.judged, folder)
    frames = {
        "printed": results.entries,
        "judged": results.judged,
        "instants": results.instants,
        "forms": results.tried,
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
